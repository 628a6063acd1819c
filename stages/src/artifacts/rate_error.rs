//! How well a sample rate is known, and what that adds to the errors of frequencies.

use afmid_kernels::modes::Root;
use afmid_kernels::ringdown::{Estimate, ModeEstimate};
use afmid_pipeline::recording::Record;
use afmid_pipeline::{Array, Attribute, StateSpace};

/// Standard error of an artifact's sample rate, relative; there where it is not 0.
const RATE_RELATIVE_STD: &str = "sample_rate_relative_std";

/// Half a normal 95 % interval, in standard errors.
const NORMAL_95: f64 = 1.959_963_985;

/// The standard error of a sample rate, relative to it: intervals that a file states with few digits, stamps that are
/// rounded. All frequencies scale with the rate, together; quality factors and damping ratios do not change.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub(crate) struct RateError {
    pub relative_std: f64,
}

impl RateError {
    /// As an artifact states it; 0 where it states none.
    pub fn of(array: &Array) -> Self {
        Self::stated(array.attributes.get(RATE_RELATIVE_STD))
    }

    /// That of the data which a model is of.
    pub fn of_model(model: &StateSpace) -> Self {
        Self::stated(model.attributes.get(RATE_RELATIVE_STD))
    }

    fn stated(attribute: Option<&Attribute>) -> Self {
        let relative_std = attribute.and_then(Attribute::as_f64).filter(|std| std.is_finite() && *std > 0.0);
        Self { relative_std: relative_std.unwrap_or(0.0) }
    }

    /// Of records that are taken together: the largest.
    pub fn of_records(records: &[Record]) -> Self {
        Self { relative_std: records.iter().map(|record| record.rate_relative_std).fold(0.0, f64::max) }
    }

    /// That of two which are taken together.
    pub fn larger(self, other: Self) -> Self {
        if other.relative_std > self.relative_std { other } else { self }
    }

    /// The artifact, which states it then.
    pub fn stated_by(self, array: Array) -> Array {
        if self.relative_std > 0.0 { array.attribute(RATE_RELATIVE_STD, self.relative_std) } else { array }
    }

    /// The model, which states it then.
    pub fn state_in(self, model: &mut StateSpace) {
        if self.relative_std > 0.0 {
            model.attributes.insert(RATE_RELATIVE_STD.to_owned(), self.relative_std.into());
        }
    }

    /// The standard error of what scales with the rate or with one over it. What has none was given, and stays as it was.
    pub fn widened(self, value: f64, std: f64) -> f64 {
        if self.relative_std > 0.0 && std != 0.0 { std.hypot(self.relative_std * value) } else { std }
    }

    /// Ends of a 95 % interval of what scales with the rate.
    pub fn widened_ends(self, value: f64, (low, high): (f64, f64)) -> (f64, f64) {
        let more = NORMAL_95 * self.relative_std * value.abs();
        match more > 0.0 {
            true => (value - (value - low).hypot(more), value + (high - value).hypot(more)),
            false => (low, high),
        }
    }

    /// Adds it to one number that scales with the rate.
    pub fn widen(self, estimate: &mut Estimate) {
        estimate.std = self.widened(estimate.value, estimate.std);
    }

    /// Adds it to the frequencies of modes.
    pub fn widen_modes(self, modes: &mut [ModeEstimate]) {
        modes.iter_mut().for_each(|mode| self.widen(&mut mode.frequency_hz));
    }

    /// Adds it to the frequency of a pole or zero.
    pub fn widen_root(self, root: &mut Root) {
        root.frequency_std_hz = self.widened(root.frequency_hz, root.frequency_std_hz);
    }
}
