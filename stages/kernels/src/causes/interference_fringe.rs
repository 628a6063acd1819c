//! Light that goes round the lever.

use std::sync::Arc;

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// `v += B cos(4 pi z / lambda + phi)`.
pub struct InterferenceFringe;

const ABOUT: About = About {
    id: "interference-fringe",
    physics: "light reflected by the sample interferes with the lever's: the baseline waves with the piezo position",
    part: Part::Record,
    needs: &[Need::Release],
    parameters: &[
        Parameter { name: "amplitude_v", unit: "V", meaning: "amplitude of the wave", low: 0.0, high: 1.0 },
        Parameter { name: "wavelength_m", unit: "m", meaning: "wavelength of the light", low: 3e-7, high: 2e-6 },
        Parameter {
            name: "phase",
            unit: "rad",
            meaning: "phase at the middle of the travel",
            low: -std::f64::consts::TAU,
            high: std::f64::consts::TAU,
        },
    ],
    class: &["interference-fringe"],
    resembles: "piezo-crosstalk: linear in the position; a travel of a fraction of a fringe can't tell the two at low strength",
    next_measurement: "a longer travel, or a lever with a better coating or a source of short coherence: a fringe repeats every half wavelength, or goes",
    identifiable: Identifiable::Record,
    source: "H.-J. Butt, B. Cappella, M. Kappl, Surf. Sci. Rep. 59 (2005) 1, on optical artefacts",
};

impl Cause for InterferenceFringe {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (amplitude, wavelength, phase) = (values[0], values[1], values[2]);
        effects
            .added
            .push(Arc::new(move |at| amplitude * (4.0 * std::f64::consts::PI * at.piezo_m / wavelength + phase).cos()));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let amplitude = 10.0 * scene.noise_v;
        [0.0, std::f64::consts::FRAC_PI_2].map(|phase| vec![amplitude, 6.33e-7, phase]).to_vec()
    }
}
