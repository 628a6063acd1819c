//! The joint fit of lever and causes to all events.

use std::sync::Arc;

use faer::Mat;
use rayon::prelude::*;

use super::basis::Basis;
use super::change::{Crossing, Slopes, base};
use super::normal::{Event, Normal};
use super::problem::Problem;
use super::signals::Signals;
use super::state::{Hold, State};
use crate::linear_algebra::symmetric_inverse;
use crate::model::ModelError;
use crate::ringdown::internals::Whitener;

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
    /// Trial steps that were spent.
    pub evaluations: usize,
    /// Damping that the search had come to.
    pub damping: f64,
    /// Parameters of causes that ended at a limit: cause and parameter.
    pub at_limit: Vec<(usize, usize)>,
}

/// Most trial steps of a fit: what has not arrived by then has no likelihood worth the time.
pub(super) const EVALUATIONS: usize = 40;
/// Fall of the cost that ends the search.
const ARRIVED: f64 = 0.05;
/// Distance from the basis' lever beyond which the basis is made again, and beyond which a step is not believed.
const NEAR: f64 = 0.03;
const FAR: f64 = 1.0;
/// The first while steps promise so much: the cost is right to one or two then (errors grow with the third power of the
/// distance).
const ON_THE_WAY: (f64, f64) = (0.1, 50.0);
/// Damping at first, at least, after a failure at least, and where the search gives up.
const DAMPING: [f64; 4] = [1e-6, 1e-9, 1e-4, 1e8];
/// What one sample more and one less may add to the cost of an event that is cut again: noise does once in a million.
const CUT_AGAIN: f64 = 25.0;

/// A basis with the data in it.
struct Frame {
    basis: Basis,
    starts: Vec<usize>,
    data: Signals,
}

impl Frame {
    /// Cuts windows again where onsets have passed a sample.
    fn new(
        problem: &Problem<'_>,
        whitener: &Whitener,
        state: &mut State,
        starts: &mut [usize],
    ) -> Result<Self, ModelError> {
        problem.starts(state, starts)?;
        let basis = Basis::new(&state.lever, problem);
        Ok(Self { basis, data: problem.data(whitener, starts), starts: starts.to_vec() })
    }
}

/// A state and what it leaves, in one frame.
pub(super) struct Point {
    pub state: State,
    /// Whitened samples less what the hypotheses change, one per event, and their coordinates.
    rest: Signals,
    heads: Vec<Vec<f64>>,
    costs: Vec<f64>,
    cost: f64,
}

impl Point {
    fn at(problem: &Problem<'_>, whitener: &Whitener, frame: &Frame, state: State) -> Self {
        let changes = base(problem, whitener, &state);
        let mut rest = frame.data.clone();
        for event in 0..changes.count() {
            rest.get_mut(event).iter_mut().zip(changes.get(event)).for_each(|(r, c)| *r -= c);
        }
        let coordinates = frame.basis.project(rest.matrix());
        let shape = frame.basis.shape(&state.lever);
        let one = |event: usize| {
            let head: Vec<f64> = coordinates.col(event).iter().copied().collect();
            let value = frame.basis.value(&shape, &state.events[event]);
            let all: f64 = rest.get(event).iter().map(|v| v * v).sum();
            let within: f64 = head.iter().map(|v| v * v).sum();
            let left: f64 = head.iter().zip(&value).map(|(h, v)| (h - v) * (h - v)).sum();
            (head, all - within + left)
        };
        let (heads, costs): (Vec<Vec<f64>>, Vec<f64>) =
            (0..state.events.len()).into_par_iter().map(one).collect::<Vec<_>>().into_iter().unzip();
        let cost = costs.iter().sum::<f64>() + problem.prior_cost(&state.lever);
        Self { state, rest, heads, costs, cost }
    }

    /// Every event with its derivatives.
    fn events<'a>(&'a self, basis: &Basis, slopes: &'a Slopes) -> Vec<Event<'a>> {
        let shape = basis.shape(&self.state.lever);
        (0..self.state.events.len())
            .into_par_iter()
            .map(|event| Event {
                place: basis.place(&shape, &self.state.events[event]),
                rest: self.rest.get(event),
                rest_head: &self.heads[event],
                amplitude: self.state.events[event].amplitude,
                causes: slopes.causes.get(event),
            })
            .collect()
    }
}

