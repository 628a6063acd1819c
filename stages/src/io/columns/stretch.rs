//! Stretches of a record, and what is taken off them.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Samples `first..end` of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stretch {
    /// First sample, from 0.
    pub first: usize,
    /// One past the last.
    pub end: usize,
}

impl Stretch {
    /// Its part of a series that is at least as long.
    pub fn of(self, values: &[f64]) -> &[f64] {
        values.get(self.first..self.end).unwrap_or(&[])
    }
}

/// First and second half; of an odd number of samples the second is the longer.
pub fn halves(samples: usize) -> (Stretch, Stretch) {
    let middle = samples / 2;
    (Stretch { first: 0, end: middle }, Stretch { first: middle, end: samples })
}

/// What is taken off a signal before a model is fitted.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Removal {
    /// Nothing.
    None,
    /// The mean.
    Mean,
    /// The straight line of least squares.
    Line,
}

impl Removal {
    /// Its name in configs.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Mean => "mean",
            Self::Line => "line",
        }
    }
}

/// Level and slope that were taken off: `level + slope (k - origin)` at sample k.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Trend {
    /// At the origin.
    pub level: f64,
    /// Per sample.
    pub slope: f64,
    /// Sample, the middle of the stretch that it is from.
    pub origin: f64,
}

impl Trend {
    /// From a stretch's finite samples alone; all zero where there are none.
    pub fn of(values: &[f64], stretch: Stretch, removal: Removal) -> Self {
        let finite: Vec<(f64, f64)> = (stretch.first..stretch.end)
            .zip(stretch.of(values))
            .filter(|(_, value)| value.is_finite())
            .map(|(k, value)| (k as f64, *value))
            .collect();
        if finite.is_empty() || removal == Removal::None {
            return Self::default();
        }
        let count = finite.len() as f64;
        let origin = finite.iter().map(|(k, _)| k).sum::<f64>() / count;
        let level = finite.iter().map(|(_, value)| value).sum::<f64>() / count;
        let spread: f64 = finite.iter().map(|(k, _)| (k - origin).powi(2)).sum();
        let slope = match removal {
            Removal::Line if spread > 0.0 => {
                finite.iter().map(|(k, value)| (k - origin) * (value - level)).sum::<f64>() / spread
            }
            _ => 0.0,
        };
        Self { level, slope, origin }
    }

    /// The series without it.
    pub fn removed(self, values: &[f64]) -> Vec<f64> {
        let at = |k: usize| self.level + self.slope * (k as f64 - self.origin);
        values.iter().enumerate().map(|(k, value)| value - at(k)).collect()
    }
}
