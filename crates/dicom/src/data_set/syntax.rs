//! Transfer syntaxes: how a data set is laid out and how its pixels are coded (PS3.5 Annex A).

use super::parse::Encoding;

/// A transfer syntax, by its UID.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct TransferSyntax {
    uid: String,
}

/// How the pixels are coded.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum PixelCoding {
    /// As they are.
    Native,
    /// Run lengths (PS3.5 Annex G).
    Rle,
    /// JPEG: baseline 8 bit and lossless.
    Jpeg,
    /// JPEG-LS.
    JpegLs,
    /// JPEG 2000.
    Jpeg2000,
    /// Not read.
    Unknown,
}

impl TransferSyntax {
    pub(crate) fn new(uid: String) -> Self {
        Self { uid }
    }

    pub(crate) fn uid(&self) -> &str {
        &self.uid
    }

    pub(super) fn encoding(&self) -> Encoding {
        let explicit = self.uid != "1.2.840.10008.1.2";
        Encoding { explicit, big_endian: self.uid == "1.2.840.10008.1.2.2" }
    }

    pub(super) fn deflated(&self) -> bool {
        self.uid == "1.2.840.10008.1.2.1.99"
    }

    pub(crate) fn pixel_coding(&self) -> PixelCoding {
        match self.uid.as_str() {
            "1.2.840.10008.1.2"
            | "1.2.840.10008.1.2.1"
            | "1.2.840.10008.1.2.2"
            | "1.2.840.10008.1.2.1.99" => PixelCoding::Native,
            "1.2.840.10008.1.2.5" => PixelCoding::Rle,
            "1.2.840.10008.1.2.4.50" | "1.2.840.10008.1.2.4.57" | "1.2.840.10008.1.2.4.70" => {
                PixelCoding::Jpeg
            }
            "1.2.840.10008.1.2.4.80" | "1.2.840.10008.1.2.4.81" => PixelCoding::JpegLs,
            "1.2.840.10008.1.2.4.90" | "1.2.840.10008.1.2.4.91" => PixelCoding::Jpeg2000,
            _ => PixelCoding::Unknown,
        }
    }

    /// Name of the syntax, as the standard has it.
    pub(crate) fn name(&self) -> &'static str {
        match self.uid.as_str() {
            "1.2.840.10008.1.2" => "Implicit VR Little Endian",
            "1.2.840.10008.1.2.1" => "Explicit VR Little Endian",
            "1.2.840.10008.1.2.1.99" => "Deflated Explicit VR Little Endian",
            "1.2.840.10008.1.2.2" => "Explicit VR Big Endian",
            "1.2.840.10008.1.2.5" => "RLE Lossless",
            "1.2.840.10008.1.2.4.50" => "JPEG Baseline",
            "1.2.840.10008.1.2.4.51" => "JPEG Extended (12 bit)",
            "1.2.840.10008.1.2.4.53" | "1.2.840.10008.1.2.4.55" => "JPEG (retired process)",
            "1.2.840.10008.1.2.4.57" => "JPEG Lossless (process 14)",
            "1.2.840.10008.1.2.4.70" => "JPEG Lossless",
            "1.2.840.10008.1.2.4.80" => "JPEG-LS Lossless",
            "1.2.840.10008.1.2.4.81" => "JPEG-LS Near-lossless",
            "1.2.840.10008.1.2.4.90" => "JPEG 2000 Lossless",
            "1.2.840.10008.1.2.4.91" => "JPEG 2000",
            "1.2.840.10008.1.2.4.201" | "1.2.840.10008.1.2.4.202" => {
                "High-Throughput JPEG 2000 Lossless"
            }
            "1.2.840.10008.1.2.4.203" => "High-Throughput JPEG 2000",
            "1.2.840.10008.1.2.4.110" => "JPEG XL Lossless",
            "1.2.840.10008.1.2.4.112" => "JPEG XL",
            _ => "unknown",
        }
    }
}
