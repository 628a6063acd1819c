//! Classes of arrays and types of stored data, by their codes.

use crate::number::Number;

/// Class of an array.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Class {
    Cell,
    Struct,
    Object,
    Char,
    Sparse,
    Number(&'static str),
    Function,
    Opaque,
}

impl Class {
    pub(super) fn of(code: u8) -> Option<Self> {
        Some(match code {
            1 => Self::Cell,
            2 => Self::Struct,
            3 => Self::Object,
            4 => Self::Char,
            5 => Self::Sparse,
            6 => Self::Number("double"),
            7 => Self::Number("single"),
            8 => Self::Number("int8"),
            9 => Self::Number("uint8"),
            10 => Self::Number("int16"),
            11 => Self::Number("uint16"),
            12 => Self::Number("int32"),
            13 => Self::Number("uint32"),
            14 => Self::Number("int64"),
            15 => Self::Number("uint64"),
            16 => Self::Function,
            17 => Self::Opaque,
            _ => return None,
        })
    }
}

/// An array in an element of its own.
pub(super) const MATRIX: u32 = 14;
/// A compressed element.
pub(super) const COMPRESSED: u32 = 15;
/// Bytes: names.
pub(super) const INT8: u32 = 1;
/// Sizes.
pub(super) const INT32: u32 = 5;
/// Flags.
pub(super) const UINT32: u32 = 6;
/// Text in UTF-8.
pub(super) const UTF8: u32 = 16;
/// Text in UTF-16.
pub(super) const UTF16: u32 = 17;
/// Text in UTF-32.
pub(super) const UTF32: u32 = 18;

/// The numbers that data of a type are.
pub(super) fn number(code: u32) -> Option<Number> {
    Some(match code {
        INT8 => Number::I8,
        2 => Number::U8,
        3 => Number::I16,
        4 => Number::U16,
        INT32 => Number::I32,
        UINT32 => Number::U32,
        7 => Number::F32,
        9 => Number::F64,
        12 => Number::I64,
        13 => Number::U64,
        _ => return None,
    })
}
