//! What is fitted: lever, causes, and each event's own parameters.

use super::lever::Lever;
use crate::causes::{Cause, Effects};
use crate::model::ringdown::EventParameters;

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
    /// What a further cause changes beside the others, which are small, it changes without them: an approximation of second order that saves most steps.
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
