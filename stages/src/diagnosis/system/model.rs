//! An oscillator with named causes, as a vector of parameters.

use super::oscillator::Oscillator;
use crate::causes::Cause;
use afmid_kernels::effects::Effects;

/// A cause with its values.
#[derive(Clone)]
pub struct Added {
    /// Which.
    pub cause: &'static dyn Cause,
    /// In the order of its parameters.
    pub values: Vec<f64>,
}

impl Added {
    /// Its id.
    pub fn id(&self) -> &'static str {
        self.cause.about().id
    }

    /// Whether its values are choices, not numbers to fit.
    pub fn is_choice(&self) -> bool {
        is_choice(self.cause)
    }
}

/// Whether a cause's values are choices: the course of the input between samples.
pub(super) fn is_choice(cause: &dyn Cause) -> bool {
    cause.about().id == "intersample"
}

/// The simulation: an oscillator, where it starts, and what causes add to it. In scaled units (see [`super::Bench`]).
#[derive(Clone)]
pub struct Model {
    /// The linear part.
    pub oscillator: Oscillator,
    /// Deflection and rate / omega at the first sample of the training part.
    pub state: [f64; 2],
    /// Whether the gain counts: false where there is no input.
    pub driven: bool,
    /// The causes, in the order in which they were added.
    pub causes: Vec<Added>,
}

/// Smallest and largest loss that is considered: a Q from a hundred million down to 1/4.
const LOSS: (f64, f64) = (1e-8, 4.0);

impl Model {
    /// What all causes add together.
    pub fn effects(&self) -> Effects {
        let mut effects = Effects::default();
        self.causes.iter().for_each(|added| added.cause.add(&added.values, &mut effects));
        effects
    }

    /// Parameters of the oscillator and its state, those of the causes behind.
    pub fn vector(&self) -> Vec<f64> {
        let mut vector = vec![self.oscillator.frequency_hz, self.oscillator.loss, self.state[0], self.state[1]];
        if self.driven {
            vector.push(self.oscillator.gain);
        }
        vector.extend(self.causes.iter().filter(|added| !added.is_choice()).flat_map(|added| added.values.clone()));
        vector
    }

    /// The model at another vector, kept within the limits of every parameter.
    pub fn at(&self, vector: &[f64]) -> Self {
        let mut model = self.clone();
        let mut next = vector.iter().copied();
        let mut take = |value: &mut f64| *value = next.next().unwrap_or(*value);
        take(&mut model.oscillator.frequency_hz);
        take(&mut model.oscillator.loss);
        take(&mut model.state[0]);
        take(&mut model.state[1]);
        if model.driven {
            take(&mut model.oscillator.gain);
        }
        for added in model.causes.iter_mut().filter(|added| !added.is_choice()) {
            for (value, parameter) in added.values.iter_mut().zip(added.cause.about().parameters) {
                take(value);
                *value = value.clamp(parameter.low, parameter.high);
            }
        }
        model.oscillator.frequency_hz = model.oscillator.frequency_hz.abs().max(f64::MIN_POSITIVE);
        model.oscillator.loss = model.oscillator.loss.clamp(LOSS.0, LOSS.1);
        model
    }

    /// Places of a cause's parameters in the vector; empty for a choice.
    pub fn places(&self, cause: usize) -> std::ops::Range<usize> {
        let count = |added: &Added| if added.is_choice() { 0 } else { added.values.len() };
        let first = self.base() + self.causes.iter().take(cause).map(count).sum::<usize>();
        first..first + self.causes.get(cause).map_or(0, count)
    }

    /// Parameters of the oscillator and its state.
    pub fn base(&self) -> usize {
        4 + usize::from(self.driven)
    }

    /// Parameters that describe the system: without its state, with its causes' choices.
    pub fn system_parameters(&self) -> usize {
        let choices = self.causes.iter().filter(|added| added.is_choice()).count();
        self.vector().len() - 2 + choices
    }

    /// The model with one more cause.
    pub fn with(&self, cause: &'static dyn Cause, values: Vec<f64>) -> Self {
        let mut model = self.clone();
        model.causes.push(Added { cause, values });
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

    /// Whether it has a cause of that id.
    pub fn has(&self, id: &str) -> bool {
        self.causes.iter().any(|added| added.id() == id)
    }
}
