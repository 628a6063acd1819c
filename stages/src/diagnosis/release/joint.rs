//! The joint fit of lever and causes to all events.

use faer::{Mat, c64};
use rayon::prelude::*;

use super::lever::{Lever, LeverMode};
use super::stepper::{Release, differences};
use super::window::{Cut, EventWindow};
use crate::causes::{Cause, Effects};
use crate::model::ModelError;
use crate::model::orthogonal::{Qr, product};
use crate::model::ringdown::internals::{Whitener, columns, shared, symmetric_inverse, weights, whiten};
use crate::model::ringdown::{EventParameters, Exponential, RingdownNoise};

/// A cause with its present values.
#[derive(Clone)]
pub struct Hypothesis {
    /// The cause.
    pub cause: &'static dyn Cause,
    /// Its parameters.
    pub values: Vec<f64>,
}

/// What a fit holds as it is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Hold {
    /// Nothing: lever, causes and events are fitted.
    Nothing,
    /// Lever and causes: the events' own parameters are fitted, as on held-out events.
    Shared,
}

/// Everything that is fitted.
#[derive(Clone)]
pub struct State {
    /// Lever and detector.
    pub lever: Lever,
    /// What has been added to them.
    pub hypotheses: Vec<Hypothesis>,
    /// Per event amplitude (V, positive for a load that pulled down), onset (s after its window's release sample: 0 or less), offset, slope.
    pub events: Vec<EventParameters>,
}

impl State {
    /// Effects of all hypotheses together.
    pub fn effects(&self) -> Effects {
        let mut effects = Effects::default();
        self.hypotheses.iter().for_each(|h| h.cause.add(&h.values, &mut effects));
        effects
    }

    fn causes(&self) -> usize {
        self.hypotheses.iter().map(|h| h.values.len()).sum()
    }
}

/// The data and what is known beforehand.
pub struct Problem<'a> {
    /// The events.
    pub windows: &'a [EventWindow],
    /// How their windows are cut.
    pub cut: Cut,
    /// Noise that they are weighted with.
    pub noise: RingdownNoise,
    /// Nominal detector poles, rad/s.
    pub nominal_poles: Vec<f64>,
    /// Standard deviation of their logarithms.
    pub pole_std: f64,
    /// What free exponentials say of the modes; weakly held, so that no weak mode runs off to absorb a misfit of another kind.
    pub seen: Vec<SeenMode>,
}

/// A mode as free exponentials show it, and how weakly the fit is held to it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SeenMode {
    /// The mode.
    pub mode: LeverMode,
    /// Standard deviations of ln w and ln Q.
    pub std: [f64; 2],
}

/// The data turned to the space of one linearisation.
pub(super) struct Turned {
    pub reference: Vec<Exponential>,
    pub r: Mat<f64>,
    qr: Qr,
    whitener: Whitener,
    /// Per event, whitened and rotated: the basis' coordinates first.
    pub events: Vec<Vec<f64>>,
}

/// Derivatives at one point, of one event, in rotated coordinates.
pub(super) struct Linearised {
    /// Residual.
    pub residual: Vec<f64>,
    /// Within the basis: per shared parameter of the lever, then the event's own four.
    pub lever: Mat<f64>,
    pub own: Mat<f64>,
    /// What the causes' change adds to both, all coordinates; empty where there is none.
    pub crossed: Vec<Vec<f64>>,
    /// Factor of that.
    pub scale: f64,
    /// All coordinates: per parameter of the causes.
    pub causes: Vec<Vec<f64>>,
}

/// Relative step of a cause's parameter in a difference quotient, of its value or of a trial's.
const STEP: f64 = 1e-3;

