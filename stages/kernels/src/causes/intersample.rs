//! An input that does not run between its samples as assumed.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Intersample};

/// The baseline holds the input; `kind` 1: straight lines, 2: the band-limited signal, 3: straight lines between what other
/// causes make of its samples, as a simulator or a digital controller has it.
pub struct IntersampleCause;

const ABOUT: About = About {
    id: "intersample",
    physics: "the input was measured through an anti-alias filter or made without a hold: between samples it does not stay where it was",
    part: Part::Input,
    needs: &[Need::Input],
    parameters: &[Parameter {
        name: "kind",
        unit: "1",
        meaning: "0 held, 1 linear, 2 band-limited, 3 linear behind what acts on each sample",
        low: 0.0,
        high: 3.0,
    }],
    class: &["intersample"],
    resembles: "a delay of half a sample: the same at low frequencies, not near the Nyquist frequency",
    next_measurement: "sample input and output faster: the difference falls with the interval",
    identifiable: Identifiable::Shape,
    source: "J. Schoukens, R. Pintelon, H. Van hamme, Automatica 30 (1994) 1153",
};

impl Cause for IntersampleCause {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let kind = values[0].round() as i64;
        effects.intersample = match kind {
            0 => effects.intersample,
            2 => Some(Intersample::BandLimited),
            _ => Some(Intersample::Linear),
        };
        effects.by_sample |= kind == 3;
    }

    fn trials(&self, _scene: &Scene) -> Vec<Vec<f64>> {
        vec![vec![1.0], vec![2.0], vec![3.0]]
    }
}
