//! A converter with uneven steps.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// Error `A sin(2 pi v / period)`.
pub struct AdcNonlinearity;

const ABOUT: About = About {
    id: "adc-nonlinearity",
    physics: "the converter's codes are not evenly spaced: the error repeats with the code",
    part: Part::Record,
    needs: &[Need::Release],
    parameters: &[
        Parameter { name: "amplitude_v", unit: "V", meaning: "amplitude of the error", low: -0.1, high: 0.1 },
        Parameter { name: "period_v", unit: "V", meaning: "volts after which it repeats", low: 1e-4, high: 100.0 },
    ],
    class: &["adc-nonlinearity"],
    resembles: "white noise: it stays below the readout's unless sorted by code",
    next_measurement: "a slow ramp over the full scale, its histogram of codes",
    identifiable: Identifiable::No("sorted by code it takes more crossings of each code than an archive has"),
    source: "W. Kester, The Data Conversion Handbook, 2005, chapter 2",
};

impl Cause for AdcNonlinearity {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (amplitude, period) = (values[0], values[1]);
        effects.optics.push(Passage::map(move |v| v + amplitude * (std::f64::consts::TAU * v / period).sin()));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![0.1 * scene.noise_v, 0.1 * scene.level_v]]
    }
}
