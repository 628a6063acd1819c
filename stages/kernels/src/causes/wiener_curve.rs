//! A linear system seen through a curve.

use super::wiener_hammerstein_curve::{CURVE, cubic};
use super::{About, Cause, Identifiable, Need, Part, Scene};
use crate::effects::Effects;

/// `y = f(G u)`.
pub struct WienerCurve;

const ABOUT: About = About {
    id: "wiener-curve",
    physics: "the sensor or the amplifier behind the system is bent: a static curve after all dynamics",
    part: Part::Detector,
    needs: &[Need::Run, Need::OneChannel],
    parameters: CURVE,
    class: &["wiener-curve"],
    resembles: "wiener-hammerstein-curve with a fast part behind the curve; output-cubic: the same beside an oscillator",
    next_measurement: "measure the output by a second sensor: it is straight",
    identifiable: Identifiable::Record,
    source: "M. Schoukens, K. Tiels, Automatica 85 (2017) 272",
};

impl Cause for WienerCurve {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        effects.optics.push(cubic(values[0]));
    }

    fn trials(&self, _scene: &Scene) -> Vec<Vec<f64>> {
        // fitted with the linear parts around it, not beside an oscillator
        Vec::new()
    }
}