/// A finished fit once more with its derivatives, for tests of what it leaves.
pub(super) struct Linear {
    pub whitener: Arc<Whitener>,
    pub basis: Basis,
    pub slopes: Slopes,
    point: Point,
}

/// The same fit with errors from every event's own derivatives at the fit's own steps: the search gets along with
/// coarser ones.
pub(super) fn with_errors(problem: &Problem<'_>, fitted: JointFit) -> Result<JointFit, ModelError> {
    let linear = Linear::with(problem, &fitted, Crossing::Exact)?;
    let Linear { basis, slopes, .. } = &linear;
    let normal = Normal::assemble(problem, basis, linear.state(), &linear.events(), slopes, Hold::Nothing);
    Ok(JointFit { covariance: symmetric_inverse(&normal.information), ..fitted })
}

impl Linear {
    pub fn at(problem: &Problem<'_>, fitted: &JointFit) -> Result<Self, ModelError> {
        Self::with(problem, fitted, Crossing::Middle)
    }

    fn with(problem: &Problem<'_>, fitted: &JointFit, crossing: Crossing) -> Result<Self, ModelError> {
        let whitener = problem.whitener();
        let (mut state, mut starts) = (fitted.state.clone(), fitted.starts.clone());
        let frame = Frame::new(problem, &whitener, &mut state, &mut starts)?;
        let slopes = Slopes::of(problem, &whitener, &state, &starts, Hold::Nothing, crossing);
        let point = Point::at(problem, &whitener, &frame, state);
        Ok(Self { whitener, basis: frame.basis, slopes, point })
    }

    pub fn state(&self) -> &State {
        &self.point.state
    }

    pub fn events(&self) -> Vec<Event<'_>> {
        self.point.events(&self.basis, &self.slopes)
    }
}

/// Fits lever, causes and events from `state` on.
///
/// # Method
/// Gauss-Newton with damping (Levenberg, Marquardt), the events' own parameters eliminated by Schur complements; the
/// lever's part in an orthonormal basis of whitened releases, made again where the lever has moved; causes by difference
/// quotients of their simulated change. A step counts if the cost has fallen in the basis of where it leads to.
/// Parameters stay within their limits.
/// # Errors
/// Onsets that leave their windows, a search without a finite result.
/// # Source
/// D. W. Marquardt, J. Soc. Indust. Appl. Math. 11 (1963) 431.
pub fn fit(problem: &Problem<'_>, state: State, starts: Vec<usize>, hold: Hold) -> Result<JointFit, ModelError> {
    fit_within(problem, state, starts, hold, Search::new(EVALUATIONS))
}

/// Steps of the events' own parameters before those of all, and the part of the cost that is not worth another.
const SETTLING: usize = 6;
const ROUGH: f64 = 1e-3;

/// The events' own parameters fitted to lever and causes as they are: a search from levels that are off goes astray
/// with everything else.
///
/// # Errors
/// Those of [`fit`].
pub(super) fn settled(problem: &Problem<'_>, state: State, starts: Vec<usize>) -> Result<JointFit, ModelError> {
    fit_within(problem, state, starts, Hold::Shared, Search { rough: ROUGH, ..Search::new(SETTLING) })
}

/// How far a search may go, and with what damping it begins.
#[derive(Debug, Clone, Copy)]
pub(super) struct Search {
    pub most: usize,
    pub damping: f64,
    /// Part of the cost whose fall is not worth another step.
    pub rough: f64,
}

impl Search {
    /// A new one.
    pub fn new(most: usize) -> Self {
        Self { most, damping: DAMPING[0], rough: 0.0 }
    }
}

