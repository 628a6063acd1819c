//! Intervals of stated level from estimates and their standard errors.

/// Level of every interval here.
pub const LEVEL: f64 = 0.95;
/// Standard errors on either side of a normal estimate at that level.
const REACH: f64 = 1.959_964;

/// Where a value lies with a probability of [`LEVEL`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Interval {
    /// Lower end; NaN where there is no error.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

impl Interval {
    /// Of an estimate that is normal.
    pub fn normal(value: f64, std: f64) -> Self {
        Self { low: value - REACH * std, high: value + REACH * std }
    }

    /// Of a positive estimate: its logarithm is taken as normal, so that the interval stays positive and is right for
    /// small errors.
    pub fn positive(value: f64, std: f64) -> Self {
        let ratio = (REACH * std / value).exp();
        Self { low: value / ratio, high: value * ratio }
    }

    /// Whether `value` lies inside.
    pub fn covers(&self, value: f64) -> bool {
        (self.low..=self.high).contains(&value)
    }
}
