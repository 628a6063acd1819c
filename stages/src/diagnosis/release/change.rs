//! What causes change in events, simulated and whitened.

use rayon::prelude::*;

use super::problem::Problem;
use super::signals::Signals;
use super::state::{Hold, Hypothesis, State};
use super::stepper::{Pace, differences};
use crate::causes::Effects;
use crate::model::ringdown::internals::{LANES, Whitener};

/// Relative step of a cause's parameter in a difference quotient, of its value or of a trial's.
const STEP: f64 = 1e-3;
/// Step of the lever's logarithmic parameters and shares in a difference quotient.
const LEVER_STEP: f64 = 1e-4;
/// Step of the onset, in samples.
const ONSET_STEP: f64 = 1e-2;
/// Relative change of a shape parameter, and of a strength, beyond which derivatives are taken anew.
const STALE: [f64; 2] = [0.02, 0.3];

/// What each set of effects changes in each event, whitened: by event.
pub(super) fn changed(
    problem: &Problem<'_>,
    whitener: &Whitener,
    state: &State,
    sets: &[Effects],
    pace: Pace,
) -> Vec<Signals> {
    let together = sets.len() < LANES;
    let one = |event: usize| {
        let (own, instant) = (&state.events[event], problem.windows[event].first);
        let release = problem.release(own);
        let sets = sets.iter().map(|effects| (effects, release, effects.frequency_change(&instant)));
        let mut out = Signals::with_capacity(problem.cut.samples, sets.len());
        differences(&state.lever, sets, pace).iter().for_each(|signal| out.push(signal));
        if !together {
            out.whiten(whitener);
        }
        out
    };
    let events: Vec<Signals> = (0..state.events.len()).into_par_iter().map(one).collect();
    if !together {
        return events;
    }
    // the filter takes many at a time
    let mut all = Signals::with_capacity(problem.cut.samples, events.len() * sets.len());
    events.iter().for_each(|event| (0..event.count()).for_each(|i| all.push(event.get(i))));
    all.whiten(whitener);
    all.split(sets.len())
}

/// What the hypotheses change as they are: one signal per event, none where there are no hypotheses.
pub(super) fn base(problem: &Problem<'_>, whitener: &Whitener, state: &State) -> Signals {
    let count = if state.hypotheses.is_empty() { 0 } else { state.events.len() };
    let mut out = Signals::with_capacity(problem.cut.samples, count);
    if count > 0 {
        changed(problem, whitener, state, &[state.effects()], Pace::FINE)
            .iter()
            .for_each(|event| out.push(event.get(0)));
    }
    out
}

/// Derivatives of what the hypotheses change, kept while their parameters stay near.
pub(super) struct Slopes {
    /// Per event, with each of their parameters; nothing where those are held.
    pub causes: Vec<Signals>,
    /// With everything else, of one event that stands for all: per parameter of the lever, then amplitude, then onset.
    pub crossed: Signals,
    /// Its amplitude.
    pub amplitude: f64,
    at: Vec<f64>,
    starts: Vec<usize>,
}

impl Slopes {
    /// By difference quotients.
    pub fn of(problem: &Problem<'_>, whitener: &Whitener, state: &State, starts: &[usize], hold: Hold) -> Self {
        let causes = match hold {
            Hold::Nothing => with_causes(problem, whitener, state),
            Hold::Shared => Vec::new(),
        };
        let (crossed, amplitude) = with_the_rest(problem, whitener, state);
        Self { causes, crossed, amplitude, at: state.cause_values(), starts: starts.to_vec() }
    }

    /// Whether windows were cut anew, or parameters have moved too far.
    pub fn are_stale(&self, state: &State, starts: &[usize], hold: Hold) -> bool {
        if state.hypotheses.is_empty() {
            return false;
        }
        let limits = state.hypotheses.iter().flat_map(|h| (0..h.values.len()).map(|p| STALE[usize::from(p == 0)]));
        let moved = |((now, then), limit): ((f64, &f64), f64)| (now - then).abs() > limit * then.abs();
        let far = state.cause_values().into_iter().zip(&self.at).zip(limits).any(moved);
        hold == Hold::Nothing && (far || self.starts != starts)
    }
}

fn step_of(hypothesis: &Hypothesis, p: usize) -> f64 {
    let parameter = &hypothesis.cause.about().parameters[p];
    let value = hypothesis.values[p];
    let step = STEP * if value == 0.0 { parameter.high } else { value.abs() };
    // inwards from a limit
    if value + step > parameter.high { -step } else { step }
}

fn with_causes(problem: &Problem<'_>, whitener: &Whitener, state: &State) -> Vec<Signals> {
    let (mut sets, mut steps) = (vec![state.effects()], Vec::new());
    for (h, hypothesis) in state.hypotheses.iter().enumerate() {
        for p in 0..hypothesis.values.len() {
            let mut moved = state.clone();
            steps.push(step_of(hypothesis, p));
            moved.hypotheses[h].values[p] += step_of(hypothesis, p);
            sets.push(moved.effects());
        }
    }
    if steps.is_empty() {
        return Vec::new();
    }
    let mut all = changed(problem, whitener, state, &sets, Pace::FINE);
    all.par_iter_mut().for_each(|event| event.quotients(&steps));
    all
}

/// How the change moves with lever, amplitude and onset, on an event of middling amplitude.
fn with_the_rest(problem: &Problem<'_>, whitener: &Whitener, state: &State) -> (Signals, f64) {
    let mut order: Vec<usize> = (0..state.events.len()).collect();
    order.sort_by(|&a, &b| state.events[a].amplitude.total_cmp(&state.events[b].amplitude));
    let middle = order.get(order.len() / 2).filter(|_| !state.hypotheses.is_empty());
    let Some(&middle) = middle else { return (Signals::with_capacity(problem.cut.samples, 0), 1.0) };
    let (own, effects) = (state.events[middle], state.effects());
    let values = state.lever.parameters();
    let mut runs = vec![(state.lever.clone(), problem.release(&own))];
    let mut steps = vec![LEVER_STEP; values.len()];
    for j in 0..values.len() {
        let mut moved = values.clone();
        moved[j] += LEVER_STEP;
        runs.push((state.lever.with(&moved), problem.release(&own)));
    }
    let (mut larger, mut later) = (problem.release(&own), problem.release(&own));
    larger.amplitude *= 1.0 + LEVER_STEP;
    later.lead_s -= ONSET_STEP * problem.cut.interval_s;
    steps.extend([LEVER_STEP * own.amplitude, ONSET_STEP * problem.cut.interval_s]);
    runs.extend([(state.lever.clone(), larger), (state.lever.clone(), later)]);
    // a change of frequency is each event's own, and what it moves of these derivatives is small
    let signals: Vec<Vec<f64>> = runs
        .par_iter()
        .map(|(lever, release)| {
            differences(lever, std::iter::once((&effects, *release, 0.0)), Pace::FINE).swap_remove(0)
        })
        .collect();
    let mut all = Signals::with_capacity(problem.cut.samples, signals.len());
    signals.iter().for_each(|signal| all.push(signal));
    all.whiten(whitener);
    all.quotients(&steps);
    (all, own.amplitude)
}
