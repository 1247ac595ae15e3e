//! Why bytes are refused.

/// Why a header is refused. The stream cannot be followed after any of these: answer, then close.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum HeaderError {
    /// Not a header version of the protocol.
    #[error(
        "header version {found} at byte 0: there are 1 and 2; is the peer OpenIGTLink, and in step?"
    )]
    Version {
        /// What stands there.
        found: u16,
    },
    /// The type name is empty or has bytes other than printable ASCII.
    #[error("type name \"{found}\" at byte 2: 1 to 12 printable ASCII characters are needed")]
    Kind {
        /// What stands there, escaped.
        found: String,
    },
    /// The body is larger than the receiver allows.
    #[error("a body of {announced} bytes is announced at byte 42, {limit} are allowed: send less")]
    TooLarge {
        /// The announced size, bytes.
        announced: u64,
        /// The receiver's limit, bytes.
        limit: u64,
    },
}

/// Why a body is refused. Its bytes have been read, so the next message can be.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum BodyError {
    /// The receiver handed over another number of bytes than the header announces.
    #[error("{given} bytes of body where the header announces {announced}: read all of them first")]
    Length {
        /// The announced size, bytes.
        announced: u64,
        /// What was handed over, bytes.
        given: u64,
    },
    /// The checksum does not fit: the body was damaged, or the sender makes none.
    #[error(
        "CRC-64 of the body is {found:#018x}, the header says {announced:#018x}: message dropped; \
         send it again, with its checksum"
    )]
    Checksum {
        /// What the header says.
        announced: u64,
        /// What the body has.
        found: u64,
    },
    /// The extended header of a version 2 message is cut or lies.
    #[error("extended header in a body of {size} bytes: {why}")]
    ExtendedHeader {
        /// Size of the body, bytes.
        size: u64,
        /// What is wrong, and how it should be.
        why: &'static str,
    },
    /// The metadata of a version 2 message are cut or lie.
    #[error("metadata in a body of {size} bytes: {why}")]
    Metadata {
        /// Size of the body, bytes.
        size: u64,
        /// What is wrong, and how it should be.
        why: &'static str,
    },
    /// The content is not what its type has.
    #[error("{kind} with {size} bytes of content: {why}")]
    Content {
        /// The type name.
        kind: String,
        /// Size of the content, bytes.
        size: u64,
        /// How it should be.
        why: &'static str,
    },
    /// More items than are taken.
    #[error("{count} {what} in one message, {limit} are taken: send fewer")]
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many there are.
        count: u64,
        /// How many may be.
        limit: u64,
    },
}

/// Why an image or an attribute cannot be put together.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
pub enum LayoutError {
    /// Not as many bytes as the layout asks for.
    #[error("{given} bytes of voxels where the layout asks for {wanted}: check extent and scalar")]
    Bytes {
        /// Bytes handed over.
        given: u64,
        /// Bytes asked for.
        wanted: u64,
    },
    /// A sample without a value.
    #[error("0 components in a sample: give 1 or more")]
    NoComponents,
    /// The sub-volume reaches out of the volume.
    #[error("axis {axis}: {extent} voxels from {start} on reach beyond {size}: make it smaller")]
    SubVolume {
        /// 0 for i, 1 for j, 2 for k.
        axis: usize,
        /// First voxel of the sub-volume.
        start: u16,
        /// Its voxels.
        extent: u16,
        /// Voxels of the volume.
        size: u16,
    },
    /// Values do not make up whole samples.
    #[error("{values} values are no multiple of {components} components: check the attribute")]
    Values {
        /// Values handed over.
        values: usize,
        /// Components of a sample.
        components: u8,
    },
}

/// Why a content is refused, before its type and size are known.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Refusal {
    /// It is not laid out as it should be: how it should be.
    Form(&'static str),
    /// It has too many items.
    TooMany {
        /// Of what.
        what: &'static str,
        /// How many there are.
        count: u64,
        /// How many may be.
        limit: u64,
    },
}

impl Refusal {
    /// The error, once type name and size of the content are known.
    pub(crate) fn of(self, kind: &str, size: usize) -> BodyError {
        match self {
            Self::Form(why) => BodyError::Content { kind: kind.to_owned(), size: size as u64, why },
            Self::TooMany { what, count, limit } => BodyError::TooMany { what, count, limit },
        }
    }
}