impl<'a> Problem<'a> {
    /// The same knowledge about other events.
    pub fn with_windows<'b>(&self, windows: &'b [EventWindow]) -> Problem<'b> {
        Problem {
            windows,
            cut: self.cut,
            noise: self.noise.clone(),
            nominal_poles: self.nominal_poles.clone(),
            pole_std: self.pole_std,
            seen: self.seen.clone(),
        }
    }

    /// Starts of the windows for the events' present onsets. Errors: an event that leaves its samples.
    pub(super) fn starts(&self, state: &mut State, starts: &mut [usize]) -> Result<(), ModelError> {
        for ((own, start), window) in state.events.iter_mut().zip(starts.iter_mut()).zip(self.windows) {
            let onset = *start as f64 + self.cut.before as f64 + own.onset_s / self.cut.interval_s;
            let next = window.start(onset, &self.cut).ok_or(ModelError::Degenerate("an onset left its window"))?;
            own.onset_s += (*start as f64 - next as f64) * self.cut.interval_s;
            *start = next;
        }
        Ok(())
    }

    /// Whitens the basis round `state` and turns the events of `starts`.
    pub(super) fn turn(&self, state: &State, starts: &[usize]) -> Turned {
        let reference = state.lever.release();
        let (before, samples) = (self.cut.before, self.cut.samples);
        let mut basis = columns(&reference, self.cut.interval_s, samples - before);
        let count = basis.len();
        for column in &mut basis[..count - 2] {
            let mut padded = vec![0.0; before];
            padded.append(column);
            *column = padded;
        }
        let centre = 0.5 * (samples.max(2) - 1) as f64;
        basis[count - 2] = vec![1.0; samples];
        basis[count - 1] = (0..samples).map(|k| (k as f64 - centre) / centre).collect();
        basis.push((0..samples).map(|k| if k < before { 1.0 } else { 0.0 }).collect());
        let whitener = Whitener::new(&self.noise, self.cut.interval_s, samples, &[]);
        whiten(&whitener, &mut basis);
        let qr = Qr::new(Mat::from_fn(samples, basis.len(), |i, j| basis[j][i]));
        let r = qr.r();
        let mut events: Vec<Vec<f64>> = self
            .windows
            .iter()
            .zip(starts)
            .map(|(window, start)| window.values[*start..*start + samples].to_vec())
            .collect();
        whiten(&whitener, &mut events);
        events.par_iter_mut().for_each(|event| rotate(&qr, std::slice::from_mut(event)));
        Turned { reference, r, qr, whitener, events }
    }

    /// What each set of effects changes in each event, whitened and rotated: by event, then by set.
    pub(super) fn changed(&self, turned: &Turned, state: &State, sets: &[Effects]) -> Vec<Vec<Vec<f64>>> {
        let simulated = (0..state.events.len()).into_par_iter().map(|event| {
            let (own, instant) = (&state.events[event], self.windows[event].first);
            let release = self.release(own);
            differences(&state.lever, sets.iter().map(|effects| (effects, release, effects.frequency_change(&instant))))
        });
        let mut all: Vec<Vec<f64>> = simulated.collect::<Vec<_>>().into_iter().flatten().collect();
        all.par_chunks_mut(LANES).for_each(|chunk| {
            let mut lanes: Vec<&mut [f64]> = chunk.iter_mut().map(Vec::as_mut_slice).collect();
            turned.whitener.apply(&mut lanes);
            rotate(&turned.qr, chunk);
        });
        let mut all = all.into_iter();
        (0..state.events.len()).map(|_| all.by_ref().take(sets.len()).collect()).collect()
    }

    /// An event as it is to be simulated.
    pub(super) fn release(&self, own: &EventParameters) -> Release {
        Release {
            amplitude: own.amplitude,
            lead_s: -own.onset_s,
            before: self.cut.before,
            samples: self.cut.samples,
            interval_s: self.cut.interval_s,
        }
    }

    /// What the hypotheses change as they are: by event; nothing where there are none.
    fn base(&self, turned: &Turned, state: &State) -> Vec<Vec<f64>> {
        if state.hypotheses.is_empty() {
            return vec![Vec::new(); state.events.len()];
        }
        self.changed(turned, state, &[state.effects()]).into_iter().map(|mut sets| sets.swap_remove(0)).collect()
    }

    /// Derivatives of what the hypotheses change with each of their parameters, by difference quotients: by event, then by parameter.
    fn slopes(&self, turned: &Turned, state: &State, base: &[Vec<f64>]) -> Vec<Vec<Vec<f64>>> {
        let (mut sets, mut steps) = (Vec::new(), Vec::new());
        for (h, hypothesis) in state.hypotheses.iter().enumerate() {
            for p in 0..hypothesis.values.len() {
                let mut moved = state.clone();
                steps.push(step_of(hypothesis, p));
                moved.hypotheses[h].values[p] += step_of(hypothesis, p);
                sets.push(moved.effects());
            }
        }
        if sets.is_empty() {
            return vec![Vec::new(); state.events.len()];
        }
        let mut all = self.changed(turned, state, &sets);
        all.par_iter_mut().zip(base).for_each(|(event, base)| {
            for (moved, step) in event.iter_mut().zip(&steps) {
                moved.iter_mut().zip(base).for_each(|(m, b)| *m = (*m - b) / step);
            }
        });
        all
    }

    /// Residuals and derivatives of every event at `state`.
    pub(super) fn linearised(&self, turned: &Turned, state: &State) -> Vec<Linearised> {
        let base = self.base(turned, state);
        let slopes = Slopes::of(self, turned, state, &base, Hold::Nothing);
        self.linearised_with(turned, state, &base, &slopes)
    }

    /// How the change that the hypotheses make moves with the lever's parameters, and with amplitude and onset: by difference quotients on an event
    /// of middling amplitude, which stands for all.
    fn crossed(&self, turned: &Turned, state: &State) -> Crossed {
        let mut order: Vec<usize> = (0..state.events.len()).collect();
        order.sort_by(|&a, &b| state.events[a].amplitude.total_cmp(&state.events[b].amplitude));
        let Some(&middle) = order.get(order.len() / 2) else { return Crossed::default() };
        let (own, effects) = (state.events[middle], state.effects());
        let values = state.lever.parameters();
        let time_step = 1e-2 * self.cut.interval_s;
        let mut levers = vec![state.lever.clone(); values.len() + 3];
        let mut releases = vec![self.release(&own); values.len() + 3];
        for (j, lever) in levers.iter_mut().enumerate().skip(1).take(values.len()) {
            let mut moved = values.clone();
            moved[j - 1] += LEVER_STEP;
            *lever = state.lever.with(&moved);
        }
        let last = values.len();
        releases[last + 1].amplitude *= 1.0 + LEVER_STEP;
        releases[last + 2].lead_s -= time_step;
        // a change of frequency is each event's own, and what it moves of these derivatives is small
        let mut all: Vec<Vec<f64>> = levers
            .par_iter()
            .zip(&releases)
            .map(|(lever, release)| differences(lever, std::iter::once((&effects, *release, 0.0))).swap_remove(0))
            .collect();
        all.par_chunks_mut(LANES).for_each(|chunk| {
            let mut lanes: Vec<&mut [f64]> = chunk.iter_mut().map(Vec::as_mut_slice).collect();
            turned.whitener.apply(&mut lanes);
            rotate(&turned.qr, chunk);
        });
        let base = all.remove(0);
        for (j, moved) in all.iter_mut().enumerate() {
            let step = match j {
                _ if j < last => LEVER_STEP,
                _ if j == last => LEVER_STEP * own.amplitude,
                _ => time_step,
            };
            moved.iter_mut().zip(&base).for_each(|(m, b)| *m = (*m - b) / step);
        }
        Crossed { columns: all, amplitude: own.amplitude }
    }

    fn linearised_with(&self, turned: &Turned, state: &State, base: &[Vec<f64>], slopes: &Slopes) -> Vec<Linearised> {
        let shared = Shared::of(&state.lever);
        (0..state.events.len())
            .into_par_iter()
            .map(|event| self.linearise(turned, state, &shared, event, &base[event], slopes))
            .collect()
    }

    /// Residual and derivatives of one event at `state`, from what the hypotheses change in it.
    fn linearise(
        &self,
        turned: &Turned,
        state: &State,
        shared: &Shared,
        event: usize,
        base: &[f64],
        slopes: &Slopes,
    ) -> Linearised {
        let own = &state.events[event];
        let w = weights(&turned.reference, &shared.exponentials, own);
        let width = turned.r.ncols();
        // the last column, the level before the release, is -amplitude
        let full = |part: &[f64], last: f64| -> Vec<f64> {
            let value: Vec<f64> = part.iter().copied().chain([last]).collect();
            (0..width).map(|i| (i..width).map(|j| turned.r[(i, j)] * value[j]).sum()).collect()
        };
        let mut residual = turned.events[event].clone();
        let head = full(&w.value, -own.amplitude);
        residual.iter_mut().zip(&head).for_each(|(r, h)| *r -= h);
        let per_parameter: Vec<Vec<f64>> = w.shared.iter().map(|column| full(column, 0.0)).collect();
        let lever = Mat::from_fn(width, shared.chain.ncols(), |i, j| {
            per_parameter.iter().enumerate().map(|(p, column)| column[i] * shared.chain[(p, j)]).sum()
        });
        let own_columns: Vec<Vec<f64>> =
            w.own.iter().enumerate().map(|(k, column)| full(column, if k == 0 { -1.0 } else { 0.0 })).collect();
        let own = Mat::from_fn(width, 4, |i, j| own_columns[j][i]);
        residual.iter_mut().zip(base).for_each(|(r, b)| *r -= b);
        let causes = slopes.values[event].clone();
        let scale = state.events[event].amplitude / slopes.crossed.amplitude;
        Linearised { residual, lever, own, crossed: slopes.crossed.columns.clone(), scale, causes }
    }

    /// Squared whitened residual of every event at `state`.
    fn costs(&self, turned: &Turned, state: &State, base: &[Vec<f64>]) -> Vec<f64> {
        let shared = Shared::of(&state.lever);
        (0..state.events.len())
            .into_par_iter()
            .map(|event| {
                let own = &state.events[event];
                let w = weights(&turned.reference, &shared.exponentials, own);
                let width = turned.r.ncols();
                let mut residual = turned.events[event].clone();
                for (i, value) in residual.iter_mut().enumerate().take(width) {
                    let head: f64 = (i..width - 1).map(|j| turned.r[(i, j)] * w.value[j]).sum();
                    *value -= head - turned.r[(i, width - 1)] * own.amplitude;
                }
                residual.iter_mut().zip(&base[event]).for_each(|(r, b)| *r -= b);
                residual.iter().map(|r| r * r).sum()
            })
            .collect()
    }

    fn prior_cost(&self, state: &State) -> f64 {
        self.known(&state.lever).iter().map(|(_, distance, std)| (distance / std).powi(2)).sum()
    }
}

