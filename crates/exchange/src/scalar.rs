//! The scalar types of files and their bytes.

use supine_space::Progress;

/// Type of one sample in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Scalar {
    I8,
    U8,
    I16,
    U16,
    I32,
    U32,
    I64,
    U64,
    F32,
    F64,
}

impl Scalar {
    /// Bytes of one sample.
    pub(crate) fn size(self) -> usize {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Whether samples are whole numbers by type.
    pub(crate) fn is_integer(self) -> bool {
        !matches!(self, Self::F32 | Self::F64)
    }

    /// Calls `f(place, value)` for each sample until it fails. Integers beyond 2^53 are rounded.
    pub(crate) fn try_each<E>(
        self,
        bytes: &[u8],
        big_endian: bool,
        mut f: impl FnMut(usize, f64) -> Result<(), E>,
    ) -> Result<(), E> {
        macro_rules! each {
            ($t:ty) => {{
                let (samples, _) = bytes.as_chunks::<{ size_of::<$t>() }>();
                if big_endian {
                    samples
                        .iter()
                        .enumerate()
                        .try_for_each(|(n, b)| f(n, <$t>::from_be_bytes(*b) as f64))
                } else {
                    samples
                        .iter()
                        .enumerate()
                        .try_for_each(|(n, b)| f(n, <$t>::from_le_bytes(*b) as f64))
                }
            }};
        }
        match self {
            Self::I8 => each!(i8),
            Self::U8 => each!(u8),
            Self::I16 => each!(i16),
            Self::U16 => each!(u16),
            Self::I32 => each!(i32),
            Self::U32 => each!(u32),
            Self::I64 => each!(i64),
            Self::U64 => each!(u64),
            Self::F32 => each!(f32),
            Self::F64 => each!(f64),
        }
    }
}

/// A sample that can be written, little endian.
pub(crate) trait Sample: Copy {
    /// Its type in files.
    const SCALAR: Scalar;
    /// Appends its bytes, little endian.
    fn push(self, bytes: &mut Vec<u8>);
}

macro_rules! sample {
    ($($t:ty, $scalar:ident);*) => {$(
        impl Sample for $t {
            const SCALAR: Scalar = Scalar::$scalar;
            fn push(self, bytes: &mut Vec<u8>) {
                bytes.extend_from_slice(&self.to_le_bytes());
            }
        }
    )*};
}
sample!(u8, U8; i16, I16; u16, U16; f32, F32; f64, F64; i64, I64);

/// Writes `count` samples, little endian, some thousand at a time; a stop is an error of the
/// writer.
pub(crate) fn write_samples<T: Sample>(
    out: &mut impl std::io::Write,
    samples: impl IntoIterator<Item = T>,
    count: usize,
    progress: Progress<'_>,
) -> std::io::Result<()> {
    const CHUNK: usize = 1 << 16;
    let mut bytes = Vec::with_capacity(CHUNK + 16);
    let (all, mut written) = ((count * T::SCALAR.size()).max(1), 0);
    for sample in samples {
        sample.push(&mut bytes);
        if bytes.len() >= CHUNK {
            out.write_all(&bytes)?;
            written += bytes.len();
            progress.at(written as f64 / all as f64).map_err(std::io::Error::other)?;
            bytes.clear();
        }
    }
    out.write_all(&bytes)
}
