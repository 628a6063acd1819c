//! Igor's type codes.

use crate::FormatError;

use crate::fail;
use crate::number::Number;

/// What a wave's elements are.
#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    Numbers(Number),
    Other(&'static str),
}

/// What a type code stands for. Errors: complex or unknown.
pub(super) fn kind(code: u16, at: u64) -> Result<Kind, FormatError> {
    if code & 1 != 0 {
        return Err(fail::at(
            at,
            format!("found complex samples (type {code:#x}), wanted real ones"),
            "in Igor, save real parts and imaginary parts (or magnitudes) as waves of their own: \
             `MatrixOp re = real(w)`",
        ));
    }
    Ok(Kind::Numbers(match code {
        0 => return Ok(Kind::Other("text wave")),
        0x100 => return Ok(Kind::Other("wave of data folder references")),
        0x4000 => return Ok(Kind::Other("wave of wave references")),
        0x02 => Number::F32,
        0x04 => Number::F64,
        0x08 => Number::I8,
        0x10 => Number::I16,
        0x20 => Number::I32,
        0x80 => Number::I64,
        0x48 => Number::U8,
        0x50 => Number::U16,
        0x60 => Number::U32,
        0xC0 => Number::U64,
        _ => {
            return Err(fail::at(
                at,
                format!(
                    "found type {code:#x}, wanted one of Igor's numeric types (2, 4, 8, 0x10, 0x20, 0x80, unsigned + \
                     0x40) or text (0)"
                ),
                "the header is damaged: copy or export the wave again",
            ));
        }
    }))
}
