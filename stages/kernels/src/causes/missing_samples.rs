//! Samples that were never stored.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// Time jumps inside a record. In a run with an input the output's clock jumps: its samples are lost, the input's are not.
pub struct MissingSamples;

const ABOUT: About = About {
    id: "missing-samples",
    physics: "the acquisition drops samples: time jumps",
    part: Part::Record,
    needs: &[Need::OneChannel, Need::OneRun, Need::ShortRun],
    parameters: &[
        Parameter { name: "samples", unit: "1", meaning: "samples lost", low: 1.0, high: 1e6 },
        Parameter { name: "time_s", unit: "s", meaning: "when, since the record's start", low: 0.0, high: 1e9 },
    ],
    class: &["missing-samples"],
    resembles: "finite-rupture, constant-delay: no other effect shifts all phases at once in the middle of an event or a run",
    next_measurement: "a counter or a sine in a spare channel",
    identifiable: Identifiable::No("a jump is not looked for in them"),
    source: "IEEE Std 1057-2017",
};

/// Times that are tried; the best is refined.
const TIMES: usize = 12;

impl Cause for MissingSamples {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        effects.lost.push((values[1], values[0].max(0.0)));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let time_s = |i: usize| scene.begin_s + scene.window_s * (i + 1) as f64 / (TIMES + 1) as f64;
        (0..TIMES).map(|i| vec![1.0, time_s(i)]).collect()
    }

    fn sets_in(&self) -> Option<usize> {
        Some(1)
    }
}