/// Signals filtered side by side.
const LANES: usize = crate::model::ringdown::internals::LANES;

fn rotate(qr: &Qr, signals: &mut [Vec<f64>]) {
    let Some(samples) = signals.first().map(Vec::len) else { return };
    let mut matrix = Mat::from_fn(samples, signals.len(), |i, j| signals[j][i]);
    qr.apply_transpose(matrix.as_mut());
    for (j, signal) in signals.iter_mut().enumerate() {
        signal.iter_mut().enumerate().for_each(|(i, value)| *value = matrix[(i, j)]);
    }
}

fn step_of(hypothesis: &Hypothesis, p: usize) -> f64 {
    let parameter = &hypothesis.cause.about().parameters[p];
    let value = hypothesis.values[p];
    let step = STEP * if value == 0.0 { parameter.high } else { value.abs() };
    // inwards from a limit
    if value + step > parameter.high { -step } else { step }
}

/// The lever's exponentials and how they move with its parameters.
pub(super) struct Shared {
    pub exponentials: Vec<Exponential>,
    /// `d(pole, residue) / d parameter`, rows in the order of the weights' shared parameters.
    pub chain: Mat<f64>,
}

impl Shared {
    pub fn of(lever: &Lever) -> Self {
        let values = lever.parameters();
        let numbers = |values: &[f64]| shared(&lever.with(values).release());
        let exponentials = lever.release();
        let rows = numbers(&values).len();
        let mut chain = Mat::zeros(rows, values.len());
        for j in 0..values.len() {
            let step = 1e-6;
            let (mut up, mut down) = (values.clone(), values.clone());
            up[j] += step;
            down[j] -= step;
            for (i, (a, b)) in numbers(&up).iter().zip(&numbers(&down)).enumerate() {
                chain[(i, j)] = (a - b) / (2.0 * step);
            }
        }
        Self { exponentials, chain }
    }
}

