//! A zero that wanders.

use std::sync::Arc;

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// `y = q + s P1 + b P2 + t P3`, Legendre polynomials in the place within the stretch that was learnt from; before and
/// behind it their tangents.
pub struct BaselineDrift;

const ABOUT: About = About {
    id: "baseline-drift",
    physics: "temperature or charge moves the zero of the sensor slowly over the record",
    part: Part::Record,
    needs: &[Need::Run, Need::OneRun],
    parameters: &[
        Parameter {
            name: "slope",
            unit: "V",
            meaning: "half the rise of the straight line over the record",
            low: -1e6,
            high: 1e6,
        },
        Parameter { name: "bend", unit: "V", meaning: "weight of the second polynomial", low: -1e6, high: 1e6 },
        Parameter { name: "twist", unit: "V", meaning: "weight of the third", low: -1e6, high: 1e6 },
    ],
    class: &["baseline-drift"],
    resembles: "offset: constant; a spurious line of less than one period in the record",
    next_measurement: "record without input as long: the drift stays",
    identifiable: Identifiable::Shape,
    source: "L. Ljung, System Identification, 2nd ed., 1999, section 14.1",
};

impl Cause for BaselineDrift {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (slope, bend, twist) = (values[0], values[1], values[2]);
        effects.added.push(Arc::new(move |instant| {
            let place = 2.0 * instant.place - 1.0;
            let x = place.clamp(-1.0, 1.0);
            let inside = slope * x + bend * (1.5 * x * x - 0.5) + twist * (2.5 * x * x - 1.5) * x;
            let rise = slope + 3.0 * bend * x + twist * (7.5 * x * x - 1.5);
            inside + rise * (place - x)
        }));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        let size = 0.01 * scene.level_v;
        vec![vec![size, 0.0, 0.0], vec![0.0, size, 0.0], vec![0.0, 0.0, size]]
    }
}
