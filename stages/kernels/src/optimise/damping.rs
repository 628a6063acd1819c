//! How much a step is shortened, and what its success says of the next one.

/// The rule for the damping of a search. It is a share of the information's diagonal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Damping {
    /// It does not fall below this.
    pub least: f64,
    /// A search ends where a step of this damping would be the next trial.
    pub most: f64,
    /// After a trial that failed it is at least this.
    pub after_failure: f64,
    /// Factor after a trial that failed.
    pub rise: f64,
    /// What the factor itself is multiplied by after each further failure in a row.
    pub rise_growth: f64,
}

/// Factor after a step that was taken; the least one where the step's promise is known.
const FALL: f64 = 0.1;

impl Damping {
    /// For objectives that are cheap to evaluate: decades up and down.
    pub const STANDARD: Self = Self { least: 1e-12, most: 1e12, after_failure: 1e-4, rise: 10.0, rise_growth: 1.0 };
    /// Where a trial costs a pass over all samples: eight failures in a row cross twenty decades.
    pub const FAST_RISE: Self = Self { least: 1e-14, most: 1e12, after_failure: 1e-6, rise: 4.0, rise_growth: 4.0 };

    /// After the `failures`-th failed trial in a row (from 0 on).
    pub(super) fn raised(&self, damping: f64, failures: i32) -> f64 {
        (damping * self.rise * self.rise_growth.powi(failures)).max(self.after_failure)
    }

    /// After a step that was taken; `kept`: fall of the cost over the one that the local model promised (Nielsen's
    /// rule).
    pub(super) fn lowered(&self, damping: f64, kept: Option<f64>) -> f64 {
        let factor = kept.map_or(FALL, |kept| (1.0 - (2.0 * kept - 1.0).powi(3)).clamp(FALL, self.rise));
        (damping * factor).max(self.least)
    }
}