/// Least factor by which a cause is taken to weaken a mode.
const SHRUNK: f64 = 0.03;

/// By what a change multiplies the residue of each mode, in one event.
fn residue_ratios(turned: &Turned, change: &[f64], own: &EventParameters, modes: usize) -> Vec<c64> {
    let width = turned.r.ncols();
    let mut weights = change[..width].to_vec();
    for i in (0..width).rev() {
        let known: f64 = (i + 1..width).map(|k| turned.r[(i, k)] * weights[k]).sum();
        weights[i] = if turned.r[(i, i)] == 0.0 { 0.0 } else { (weights[i] - known) / turned.r[(i, i)] };
    }
    let one = |(m, e): (usize, &Exponential)| {
        // six columns per mode; Re(rho z) has the weights Re rho and -Im rho
        let now = e.residue * (-e.pole * own.onset_s).exp() * own.amplitude;
        (now + c64::new(weights[6 * m], -weights[6 * m + 1])) / now
    };
    turned.reference.iter().enumerate().take(modes).map(one).collect()
}

/// Moves onsets, shares and amplitudes by what the last hypothesis does to the modes, so that a fit that begins with it begins in phase and at the rings seen.
///
/// A slow release delays all modes alike, by several samples: more than the search could find from there, since the high modes turn within one.
pub fn aligned(problem: &Problem<'_>, state: &mut State, starts: &mut [usize]) -> Result<(), ModelError> {
    problem.starts(state, starts)?;
    let mut before = state.clone();
    before.hypotheses.pop();
    let turned = problem.turn(state, starts);
    let both = problem.changed(&turned, state, &[before.effects(), state.effects()]);
    let count = state.lever.modes.len();
    let mut shrunk = vec![0.0; count];
    for (own, sets) in state.events.iter_mut().zip(&both) {
        let change: Vec<f64> = sets[1].iter().zip(&sets[0]).map(|(a, b)| a - b).collect();
        let ratios = residue_ratios(&turned, &change, own, count);
        shrunk.iter_mut().zip(&ratios).for_each(|(s, r)| *s += r.norm() / both.len() as f64);
        if let (Some(ratio), Some(first)) = (ratios.first(), turned.reference.first()) {
            let late = -ratio.arg() / first.pole.im;
            if late.is_finite() && ratio.norm() > 0.5 && ratio.norm() < 2.0 {
                own.onset_s -= late;
            }
        }
    }
    // what the cause takes from a mode, its share must have: the rings that were seen are still there
    let shares: Vec<f64> = state
        .lever
        .modes
        .iter()
        .zip(&shrunk)
        .map(|(mode, shrunk)| mode.share / shrunk.clamp(SHRUNK, 1.0 / SHRUNK))
        .collect();
    let total: f64 = shares.iter().sum();
    if total.is_finite() && total > 0.0 {
        let old = state.lever.modes.first().map_or(1.0, |mode| mode.share);
        state.lever.modes.iter_mut().zip(&shares).for_each(|(mode, share)| mode.share = share / total);
        let first = state.lever.modes.first().map_or(1.0, |mode| mode.share);
        let factor = old / first / shrunk.first().copied().unwrap_or(1.0);
        if factor > 0.5 && factor < 2.0 {
            state.events.iter_mut().for_each(|own| own.amplitude *= factor);
        }
    }
    problem.starts(state, starts)
}

