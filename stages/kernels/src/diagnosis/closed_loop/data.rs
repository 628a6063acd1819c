//! What is measured, what is asked for, what comes back.

use std::ops::Range;

use crate::diagnosis::verdict::Diagnosis;

use super::controller::Controller;
use super::motion::Plant;

/// Fewest samples: every block of the jackknife then holds more rows than there are unknowns.
pub(super) const LEAST_SAMPLES: usize = 400;

/// Largest magnitude of a sample: sums of squares of more would overflow.
const LARGEST: f64 = 1e100;

/// A measured loop, equally sampled.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ClosedLoop<'a> {
    /// What the output is to follow.
    pub reference: &'a [f64],
    /// What the controller puts out, held until the next sample.
    pub drive: &'a [f64],
    /// Measured position.
    pub output: &'a [f64],
    /// A further channel with its name: what is added to the drive, or pushes the plant.
    pub extra: Option<(&'a str, &'a [f64])>,
    /// Seconds between samples.
    pub interval_s: f64,
    /// Force per unit of the drive; its sign may be wrong.
    pub drive_scale: f64,
}

/// Units of the channels and of the force.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct ClosedLoopUnits {
    /// Of reference and output.
    pub output: String,
    /// Of the drive.
    pub drive: String,
    /// Of the drive times its scale.
    pub force: String,
}

impl Default for ClosedLoopUnits {
    fn default() -> Self {
        Self { output: "m".to_owned(), drive: "V".to_owned(), force: "N".to_owned() }
    }
}

/// A stretch that the verdict is judged on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct JudgedPart {
    /// Its name.
    pub name: String,
    /// First sample, from 0.
    pub first: usize,
    /// One past the last.
    pub end: usize,
}

/// What is asked for.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedLoopOptions<'a> {
    /// Causes that may be named: `coulomb-friction`, `offset`, `quadratic-damping`, `asymmetric-friction`. Default: all
    /// but the last, which is then only mentioned where the data tell it from an offset.
    pub candidates: &'a [&'a str],
    /// Rate of false alarms over all candidates together.
    pub false_alarm_rate: f64,
    /// Samples that choose and fit; absent: all.
    pub training: Option<Range<usize>>,
    /// Stretches to judge on; the simulation runs through from the record's first sample.
    pub parts: Vec<JudgedPart>,
    /// Units.
    pub units: ClosedLoopUnits,
}

impl Default for ClosedLoopOptions<'_> {
    fn default() -> Self {
        Self {
            candidates: &["coulomb-friction", "offset", "quadratic-damping"],
            false_alarm_rate: 0.01,
            training: None,
            parts: Vec::new(),
            units: ClosedLoopUnits::default(),
        }
    }
}

/// The answer with what it rests on.
#[derive(Debug, Clone, PartialEq)]
pub struct ClosedLoopDiagnosis {
    /// Verdict.
    pub diagnosis: Diagnosis,
    /// Output of the loop simulated from its reference with mass and viscous friction alone, in the output's unit.
    pub before: Vec<f64>,
    /// The same with all that was found.
    pub after: Vec<f64>,
    /// Drive of that simulation.
    pub drive_after: Vec<f64>,
    /// The controller.
    pub controller: Controller,
    /// The plant with all that was found.
    pub plant: Plant,
}

/// Why this is no loop for this engine.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum NotClosedLoop {
    /// Channels of different lengths.
    #[error("{name} has {found} samples, the output {wanted}")]
    Lengths {
        /// The channel.
        name: String,
        /// Its samples.
        found: usize,
        /// The output's.
        wanted: usize,
    },
    /// Too few samples.
    #[error("{found} samples, wanted at least {wanted}")]
    TooShort {
        /// Samples.
        found: usize,
        /// Samples.
        wanted: usize,
    },
    /// A missing or absurd value.
    #[error("sample {index} of {name} is not a number below 1e100")]
    NotFinite {
        /// The channel.
        name: String,
        /// The first such sample.
        index: usize,
    },
    /// A channel that does not move.
    #[error("{name} is constant: there is no loop to follow")]
    Constant {
        /// The channel.
        name: &'static str,
    },
    /// A scalar out of range.
    #[error("{name} is {found}, wanted a finite number other than 0 (an interval: above 0)")]
    Parameter {
        /// Its name.
        name: &'static str,
        /// Its value.
        found: f64,
    },
    /// The drive is not a function of reference and output.
    #[error("reference and output leave {share:.3} of the drive's standard deviation: wanted at most {wanted}")]
    NoLaw {
        /// Residual over the drive's standard deviation, held out.
        share: f64,
        /// Most of it.
        wanted: f64,
    },
    /// The drive follows without one of them.
    #[error("without {name} the prediction of the drive is only {ratio:.2} times worse: wanted {wanted} times")]
    Independent {
        /// The channel that is not used.
        name: &'static str,
        /// How much worse.
        ratio: f64,
        /// How much worse it is to be.
        wanted: f64,
    },
    /// No force balance with a mass.
    #[error("the drive moves no mass: no force balance can be solved")]
    NoMass,
}

impl ClosedLoop<'_> {
    /// Everything that can be wrong before a number is computed.
    pub(super) fn check(&self) -> Result<(), NotClosedLoop> {
        let wanted = self.output.len();
        let extra = self.extra;
        let channels = [("reference", self.reference), ("drive", self.drive), ("output", self.output)];
        for (name, values) in channels.into_iter().chain(extra) {
            if values.len() != wanted {
                return Err(NotClosedLoop::Lengths { name: name.to_owned(), found: values.len(), wanted });
            }
            if let Some(index) = values.iter().position(|x| !x.is_finite() || x.abs() > LARGEST) {
                return Err(NotClosedLoop::NotFinite { name: name.to_owned(), index });
            }
        }
        if !(self.interval_s.is_finite() && self.interval_s > 0.0) {
            return Err(NotClosedLoop::Parameter { name: "interval_s", found: self.interval_s });
        }
        if !(self.drive_scale.is_finite() && self.drive_scale != 0.0) {
            return Err(NotClosedLoop::Parameter { name: "drive_scale", found: self.drive_scale });
        }
        if wanted < LEAST_SAMPLES {
            return Err(NotClosedLoop::TooShort { found: wanted, wanted: LEAST_SAMPLES });
        }
        Ok(())
    }
}

/// Samples to learn from, within the record. Errors: too few, a channel constant.
pub(super) fn training(
    measured: &ClosedLoop<'_>,
    options: &ClosedLoopOptions<'_>,
) -> Result<Range<usize>, NotClosedLoop> {
    let all = measured.output.len();
    let asked = options.training.clone().unwrap_or(0..all);
    let range = asked.start.min(all)..asked.end.min(all);
    if range.len() < LEAST_SAMPLES {
        return Err(NotClosedLoop::TooShort { found: range.len(), wanted: LEAST_SAMPLES });
    }
    for (name, values) in
        [("the reference", measured.reference), ("the drive", measured.drive), ("the output", measured.output)]
    {
        if deviation(values.get(range.clone()).unwrap_or_default()) <= 0.0 {
            return Err(NotClosedLoop::Constant { name });
        }
    }
    Ok(range)
}

/// Standard deviation; 0 where all samples are equal to rounding.
pub(super) fn deviation(values: &[f64]) -> f64 {
    let count = values.len().max(1) as f64;
    let mean = values.iter().sum::<f64>() / count;
    let deviation = (values.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / count).sqrt();
    if deviation > 1e-12 * mean.abs() { deviation } else { 0.0 }
}
