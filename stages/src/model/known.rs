//! The parameter `known` of ringdown and grey form: what is known beforehand.

use afmid_pipeline::StageError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use afmid_kernels::grey::{GreyKnown, GreyQuantity};
use afmid_kernels::ringdown::{Knowledge, Known, Quantity};

/// What is known of one number, by exactly one of `fixed`, `between` and `about`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct KnownNumber {
    /// Which number.
    pub quantity: KnownQuantity,
    /// Which mode, 1 the lowest: for `frequency_hz`, `quality_factor` and `gain`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mode: Option<usize>,
    /// Which real pole, for `corner_hz`: 1 the lowest of a grey form; the first of a ringdown's start (0.256 of the
    /// sample rate, each further one's decay per sample half of the one before).
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

/// A number that something may be known of.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "snake_case")]
pub enum KnownQuantity {
    /// Undamped frequency of a mode, or corner frequency of a real pole.
    FrequencyHz,
    /// Quality factor of a mode.
    QualityFactor,
    /// Corner frequency of a real pole.
    CornerHz,
    /// Static gain of a mode; of a grey form alone, as what follows.
    Gain,
    /// Delay.
    DelayS,
    /// What passes without any mode.
    Feedthrough,
}

impl KnownNumber {
    /// The same of a grey form. Errors: an owner too few or too many, no or two kinds of knowledge.
    pub(super) fn of_grey(&self) -> Result<GreyKnown, StageError> {
        Ok(GreyKnown { quantity: self.quantity()?, knowledge: self.knowledge()? })
    }

    /// The same of a ringdown. Errors: as before; a number that a ringdown does not have, or that is out of range.
    pub(super) fn of_ringdown(&self, modes: usize, real_poles: usize) -> Result<Known, StageError> {
        let within = |what: &str, index: usize, most: usize| match index < most {
            true => Ok(index),
            false => Err(StageError::new(format!("`known`: {what} {} of {most}", index + 1))),
        };
        let quantity = match self.quantity()? {
            GreyQuantity::Frequency(mode) => Quantity::Frequency(within("mode", mode, modes)?),
            GreyQuantity::QualityFactor(mode) => Quantity::QualityFactor(within("mode", mode, modes)?),
            GreyQuantity::RealPole(pole) => Quantity::RealPole(within("real pole", pole, real_poles)?),
            GreyQuantity::Delay | GreyQuantity::Gain { .. } | GreyQuantity::Feedthrough(_) => {
                let wanted = "`known`: wanted `frequency_hz`, `quality_factor` or `corner_hz`, what a ringdown has";
                return Err(StageError::new(wanted));
            }
        };
        let known = Known { quantity, knowledge: self.knowledge()? };
        known.check().map_err(|error| StageError::new(format!("`known`: {error}")))?;
        Ok(known)
    }

    fn quantity(&self) -> Result<GreyQuantity, StageError> {
        let counted = |name: &str, number: Option<usize>| match number {
            Some(number) if number > 0 => Ok(number - 1),
            Some(_) => Err(StageError::new(format!("`known`: `{name}` is 0, they are counted from 1"))),
            None => Err(StageError::new(format!("`known`: wanted `{name}` beside this quantity"))),
        };
        let input = || counted("input", Some(self.input.unwrap_or(1)));
        use KnownQuantity as Kind;
        // the frequency of a real pole is its corner
        let corner = self.quantity == Kind::FrequencyHz && self.mode.is_none() && self.real_pole.is_some();
        let kind = if corner { Kind::CornerHz } else { self.quantity };
        let (wants_mode, wants_pole, wants_input) = (
            matches!(kind, Kind::FrequencyHz | Kind::QualityFactor | Kind::Gain),
            kind == Kind::CornerHz,
            matches!(kind, Kind::Gain | Kind::Feedthrough),
        );
        for (name, given, wanted) in [
            ("mode", self.mode.is_some(), wants_mode),
            ("real_pole", self.real_pole.is_some(), wants_pole),
            ("input", self.input.is_some(), wants_input),
        ] {
            if given && !wanted {
                return Err(StageError::new(format!("`known`: `{name}` does not go with this quantity: leave it out"))
                    .help("a real pole has a `corner_hz`, a mode `frequency_hz` and `quality_factor`"));
            }
        }
        Ok(match kind {
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
