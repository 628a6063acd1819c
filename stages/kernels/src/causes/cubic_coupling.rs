//! Two modes that stiffen one another.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ModalForce, PowerLaw, Quantity};

/// `w1^2 c1 q1 q2^2` on the first mode, `w2^2 c2 q1^2 q2` on the second.
pub struct CubicCoupling;

const ABOUT: About = About {
    id: "cubic-coupling",
    physics: "the swing of either mode stretches what the other bends: internal resonance 1:1, or a shift of one \
              mode's frequency by the other",
    part: Part::Lever,
    needs: &[Need::Run, Need::TwoModes],
    parameters: &[
        Parameter {
            name: "c1",
            unit: "1/V^2",
            meaning: "relative change of the first mode's stiffness per square of the second's deflection signal",
            low: -10.0,
            high: 10.0,
        },
        Parameter {
            name: "c2",
            unit: "1/V^2",
            meaning: "relative change of the second mode's stiffness per square of the first's deflection signal",
            low: -10.0,
            high: 10.0,
        },
    ],
    class: &["cubic-coupling"],
    resembles: "duffing: acts on each mode by itself",
    next_measurement: "excite one mode alone, then both: its frequency depends on the other's swing",
    identifiable: Identifiable::Shape,
    source: "A. H. Nayfeh, D. T. Mook, Nonlinear Oscillations, 1979, chapter 6",
};

impl Cause for CubicCoupling {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        use Quantity::Deflection as Q;
        effects.modal_force.extend([
            ModalForce::Power(PowerLaw::new(0, values[0], &[(Q, 0), (Q, 1), (Q, 1)])),
            ModalForce::Power(PowerLaw::new(1, values[1], &[(Q, 0), (Q, 0), (Q, 1)])),
        ]);
    }

    fn is_symmetric(&self) -> bool {
        true
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let c = 0.003 / scene.level_v.powi(2);
        vec![vec![c, c], vec![c, 0.0]]
    }
}
