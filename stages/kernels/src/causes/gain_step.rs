//! A detector or amplifier whose gain jumps.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// From an instant on the signal is `1 + change` times as large. Under a measured input only: in a free decay a loss that
/// is larger for a while leaves the same.
pub struct GainStep;

const ABOUT: About = About {
    id: "gain-step",
    physics: "a contact, a range switch or the light changes within the record: the gain of detector or amplifier jumps",
    part: Part::Detector,
    needs: &[Need::Input, Need::OneChannel, Need::OneRun, Need::ShortRun],
    parameters: &[
        Parameter { name: "change", unit: "1", meaning: "relative change of the gain", low: -0.9, high: 10.0 },
        Parameter {
            name: "time_s",
            unit: "s",
            meaning: "when it changes, from the record's first sample",
            low: 0.0,
            high: 1e9,
        },
    ],
    class: &["gain-step"],
    resembles: "a system that changes: frequency and loss change as well; baseline-drift: adds to the signal, does not scale it",
    next_measurement: "a constant signal of known size through the same chain over the same time",
    identifiable: Identifiable::Shape,
    source: "M. Basseville, I. V. Nikiforov, Detection of Abrupt Changes, 1993, chapter 2",
};

/// Times that are tried; the best is refined.
const TIMES: usize = 12;

impl Cause for GainStep {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (change, time_s) = (values[0], values[1]);
        effects.optics.push(Passage::path(move |times, samples| {
            let first = times.partition_point(|time| *time < time_s);
            samples[first..].iter_mut().for_each(|value| *value *= 1.0 + change);
        }));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let time_s = |i: usize| scene.begin_s + scene.window_s * (i + 1) as f64 / (TIMES + 1) as f64;
        (0..TIMES).map(|i| vec![0.01, time_s(i)]).collect()
    }

    fn sets_in(&self) -> Option<usize> {
        Some(1)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::pass;

    #[test]
    fn the_gain_jumps_at_its_time_in_the_record() {
        let mut effects = Effects::default();
        GainStep.add(&[0.1, 0.55], &mut effects);
        // a stretch that begins half a second into its record
        let mut values = vec![2.0; 3];
        pass(&effects.optics, |k| 0.5 + 0.04 * k as f64, &mut values);
        assert_eq!(values, [2.0, 2.0, 2.2]);
    }
}
