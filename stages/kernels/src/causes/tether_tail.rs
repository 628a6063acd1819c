//! A thread of liquid or polymer that lets go slowly.

use faer::c64;

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{DecayingLoad, Effects};

/// `u = -F p exp(-t / tau)` after the release.
pub struct TetherTail;

const ABOUT: About = About {
    id: "tether-tail",
    physics: "a thread still pulls after the rupture and relaxes exponentially",
    part: Part::Force,
    needs: &[Need::Release],
    parameters: &[
        Parameter {
            name: "fraction",
            unit: "1",
            meaning: "share of the load that the thread holds",
            low: -0.3,
            high: 0.3,
        },
        Parameter { name: "tau_s", unit: "s", meaning: "its relaxation time", low: 4e-7, high: 1e-2 },
    ],
    class: &["tether-tail", "photodiode-tail"],
    resembles: "photodiode-tail: the two commute in a linear chain and are one signal in equal events",
    next_measurement: "thermal spectrum: a tail of the photodiode shows there, one of the force does not",
    identifiable: Identifiable::Shape,
    source: "R. Szoszkiewicz, E. Riedo, Phys. Rev. Lett. 95 (2005) 135502 (water bridges)",
};

impl Cause for TetherTail {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (fraction, tau) = (values[0], values[1]);
        effects.decaying_load.push(DecayingLoad { share: c64::new(fraction, 0.0), rate: c64::new(-1.0 / tau, 0.0) });
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        // thirds of a decade from ten samples to the window's third
        let (first, last) = (10.0 * scene.interval_s, scene.window_s / 3.0);
        let count = (3.0 * (last / first).log10()).floor().max(0.0) as i32;
        (0..=count).map(|i| vec![0.01, first * 10f64.powf(f64::from(i) / 3.0)]).collect()
    }
}
