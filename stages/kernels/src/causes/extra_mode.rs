//! A resonance that the lever's model does not have.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, ExtraMode};

/// One more pole pair.
pub struct ExtraModeCause;

const ABOUT: About = About {
    id: "extra-mode",
    physics: "another resonance rings along: torsion, holder, a fifth flexural mode",
    part: Part::Lever,
    needs: &[Need::Release],
    parameters: &[
        Parameter { name: "share", unit: "1", meaning: "its share of the static response", low: -0.2, high: 0.2 },
        Parameter { name: "frequency_hz", unit: "Hz", meaning: "its frequency", low: 1e2, high: 1e8 },
        Parameter { name: "quality_factor", unit: "1", meaning: "its quality factor", low: 3.0, high: 1e5 },
    ],
    class: &["extra-mode", "piezo-ring"],
    resembles: "every nonlinearity makes lines that a further mode can follow in part: it must beat them by more",
    next_measurement: "thermal spectrum far from the surface: its peak is there without any event; its sign per event tells torsion",
    identifiable: Identifiable::Shape,
    source: "C. P. Green, J. E. Sader, J. Appl. Phys. 92 (2002) 6262 (torsion)",
};

impl Cause for ExtraModeCause {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        effects.extra_modes.push(ExtraMode { share: values[0], frequency_hz: values[1], quality_factor: values[2] });
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let peaks = scene.residual_peaks_hz.iter().take(4);
        peaks.flat_map(|&f| [30.0, 150.0, 600.0].map(|q| vec![0.002, f, q])).collect()
    }
}
