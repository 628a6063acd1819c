//! The parameter `known`: what is known beforehand.

use afmid_pipeline::StageError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use afmid_kernels::ringdown::{Knowledge, Known, Quantity};

/// What is known of one number, by exactly one of `fixed`, `between` and `about`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnownNumber {
    /// Which mode, 1 the lowest. Either this or `real_pole`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mode: Option<usize>,
    /// Which real pole, 1 the first of the start (0.256 of the sample rate, each further one's decay per sample half of
    /// the one before).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub real_pole: Option<usize>,
    /// `frequency_hz` (of a real pole: its corner) or `quality_factor`.
    pub quantity: KnownQuantity,
    /// Its value: it is not estimated and has no error.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub fixed: Option<f64>,
    /// Its least and largest value.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub between: Option<[f64; 2]>,
    /// Its expected value and standard deviation.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub about: Option<[f64; 2]>,
}

/// What something is known of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum KnownQuantity {
    /// Frequency.
    FrequencyHz,
    /// Quality factor.
    QualityFactor,
}

impl KnownNumber {
    /// The same for the kernel. Errors: no or two owners, no or two kinds of knowledge, a number that is out of range.
    pub(super) fn known(&self, modes: usize, real_poles: usize) -> Result<Known, StageError> {
        Ok(Known { quantity: self.quantity(modes, real_poles)?, knowledge: self.knowledge()? })
    }

    fn quantity(&self, modes: usize, real_poles: usize) -> Result<Quantity, StageError> {
        let within = |what: &str, number: usize, most: usize| match number.checked_sub(1) {
            Some(index) if number <= most => Ok(index),
            _ => Err(StageError::new(format!("`known`: {what} {number} of {most}")).help("they are counted from 1")),
        };
        match (self.mode, self.real_pole, self.quantity) {
            (Some(mode), None, KnownQuantity::FrequencyHz) => Ok(Quantity::Frequency(within("mode", mode, modes)?)),
            (Some(mode), None, KnownQuantity::QualityFactor) => {
                Ok(Quantity::QualityFactor(within("mode", mode, modes)?))
            }
            (None, Some(pole), KnownQuantity::FrequencyHz) => {
                Ok(Quantity::RealPole(within("real pole", pole, real_poles)?))
            }
            (None, Some(_), KnownQuantity::QualityFactor) => {
                Err(StageError::new("`known`: a quality factor of a real pole, wanted `frequency_hz`"))
            }
            _ => Err(StageError::new("`known`: wanted either `mode` or `real_pole` in every entry")),
        }
    }

    fn knowledge(&self) -> Result<Knowledge, StageError> {
        let found = match (self.fixed, self.between, self.about) {
            (Some(value), None, None) => Knowledge::Fixed(value),
            (None, Some([least, most]), None) => Knowledge::Between(least, most),
            (None, None, Some([value, std])) => Knowledge::About(value, std),
            _ => {
                return Err(StageError::new("`known`: wanted one of `fixed`, `between` and `about` in every entry"));
            }
        };
        let floor = if self.quantity == KnownQuantity::QualityFactor { 0.5 } else { 0.0 };
        let (possible, wanted) = match found {
            Knowledge::Fixed(value) => (value > floor && value.is_finite(), "a finite value"),
            Knowledge::Between(a, b) => (a > floor && a < b && b.is_finite(), "ascending bounds"),
            Knowledge::About(value, std) => (
                value > floor && value.is_finite() && std > 0.0 && std.is_finite(),
                "a standard deviation above 0, a value",
            ),
            Knowledge::Free => (true, ""),
        };
        if possible {
            return Ok(found);
        }
        Err(StageError::new(format!("`known`: found {found:?}, wanted {wanted} above {floor}")))
    }
}

/// The name of a quantity in messages.
pub(super) fn named(quantity: Quantity) -> String {
    match quantity {
        Quantity::Frequency(mode) => format!("the frequency of mode {}", mode + 1),
        Quantity::QualityFactor(mode) => format!("the quality factor of mode {}", mode + 1),
        Quantity::RealPole(pole) => format!("real pole {}", pole + 1),
    }
}
