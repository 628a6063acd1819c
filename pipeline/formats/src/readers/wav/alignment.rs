//! Samples of fewer bits than their container has: at its upper end, or at its lower.
//!
//! By the specification samples of 24 valid bits in 32 lie at the upper end, their lower bits are 0, and full scale is
//! that of the container. Some recorders write them at the lower end. Then all samples lie within 24 bits, and their
//! lowest bits are in use:
//!
//! - Where 24 valid bits are stated, that is what was written: at the upper end the lowest bits are 0.
//! - Where nothing is stated, a quiet signal of 32 bits looks alike. It is taken for 24 bits if its peak is above half of
//!   their full scale (a signal of 32 bits is that by chance only between -54 and -48 dB of full scale). Below, the
//!   container's full scale stays, and a remark says that it is uncertain.
//!
//! All samples are looked at, until one is found that does not fit.

use super::coding::Coding;
use crate::grid::Grid;
use crate::number::Number;
use crate::{FormatError, Raw, Source};

/// Bits that converters have, kept in words of 32.
const USUAL_BITS: u16 = 24;
/// Samples read at once.
const PIECE: usize = 1 << 18;

/// What the samples are like that were looked at.
#[derive(Debug, Default)]
struct Seen {
    least: i32,
    most: i32,
    /// All bits that any sample has.
    bits: i32,
    /// Whether all samples lie within the bits looked for.
    within: bool,
}

/// Bits of which full scale is, of samples that lie side by side. Errors: they cannot be read.
pub(super) fn full_scale_bits(coding: &Coding, samples: &Grid, remarks: &mut Vec<String>) -> Result<u16, FormatError> {
    let container = coding.bits;
    let stated = coding.valid_bits < container;
    let bits = if stated { coding.valid_bits } else { USUAL_BITS };
    let whole = !matches!(coding.number, Number::I16 | Number::I24 | Number::I32);
    if whole || bits >= container || (!stated && coding.number != Number::I32) {
        return Ok(container);
    }
    let seen = look(samples, bits)?;
    let low_bits = seen.bits & ((1 << (container - bits)) - 1);
    if low_bits == 0 {
        return Ok(container);
    }
    if !seen.within {
        if stated {
            remarks.push(format!(
                "{bits} valid bits of {container} are stated, the samples use more: full scale is that of {container}"
            ));
        }
        return Ok(container);
    }
    let peak = seen.most.unsigned_abs().max(seen.least.unsigned_abs());
    let half_scale = 1_u32 << (bits - 2);
    if stated || peak >= half_scale {
        let why = if stated { "as many valid bits are stated" } else { "the peak is above half of that full scale" };
        remarks.push(format!(
            "all samples lie within the lower {bits} of {container} bits (from {} to {}) and {why}: full scale is that \
             of {bits} bits",
            seen.least, seen.most
        ));
        return Ok(bits);
    }
    let factor = 1_u64 << (container - bits);
    remarks.push(format!(
        "the scale is uncertain: all samples lie within the lower {bits} of {container} bits (from {} to {}); they are \
         read as fractions of {container} bits, if {bits} were recorded they are {factor} times as large",
        seen.least, seen.most
    ));
    Ok(container)
}

/// Looks at the samples up to the first that does not lie within so many bits.
fn look(samples: &Grid, bits: u16) -> Result<Seen, FormatError> {
    let limit = 1_i64 << (bits - 1);
    let mut seen = Seen { within: true, ..Seen::default() };
    let mut from = 0;
    while from < samples.samples && seen.within {
        let count = PIECE.min(samples.samples - from);
        let codes: Vec<i32> = match samples.read(from, count)? {
            Raw::Int32(codes) => codes,
            Raw::Int16(codes) => codes.into_iter().map(i32::from).collect(),
            Raw::Float32(_) | Raw::Float64(_) => return Ok(Seen::default()),
        };
        for code in codes {
            seen.least = seen.least.min(code);
            seen.most = seen.most.max(code);
            seen.bits |= code;
        }
        seen.within = i64::from(seen.least) >= -limit && i64::from(seen.most) < limit;
        from += count;
    }
    Ok(seen)
}
