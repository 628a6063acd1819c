//! A cause in a model: its values, and the mode that it acts on.

use std::sync::Arc;

use crate::causes::Cause;
use crate::effects::{Effects, ModalForce, Motion};

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

    /// Whether it is the same cause at the same place.
    pub(crate) fn is(&self, cause: &dyn Cause, modes: &[usize]) -> bool {
        self.id() == cause.about().id && self.modes == modes
    }

    /// Adds its effects.
    pub(super) fn add(&self, effects: &mut Effects) {
        if self.modes.is_empty() {
            return self.cause.add(&self.values, effects);
        }
        let before = effects.modal_force.len();
        self.cause.add(&self.values, effects);
        for force in &mut effects.modal_force[before..] {
            *force = seen_from(force.clone(), self.modes.clone());
        }
    }
}

/// Most modes that a force may see.
const MOST: usize = 8;

/// A force that takes modes `order` for its first, second, ...
fn seen_from(force: ModalForce, order: Vec<usize>) -> ModalForce {
    Arc::new(move |motion, acceleration| {
        let n = order.len().min(MOST);
        let (mut position, mut velocity, mut omega, mut own) = ([0.0; MOST], [0.0; MOST], [0.0; MOST], [0.0; MOST]);
        for (to, &from) in order.iter().take(n).enumerate() {
            let of = |values: &[f64]| values.get(from).copied().unwrap_or(0.0);
            (position[to], velocity[to], omega[to]) = (of(motion.position), of(motion.velocity), of(motion.omega));
        }
        let seen = Motion {
            position: &position[..n],
            velocity: &velocity[..n],
            omega: &omega[..n],
            gap: position[0],
            thermal: motion.thermal,
        };
        force(&seen, &mut own[..n]);
        for (from, &to) in order.iter().take(n).enumerate() {
            if let Some(a) = acceleration.get_mut(to) {
                *a += own[from];
            }
        }
    })
}

/// Whether a cause's values are choices: the course of the input between samples.
pub(crate) fn is_choice(cause: &dyn Cause) -> bool {
    cause.about().id == "intersample"
}
