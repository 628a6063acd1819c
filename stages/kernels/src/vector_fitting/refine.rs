//! Damped least squares on the weighted error itself, and what follows from its last linearisation.

use crate::linear_algebra::{Qr, Svd};
use faer::{Mat, c64};

use super::linear::{Fitted, Points, with_sections};
use super::{VectorFit, VectorFitting};
use crate::model::ModelError;
use crate::optimise::{Damping, Ending, Limits, Objective, Taken, Trial, damped_svd_step, descend};

/// A fit with its weighted squared error.
pub(super) struct Refined {
    pub fitted: Fitted,
    pub cost: f64,
    pub steps: usize,
    pub gradient: f64,
    /// Whether the last step no longer changed the error by anything that counts.
    pub settled: bool,
}

/// Damping of the first step.
const FIRST: f64 = 1e-8;
/// Steps at most: ten are usual; more where the data hardly know a pole.
const STEPS: usize = 100;
/// Gradient share that counts as none: a hundredth of a standard error at 8192 points, as in `model.pem`.
const GRADIENT: f64 = 1e-4;
/// Gain of twice the log-likelihood that ends the iteration: no estimate moves by more than a hundredth of its error. A
/// pole that the data hardly know may go on creeping.
const SETTLED: f64 = 1e-4;
/// Singular values below this share of the largest span no direction that the data know.
const RANK: f64 = 1e-13;

/// Refines `fitted` if asked for; `steps` went before. Errors: an error that is not finite.
pub(super) fn refined(
    points: &Points,
    fitted: Fitted,
    steps: usize,
    settings: &VectorFitting,
) -> Result<Refined, ModelError> {
    let cost = squared(&residual(points, &fitted)?);
    if !cost.is_finite() {
        return Err(ModelError::Degenerate("the response of a starting model is not finite"));
    }
    let state = Refined { fitted, cost, steps, gradient: f64::NAN, settled: false };
    if !settings.refine {
        return Ok(state);
    }
    let limits = Limits { steps: STEPS, ..Limits::NONE };
    let found = descend(&mut Fit { points, settings }, state, &mut { FIRST }, Damping::STANDARD, limits)?;
    let stalled = found.ending == Ending::Stalled;
    let mut best = Refined { steps: steps + found.steps, ..found.point };
    // no damping helps any more: what gradient is left lies along poles that the data hardly determine, and is less
    // than one standard error in all
    best.settled |= stalled && best.gradient * (2.0 * points.len() as f64).sqrt() < 1.0;
    Ok(best)
}

/// The weighted error as an objective.
struct Fit<'a> {
    points: &'a Points,
    settings: &'a VectorFitting,
}

impl Objective for Fit<'_> {
    type Point = Refined;
    type Local = Linearised;
    type Step = ();
    type Error = ModelError;

    fn cost(&self, at: &Refined) -> f64 {
        at.cost
    }

    fn local(&mut self, at: &mut Refined) -> Result<Option<Linearised>, ModelError> {
        let linear = Linearised::new(self.points, &at.fitted)?;
        at.gradient = linear.gradient();
        Ok((at.gradient >= GRADIENT).then_some(linear))
    }

    fn trial(&mut self, at: &Refined, linear: &Linearised, damping: f64) -> Result<Trial<Refined, ()>, ModelError> {
        let trial = trial(self.points, &at.fitted, &linear.step(damping), self.settings);
        let refined = |(fitted, cost)| Refined { fitted, cost, steps: 0, gradient: at.gradient, settled: false };
        Ok(trial.map(|found| (refined(found), ())))
    }

    fn taken(&mut self, from: &Refined, _: &Linearised, (): (), to: &mut Refined) -> Taken {
        // twice the log-likelihood, the noise's level taken from the fit itself
        let gain = 2.0 * self.points.len() as f64 * (from.cost / to.cost).ln();
        to.settled = gain < SETTLED;
        Taken { kept: None, ending: to.settled.then_some(Ending::Minimum) }
    }
}

