//! Dry friction.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce};

/// `+ w^2 c sgn(q')` on the first mode.
pub struct CoulombFriction;

const ABOUT: About = About {
    id: "coulomb-friction",
    physics: "two surfaces rub: a force of constant size against the motion, so that the envelope falls on a straight line and stops",
    part: Part::Lever,
    needs: &[Need::Mode],
    parameters: &[Parameter {
        name: "c",
        unit: "V",
        meaning: "static deflection that the friction holds",
        low: 0.0,
        high: 10.0,
    }],
    class: &["coulomb-friction"],
    resembles: "a higher loss: decays exponentially at small amplitudes, where friction stops the motion",
    next_measurement: "let it ring until it stops: under friction it stops off zero, within the static deflection that it holds",
    identifiable: Identifiable::Shape,
    source: "T. K. Caughey, A. Vijayaraghavan, Int. J. Non-Linear Mech. 5 (1970) 533",
};

/// Speed at which friction is three quarters of its full size, in units of omega times the deflection that it holds.
const CREEP: f64 = 0.2;

/// By how much more thermal motion rounds: a tanh is an erf stretched by sqrt(pi) / 2, whose normal law has twice the
/// variance.
const ROUNDS: f64 = 1.2533;

impl Cause for CoulombFriction {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let c = values[0];
        effects.modal_force.push(ModalForce::law(move |motion, acceleration| {
            if let (Some(a), Some(v), Some(w)) =
                (acceleration.first_mut(), motion.velocity.first(), motion.omega.first())
            {
                // rounded below a creep of this speed: a jump of the force would stall every integrator. Thermal motion
                // rounds what acts on the mean motion: the mean of erf(v) over a normal spread of v is an erf of a
                // wider one
                let creep = match motion.thermal {
                    0.0 => w * (CREEP * c).abs(),
                    thermal => w * ((CREEP * c).powi(2) + (ROUNDS * thermal).powi(2)).sqrt(),
                };
                if c != 0.0 {
                    *a -= w * w * c * (v / creep).tanh();
                }
            }
        }));
    }

    fn inexact(&self) -> f64 {
        // each event's own thermal motion rounds its friction otherwise than the mean does: some tenths of a per cent
        // are left, of which a linear frequency, a spring and more take their parts
        0.01
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        // a strong one stops the motion within the window, a weak one shows at its end
        [3e-5, 3e-3].map(|share| vec![share * scene.level_v]).to_vec()
    }
}