/// The same within limits.
pub(super) fn fit_within(
    problem: &Problem<'_>,
    state: State,
    starts: Vec<usize>,
    hold: Hold,
    search: Search,
) -> Result<JointFit, ModelError> {
    let whitener = problem.whitener();
    let (mut state, mut starts) = (state, starts);
    let mut frame = Frame::new(problem, &whitener, &mut state, &mut starts)?;
    let mut crossing = if hold == Hold::Shared { Crossing::Each } else { Crossing::Middle };
    let mut slopes = Slopes::of(problem, &whitener, &state, &frame.starts, hold, crossing);
    let mut point = Point::at(problem, &whitener, &frame, state);
    if !point.cost.is_finite() {
        return Err(ModelError::Degenerate("the search has no finite cost where it begins"));
    }
    let mut damping = search.damping;
    let mut evaluations = 0;
    let mut normal = None;
    let converged = loop {
        if slopes.are_stale(&point.state, &frame.starts, hold) {
            slopes = Slopes::of(problem, &whitener, &point.state, &frame.starts, hold, crossing);
            normal = None;
        }
        let equations = normal.take().unwrap_or_else(|| {
            let events = point.events(&frame.basis, &slopes);
            Normal::assemble(problem, &frame.basis, &point.state, &events, &slopes, hold)
        });
        let step = equations.solve(damping);
        let near = if step.promised > ON_THE_WAY.1 { ON_THE_WAY.0 } else { NEAR };
        if frame.basis.distance(&point.state.lever) > near {
            // from here on small gains count
            let Point { mut state, .. } = point;
            frame = Frame::new(problem, &whitener, &mut state, &mut frame.starts.clone())?;
            point = Point::at(problem, &whitener, &frame, state);
            normal = None;
            continue;
        }
        normal = Some(equations);
        let arrived = ARRIVED.max(search.rough * point.cost);
        if step.promised < arrived {
            break true;
        }
        if evaluations >= search.most || damping > DAMPING[3] {
            break false;
        }
        evaluations += 1;
        let trial = problem.confined(point.state.moved(&step, hold));
        let Some((next, new_frame)) = advance(problem, &whitener, &frame, &point, trial, near) else {
            if crossing == Crossing::Middle && !point.state.hypotheses.is_empty() {
                // one event's derivatives have led astray: another instant within the sample, another amplitude
                crossing = Crossing::Each;
                slopes = Slopes::of(problem, &whitener, &point.state, &frame.starts, hold, crossing);
                normal = None;
            } else {
                damping = (damping * 10.0).max(DAMPING[2]);
            }
            continue;
        };
        let gain = point.cost - next.cost;
        point = next;
        normal = None;
        damping = (0.1 * damping).max(DAMPING[1]);
        let cut_again = new_frame.as_ref().is_some_and(|new_frame| new_frame.starts != frame.starts);
        frame = new_frame.unwrap_or(frame);
        // with other samples in the windows the costs are of other data
        if gain < arrived && !cut_again {
            break true;
        }
    };
    let equations = normal.unwrap_or_else(|| {
        let events = point.events(&frame.basis, &slopes);
        Normal::assemble(problem, &frame.basis, &point.state, &events, &slopes, hold)
    });
    let at_limit = point.state.at_limit();
    Ok(JointFit {
        covariance: symmetric_inverse(&equations.information),
        state: point.state,
        starts: frame.starts,
        costs: point.costs,
        cost: point.cost,
        converged,
        evaluations,
        damping,
        at_limit,
    })
}

/// The point of `trial`, in a new frame where it is far; none unless the cost has fallen.
fn advance(
    problem: &Problem<'_>,
    whitener: &Whitener,
    frame: &Frame,
    point: &Point,
    trial: State,
    near: f64,
) -> Option<(Point, Option<Frame>)> {
    let distance = frame.basis.distance(&trial.lever);
    if !distance.is_finite() || distance > FAR {
        return None;
    }
    if distance <= near && !problem.have_passed(&trial) {
        let next = Point::at(problem, whitener, frame, trial);
        return (next.cost <= point.cost).then_some((next, None));
    }
    let (mut state, mut starts) = (trial, frame.starts.clone());
    // an onset that leaves its window belongs to a step that went too far
    let new_frame = Frame::new(problem, whitener, &mut state, &mut starts).ok()?;
    let next = Point::at(problem, whitener, &new_frame, state);
    let cut_again = frame.starts.iter().zip(&starts).filter(|(a, b)| a != b).count();
    (next.cost <= point.cost + CUT_AGAIN * cut_again as f64).then_some((next, Some(new_frame)))
}