/// The model whose sections are a step further, and its squared error; none if a pole that must be stable is not.
fn trial(points: &Points, from: &Fitted, step: &[f64], settings: &VectorFitting) -> Option<(Fitted, f64)> {
    let a: Vec<f64> = from.theta().iter().zip(step).map(|(x, d)| x + d).collect();
    let fitted = with_sections(points, &a).ok()?;
    if settings.stable && unstable(&fitted) > 0 {
        return None;
    }
    let cost = squared(&residual(points, &fitted).ok()?);
    cost.is_finite().then_some((fitted, cost))
}

fn unstable(fitted: &Fitted) -> usize {
    fitted.model.sections.iter().flat_map(|section| section.poles()).filter(|z| z.norm() >= 1.0).count()
}

fn squared(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum()
}

/// Model plus transient at each point.
fn modelled(points: &Points, fitted: &Fitted) -> Result<Vec<c64>, ModelError> {
    let transient = fitted.transient_model()?;
    let at = |k: usize| {
        let main = fitted.model.transfer(points.z[k]);
        match (&transient, &points.turn) {
            (Some(model), Some(turn)) => main + model.transfer(points.z[k]) * turn[k],
            _ => main,
        }
    };
    Ok((0..points.len()).map(at).collect())
}

/// Weighted `G - model`: real parts, then imaginary ones.
fn residual(points: &Points, fitted: &Fitted) -> Result<Vec<f64>, ModelError> {
    let errors: Vec<c64> = modelled(points, fitted)?.iter().zip(&points.g).map(|(m, g)| g - m).collect();
    let part = |value: fn(&c64) -> f64| errors.iter().zip(&points.weight).map(move |(e, w)| w * value(e));
    Ok(part(|e| e.re).chain(part(|e| e.im)).collect())
}

/// The problem about a model, its columns scaled to one: what enters linearly first, section coefficients last.
struct Linearised {
    r: Mat<f64>,
    scale: Vec<f64>,
    /// Of the section coefficients alone, everything linear eliminated (variable projection): their triangle.
    projected: Svd,
    /// The residual along each of its left vectors.
    along: Vec<f64>,
    norm: f64,
}

impl Linearised {
    fn new(points: &Points, fitted: &Fitted) -> Result<Self, ModelError> {
        let order = fitted.model.order();
        let columns = points.coefficients(order);
        let transient = fitted.transient_model()?;
        let mut stacked = points.rows(columns + 1, 0, |k| {
            let mut row = fitted.model.transfer_sensitivities(points.z[k]);
            if let (Some(model), Some(turn)) = (&transient, &points.turn) {
                let mut further = model.transfer_sensitivities(points.z[k]);
                further.iter_mut().for_each(|value| *value *= turn[k]);
                row.iter_mut().zip(&further[..order]).for_each(|(a, more)| *a += more);
                row.extend_from_slice(&further[order..]);
            }
            row.rotate_left(order);
            row
        });
        let e = residual(points, fitted)?;
        stacked.col_mut(columns).iter_mut().zip(&e).for_each(|(x, e)| *x = *e);
        let scale: Vec<f64> = (0..columns).map(|j| stacked.col(j).norm_l2().max(f64::MIN_POSITIVE)).collect();
        (0..columns).for_each(|j| stacked.col_mut(j).iter_mut().for_each(|value| *value /= scale[j]));
        let r = Qr::new(stacked).r();
        let first = columns - order;
        let projected = Svd::new(&r.as_ref().get(first..columns, first..columns).to_owned())?;
        let along = |k: usize| (0..order).map(|i| projected.u[(i, k)] * r[(first + i, columns)]).sum();
        let along = (0..order).map(along).collect();
        Ok(Self { r, scale, projected, along, norm: squared(&e).sqrt() })
    }

    /// Share of the residual along the section coefficients; zero where nothing is left.
    fn gradient(&self) -> f64 {
        let known = &self.along[..self.projected.rank(RANK)];
        if self.norm > 0.0 { squared(known).sqrt() / self.norm } else { 0.0 }
    }

