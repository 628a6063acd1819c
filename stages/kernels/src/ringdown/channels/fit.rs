//! The search on the poles under given noise.

use std::convert::Infallible;

use faer::Mat;

use super::basis::Poles;
use super::projection::Projection;
use super::records::{Group, Records, groups};
use crate::optimise::{Damping, Ending, Limits, Objective, Taken, Trial, damped_step, descend};
use crate::ringdown::{RingdownNoise, RingdownVerdict};

/// Largest number of trial steps.
const TRIALS: usize = 60;
/// Damping of the first step.
const FIRST: f64 = 1e-4;
/// Length of a step, in standard errors, that counts as arrived.
pub(super) const ARRIVED: f64 = 1e-3;
/// The same where another fit begins there.
pub(super) const NEARLY: f64 = 3e-2;

/// Share of the noise that was assumed below which what is left is rounding: a channel that is one number throughout.
const LEAST_SCALE: f64 = 1e-9;

/// A fit under one noise.
pub(super) struct Fitted {
    pub poles: Poles,
    pub projection: Projection,
    pub verdict: RingdownVerdict,
    /// Time unit of the shared parameters, s.
    pub unit_s: f64,
    /// Per channel: whitened energy left, and minus twice the log-likelihood's part of the noise's volume.
    pub energy: Vec<f64>,
    pub log_variance: Vec<f64>,
}

impl Fitted {
    /// From a start to at most `arrived` standard errors from the best.
    pub fn of(records: &Records<'_>, noise: &[RingdownNoise], start: &Poles, least_q: f64, arrived: f64) -> Self {
        let groups = groups(records, noise);
        let unit_s = records.longest as f64 * records.interval_s;
        let observed: usize = records.all.iter().map(super::records::Record::observed).sum();
        let mut fit = Fit { records, groups: &groups, unit_s, least_q, arrived, observed, distance: f64::INFINITY };
        let begin = fit.at(start.clone());
        let limits = Limits { trials: TRIALS, ..Limits::NONE };
        let found = match descend(&mut fit, begin, &mut { FIRST }, Damping::STANDARD, limits) {
            Ok(found) => found,
            Err(never) => match never {},
        };
        let converged = found.ending == Ending::Minimum || fit.distance < arrived;
        let verdict = RingdownVerdict { converged, distance: fit.distance, steps: found.steps };
        let (mut energy, mut log_variance) = (vec![0.0; records.channels], vec![0.0; records.channels]);
        for (record, solved) in records.all.iter().zip(&found.point.projection.solved) {
            energy[record.channel] += solved.energy;
        }
        for group in &groups {
            for (&member, log) in group.members.iter().zip(&group.log_variance) {
                log_variance[records.all[member].channel] += log;
            }
        }
        let At { poles, projection, .. } = found.point;
        Self { poles, projection, verdict, unit_s, energy, log_variance }
    }

    /// Minus twice the log-likelihood, each channel's noise scaled to its best (by [`LEAST_SCALE`] at least), constants
    /// left out.
    pub fn deviance(&self, records: &Records<'_>) -> f64 {
        (0..records.channels)
            .map(|c| {
                let count = records.observed(c) as f64;
                count * (self.energy[c] / count).max(LEAST_SCALE).ln() + self.log_variance[c]
            })
            .sum()
    }
}

/// The fit as an objective.
struct Fit<'a> {
    records: &'a Records<'a>,
    groups: &'a [Group],
    unit_s: f64,
    least_q: f64,
    arrived: f64,
    observed: usize,
    /// Length of the last step taken, in standard errors.
    distance: f64,
}

/// Poles with their amplitudes.
struct At {
    poles: Poles,
    projection: Projection,
    cost: f64,
}

impl Fit<'_> {
    fn at(&self, poles: Poles) -> At {
        let projection = Projection::of(self.records, self.groups, &poles, self.unit_s);
        let cost = projection.energy();
        At { poles, projection, cost }
    }
}

impl Objective for Fit<'_> {
    type Point = At;
    type Local = (Mat<f64>, Vec<f64>);
    type Step = f64;
    type Error = Infallible;

    fn cost(&self, at: &At) -> f64 {
        at.cost
    }

    fn local(&mut self, at: &mut At) -> Result<Option<Self::Local>, Infallible> {
        Ok(Some(at.projection.normal()))
    }

    fn trial(
        &mut self,
        at: &At,
        (information, gradient): &Self::Local,
        damping: f64,
    ) -> Result<Trial<At, f64>, Infallible> {
        let (step, _) = damped_step(information, gradient, damping);
        let from = at.poles.values(self.unit_s);
        let values: Vec<f64> = from.iter().zip(&step).map(|(v, s)| v + s).collect();
        // one at its bound must not hold the others
        let poles = Poles::from_values(&values, self.unit_s).bounded(self.least_q);
        if !poles.valid(self.records.interval_s, self.least_q) {
            return Ok(None);
        }
        let taken = poles.values(self.unit_s).into_iter().zip(&from).map(|(to, from)| to - from);
        let gain: f64 = taken.zip(gradient).map(|(s, g)| s * g).sum();
        // in units of the noise that is really there
        let excess = at.cost / self.observed as f64;
        Ok(Some((self.at(poles), (gain.max(0.0) / excess.max(f64::MIN_POSITIVE)).sqrt())))
    }

    /// The last steps change the cost by less than its rounding.
    fn accepts(&self, cost: f64, next: f64) -> bool {
        next.is_finite() && next <= cost * (1.0 + 1e-13)
    }

    fn taken(&mut self, _from: &At, _local: &Self::Local, distance: f64, _to: &mut At) -> Taken {
        self.distance = distance;
        Taken { kept: None, ending: (distance < self.arrived).then_some(Ending::Minimum) }
    }
}
