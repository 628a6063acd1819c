//! The search, and what it yields.

use std::convert::Infallible;

use crate::linear_algebra::{Qr, product};
use faer::{Mat, c64};

use super::projection::{Projected, Record, back_substitute};
use super::start::hankel_poles;
use crate::model::{ModelError, finite};
use crate::optimise::{Damping, Ending, Limits, Objective, Trial, damped_step, descend};
use crate::ringdown::estimate::{ModeEstimate, RingdownVerdict, modes_of};
use crate::ringdown::modal_form::Exponential;

/// What is fitted.
#[derive(Debug, Clone, PartialEq)]
pub struct DecayOptions {
    /// Oscillating modes, at least 1; default 4, the paper's.
    pub modes: usize,
    /// Real poles of the detector, default 3, the paper's.
    pub real_poles: usize,
    /// Rows of the start's Hankel matrix, default 64: half a period of the slowest mode or more.
    pub rows: usize,
    /// Slowest real pole allowed, per sample; default 0.45: gone after 64 samples. Slower ones make the head longer and
    /// the fit slower.
    pub slowest_decay: f64,
}

impl Default for DecayOptions {
    fn default() -> Self {
        Self { modes: 4, real_poles: 3, rows: 64, slowest_decay: 0.45 }
    }
}

/// A fitted decay.
#[derive(Debug, Clone)]
pub struct Decay {
    /// Modes ascending in frequency, then real poles.
    pub exponentials: Vec<Exponential>,
    /// Level that it decays to, V.
    pub offset: f64,
    /// Covariance of poles and residues: per mode Re and Im of pole (rad/s) and residue (V), per real pole both.
    pub covariance: Mat<f64>,
    /// Variance of the residuals, V^2.
    pub variance: f64,
    /// How the search ended.
    pub verdict: RingdownVerdict,
}

impl Decay {
    /// The modes with their standard errors.
    pub fn modes(&self) -> Vec<ModeEstimate> {
        modes_of(&self.exponentials, &self.covariance)
    }
}

/// Exponent below which nothing is left of a real pole: `exp(-28)` is `1e-12`.
const GONE: f64 = 28.0;
/// Relative standard deviation of what is known beforehand of a real pole's decay: they hardly show beyond the first
/// samples.
const POLE_STD: f64 = 0.5;
/// Most trial steps.
const TRIALS: usize = 40;
/// Damping of the first step: the start is near.
const FIRST_DAMPING: f64 = 1e-9;
/// Promised fall of the sum of squares, in noise variances, that ends the search: a step of a thirtieth of a standard
/// error.
const ARRIVED: f64 = 1e-3;

/// Step of every mode's pole, in its standard errors, that ends the search too, if what all parameters together still
/// promise is less than
/// [`VALLEY`]: real poles that nearly coincide make a long flat valley, along which nothing else changes.
const MODES_ARRIVED: f64 = 1e-2;
/// Half a standard error, squared.
const VALLEY: f64 = 0.25;

/// Fits decaying exponentials and an offset to one record in white noise.
///
/// # Model
/// `y(k) = sum_j Re(rho_j exp(s_j k T)) + c + n(k)`, n white; real poles faster than [`DecayOptions::slowest_decay`].
/// # Method
/// Start by shift invariance of the Hankel matrix. Then Levenberg-Marquardt on the poles alone, amplitudes solved for
/// (variable projection, Kaufman's Jacobian), on a triangle of a few dozen rows that has the same norms and gradients
/// as all samples: sums of exponentials by doubling, one product of the record with short exponentials per step.
/// # Shapes
/// `values`: N samples from the first one after the release on; at least `3 rows` of them.
/// # Units
/// Volts, seconds, rad/s.
/// # Accuracy
/// The Cramer-Rao bound of free amplitudes, unbiased, in white noise; under coloured noise its errors are too small:
/// see
/// [`super::super::fit_ringdowns`]. The triangle squares the condition: residuals below `1e-7` of the signal, and modes closer than a thousandth of
/// their width, are lost in rounding. `N modes` operations per step (docs/results/timings.md).
/// # Errors
/// Too few samples, values that are not finite, a constant record, fewer oscillations than `modes`.
/// # Source
/// G. H. Golub and V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; L. Kaufman, BIT 15 (1975) 49.
pub fn fit_decay(values: &[f64], interval_s: f64, options: &DecayOptions) -> Result<Decay, ModelError> {
    let head = check(values, interval_s, options)?;
    let record = Record::new(values, head);
    let noise = white_variance(values);
    let start = first_poles(values, head, options, &record)?;
    let mut fit = Fit { record: &record, prior: start.clone(), noise, distance: f64::INFINITY };
    let start = fit.at(start);
    let limits = Limits { trials: TRIALS, ..Limits::NONE };
    let found = match descend(&mut fit, start, &mut { FIRST_DAMPING }, Damping::STANDARD, limits) {
        Ok(found) => found,
        Err(never) => match never {},
    };
    let verdict =
        RingdownVerdict { converged: found.ending == Ending::Minimum, distance: fit.distance, steps: found.steps };
    let At { poles, state, .. } = found.point;
    result(&state, &poles, &fit.prior, values.len(), interval_s, verdict)
}

