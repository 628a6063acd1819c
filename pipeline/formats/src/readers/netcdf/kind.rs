//! Types of netCDF's numbers.

use crate::number::Number;

/// Type of the elements of a variable or attribute.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Text,
    Number(Number),
}

impl Kind {
    /// The type of a code; those from 7 on are of CDF-5. None: unknown.
    pub(super) fn of(code: u32, version: u8) -> Option<Self> {
        const WIDE: u8 = 5;
        Some(match code {
            1 => Self::Number(Number::I8),
            2 => Self::Text,
            3 => Self::Number(Number::I16),
            4 => Self::Number(Number::I32),
            5 => Self::Number(Number::F32),
            6 => Self::Number(Number::F64),
            7 if version == WIDE => Self::Number(Number::U8),
            8 if version == WIDE => Self::Number(Number::U16),
            9 if version == WIDE => Self::Number(Number::U32),
            10 if version == WIDE => Self::Number(Number::I64),
            11 if version == WIDE => Self::Number(Number::U64),
            _ => return None,
        })
    }

    /// Bytes of an element.
    pub(super) fn bytes(self) -> u64 {
        match self {
            Self::Text => 1,
            Self::Number(number) => number.bytes(),
        }
    }
}

/// The unsigned type of as many bytes.
pub(super) fn unsigned(number: Number) -> Number {
    match number {
        Number::I8 => Number::U8,
        Number::I16 => Number::U16,
        Number::I32 => Number::U32,
        Number::I64 => Number::U64,
        other => other,
    }
}

/// What numbers hold that were never written. None for those of fewer bits, which may be samples.
pub(super) fn never_written(number: Number) -> Option<f64> {
    const FLOAT: f64 = 9.969_209_968_386_869e36;
    match number {
        Number::F32 | Number::F64 => Some(FLOAT),
        Number::I32 => Some(-2_147_483_647.0),
        Number::U32 => Some(4_294_967_295.0),
        _ => None,
    }
}