/// A finished fit.
pub struct JointFit {
    /// Where it ended.
    pub state: State,
    /// First samples of the windows.
    pub starts: Vec<usize>,
    /// Inverse information of lever and causes' parameters, events' own eliminated, priors included.
    pub covariance: Mat<f64>,
    /// Squared whitened residual per event.
    pub costs: Vec<f64>,
    /// Minus twice the logarithm of the posterior, but for a constant.
    pub cost: f64,
    /// Whether the last step was small.
    pub converged: bool,
    /// Parameters of causes that ended at a limit: cause and parameter.
    pub at_limit: Vec<(usize, usize)>,
}

/// Most trial steps of a fit, over all turns: what has not arrived by then has no likelihood worth the time.
const EVALUATIONS: usize = 28;
/// Turns of the basis, and steps within each.
const ROUNDS: usize = 6;
const STEPS: usize = 10;
/// Fall of the cost that ends the search.
const ARRIVED: f64 = 0.05;

/// Fits lever, causes and events from `state` on.
///
/// # Method
/// Gauss-Newton with damping, the events' own parameters eliminated by Schur complements; the lever's part in the rotated basis of the whitened
/// exponentials, causes by difference quotients of their simulated change. Parameters stay within their limits.
/// # Errors
/// Onsets that leave their windows, a search without a finite result.
pub fn fit(problem: &Problem<'_>, state: State, starts: Vec<usize>, hold: Hold) -> Result<JointFit, ModelError> {
    let (mut state, mut starts) = (state, starts);
    let mut last_round = f64::INFINITY;
    let mut damping = 1e-6;
    let mut evaluations = 0;
    for round in 0..ROUNDS {
        problem.starts(&mut state, &mut starts)?;
        let turned = problem.turn(&state, &starts);
        let mut base = problem.base(&turned, &state);
        let mut slopes = Slopes::of(problem, &turned, &state, &base, hold);
        let mut costs = problem.costs(&turned, &state, &base);
        let mut cost = costs.iter().sum::<f64>() + problem.prior_cost(&state);
        let mut converged = false;
        let mut covariance = None;
        for _ in 0..STEPS {
            if slopes.are_stale(&state, hold) {
                slopes = Slopes::of(problem, &turned, &state, &base, hold);
            }
            let linearised = problem.linearised_with(&turned, &state, &base, &slopes);
            let normal = Normal::assemble(problem, &turned, &state, linearised, hold);
            let step = normal.solve(damping);
            if step.promised < ARRIVED {
                covariance = Some(symmetric_inverse(&normal.information));
                converged = true;
                break;
            }
            if evaluations == EVALUATIONS {
                covariance = Some(symmetric_inverse(&normal.information));
                break;
            }
            evaluations += 1;
            let trial = moved(&state, &step.shared, &step.own, hold);
            let next_base = problem.base(&turned, &trial);
            let next = problem.costs(&turned, &trial, &next_base);
            let next_cost = next.iter().sum::<f64>() + problem.prior_cost(&trial);
            if next_cost <= cost && next_cost.is_finite() {
                let gain = cost - next_cost;
                (state, costs, cost, base) = (trial, next, next_cost, next_base);
                damping = (0.1 * damping).max(1e-9);
                if gain < ARRIVED {
                    covariance = Some(symmetric_inverse(&normal.information));
                    converged = true;
                    break;
                }
                // an onset has passed a sample: cut anew
                if state.events.iter().any(|e| e.onset_s > 0.0 || e.onset_s < -1.5 * problem.cut.interval_s) {
                    covariance = Some(symmetric_inverse(&normal.information));
                    break;
                }
            } else {
                damping = (damping * 10.0).max(1e-4);
                if damping > 1e6 {
                    covariance = Some(symmetric_inverse(&normal.information));
                    break;
                }
            }
        }
        if (converged && (last_round - cost).abs() < 1.0) || round + 1 == ROUNDS || evaluations == EVALUATIONS {
            let covariance = match covariance {
                Some(covariance) => covariance,
                None => {
                    let linearised = problem.linearised_with(&turned, &state, &base, &slopes);
                    symmetric_inverse(&Normal::assemble(problem, &turned, &state, linearised, hold).information)
                }
            };
            let at_limit = at_limit(&state);
            return Ok(JointFit { state, starts, covariance, costs, cost, converged, at_limit });
        }
        last_round = cost;
    }
    Err(ModelError::Degenerate("no round was made"))
}

