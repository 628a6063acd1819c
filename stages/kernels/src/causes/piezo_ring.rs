//! A piezo that rings after the release.

use faer::c64;

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{DecayingLoad, Effects};

/// Base motion at the piezo's resonance, passed on by the modes.
pub struct PiezoRing;

const ABOUT: About = About {
    id: "piezo-ring",
    physics: "the release kicks the piezo stack: its resonance shakes the lever's base",
    part: Part::Force,
    needs: &[Need::Release],
    parameters: &[
        Parameter {
            name: "share",
            unit: "1",
            meaning: "amplitude of the equivalent load over the load",
            low: -0.2,
            high: 0.2,
        },
        Parameter { name: "frequency_hz", unit: "Hz", meaning: "resonance of the piezo", low: 1e2, high: 1e7 },
        Parameter { name: "quality_factor", unit: "1", meaning: "its quality factor", low: 3.0, high: 1e4 },
    ],
    class: &["piezo-ring", "extra-mode"],
    resembles: "extra-mode: the same frequency, another phase",
    next_measurement: "tap the piezo with a voltage step far from the surface: its resonance shows without any event",
    identifiable: Identifiable::Shape,
    source: "D. Croft, G. Shed, S. Devasia, J. Dyn. Syst. Meas. Control 123 (2001) 35",
};

impl Cause for PiezoRing {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (share, omega, quality) = (values[0], std::f64::consts::TAU * values[1], values[2]);
        // sin is the real part of -i exp(i ...)
        effects
            .decaying_load
            .push(DecayingLoad { share: c64::new(0.0, -share), rate: c64::new(-0.5 * omega / quality, omega) });
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let peaks = scene.residual_peaks_hz.iter().take(4);
        peaks.flat_map(|&f| [20.0, 100.0].map(|q| vec![0.002, f, q])).collect()
    }
}
