//! What causes change in events, simulated and whitened.

use rayon::prelude::*;

use super::lever::Lever;
use super::problem::Problem;
use super::signals::Signals;
use super::state::{Hold, Hypothesis, State};
use super::stepper::{Pace, Release, differences};
use crate::effects::Effects;
use crate::ringdown::internals::{LANES, Whitener};

/// Relative step of a cause's parameter in a difference quotient, of its value or of a trial's.
const STEP: f64 = 1e-3;
/// Step of the lever's logarithmic parameters and shares in a difference quotient.
const LEVER_STEP: f64 = 1e-4;
/// Step of the onset, in samples.
const ONSET_STEP: f64 = 1e-2;
/// Relative change of a shape parameter, and of a strength, beyond which derivatives are taken again.
const STALE: [f64; 2] = [0.02, 0.3];

/// What each set of effects changes in each event, whitened: by event.
pub(super) fn changed(
    problem: &Problem<'_>,
    whitener: &Whitener,
    state: &State,
    sets: &[Effects],
    pace: Pace,
) -> Vec<Signals> {
    let shaped = sets.iter().filter(|effects| effects.change_the_shape()).count();
    problem.prepared.count(shaped * state.events.len() * steps_of(problem, &state.lever, pace));
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

/// Steps of a mode in one simulation.
fn steps_of(problem: &Problem<'_>, lever: &Lever, pace: Pace) -> usize {
    problem.cut.samples * pace.late * lever.modes.len()
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
    /// Per event, with each of the causes' parameters; nothing where those are held.
    pub causes: Vec<Signals>,
    /// With everything else.
    crossed: Vec<CrossedSlopes>,
    at: Vec<f64>,
    starts: Vec<usize>,
}

/// How what the hypotheses change in an event moves with lever, amplitude and onset.
pub(super) struct CrossedSlopes {
    /// Per parameter of the lever (none where it is held), then amplitude, then onset.
    pub signals: Signals,
    /// The event's amplitude.
    pub amplitude: f64,
}

/// Whose crossed derivatives are taken.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Crossing {
    /// Those of an event of middling amplitude, which stands for all: enough where causes change little.
    Middle,
    /// Each event's own.
    Each,
    /// Those with the steps of a fit: for errors, which they set where a cause and the detector stand for one another.
    Exact,
}

impl Crossing {
    fn pace(self) -> Pace {
        match self {
            Self::Middle | Self::Each => Pace::CROSSED,
            Self::Exact => Pace::FINE,
        }
    }
}

impl Slopes {
    /// By difference quotients.
    pub fn of(
        problem: &Problem<'_>,
        whitener: &Whitener,
        state: &State,
        starts: &[usize],
        hold: Hold,
        crossing: Crossing,
    ) -> Self {
        let causes = match hold {
            Hold::Nothing => with_causes(problem, whitener, state),
            Hold::Shared => Vec::new(),
        };
        let crossed = with_the_rest(problem, whitener, state, hold, crossing);
        Self { causes, crossed, at: state.cause_values(), starts: starts.to_vec() }
    }

    /// Those of one event, or those that stand for all.
    pub fn crossed(&self) -> &[CrossedSlopes] {
        &self.crossed
    }

    /// Whether windows were cut again, or parameters have moved too far.
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

/// How the change moves with lever, amplitude and onset: of each event, or of one of middling amplitude.
fn with_the_rest(
    problem: &Problem<'_>,
    whitener: &Whitener,
    state: &State,
    hold: Hold,
    crossing: Crossing,
) -> Vec<CrossedSlopes> {
    let mut order: Vec<usize> = (0..state.events.len()).collect();
    if crossing == Crossing::Middle {
        order.sort_by(|&a, &b| state.events[a].amplitude.total_cmp(&state.events[b].amplitude));
        order = order.get(order.len() / 2).copied().into_iter().collect();
    }
    if state.hypotheses.is_empty() {
        order.clear();
    }
    let effects = state.effects();
    let values = state.lever.parameters();
    let lever_steps = if hold == Hold::Nothing { values.len() } else { 0 };
    let mut levers = vec![state.lever.clone()];
    levers.extend((0..lever_steps).map(|j| {
        let mut moved = values.clone();
        moved[j] += LEVER_STEP;
        state.lever.with(&moved)
    }));
    // a change of frequency is each event's own, and what it moves of these derivatives is small
    let run = |lever: &Lever, release: Release| {
        differences(lever, std::iter::once((&effects, release, 0.0)), crossing.pace()).swap_remove(0)
    };
    let per_event = levers.len() + 2;
    problem.prepared.count(order.len() * per_event * steps_of(problem, &state.lever, crossing.pace()));
    let all: Vec<Vec<f64>> = (0..order.len() * per_event)
        .into_par_iter()
        .map(|i| {
            let own = &state.events[order[i / per_event]];
            let mut release = problem.release(own);
            match levers.get(i % per_event) {
                Some(lever) => run(lever, release),
                None if i % per_event == levers.len() => {
                    release.amplitude *= 1.0 + LEVER_STEP;
                    run(&state.lever, release)
                }
                None => {
                    release.lead_s -= ONSET_STEP * problem.cut.interval_s;
                    run(&state.lever, release)
                }
            }
        })
        .collect();
    let mut signals = Signals::with_capacity(problem.cut.samples, all.len());
    all.iter().for_each(|signal| signals.push(signal));
    signals.whiten(whitener);
    let quotients = |(mut signals, event): (Signals, &usize)| {
        let amplitude = state.events[*event].amplitude;
        let mut steps = vec![LEVER_STEP; lever_steps];
        steps.extend([LEVER_STEP * amplitude, ONSET_STEP * problem.cut.interval_s]);
        signals.quotients(&steps);
        CrossedSlopes { signals, amplitude }
    };
    signals.split(per_event).into_iter().zip(&order).map(quotients).collect()
}
