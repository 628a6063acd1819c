//! A line that is always there.

use std::sync::Arc;

use super::{About, Cause, Domain, Effects, Identifiable, Parameter, Part, Scene};

/// `A sin(2 pi f t + phi)` at any frequency.
pub struct SpuriousLine;

const ABOUT: About = About {
    id: "spurious-line",
    physics: "a switching supply, a monitor or another oscillator couples into the readout",
    part: Part::Record,
    domain: Domain::Release,
    parameters: &[
        Parameter { name: "amplitude_v", unit: "V", meaning: "amplitude", low: 0.0, high: 1.0 },
        Parameter { name: "frequency_hz", unit: "Hz", meaning: "frequency", low: 1e3, high: 1e8 },
    ],
    class: &["spurious-line"],
    resembles: "extra-mode: is not there before the event",
    next_measurement: "a record without any contact: the line stays",
    identifiable: Identifiable::Record,
    source: "H. W. Ott, Electromagnetic Compatibility Engineering, 2009, chapter 3",
};

impl Cause for SpuriousLine {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (amplitude, frequency) = (values[0], values[1]);
        effects.added.push(Arc::new(move |at| {
            amplitude
                * (std::f64::consts::TAU * (frequency * at.time_s + (at.record as f64 * 0.618_033_988_75).fract()))
                    .sin()
        }));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![scene.noise_v, 0.1 / scene.interval_s]]
    }
}
