//! Tip force against time from one record and an identified model.

mod filter;
mod rise;
mod smoother;
mod strength;
mod system;
#[cfg(test)]
mod tests;
mod triangle;

use crate::force::error::ForceError;
use filter::{Strengths, filter};
pub use rise::{Rise, rise};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use smoother::smooth;
use strength::{log_likelihood, strongest};
use system::Augmented;

/// An identified model in innovations form, one input, one output.
///
/// Model: `x+ = A x + B u + K e`, `y = C x + D u + e`. A is row-major, n x n; B, C, K have n values.
#[derive(Debug, Clone, Copy)]
pub struct IdentifiedModel<'a> {
    /// State matrix, row-major.
    pub a: &'a [f64],
    /// Input gains.
    pub b: &'a [f64],
    /// Output weights.
    pub c: &'a [f64],
    /// Feedthrough.
    pub d: f64,
    /// Kalman gain.
    pub k: &'a [f64],
}

/// How the force may move from sample to sample.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ForcePrior {
    /// Independent steps.
    RandomWalk,
    /// Independent changes of slope.
    IntegratedWalk,
}

/// How a force is reconstructed.
#[derive(Debug, Clone, PartialEq)]
pub struct ReconstructionSettings {
    /// How it may move.
    pub prior: ForcePrior,
    /// Samples after which it may jump, besides: the event.
    pub transition: std::ops::Range<usize>,
    /// Variance of e; `None`: the likelihood's own.
    pub noise_variance: Option<f64>,
}

/// A force against time.
#[derive(Debug, Clone, PartialEq)]
pub struct Reconstruction {
    /// Force per sample, held until the next, in the unit of u.
    pub force: Vec<f64>,
    /// Its standard deviation: measurement noise and prior.
    pub std: Vec<f64>,
    /// One-step innovations over their standard deviation: white and of size one if model and prior hold.
    pub innovations: Vec<f64>,
    /// Standard deviation of the walk's step per sample (of its change of slope if integrated), up to the transition
    /// and after it.
    pub walk_std: [f64; 2],
    /// Standard deviation of a jump per sample of the transition; 0 without one.
    pub jump_std: f64,
    /// Variance of e.
    pub noise_variance: f64,
    /// Log-likelihood.
    pub log_likelihood: f64,
    /// Passes of the filter that the search took.
    pub evaluations: usize,
    /// A walk is too weak to be distinguished from none.
    pub walk_at_limit: bool,
}

/// Reconstructs the input of an identified model from its output.
///
/// # Model
/// The model, with its input as one more state: a random walk (or an integrated one), of one strength up to the event
/// and another after it (a tip in contact feels more than a free one), and jumps of their own size in the samples of
/// the transition. The innovation form is solved for e, `x+ = (A - K C) x + (B - K D) u + K y`, so that what drives the
/// states is known and only the force is uncertain.
///
/// # Method
/// Square-root Kalman filter and square-root Rauch-Tung-Striebel smoother. Sizes of walks and jumps, and of the noise
/// unless given, by maximum likelihood (the noise eliminated in closed form, the others searched in logarithms).
///
/// # Shapes
/// `y` `[N]`; results `[N]`.
///
/// # Units
/// y in the model's output unit above the line without force, the force in its input's.
///
/// # Accuracy
/// The band is that of measurement noise and prior: where these hold, 68 and 95 % of the values lie within one and two
/// of them (tested over seeds). It leaves out: readout noise slower than the model's ([`band_inflation`] counts it),
/// errors of the model, of its t0 (a shift in time), of the line without force, and of the strengths themselves; the
/// force's shape within a sample. Cost: some `n^3` operations per sample and pass.
///
/// # Errors
/// Shapes that do not fit, values that are not finite, fewer than eight samples per state, a response that is constant.
///
/// # Source
/// R. E. Kalman, J. Basic Eng. 82 (1960) 35; H. Rauch, F. Tung, C. Striebel, AIAA J. 3 (1965) 1445; P. Park, T.
/// Kailath, IEEE Trans. Autom. Control 40 (1995) 727; A. C. Harvey, Forecasting, Structural Time Series Models and the
/// Kalman Filter (1989), ch. 3 and 4.
pub fn reconstruct(
    model: IdentifiedModel<'_>,
    y: &[f64],
    settings: &ReconstructionSettings,
) -> Result<Reconstruction, ForceError> {
    check(&model, y, settings)?;
    let system = Augmented::new(&model, settings.prior);
    let strengths = guess(y, settings, system.size);
    let found = strongest(&system, y, strengths, settings.noise_variance);
    let filtered = filter(&system, y, &found.strengths, true);
    let (force, std) = smooth(&system, y, &found.strengths, &filtered);
    let noise_std = found.noise_variance.sqrt();
    let (log_likelihood, _) = log_likelihood(&filtered, Some(found.noise_variance));
    let scaled = |values: Vec<f64>| values.into_iter().map(|v| v * noise_std).collect::<Vec<f64>>();
    Ok(Reconstruction {
        force,
        std: scaled(std),
        innovations: filtered.innovations.iter().map(|v| v / noise_std).collect(),
        walk_std: found.strengths.walk.map(|walk| walk * noise_std),
        jump_std: if settings.transition.is_empty() { 0.0 } else { found.strengths.jump * noise_std },
        noise_variance: found.noise_variance,
        log_likelihood,
        evaluations: found.evaluations,
        walk_at_limit: found.walk_at_limit,
    })
}

