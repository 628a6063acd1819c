//! Codes of samples as they lie in a file, and how they become `Raw`.

use common::Raw;

/// Type of a stored sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Code {
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

/// Byte order of stored samples.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Order {
    Little,
    Big,
}

impl Order {
    /// For people.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::Little => "little-endian",
            Self::Big => "big-endian",
        }
    }

    /// The bytes of a word in little-endian order.
    pub(crate) fn little<const N: usize>(self, mut word: [u8; N]) -> [u8; N] {
        if self == Self::Big {
            word.reverse();
        }
        word
    }
}

impl Code {
    /// Size of one sample.
    pub(crate) fn bytes(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 => 2,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// For people.
    pub(crate) fn name(self) -> &'static str {
        match self {
            Self::I8 => "int8",
            Self::U8 => "uint8",
            Self::I16 => "int16",
            Self::U16 => "uint16",
            Self::I32 => "int32",
            Self::U32 => "uint32",
            Self::I64 => "int64",
            Self::U64 => "uint64",
            Self::F32 => "float32",
            Self::F64 => "float64",
        }
    }

    /// Samples of whole words; 64-bit codes beyond 2^53 are rounded, as `Raw` has no wider integers.
    pub(crate) fn decode(self, bytes: &[u8], order: Order) -> Raw {
        match self {
            Self::I8 => Raw::Int16(words(bytes, |w| i16::from(i8::from_le_bytes(w)))),
            Self::U8 => Raw::Int16(words(bytes, |[b]: [u8; 1]| i16::from(b))),
            Self::I16 => Raw::Int16(words(bytes, |w| i16::from_le_bytes(order.little(w)))),
            Self::U16 => Raw::Int32(words(bytes, |w| i32::from(u16::from_le_bytes(order.little(w))))),
            Self::I32 => Raw::Int32(words(bytes, |w| i32::from_le_bytes(order.little(w)))),
            Self::U32 => Raw::Float64(words(bytes, |w| f64::from(u32::from_le_bytes(order.little(w))))),
            Self::I64 => Raw::Float64(words(bytes, |w| i64::from_le_bytes(order.little(w)) as f64)),
            Self::U64 => Raw::Float64(words(bytes, |w| u64::from_le_bytes(order.little(w)) as f64)),
            Self::F32 => Raw::Float32(words(bytes, |w| f32::from_le_bytes(order.little(w)))),
            Self::F64 => Raw::Float64(words(bytes, |w| f64::from_le_bytes(order.little(w)))),
        }
    }
}

/// Each whole word of `N` bytes, converted.
fn words<const N: usize, T>(bytes: &[u8], convert: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks::<N>().0.iter().map(|word| convert(*word)).collect()
}

/// The same samples, the last one first.
pub(crate) fn reversed(mut raw: Raw) -> Raw {
    match &mut raw {
        Raw::Int16(v) => v.reverse(),
        Raw::Int32(v) => v.reverse(),
        Raw::Float32(v) => v.reverse(),
        Raw::Float64(v) => v.reverse(),
    }
    raw
}