/// The decay as an objective.
struct Fit<'a> {
    record: &'a Record<'a>,
    /// What is expected of the real poles.
    prior: Poles,
    noise: f64,
    /// Largest step of a mode's parameter that the local model wants, in its standard errors.
    distance: f64,
}

/// Poles, with the amplitudes solved for.
struct At {
    poles: Poles,
    state: Projected,
    cost: f64,
}

impl Fit<'_> {
    fn at(&self, poles: Poles) -> At {
        let state = self.record.project(&poles.modes, &poles.decays);
        let cost = state.rest() / self.noise + poles.distance(&self.prior);
        At { poles, state, cost }
    }
}

impl Objective for Fit<'_> {
    type Point = At;
    type Local = Normal;
    type Step = ();
    type Error = Infallible;

    fn cost(&self, at: &At) -> f64 {
        at.cost
    }

    fn local(&mut self, at: &mut At) -> Result<Option<Normal>, Infallible> {
        let normal = Normal::of(&at.state, &at.poles, &self.prior, self.noise);
        let (step, inverse) = damped_step(&normal.information, &normal.gradient, 0.0);
        let errors =
            (0..2 * at.poles.modes.len()).map(|i| step[i].abs() / inverse[(i, i)].sqrt().max(f64::MIN_POSITIVE));
        self.distance = errors.fold(0.0, f64::max);
        let promised: f64 = step.iter().zip(&normal.gradient).map(|(s, g)| s * g).sum();
        let arrived = promised < ARRIVED || (self.distance < MODES_ARRIVED && promised < VALLEY);
        Ok((!arrived).then_some(normal))
    }

    fn trial(&mut self, at: &At, normal: &Normal, damping: f64) -> Result<Trial<At, ()>, Infallible> {
        let (step, _) = damped_step(&normal.information, &normal.gradient, damping);
        let poles = at.poles.moved(&step);
        Ok(poles.stable().then(|| (self.at(poles), ())))
    }

    fn accepts(&self, cost: f64, next: f64) -> bool {
        next <= cost
    }
}

fn check(values: &[f64], interval_s: f64, options: &DecayOptions) -> Result<usize, ModelError> {
    let outside = |name, found, wanted| Err(ModelError::Parameter { name, found, wanted });
    if options.modes == 0 {
        return outside("modes", 0.0, "at least 1");
    }
    if options.rows < 2 * options.modes + 2 {
        return outside("rows", options.rows as f64, "at least two more than twice the modes");
    }
    if !(options.slowest_decay > 0.0 && options.slowest_decay.is_finite()) {
        return outside("slowest_decay", options.slowest_decay, "above 0");
    }
    if !(interval_s > 0.0 && interval_s.is_finite()) {
        return outside("interval_s", interval_s, "above 0");
    }
    finite("record", values)?;
    let head = if options.real_poles == 0 { 1.0 } else { (GONE / options.slowest_decay).ceil().max(1.0) };
    let wanted = 2.0 * head + 3.0 * options.rows as f64 + 4.0 * (2 * options.modes + options.real_poles) as f64;
    if (values.len() as f64) < wanted {
        return Err(ModelError::TooShort { found: values.len(), wanted: wanted as usize });
    }
    if values.iter().all(|value| *value == values[0]) {
        return Err(ModelError::ConstantOutput);
    }
    Ok(head as usize)
}