/// Derivatives of the hypotheses' change, kept while their parameters stay near.
struct Slopes {
    values: Vec<Vec<Vec<f64>>>,
    crossed: Crossed,
    at: Vec<f64>,
}

/// How the hypotheses' change moves with everything else, of one event.
#[derive(Default)]
struct Crossed {
    /// Per parameter of the lever, then amplitude, then onset; none without hypotheses.
    columns: Vec<Vec<f64>>,
    amplitude: f64,
}

/// Step of the lever's logarithmic parameters and shares in a difference quotient.
const LEVER_STEP: f64 = 1e-4;

/// Relative change of a shape parameter, and of a strength, beyond which derivatives are taken anew.
const STALE: [f64; 2] = [0.02, 0.3];

impl Slopes {
    fn of(problem: &Problem<'_>, turned: &Turned, state: &State, base: &[Vec<f64>], hold: Hold) -> Self {
        let values = match hold {
            Hold::Nothing => problem.slopes(turned, state, base),
            Hold::Shared => vec![Vec::new(); state.events.len()],
        };
        let crossed = if state.hypotheses.is_empty() { Crossed::default() } else { problem.crossed(turned, state) };
        Self { values, crossed, at: numbers(state) }
    }

    fn are_stale(&self, state: &State, hold: Hold) -> bool {
        let limits = state.hypotheses.iter().flat_map(|h| (0..h.values.len()).map(|p| STALE[usize::from(p == 0)]));
        let moved = |((now, then), limit): ((f64, &f64), f64)| (now - then).abs() > limit * then.abs();
        hold == Hold::Nothing && numbers(state).into_iter().zip(&self.at).zip(limits).any(moved)
    }
}

fn numbers(state: &State) -> Vec<f64> {
    state.hypotheses.iter().flat_map(|h| h.values.iter().copied()).collect()
}

fn at_limit(state: &State) -> Vec<(usize, usize)> {
    let mut out = Vec::new();
    for (h, hypothesis) in state.hypotheses.iter().enumerate() {
        for (p, (parameter, value)) in hypothesis.cause.about().parameters.iter().zip(&hypothesis.values).enumerate() {
            // steps are cut at the limits
            if *value <= parameter.low || *value >= parameter.high {
                out.push((h, p));
            }
        }
    }
    out
}