/// By how much a band is too narrow where no force acts: rms of force over band in the free stretch, never below one.
///
/// Readout noise that is slower than the model's (1/f, mains) looks like a force and is followed as one; where the
/// force is known to be zero, what is found there is error. `None` for a stretch outside or without samples.
pub fn band_inflation(force: &[f64], band: &[f64], free: std::ops::Range<usize>) -> Option<f64> {
    let (force, band) = (force.get(free.clone())?, band.get(free)?);
    let mean = force.iter().zip(band).map(|(f, b)| (f / b).powi(2)).sum::<f64>() / force.len() as f64;
    mean.is_finite().then(|| mean.sqrt().max(1.0))
}

/// Start of the search: noise from the differences of the second half, a walk of a hundredth of it, jumps as large as
/// the response.
fn guess(y: &[f64], settings: &ReconstructionSettings, size: usize) -> Strengths {
    let largest = y.iter().fold(0.0_f64, |a, y| a.max(y.abs()));
    let rough = settings.noise_variance.map_or_else(
        || {
            let mut steps: Vec<f64> = y.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).abs()).collect();
            steps.sort_by(f64::total_cmp);
            // median of the second difference of white noise: 0.6745 sqrt(6) sigma
            steps[steps.len() / 2] / 1.652
        },
        f64::sqrt,
    );
    let noise = rough.max(1e-9 * largest).max(f64::MIN_POSITIVE);
    let lasting = settings.transition.len().max(1) as f64;
    let integrated = settings.prior == ForcePrior::IntegratedWalk;
    Strengths {
        walk: [if integrated { 1e-4 } else { 1e-2 }; 2],
        jump: (largest / noise / lasting.sqrt()).max(1e-2),
        transition: settings.transition.clone(),
        // loose against anything that the response can hold: a state of these models is some ten times the response at
        // most
        start: 1e2 * (largest / noise).max(1.0) * (size as f64).sqrt(),
    }
}

fn check(model: &IdentifiedModel<'_>, y: &[f64], settings: &ReconstructionSettings) -> Result<(), ForceError> {
    let n = model.b.len();
    for (name, found, wanted) in [("A", model.a.len(), n * n), ("C", model.c.len(), n), ("K", model.k.len(), n)] {
        if found != wanted || n == 0 {
            return Err(ForceError::Model { name, found, wanted });
        }
    }
    let finite = |values: &[f64]| values.iter().all(|v| v.is_finite());
    if ![model.a, model.b, model.c, model.k].into_iter().all(finite) || !model.d.is_finite() {
        return Err(ForceError::Reconstruction("the model holds values that are not finite"));
    }
    let wanted = 8 * (n + 2);
    if y.len() < wanted {
        return Err(ForceError::TooShort { samples: y.len(), stretch: "in the window of", wanted });
    }
    if let Some(at) = y.iter().position(|y| !y.is_finite()) {
        return Err(ForceError::NotFinite(at));
    }
    if y.iter().all(|v| *v == y[0]) {
        return Err(ForceError::Reconstruction("the response is constant"));
    }
    if settings.transition.end > y.len() || settings.noise_variance.is_some_and(|v| !(v.is_finite() && v > 0.0)) {
        return Err(ForceError::Reconstruction(
            "wanted a transition within the window and a noise variance above zero",
        ));
    }
    Ok(())
}