    /// Damped step of the section coefficients. The columns are scaled, and a cancelled pole's are still weak: damping
    /// counts from the strongest direction on.
    fn step(&self, damping: f64) -> Vec<f64> {
        let first = self.scale.len() - self.along.len();
        let step = damped_svd_step(&self.projected, &self.along, damping, 0.0);
        step.iter().zip(&self.scale[first..]).map(|(own, scale)| own / scale).collect()
    }

    /// `(J^T J)^+` of all a, all b and D. Errors: no convergence.
    fn covariance(&self) -> Result<Mat<f64>, ModelError> {
        let (columns, order) = (self.scale.len(), self.along.len());
        let svd = Svd::new(&self.r.as_ref().get(..columns, ..columns).to_owned())?;
        let rank = svd.rank(RANK);
        // the a were rotated to the end
        let place = |i: usize| if i < order { columns - order + i } else { i - order };
        let inverse = svd.normal_inverse(rank);
        let entry = |i: usize, j: usize| inverse[(i, j)] / (self.scale[i] * self.scale[j]);
        Ok(Mat::from_fn(2 * order + 1, 2 * order + 1, |i, j| entry(place(i), place(j))))
    }
}

/// The fit with its covariance and verdict. Errors: no decomposition.
pub(super) fn concluded(points: &Points, best: &Refined, settings: &VectorFitting) -> Result<VectorFit, ModelError> {
    let linear = Linearised::new(points, &best.fitted)?;
    let count = 2 * settings.order + 1;
    let freedom = 2 * points.len() - points.coefficients(settings.order);
    let misfit = best.cost / freedom.max(1) as f64;
    let factor = correlation_factor(&residual(points, &best.fitted)?, settings.correlated_bins);
    let mut covariance = linear.covariance()?;
    (0..count).for_each(|j| covariance.col_mut(j).iter_mut().for_each(|value| *value *= misfit * factor));
    let power = points.g.iter().zip(&points.weight).map(|(g, w)| w * w * g.norm_sqr()).sum::<f64>();
    let gradient = linear.gradient();
    Ok(VectorFit {
        model: best.fitted.model.clone(),
        transient: best.fitted.transient.clone(),
        covariance,
        misfit,
        fit_percent: fit_percent(points, best.cost),
        points: points.len(),
        iterations: best.steps,
        // nine decades below the response: what is left is rounding
        converged: best.settled || gradient < 1e-3 || best.cost < 1e-18 * power,
        gradient,
        unstable: unstable(&best.fitted),
        correlation_factor: factor,
    })
}

/// `100 (1 - |w (G - model)| / |w (G - mean)|)`.
fn fit_percent(points: &Points, cost: f64) -> f64 {
    let squares: f64 = points.weight.iter().map(|w| w * w).sum();
    let mean: c64 = points.g.iter().zip(&points.weight).map(|(g, w)| g * (w * w)).sum::<c64>() / squares;
    let about = points.g.iter().zip(&points.weight).map(|(g, w)| w * w * (g - mean).norm_sqr()).sum::<f64>();
    100.0 * (1.0 - (cost / about).sqrt())
}

/// `1 + 2 sum (1 - l / (L + 1)) rho_l` over the lags up to L: how much less neighbours that share data tell; at least
/// one.
fn correlation_factor(residual: &[f64], lags: usize) -> f64 {
    let half = residual.len() / 2;
    let lags = lags.min(half / 4);
    let at = |lag: usize| -> f64 {
        residual.chunks_exact(half.max(1)).map(|e| e.iter().zip(&e[lag..]).map(|(x, y)| x * y).sum::<f64>()).sum()
    };
    let power = at(0);
    if power <= 0.0 {
        return 1.0;
    }
    let taper = |lag: usize| 1.0 - lag as f64 / (lags + 1) as f64;
    (1.0 + 2.0 * (1..=lags).map(|lag| taper(lag) * at(lag) / power).sum::<f64>()).max(1.0)
}