/// Largest relative change of a cause's shape parameter in one step.
const STRETCH: f64 = 2.0;

fn moved(state: &State, shared: &[f64], own: &[[f64; 4]], hold: Hold) -> State {
    let mut out = state.clone();
    let lever = if hold == Hold::Shared { 0 } else { state.lever.parameters().len() };
    if hold == Hold::Nothing {
        let values: Vec<f64> = state.lever.parameters().iter().zip(shared).map(|(v, s)| v + s).collect();
        out.lever = state.lever.with(&values);
    }
    let mut next = lever;
    for hypothesis in out.hypotheses.iter_mut().filter(|_| hold == Hold::Nothing) {
        let about = hypothesis.cause.about();
        for (p, (value, parameter)) in hypothesis.values.iter_mut().zip(about.parameters).enumerate() {
            let mut goal = *value + shared[next];
            if p > 0 && *value > 0.0 && parameter.low >= 0.0 {
                goal = goal.clamp(*value / STRETCH, *value * STRETCH);
            }
            *value = goal.clamp(parameter.low, parameter.high);
            next += 1;
        }
    }
    for (event, step) in out.events.iter_mut().zip(own) {
        event.amplitude += step[0];
        event.onset_s += step[1];
        event.offset += step[2];
        event.slope += step[3];
    }
    out
}

/// Normal equations with the events' own parameters eliminated.
pub(super) struct Normal {
    pub information: Mat<f64>,
    pub gradient: Vec<f64>,
    events: Vec<Eliminated>,
}

pub(super) struct Eliminated {
    inverse: Mat<f64>,
    coupling: Mat<f64>,
    own_gradient: Vec<f64>,
    pub information: Mat<f64>,
    pub gradient: Vec<f64>,
}

struct Step {
    shared: Vec<f64>,
    own: Vec<[f64; 4]>,
    promised: f64,
}

/// Columns of one event: shared ones (lever within the basis, causes everywhere), then its own four.
pub(super) fn eliminate(columns: &Mat<f64>, residual: &[f64], shared: usize) -> Eliminated {
    let gram = product(columns.transpose(), columns.as_ref());
    let right = product(columns.transpose(), Mat::from_fn(residual.len(), 1, |i, _| residual[i]).as_ref());
    let own = columns.ncols() - shared;
    let inverse = symmetric_inverse(&Mat::from_fn(own, own, |i, j| gram[(shared + i, shared + j)]));
    let cross = Mat::from_fn(own, shared, |i, j| gram[(shared + i, j)]);
    let coupling = product(inverse.as_ref(), cross.as_ref());
    let taken = product(cross.transpose(), coupling.as_ref());
    let information = Mat::from_fn(shared, shared, |i, j| gram[(i, j)] - taken[(i, j)]);
    let own_gradient: Vec<f64> = (0..own).map(|i| right[(shared + i, 0)]).collect();
    let gradient = (0..shared)
        .map(|j| right[(j, 0)] - (0..own).map(|i| coupling[(i, j)] * own_gradient[i]).sum::<f64>())
        .collect();
    Eliminated { inverse, coupling, own_gradient, information, gradient }
}

impl Linearised {
    /// All columns: lever (unless held), causes, `extra`, own.
    pub fn matrix(&self, hold: Hold, extra: &[Vec<f64>]) -> Mat<f64> {
        let lever = if hold == Hold::Shared { 0 } else { self.lever.ncols() };
        let width = self.lever.nrows();
        let (causes, total) = (self.causes.len(), lever + self.causes.len() + extra.len() + 4);
        let within = |matrix: &Mat<f64>, i: usize, j: usize| if i < width { matrix[(i, j)] } else { 0.0 };
        // the lever's columns first, then amplitude (which the scale is one over of) and onset
        let crossed = |i: usize, c: usize, scale: f64| self.crossed.get(c).map_or(0.0, |column| scale * column[i]);
        let known = self.lever.ncols();
        Mat::from_fn(self.residual.len(), total, |i, j| {
            if j < lever {
                within(&self.lever, i, j) + crossed(i, j, self.scale)
            } else if j < lever + causes {
                self.causes[j - lever][i]
            } else if j < lever + causes + extra.len() {
                extra[j - lever - causes][i]
            } else {
                let own = j + 4 - total;
                within(&self.own, i, own)
                    + match own {
                        0 => crossed(i, known, 1.0),
                        1 => crossed(i, known + 1, self.scale),
                        _ => 0.0,
                    }
            }
        })
    }
}

