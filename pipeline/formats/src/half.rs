//! Numbers of half precision.

/// Bits of the fraction.
const FRACTION_BITS: u32 = 10;
/// Bits by which the fraction of single precision is longer.
const LONGER_BY_BITS: u32 = f32::MANTISSA_DIGITS - 1 - FRACTION_BITS;
/// By how much the exponent of single precision is biased more: 127 instead of 15.
const MORE_BIAS: u32 = 127 - 15;
/// What the last place of numbers below the smallest normal one counts: 2^-24.
const LEAST: f32 = 1.0 / (1 << 24) as f32;
/// The exponent of infinity and of what is no number.
const NOT_FINITE: u32 = 31;

/// A number of IEEE half precision in single precision, which holds all of them exactly.
///
/// Source: IEEE 754-2019, section 3.4 and table 3.5 (binary16).
pub(crate) fn half_precision(bits: u16) -> f32 {
    let (negative, bits) = (bits >> 15 != 0, u32::from(bits & 0x7fff));
    let magnitude = match bits >> FRACTION_BITS {
        0 => bits as f32 * LEAST,
        NOT_FINITE => f32::from_bits(f32::INFINITY.to_bits() | ((bits << LONGER_BY_BITS) & 0x007f_ffff)),
        _ => f32::from_bits((bits << LONGER_BY_BITS) + (MORE_BIAS << (f32::MANTISSA_DIGITS - 1))),
    };
    if negative { -magnitude } else { magnitude }
}

#[cfg(test)]
mod tests {
    use super::half_precision;

    /// The definition, in double precision.
    fn slow(bits: u16) -> f64 {
        let (exponent, fraction) = (i32::from(bits >> 10 & 31), f64::from(bits & 1023));
        let magnitude = match exponent {
            0 => fraction * 2_f64.powi(-24),
            31 if fraction == 0.0 => f64::INFINITY,
            31 => f64::NAN,
            _ => (1.0 + fraction / 1024.0) * 2_f64.powi(exponent - 15),
        };
        if bits >> 15 == 1 { -magnitude } else { magnitude }
    }

    #[test]
    fn each_of_the_65536_numbers_is_exact() {
        for bits in 0..=u16::MAX {
            let (found, wanted) = (f64::from(half_precision(bits)), slow(bits));
            assert!(found.is_nan() && wanted.is_nan() || found.to_bits() == wanted.to_bits(), "{bits:#06x}: {found}");
        }
        assert_eq!([0x3555, 0xc000, 0x7bff, 1].map(half_precision), [0.333_251_95, -2.0, 65504.0, 5.960_464_5e-8]);
    }
}
