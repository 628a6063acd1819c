//! The analogue-to-digital converter.

use super::error::{SimulateError, require};

/// A mid-tread converter with two's complement codes.
///
/// # Model
/// `code = round(v / lsb)`, half away from zero, limited to `-2^(bits-1) ..= 2^(bits-1) - 1`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adc {
    /// Number of bits, 2 to 16.
    pub bits: u32,
    /// Volts per code.
    pub lsb_v: f64,
}

impl Adc {
    /// Every parameter's range.
    pub fn check(&self) -> Result<(), SimulateError> {
        require("lsb_v", self.lsb_v, self.lsb_v > 0.0, "wanted above 0")?;
        if (2..=16).contains(&self.bits) {
            Ok(())
        } else {
            Err(SimulateError::parameter("adc_bits", self.bits, "wanted 2 to 16 (the record holds int16)"))
        }
    }

    /// The lowest and the highest code.
    pub fn code_range(&self) -> (i16, i16) {
        let half = 1i32 << (self.bits.clamp(2, 16) - 1);
        ((-half) as i16, (half - 1) as i16)
    }

    /// The code of one voltage.
    pub fn code(&self, volts: f64) -> i16 {
        let (low, high) = self.code_range();
        (volts / self.lsb_v).round().clamp(f64::from(low), f64::from(high)) as i16
    }

    /// How many of `codes` lie at a limit.
    pub fn saturated(&self, codes: &[i16]) -> usize {
        let (low, high) = self.code_range();
        codes.iter().filter(|&&code| code == low || code == high).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn twelve_bits_round_and_saturate() {
        let adc = Adc { bits: 12, lsb_v: 0.977e-3 };
        assert_eq!(adc.code_range(), (-2048, 2047));
        assert_eq!(adc.code(0.9e-3), 1);
        assert_eq!(adc.code(-0.4e-3), 0);
        assert_eq!(adc.code(3.0), 2047);
        assert_eq!(adc.code(-3.0), -2048);
        assert_eq!(adc.saturated(&[2047, 0, -2048, 12]), 2);
        assert_eq!(Adc { bits: 16, lsb_v: 1.0 }.code_range(), (i16::MIN, i16::MAX));
    }
}
