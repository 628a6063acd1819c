//! What a channel finds.

use crate::diagnosis::verdict::{Gain, RunnerUp, Value};

/// A cause that shows in the records themselves.
#[derive(Debug, Clone, PartialEq)]
pub struct RecordSign {
    /// Its id in the catalogue of causes.
    pub id: &'static str,
    /// Probability of so large a sign without it, corrected for all that its channel looked at (not for the number of
    /// channels).
    pub p_value: f64,
    /// Its parameters, named as in the catalogue. Those that differ from record to record (phases of lines) are left
    /// out.
    pub parameters: Vec<(&'static str, Value)>,
    /// What gave it away.
    pub evidence: String,
    /// Rms over the stretch where it acts, on records (or parts of them) that did not determine it.
    pub gain: Gain,
    /// The next best name, where another shape was tried.
    pub runner_up: Option<RunnerUp>,
    /// The other cause fits as well: the two can't be distinguished from these records.
    pub tied: bool,
}

/// Least strength of a sign over its standard error.
const KNOWN: f64 = 3.0;

impl RecordSign {
    /// Whether its strength, the first parameter, is more than three of its errors: one that differs so much from record
    /// to record is none of its kind.
    pub(super) fn is_known(&self) -> bool {
        let strength = self.parameters.first().map(|(_, strength)| strength);
        let ratio = strength.and_then(|strength| Some(strength.value?.abs() / strength.std?));
        ratio.is_none_or(|ratio| ratio > KNOWN)
    }

    /// Frequency of a line that is none of the mains', Hz.
    pub fn line_hz(&self) -> Option<f64> {
        let of_line = self.parameters.iter().filter(|_| self.id == "spurious-line");
        of_line.filter(|(name, _)| *name == "frequency_hz").find_map(|(_, value)| value.value)
    }
}

/// A cause that these records can't be asked about.
#[derive(Debug, Clone, PartialEq)]
pub struct Abstention {
    /// Its id.
    pub id: &'static str,
    /// Why.
    pub reason: String,
}

pub(super) fn value(value: f64, std: f64, unit: &str) -> Value {
    let known = |x: f64| x.is_finite().then_some(x);
    Value { value: known(value), std: known(std), unit: unit.to_owned() }
}

pub(super) fn gain(before: f64, after: f64, held_out: impl Into<String>) -> Gain {
    let known = |x: f64| x.is_finite().then_some(x);
    Gain {
        rms_before: known(before),
        rms_after: known(after),
        unit: "V".to_owned(),
        log_likelihood: None,
        held_out: held_out.into(),
    }
}
