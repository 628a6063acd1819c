//! A readout that forgets its level.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, LinearSection};

/// `D = s / (s + w)`.
pub struct AcCoupling;

const ABOUT: About = About {
    id: "ac-coupling",
    physics: "a coupling capacitor lets slow signals through only in part: levels droop",
    part: Part::Detector,
    needs: &[Need::Release],
    parameters: &[Parameter { name: "corner_hz", unit: "Hz", meaning: "corner of the high-pass", low: 0.0, high: 5e3 }],
    class: &["ac-coupling"],
    resembles: "baseline-drift and tails: those do not droop before the rupture as well",
    next_measurement: "switch the input to DC, or record a longer hold in contact",
    identifiable: Identifiable::Shape,
    source: "P. Horowitz, W. Hill, The Art of Electronics, 3rd ed., chapter 1",
};

impl Cause for AcCoupling {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        if values[0] > 0.0 {
            effects.electronics.push(LinearSection { pole: std::f64::consts::TAU * values[0], low: 0.0, high: 1.0 });
        }
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        [0.03, 0.1, 0.3].map(|share| vec![share / scene.window_s]).to_vec()
    }
}
