//! What is fitted: lever, causes, and each event's own parameters.

use super::lever::Lever;
use crate::causes::Cause;
use crate::effects::Effects;
use crate::ringdown::EventParameters;

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
    /// Per event amplitude (V, positive for a load that pulled down), onset (s after its window's release sample: 0 or
    /// less), offset, slope.
    pub events: Vec<EventParameters>,
}

/// A step of everything: lever, then causes; per event amplitude, onset, offset, slope.
pub(super) struct Step {
    pub shared: Vec<f64>,
    pub own: Vec<[f64; 4]>,
    /// Fall of the cost that the linear model promises.
    pub promised: f64,
}

/// Largest relative change of a cause's shape parameter in one step.
const STRETCH: f64 = 2.0;

impl State {
    /// Effects of all hypotheses together.
    pub fn effects(&self) -> Effects {
        let mut effects = Effects::default();
        self.hypotheses.iter().for_each(|h| h.cause.add(&h.values, &mut effects));
        effects
    }

    /// Effects of those hypotheses that are linear by themselves.
    ///
    /// What a further cause changes beside the others, which are small, it changes without them: an approximation of
    /// second order that saves most steps.
    pub(super) fn linear_effects(&self) -> Effects {
        let mut effects = Effects::default();
        for hypothesis in &self.hypotheses {
            let mut own = Effects::default();
            hypothesis.cause.add(&hypothesis.values, &mut own);
            if own.are_linear() {
                hypothesis.cause.add(&hypothesis.values, &mut effects);
            }
        }
        effects
    }

    /// Number of the causes' parameters.
    pub(super) fn causes(&self) -> usize {
        self.hypotheses.iter().map(|h| h.values.len()).sum()
    }

    /// The causes' parameters, one after the other.
    pub(super) fn cause_values(&self) -> Vec<f64> {
        self.hypotheses.iter().flat_map(|h| h.values.iter().copied()).collect()
    }

    /// After a step, causes within their limits.
    pub(super) fn moved(&self, step: &Step, hold: Hold) -> Self {
        let mut out = self.clone();
        let mut bent_s = 0.0;
        if hold == Hold::Nothing {
            let values = self.lever.parameters();
            let (lever, causes) = step.shared.split_at(values.len());
            let values: Vec<f64> = values.iter().zip(lever).map(|(v, s)| v + s).collect();
            out.lever = self.lever.with(&values);
            bent_s = self.lever.bent_delay_s(lever, &out.lever);
            let mut causes = causes.iter();
            for hypothesis in &mut out.hypotheses {
                let parameters = hypothesis.cause.about().parameters;
                for (p, (value, parameter)) in hypothesis.values.iter_mut().zip(parameters).enumerate() {
                    let mut goal = *value + causes.next().unwrap_or(&0.0);
                    if p > 0 && *value > 0.0 && parameter.low >= 0.0 {
                        goal = goal.clamp(*value / STRETCH, *value * STRETCH);
                    }
                    *value = goal.clamp(parameter.low, parameter.high);
                }
            }
        }
        for (event, step) in out.events.iter_mut().zip(&step.own) {
            event.amplitude += step[0];
            event.onset_s += step[1] - bent_s;
            event.offset += step[2];
            event.slope += step[3];
        }
        out
    }

    /// Parameters of causes that are at a limit: cause and parameter.
    pub(super) fn at_limit(&self) -> Vec<(usize, usize)> {
        let mut out = Vec::new();
        for (h, hypothesis) in self.hypotheses.iter().enumerate() {
            let parameters = hypothesis.cause.about().parameters;
            for (p, (parameter, value)) in parameters.iter().zip(&hypothesis.values).enumerate() {
                // steps are cut at the limits
                if *value <= parameter.low || *value >= parameter.high {
                    out.push((h, p));
                }
            }
        }
        out
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::causes::built_in;
    use crate::diagnosis::release::LeverMode;

    fn state() -> State {
        let mode = LeverMode { omega: 3e5, quality_factor: 50.0, share: 1.0 };
        let own = EventParameters { amplitude: 0.8, onset_s: -1e-7, offset: 0.0, slope: 0.0 };
        State { lever: Lever { modes: vec![mode], poles: vec![8e6, 1.2e7] }, hypotheses: Vec::new(), events: vec![own] }
    }

    #[test]
    fn a_step_along_the_ridge_of_onset_and_delay_stays_on_it() {
        let before = state();
        let delay = |state: &State| state.lever.poles.iter().map(|p| 1.0 / p).sum::<f64>();
        // poles a tenth and a quarter slower; the onset earlier by what this delays, to first order
        let steps = [-0.1, -0.25];
        let later: f64 = before.lever.poles.iter().zip(steps).map(|(p, step)| -step / p).sum();
        let step =
            Step { shared: vec![0.0, 0.0, steps[0], steps[1]], own: vec![[0.0, -later, 0.0, 0.0]], promised: 0.0 };
        let after = before.moved(&step, Hold::Nothing);
        let sum = |state: &State| state.events[0].onset_s + delay(state);
        // rounding of sums of 1e-7 s; without the second order it would be off by 3e-9 s
        assert!((sum(&after) - sum(&before)).abs() < 1e-20, "{:e}", sum(&after) - sum(&before));
        // with the lever held, a step of the onset is one
        let held = before.moved(&step, Hold::Shared);
        assert_eq!(held.events[0].onset_s, -1e-7 - later);
    }

    #[test]
    fn only_linear_hypotheses_stand_beside_a_screen() {
        let mut state = state();
        for (id, values) in
            [("duffing", vec![1e-3]), ("tether-tail", vec![0.01, 5e-5]), ("quadratic-detector", vec![0.01])]
        {
            state.hypotheses.push(Hypothesis { cause: built_in(id).unwrap(), values });
        }
        let (all, linear) = (state.effects(), state.linear_effects());
        assert!(all.bend_the_motion() && !all.optics.is_empty());
        assert!(!linear.bend_the_motion() && linear.optics.is_empty());
        assert_eq!(linear.decaying_load, all.decaying_load);
        assert_eq!(linear.decaying_load.len(), 1);
    }
}
