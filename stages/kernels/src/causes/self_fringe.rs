//! An interferometer whose fringe the signal itself runs through.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// `v = A (sin(phi + beta x) - sin phi) / (beta cos phi)` of a deflection x between -1 and 1 at its largest.
pub struct SelfFringe;

const ABOUT: About = About {
    id: "self-fringe",
    physics: "an interferometer's own fringe bends the signal: the deflection is no longer small against the wavelength",
    part: Part::Detector,
    needs: &[Need::Run, Need::OneChannel],
    parameters: &[
        Parameter {
            name: "modulation_depth_rad",
            unit: "rad",
            meaning: "phase by which the largest deflection moves along the fringe",
            low: 0.0,
            high: 3.83,
        },
        Parameter {
            name: "phase_rad",
            unit: "rad",
            meaning: "place on the fringe at rest, from the steepest point",
            low: -std::f64::consts::FRAC_PI_2,
            high: std::f64::consts::FRAC_PI_2,
        },
        Parameter { name: "fringe_amplitude_v", unit: "V", meaning: "amplitude of the fringe", low: 0.0, high: 1e3 },
    ],
    class: &["self-fringe"],
    resembles: "quadratic-detector and cubic-detector, where the depth is small: the fourth harmonic tells them apart",
    next_measurement: "shift the fibre by an eighth of the wavelength: even and odd harmonics change places",
    identifiable: Identifiable::Record,
    source: "D. Rugar, H. J. Mamin, P. Guethner, Appl. Phys. Lett. 55 (1989) 2588",
};

impl Cause for SelfFringe {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (depth, phase, amplitude) = (values[0], values[1], values[2]);
        // the slope at rest stays 1: the curve bends, the gain does not change
        let slope = amplitude * phase.cos();
        if depth > 0.0 && slope > 0.0 {
            effects.optics.push(Passage::map(move |v| amplitude * ((phase + v / slope).sin() - phase.sin())));
        }
    }

    fn trials(&self, _scene: &Scene) -> Vec<Vec<f64>> {
        // the harmonics of a steady oscillation show it, not the fit of a motion
        Vec::new()
    }
}
