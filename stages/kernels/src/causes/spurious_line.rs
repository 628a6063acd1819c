//! A line that the input does not make.

use std::f64::consts::PI;
use std::sync::Arc;

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// `y = q + amplitude cos(2 pi frequency t + phase)`.
pub struct SpuriousLine;

const ABOUT: About = About {
    id: "spurious-line",
    physics: "mains, a fan or a switching supply couples into the output at a frequency of its own",
    part: Part::Record,
    needs: &[Need::OneRun],
    parameters: &[
        Parameter { name: "amplitude", unit: "V", meaning: "amplitude of the line", low: -1e6, high: 1e6 },
        Parameter { name: "frequency_hz", unit: "Hz", meaning: "its frequency", low: 0.0, high: 1e9 },
        Parameter {
            name: "phase_rad",
            unit: "rad",
            meaning: "its phase at the first sample of the first record",
            low: -100.0,
            high: 100.0,
        },
    ],
    class: &["spurious-line"],
    resembles: "extra-mode: also a line, but it is driven by the input and decays",
    next_measurement: "record without input: the line stays",
    identifiable: Identifiable::Shape,
    source: "R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapter 3",
};

impl Cause for SpuriousLine {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (amplitude, omega, phase) = (values[0], 2.0 * PI * values[1], values[2]);
        // from record to record the phase moves on, evenly spread by the golden section
        let start = move |record: usize| phase + 2.0 * PI * (record as f64 * 0.618_033_988_75).fract();
        effects.added.push(Arc::new(move |at| amplitude * (omega * at.time_s + start(at.record)).cos()));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let peaks = scene.residual_peaks_hz.iter().take(3);
        let phases = [0.0, 0.25, 0.5, 0.75].map(|half_turns| half_turns * PI);
        peaks.flat_map(|&f| phases.map(|phase| vec![0.01 * scene.level_v, f, phase])).collect()
    }

    fn free_in_each_record(&self) -> usize {
        // its phase, and with that its amplitude
        2
    }
}
