//! Carriers that arrive late.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, LinearSection};

/// `D = (1 - a) + a / (1 + s tau)`.
pub struct PhotodiodeTail;

const ABOUT: About = About {
    id: "photodiode-tail",
    physics: "part of the light is absorbed deep in the photodiode: its carriers diffuse and arrive late",
    part: Part::Detector,
    needs: &[Need::Release],
    parameters: &[
        Parameter { name: "fraction", unit: "1", meaning: "share of the late carriers", low: -0.3, high: 0.3 },
        Parameter { name: "tau_s", unit: "s", meaning: "their time constant", low: 4e-7, high: 1e-2 },
    ],
    class: &["photodiode-tail", "tether-tail"],
    resembles: "tether-tail: the two commute in a linear chain and are one signal in equal events",
    next_measurement: "thermal spectrum, or a modulated laser: a tail of the photodiode shows there, one of the force does not",
    identifiable: Identifiable::Shape,
    source: "S. M. Sze, Physics of Semiconductor Devices, 3rd ed., chapter 13",
};

impl Cause for PhotodiodeTail {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (fraction, tau) = (values[0], values[1]);
        effects.electronics.push(LinearSection { pole: 1.0 / tau, low: 1.0, high: 1.0 - fraction });
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        // thirds of a decade from ten samples to the window's third
        let (first, last) = (10.0 * scene.interval_s, scene.window_s / 3.0);
        let count = (3.0 * (last / first).log10()).floor().max(0.0) as i32;
        (0..=count).map(|i| vec![0.01, first * 10f64.powf(f64::from(i) / 3.0)]).collect()
    }
}