/// Variance of what is white at the highest frequencies: second differences of the quieter half.
fn white_variance(values: &[f64]) -> f64 {
    let half = &values[values.len() / 2..];
    let sum: f64 = half.windows(3).map(|w| (w[0] - 2.0 * w[1] + w[2]).powi(2)).sum();
    (sum / (6.0 * (half.len() - 2) as f64)).max(f64::MIN_POSITIVE)
}

/// The poles that the search moves: modes per sample in the upper half plane, decays of real poles per sample.
#[derive(Debug, Clone)]
struct Poles {
    modes: Vec<c64>,
    decays: Vec<f64>,
    slowest: f64,
}

impl Poles {
    /// Steps: relative change of a mode's decay, change of its frequency, relative change of what a real pole has above
    /// the slowest.
    fn moved(&self, step: &[f64]) -> Self {
        let modes = self.modes.iter().zip(step.chunks(2)).map(|(s, d)| c64::new(s.re * d[0].exp(), s.im + d[1]));
        let above = |(d, x): (&f64, &f64)| self.slowest + (d - self.slowest) * x.clamp(-3.0, 3.0).exp();
        let decays = self.decays.iter().zip(&step[2 * self.modes.len()..]).map(above).collect();
        Self { modes: modes.collect(), decays, slowest: self.slowest }
    }

    fn stable(&self) -> bool {
        let inside = |s: &c64| s.is_finite() && s.re < 0.0 && s.im > 0.0 && s.im < std::f64::consts::PI;
        self.modes.iter().all(inside) && self.decays.iter().all(|d| d.is_finite())
    }

    /// Squared distance of the real poles from what is expected of them, in its standard deviations.
    fn distance(&self, prior: &Self) -> f64 {
        self.decays.iter().zip(&prior.decays).map(|(d, p)| ((d - p) / (POLE_STD * p)).powi(2)).sum()
    }
}

/// Modes from the Hankel matrix behind the real poles; real poles from a fifth per sample down, each half of the one
/// before.
fn first_poles(values: &[f64], head: usize, options: &DecayOptions, record: &Record) -> Result<Poles, ModelError> {
    let skipped = &values[head.min(values.len() / 8)..];
    let slowest = options.slowest_decay;
    let decays =
        (0..options.real_poles).map(|i| (1.6 + std::f64::consts::LN_2 * i as f64).max(1.5 * slowest)).collect();
    // room for what is no mode: wander, mains hum
    for spare in [0, 2, 4] {
        let order = (2 * options.modes + spare).min(options.rows - 2);
        let poles = hankel_poles(skipped, options.rows, order)?;
        let upper = poles.iter().filter(|z| z.im > 0.0).map(|z| z.ln());
        let mut modes: Vec<c64> =
            upper.map(|s| c64::new(s.re.min(-1e-6), s.im)).filter(|s| s.im > -2.0 * s.re).collect();
        if modes.len() < options.modes {
            continue;
        }
        if modes.len() > options.modes {
            let weights = record.project(&modes, &[]).weights();
            let energy = |m: usize| weights[2 * m].hypot(weights[2 * m + 1]).powi(2) / -modes[m].re;
            let mut strongest: Vec<usize> = (0..modes.len()).collect();
            strongest.sort_by(|&a, &b| energy(b).total_cmp(&energy(a)));
            modes = strongest[..options.modes].iter().map(|&m| modes[m]).collect();
        }
        modes.sort_by(|a, b| a.im.total_cmp(&b.im));
        return Ok(Poles { modes, decays, slowest });
    }
    Err(ModelError::Parameter {
        name: "modes",
        found: options.modes as f64,
        wanted: "at most the oscillations that the Hankel matrix shows",
    })
}

/// Normal equations of the poles' steps.
struct Normal {
    information: Mat<f64>,
    gradient: Vec<f64>,
}

