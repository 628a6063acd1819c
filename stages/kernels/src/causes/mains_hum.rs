//! The mains in the record.

use std::sync::Arc;

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// `A sin(2 pi f t + phi)`, f the mains' frequency.
pub struct MainsHum;

const ABOUT: About = About {
    id: "mains-hum",
    physics: "the mains couples into the readout",
    part: Part::Record,
    needs: &[Need::Release],
    parameters: &[
        Parameter { name: "amplitude_v", unit: "V", meaning: "amplitude", low: 0.0, high: 1.0 },
        Parameter {
            name: "frequency_hz",
            unit: "Hz",
            meaning: "frequency: 50 or 60 Hz or a multiple",
            low: 45.0,
            high: 1e3,
        },
    ],
    class: &["mains-hum"],
    resembles: "baseline-drift: has no line",
    next_measurement: "unplug, move, ground: it goes",
    identifiable: Identifiable::Record,
    source: "H. W. Ott, Electromagnetic Compatibility Engineering, 2009, chapter 3",
};

impl Cause for MainsHum {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (amplitude, frequency) = (values[0], values[1]);
        // the phase differs from record to record, evenly spread by the golden section
        effects.added.push(Arc::new(move |at| {
            amplitude
                * (std::f64::consts::TAU * (frequency * at.time_s + (at.record as f64 * 0.618_033_988_75).fract()))
                    .sin()
        }));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        [50.0, 60.0].map(|mains_hz| vec![3.0 * scene.noise_v, mains_hz]).to_vec()
    }

    fn free_in_each_record(&self) -> usize {
        // its phase, and with that its amplitude
        2
    }
}
