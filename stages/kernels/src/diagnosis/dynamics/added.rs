//! A cause in a model: its values, and the mode that it acts on.

use crate::causes::Cause;
use crate::effects::Effects;

/// A cause with its values.
#[derive(Clone)]
pub struct Added {
    /// Which.
    pub cause: &'static dyn Cause,
    /// In the order of its parameters.
    pub values: Vec<f64>,
    /// The modes that it sees as its first, second, ...; empty: in their own order.
    pub modes: Vec<usize>,
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

    /// Places of its values that are numbers to fit: all but choices and when it sets in, which have no slope.
    pub(crate) fn free(&self) -> impl Iterator<Item = usize> + use<> {
        let held = self.cause.sets_in();
        let count = if self.is_choice() { 0 } else { self.values.len() };
        (0..count).filter(move |i| Some(*i) != held)
    }

    /// Its values that are numbers to fit.
    pub(crate) fn free_values(&self) -> impl Iterator<Item = f64> {
        self.free().filter_map(|i| self.values.get(i).copied())
    }

    /// Whether it is the same cause at the same place.
    pub(crate) fn is(&self, cause: &dyn Cause, modes: &[usize]) -> bool {
        self.id() == cause.about().id && self.modes == modes
    }

    /// Adds its effects.
    pub(super) fn add(&self, effects: &mut Effects) {
        effects.add_at(&self.modes, |effects| self.cause.add(&self.values, effects));
    }
}

/// Whether a cause's values are choices: the course of the input between samples.
pub(crate) fn is_choice(cause: &dyn Cause) -> bool {
    cause.about().id == "intersample"
}
