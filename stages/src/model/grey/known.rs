//! The parameter `known`: what is known beforehand.

use afmid_pipeline::StageError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use afmid_kernels::grey::{GreyKnown, GreyQuantity};
use afmid_kernels::ringdown::Knowledge;

/// What is known of one number, by exactly one of `fixed`, `between` and `about`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct GreyNumber {
    /// Which number.
    pub quantity: GreyNumberKind,
    /// Which mode, 1 the lowest: for `frequency_hz`, `quality_factor` and `gain`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mode: Option<usize>,
    /// Which real pole, 1 the lowest: for `corner_hz`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub real_pole: Option<usize>,
    /// From which input, 1 the first: for `gain` and `feedthrough`. Default: 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub input: Option<usize>,
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

/// A number of the grey form.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum GreyNumberKind {
    /// Undamped frequency of a mode.
    FrequencyHz,
    /// Quality factor of a mode.
    QualityFactor,
    /// Static gain of a mode.
    Gain,
    /// Corner frequency of a real pole.
    CornerHz,
    /// Delay.
    DelayS,
    /// What passes without any mode.
    Feedthrough,
}

impl GreyNumber {
    /// The same for the kernel. Errors: an owner too few or too many, no or two kinds of knowledge.
    pub(super) fn known(&self) -> Result<GreyKnown, StageError> {
        Ok(GreyKnown { quantity: self.quantity()?, knowledge: self.knowledge()? })
    }

    fn quantity(&self) -> Result<GreyQuantity, StageError> {
        let counted = |name: &str, number: Option<usize>| match number {
            Some(number) if number > 0 => Ok(number - 1),
            Some(_) => Err(StageError::new(format!("`known`: `{name}` is 0, they are counted from 1"))),
            None => Err(StageError::new(format!("`known`: wanted `{name}` beside this quantity"))),
        };
        let input = || counted("input", Some(self.input.unwrap_or(1)));
        use GreyNumberKind as Kind;
        let (wants_mode, wants_pole, wants_input) = (
            matches!(self.quantity, Kind::FrequencyHz | Kind::QualityFactor | Kind::Gain),
            self.quantity == Kind::CornerHz,
            matches!(self.quantity, Kind::Gain | Kind::Feedthrough),
        );
        for (name, given, wanted) in [
            ("mode", self.mode.is_some(), wants_mode),
            ("real_pole", self.real_pole.is_some(), wants_pole),
            ("input", self.input.is_some(), wants_input),
        ] {
            if given && !wanted {
                return Err(StageError::new(format!("`known`: `{name}` does not go with this quantity: leave it out")));
            }
        }
        Ok(match self.quantity {
            Kind::FrequencyHz => GreyQuantity::Frequency(counted("mode", self.mode)?),
            Kind::QualityFactor => GreyQuantity::QualityFactor(counted("mode", self.mode)?),
            Kind::Gain => GreyQuantity::Gain { mode: counted("mode", self.mode)?, input: input()? },
            Kind::CornerHz => GreyQuantity::RealPole(counted("real_pole", self.real_pole)?),
            Kind::DelayS => GreyQuantity::Delay,
            Kind::Feedthrough => GreyQuantity::Feedthrough(input()?),
        })
    }

    fn knowledge(&self) -> Result<Knowledge, StageError> {
        match (self.fixed, self.between, self.about) {
            (Some(value), None, None) => Ok(Knowledge::Fixed(value)),
            (None, Some([least, most]), None) => Ok(Knowledge::Between(least, most)),
            (None, None, Some([value, std])) => Ok(Knowledge::About(value, std)),
            _ => Err(StageError::new("`known`: wanted one of `fixed`, `between` and `about` in every entry")),
        }
    }
}
