//! How one stored number is coded.

use crate::Raw;
use crate::half::half_precision;

/// Byte order of stored numbers.
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

    /// The bytes of a word, least significant first.
    pub(crate) fn little<const N: usize>(self, mut word: [u8; N]) -> [u8; N] {
        if self == Self::Big {
            word.reverse();
        }
        word
    }
}

/// Type of a stored number.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Number {
    /// Signed byte.
    I8,
    /// Unsigned byte.
    U8,
    /// Signed, 16 bits.
    I16,
    /// Unsigned, 16 bits.
    U16,
    /// Signed, 24 bits.
    I24,
    /// Signed, 32 bits.
    I32,
    /// Unsigned, 32 bits.
    U32,
    /// Signed, 64 bits.
    I64,
    /// Unsigned, 64 bits.
    U64,
    /// IEEE half precision.
    F16,
    /// IEEE single precision.
    F32,
    /// IEEE double precision.
    F64,
}

impl Number {
    /// Bytes of one.
    pub const fn bytes(self) -> u64 {
        match self {
            Self::I8 | Self::U8 => 1,
            Self::I16 | Self::U16 | Self::F16 => 2,
            Self::I24 => 3,
            Self::I32 | Self::U32 | Self::F32 => 4,
            Self::I64 | Self::U64 | Self::F64 => 8,
        }
    }

    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::I8 => "int8",
            Self::U8 => "uint8",
            Self::I16 => "int16",
            Self::U16 => "uint16",
            Self::I24 => "int24",
            Self::I32 => "int32",
            Self::U32 => "uint32",
            Self::I64 => "int64",
            Self::U64 => "uint64",
            Self::F16 => "float16",
            Self::F32 => "float32",
            Self::F64 => "float64",
        }
    }

    /// Whether codes beyond 2^53 are rounded, because they are given as `f64`.
    pub fn may_be_rounded(self) -> bool {
        matches!(self, Self::I64 | Self::U64)
    }

    /// Whether it has a fraction and an exponent.
    pub(crate) fn is_float(self) -> bool {
        matches!(self, Self::F16 | Self::F32 | Self::F64)
    }

    /// Reads `count` numbers that lie side by side: `fill` gets as many bytes as they take. Errors: those of `fill`.
    ///
    /// Where this machine has the same type and byte order, they are read to where they stay.
    pub fn read<E>(
        self,
        count: usize,
        big_endian: bool,
        fill: impl FnOnce(&mut [u8]) -> Result<(), E>,
    ) -> Result<Raw, E> {
        fn filled<T: bytemuck::Pod, E>(
            count: usize,
            fill: impl FnOnce(&mut [u8]) -> Result<(), E>,
        ) -> Result<Vec<T>, E> {
            let mut numbers = vec![T::zeroed(); count];
            fill(bytemuck::cast_slice_mut(&mut numbers))?;
            Ok(numbers)
        }
        if big_endian == cfg!(target_endian = "big") {
            match self {
                Self::I16 => return filled(count, fill).map(Raw::Int16),
                Self::I32 => return filled(count, fill).map(Raw::Int32),
                Self::F32 => return filled(count, fill).map(Raw::Float32),
                Self::F64 => return filled(count, fill).map(Raw::Float64),
                _ => {}
            }
        }
        filled(count * self.bytes() as usize, fill).map(|bytes: Vec<u8>| self.decode(&bytes, big_endian))
    }

    /// Decodes numbers that lie side by side; an incomplete last one is left out.
    pub fn decode(self, bytes: &[u8], big_endian: bool) -> Raw {
        let big = big_endian;
        match self {
            Self::I8 => Raw::Int16(each(bytes, big, |b| i16::from(i8::from_le_bytes(b)))),
            Self::U8 => Raw::Int16(each(bytes, big, |b| i16::from(u8::from_le_bytes(b)))),
            Self::I16 => Raw::Int16(each(bytes, big, i16::from_le_bytes)),
            Self::U16 => Raw::Int32(each(bytes, big, |b| i32::from(u16::from_le_bytes(b)))),
            // the three bytes are the upper ones of a word: the shift back keeps the sign
            Self::I24 => Raw::Int32(each(bytes, big, |[a, b, c]: [u8; 3]| i32::from_le_bytes([0, a, b, c]) >> 8)),
            Self::I32 => Raw::Int32(each(bytes, big, i32::from_le_bytes)),
            Self::U32 => Raw::Float64(each(bytes, big, |b| f64::from(u32::from_le_bytes(b)))),
            Self::I64 => Raw::Float64(each(bytes, big, |b| i64::from_le_bytes(b) as f64)),
            Self::U64 => Raw::Float64(each(bytes, big, |b| u64::from_le_bytes(b) as f64)),
            Self::F16 => Raw::Float32(each(bytes, big, |b| half_precision(u16::from_le_bytes(b)))),
            Self::F32 => Raw::Float32(each(bytes, big, f32::from_le_bytes)),
            Self::F64 => Raw::Float64(each(bytes, big, f64::from_le_bytes)),
        }
    }
}

fn each<const N: usize, T>(bytes: &[u8], big_endian: bool, number: impl Fn([u8; N]) -> T) -> Vec<T> {
    let order = if big_endian { Order::Big } else { Order::Little };
    bytes.as_chunks().0.iter().map(|&word| number(order.little(word))).collect()
}
