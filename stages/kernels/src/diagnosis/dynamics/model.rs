//! Dynamics with named causes, as a vector of parameters.

use serde::{Deserialize, Serialize};

use super::added::Added;
use super::modal::Modal;
use crate::causes::{Cause, Part};
use crate::effects::Effects;

/// What a stretch has of its own: where its motion begins, where its zero lies.
#[derive(Debug, Clone, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct State {
    /// Deflection and rate / omega of each section at its first sample.
    pub sections: Vec<[f64; 2]>,
    /// Offset of each channel; empty where the model has none.
    pub offsets: Vec<f64>,
}

/// The simulation: linear dynamics, where each stretch starts, and what causes add. In scaled units (see
/// [`Bench`](crate::diagnosis::Bench)).
#[derive(Clone)]
pub struct Model {
    /// The linear part.
    pub dynamics: Modal,
    /// One per stretch that is learnt from.
    pub states: Vec<State>,
    /// The causes, in the order in which they were added.
    pub causes: Vec<Added>,
}

impl Model {
    /// What all causes add together.
    pub fn effects(&self) -> Effects {
        let mut effects = Effects::default();
        self.causes.iter().for_each(|added| added.add(&mut effects));
        effects
    }

    /// Numbers that all stretches share: the dynamics', those of the causes behind.
    pub fn vector(&self) -> Vec<f64> {
        let mut vector = self.dynamics.vector();
        vector.extend(self.causes.iter().flat_map(Added::free_values));
        vector
    }

    /// The model at another vector, kept within the limits of every parameter.
    pub fn at(&self, vector: &[f64]) -> Self {
        let mut next = vector.iter().copied();
        let mut model = Self { dynamics: self.dynamics.at(&mut next), ..self.clone() };
        for added in &mut model.causes {
            let parameters = added.cause.about().parameters;
            for i in added.free() {
                if let (Some(value), Some(parameter)) = (added.values.get_mut(i), parameters.get(i)) {
                    *value = next.next().unwrap_or(*value).clamp(parameter.low, parameter.high);
                }
            }
        }
        model
    }

    /// Numbers that each stretch has of its own.
    pub(crate) fn own_numbers(&self) -> usize {
        self.dynamics.own_numbers()
    }

    /// The model with each stretch's own numbers moved: number `i` of stretch `e` by `by(e, i)`.
    pub(crate) fn moved(&self, by: impl Fn(usize, usize) -> f64) -> Self {
        let mut model = self.clone();
        let orders: Vec<usize> = self.dynamics.sections.iter().map(super::Section::order).collect();
        for (e, state) in model.states.iter_mut().enumerate() {
            let mut i = 0;
            for (x, order) in state.sections.iter_mut().zip(&orders) {
                for value in x.iter_mut().take(*order) {
                    *value += by(e, i);
                    i += 1;
                }
            }
            for value in &mut state.offsets {
                *value += by(e, i);
                i += 1;
            }
        }
        model
    }

    /// Places of a cause's numbers to fit in the vector; empty for a choice.
    pub fn places(&self, cause: usize) -> std::ops::Range<usize> {
        let count = |added: &Added| added.free().count();
        let first = self.dynamics.vector().len() + self.causes.iter().take(cause).map(count).sum::<usize>();
        first..first + self.causes.get(cause).map_or(0, count)
    }

    /// Parameters that describe the system: without its states, with its causes' choices and when they set in.
    pub fn system_parameters(&self) -> usize {
        let held = self.causes.iter().map(|added| added.values.len() - added.free().count()).sum::<usize>();
        self.vector().len() + held
    }

    /// The model with one more cause.
    pub fn with(&self, cause: &'static dyn Cause, modes: &[usize], values: Vec<f64>) -> Self {
        let mut model = self.clone();
        model.causes.push(Added { cause, values, modes: modes.to_vec() });
        model
    }

    /// The model without one of its causes.
    pub fn without(&self, cause: usize) -> Self {
        let mut model = self.clone();
        if cause < model.causes.len() {
            model.causes.remove(cause);
        }
        model
    }

    /// Whether the causes that another has of its input are its own, with the same values.
    pub(crate) fn drives_as(&self, other: &Self) -> bool {
        let acts = |added: &&Added| added.cause.about().part == Part::Input;
        let (own, its) = (self.causes.iter().filter(acts), other.causes.iter().filter(acts));
        own.map(|added| (added.id(), &added.values)).eq(its.map(|added| (added.id(), &added.values)))
    }

    /// Whether it has that cause at that place.
    pub(crate) fn has(&self, cause: &dyn Cause, modes: &[usize]) -> bool {
        self.causes.iter().any(|added| added.is(cause, modes))
    }
}
