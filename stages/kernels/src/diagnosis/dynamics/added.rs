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
            *force = seen_from(force.clone(), &self.modes);
        }
    }
}

/// Most modes that a force may see.
const MOST: usize = 8;

/// A force that takes modes `order` for its first, second, ...
fn seen_from(force: ModalForce, order: &[usize]) -> ModalForce {
    // this runs four times a step: nothing is copied where it need not be
    if order.iter().enumerate().all(|(i, mode)| i == *mode) {
        return force;
    }
    match *order {
        [mode] => of_one(force, mode),
        [first, second] => seen(force, [first, second]),
        _ => seen(force, std::array::from_fn::<usize, MOST, _>(|i| order.get(i).copied().unwrap_or(usize::MAX))),
    }
}

fn of_one(force: ModalForce, mode: usize) -> ModalForce {
    let own = mode..mode + 1;
    Arc::new(move |motion, acceleration| {
        let at = |values| <[f64]>::get(values, own.clone());
        if let (Some(position), Some(velocity), Some(omega), Some(acceleration)) =
            (at(motion.position), at(motion.velocity), at(motion.omega), acceleration.get_mut(own.clone()))
        {
            force(&Motion { position, velocity, omega, gap: position[0], thermal: motion.thermal }, acceleration);
        }
    })
}

fn seen<const N: usize>(force: ModalForce, order: [usize; N]) -> ModalForce {
    Arc::new(move |motion, acceleration| {
        let of = |values: &[f64]| order.map(|from| values.get(from).copied().unwrap_or(0.0));
        let (position, velocity, omega) = (of(motion.position), of(motion.velocity), of(motion.omega));
        let gap = position[0];
        let mut own = [0.0; N];
        let seen = Motion { position: &position, velocity: &velocity, omega: &omega, gap, thermal: motion.thermal };
        force(&seen, &mut own);
        for (to, own) in order.into_iter().zip(own) {
            if let Some(a) = acceleration.get_mut(to) {
                *a += own;
            }
        }
    })
}

/// Whether a cause's values are choices: the course of the input between samples.
pub(crate) fn is_choice(cause: &dyn Cause) -> bool {
    cause.about().id == "intersample"
}