impl Normal {
    fn of(state: &Projected, poles: &Poles, prior: &Poles, noise: f64) -> Self {
        let modes = poles.modes.len();
        let mut changes = state.changes(&state.weights(), modes);
        let basis = changes.ncols() + 1;
        for i in 0..changes.nrows() {
            for (m, s) in poles.modes.iter().enumerate() {
                changes[(i, 2 * m)] *= s.re;
            }
            for (p, d) in poles.decays.iter().enumerate() {
                changes[(i, 2 * modes + p)] *= d - poles.slowest;
            }
        }
        let below = changes.as_ref().get(basis.., ..);
        let residual = state.residual();
        let right = Mat::from_fn(residual.len(), 1, |i, _| residual[i]);
        let mut information = product(below.transpose(), below);
        let product = product(below.transpose(), right.as_ref());
        (0..information.ncols()).for_each(|j| information.col_mut(j).iter_mut().for_each(|v| *v /= noise));
        let mut gradient: Vec<f64> = (0..product.nrows()).map(|i| product[(i, 0)] / noise).collect();
        for (p, (d, known)) in poles.decays.iter().zip(&prior.decays).enumerate() {
            let slope = (d - poles.slowest) / (POLE_STD * known);
            information[(2 * modes + p, 2 * modes + p)] += slope * slope;
            gradient[2 * modes + p] -= slope * (d - known) / (POLE_STD * known);
        }
        Self { information, gradient }
    }
}

/// Poles per second, residues, and the covariance of both under the residuals' variance.
fn result(
    state: &Projected,
    poles: &Poles,
    prior: &Poles,
    samples: usize,
    interval_s: f64,
    verdict: RingdownVerdict,
) -> Result<Decay, ModelError> {
    let (modes, weights) = (poles.modes.len(), state.weights());
    let changes = state.changes(&weights, modes);
    let (count, basis) = (changes.ncols(), changes.ncols() + 1);
    let variance = state.rest() / (samples - 2 * basis + 1) as f64;
    // poles first: those below the basis; priors as rows of their own
    let known = poles.decays.len();
    let rows = changes.nrows() - basis;
    let stacked = Mat::from_fn(rows + known, count, |i, j| match i.checked_sub(rows) {
        None => changes[(basis + i, j)],
        Some(p) if j == 2 * modes + p => variance.sqrt() / (POLE_STD * prior.decays[p]),
        Some(_) => 0.0,
    });
    let inner = Qr::new(stacked).r();
    // parameters move with unit noise e: poles = inner^-1 e1, weights = basis^-1 (e2 - changes poles)
    let mut roots = Mat::<f64>::zeros(count + basis, count + basis);
    for j in 0..count {
        let mut poles: Vec<f64> = (0..count).map(|i| if i == j { 1.0 } else { 0.0 }).collect();
        back_substitute(inner.as_ref(), &mut poles);
        let mut own: Vec<f64> =
            (0..basis).map(|i| -(0..count).map(|k| changes[(i, k)] * poles[k]).sum::<f64>()).collect();
        back_substitute(state.basis_triangle(), &mut own);
        poles.iter().chain(&own).enumerate().for_each(|(i, v)| roots[(i, j)] = *v);
    }
    for j in 0..basis {
        let mut own: Vec<f64> = (0..basis).map(|i| if i == j { 1.0 } else { 0.0 }).collect();
        back_substitute(state.basis_triangle(), &mut own);
        own.iter().enumerate().for_each(|(i, v)| roots[(count + i, count + j)] = *v);
    }
    // order and units of the result: s in rad/s; Re(rho z^k) = re Re z^k - im Im z^k
    let mut order: Vec<(usize, f64)> = Vec::new();
    for m in 0..modes {
        let rate = interval_s.recip();
        order.extend([(2 * m, rate), (2 * m + 1, rate), (count + 2 * m, 1.0), (count + 2 * m + 1, -1.0)]);
    }
    for p in 2 * modes..count {
        order.extend([(p, -interval_s.recip()), (count + p, 1.0)]);
    }
    let scaled = Mat::from_fn(order.len(), roots.ncols(), |i, j| order[i].1 * variance.sqrt() * roots[(order[i].0, j)]);
    let covariance = product(scaled.as_ref(), scaled.transpose());
    if (0..covariance.nrows()).any(|i| !covariance[(i, i)].is_finite()) {
        return Err(ModelError::Degenerate("no finite covariance"));
    }
    let mode = |(m, s): (usize, &c64)| Exponential {
        pole: s / interval_s,
        residue: c64::new(weights[2 * m], -weights[2 * m + 1]),
    };
    let real = |(p, d): (usize, &f64)| Exponential {
        pole: c64::new(-d / interval_s, 0.0),
        residue: c64::new(weights[2 * modes + p], 0.0),
    };
    let exponentials =
        poles.modes.iter().enumerate().map(mode).chain(poles.decays.iter().enumerate().map(real)).collect();
    Ok(Decay { exponentials, offset: weights[basis - 1], covariance, variance, verdict })
}