impl Normal {
    fn assemble(
        problem: &Problem<'_>,
        turned: &Turned,
        state: &State,
        linearised: Vec<Linearised>,
        hold: Hold,
    ) -> Self {
        let lever = if hold == Hold::Shared { 0 } else { state.lever.parameters().len() };
        let count = if hold == Hold::Shared { 0 } else { lever + state.causes() };
        let bent = !state.hypotheses.is_empty();
        let width = turned.r.ncols();
        let events: Vec<Eliminated> = linearised
            .into_par_iter()
            .map(|mut event| {
                if !bent {
                    // nothing but the residual is outside the basis
                    event.residual.truncate(width);
                }
                eliminate(&event.matrix(hold, &[]), &event.residual, count)
            })
            .collect();
        let mut information = Mat::zeros(count, count);
        let mut gradient = vec![0.0; count];
        for event in &events {
            information += &event.information;
            gradient.iter_mut().zip(&event.gradient).for_each(|(g, e)| *g += e);
        }
        if hold == Hold::Nothing {
            problem.add_prior(&state.lever, &mut information, &mut gradient);
        }
        Self { information, gradient, events }
    }

    fn solve(&self, damping: f64) -> Step {
        let n = self.gradient.len();
        let mut damped = self.information.clone();
        (0..n).for_each(|i| damped[(i, i)] *= 1.0 + damping);
        let covariance = symmetric_inverse(&damped);
        let shared: Vec<f64> = (0..n).map(|i| (0..n).map(|j| covariance[(i, j)] * self.gradient[j]).sum()).collect();
        let mut promised: f64 = shared.iter().zip(&self.gradient).map(|(s, g)| s * g).sum();
        let own = self
            .events
            .iter()
            .map(|event| {
                let mut step = [0.0; 4];
                for (i, value) in step.iter_mut().enumerate() {
                    let alone: f64 = (0..4).map(|k| event.inverse[(i, k)] * event.own_gradient[k]).sum();
                    promised += alone * event.own_gradient[i];
                    *value = alone - (0..n).map(|j| event.coupling[(i, j)] * shared[j]).sum::<f64>();
                }
                step
            })
            .collect();
        Step { shared, own, promised }
    }
}

impl Problem<'_> {
    /// Parameters of which something is known: number, distance from it, its standard deviation.
    fn known(&self, lever: &Lever) -> Vec<(usize, f64, f64)> {
        let first = lever.parameters().len() - lever.poles.len();
        let poles = lever.poles.iter().zip(&self.nominal_poles).enumerate();
        let poles = poles.map(|(k, (pole, nominal))| (first + k, (pole / nominal).ln(), self.pole_std));
        let modes = lever.modes.iter().zip(&self.seen).enumerate().flat_map(|(m, (now, seen))| {
            [
                (2 * m, (now.omega / seen.mode.omega).ln(), seen.std[0]),
                (2 * m + 1, (now.quality_factor / seen.mode.quality_factor).ln(), seen.std[1]),
            ]
        });
        poles.chain(modes).collect()
    }

    pub(super) fn add_prior(&self, lever: &Lever, information: &mut Mat<f64>, gradient: &mut [f64]) {
        for (parameter, distance, std) in self.known(lever) {
            information[(parameter, parameter)] += std.powi(-2);
            gradient[parameter] -= distance / (std * std);
        }
    }
}

/// The lever that free exponentials suggest: modes' poles taken over, shares from their residues, poles nominal.
pub fn suggested(exponentials: &[Exponential], nominal_poles: &[f64]) -> Lever {
    let modes: Vec<LeverMode> = exponentials
        .iter()
        .filter(|e| e.oscillates())
        .map(|e| LeverMode {
            omega: e.pole.norm(),
            quality_factor: (e.pole.norm() / (-2.0 * e.pole.re)).max(0.6),
            share: 0.0,
        })
        .collect();
    let unit =
        Lever { modes: modes.iter().map(|m| LeverMode { share: 1.0, ..*m }).collect(), poles: nominal_poles.to_vec() };
    let sizes: Vec<f64> = exponentials
        .iter()
        .filter(|e| e.oscillates())
        .zip(unit.release())
        .map(|(found, unit)| found.residue.norm() / unit.residue.norm())
        .collect();
    let total: f64 = sizes.iter().sum();
    let modes = modes.iter().zip(&sizes).map(|(m, size)| LeverMode { share: size / total, ..*m }).collect();
    Lever { modes, poles: nominal_poles.to_vec() }
}
