//! A curve between two linear systems.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// Numbers of a static curve between linear parts.
pub(super) const CURVE: &[Parameter] = &[
    Parameter {
        name: "bend",
        unit: "1",
        meaning: "departure of the curve from a straight line over what it passes, both rms; simulated as a cubic \
                  of a signal of size 1",
        low: 0.0,
        high: 1.0,
    },
    Parameter { name: "poles_before", unit: "1", meaning: "poles before the curve", low: 0.0, high: 20.0 },
    Parameter { name: "poles_behind", unit: "1", meaning: "poles behind the curve", low: 0.0, high: 20.0 },
];

/// A cubic that bends that much at size 1.
pub(super) fn cubic(bend: f64) -> Passage {
    Passage::map(move |x| x - bend * x * x * x)
}

/// `y = G2 f(G1 u)`.
pub struct WienerHammersteinCurve;

const ABOUT: About = About {
    id: "wiener-hammerstein-curve",
    physics: "a static curve between two parts of the dynamics: an amplifier, a diode, a valve between two filters",
    part: Part::Detector,
    needs: &[Need::Run, Need::OneChannel],
    parameters: CURVE,
    class: &["wiener-hammerstein-curve"],
    resembles: "wiener-curve and hammerstein-curve, where one of the parts is fast",
    next_measurement: "measure between the two parts: what comes before the curve is linear in the input",
    identifiable: Identifiable::Record,
    source: "J. Sjoberg, J. Schoukens, Automatica 48 (2012) 353",
};

impl Cause for WienerHammersteinCurve {
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
