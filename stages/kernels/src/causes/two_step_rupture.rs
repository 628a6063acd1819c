//! A contact that lets go twice.

use std::sync::Arc;

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::Effects;

/// `u = -F p` for a while after the first rupture.
pub struct TwoStepRupture;

const ABOUT: About = About {
    id: "two-step-rupture",
    physics: "a second, smaller contact or neck holds on and ruptures a little later",
    part: Part::Force,
    needs: &[Need::Release],
    parameters: &[
        Parameter {
            name: "fraction",
            unit: "1",
            meaning: "share of the load that lets go later",
            low: -0.3,
            high: 0.3,
        },
        Parameter { name: "delay_s", unit: "s", meaning: "how much later", low: 2e-7, high: 1e-3 },
    ],
    class: &["two-step-rupture"],
    resembles: "tether-tail: relaxes smoothly instead of at once",
    next_measurement: "other spots of the sample: delays and shares change from event to event",
    identifiable: Identifiable::Shape,
    source: "H.-J. Butt, B. Cappella, M. Kappl, Surf. Sci. Rep. 59 (2005) 1",
};

impl Cause for TwoStepRupture {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (fraction, delay) = (values[0], values[1]);
        effects.remaining_load.push(Arc::new(move |t| if t < delay { fraction } else { 0.0 }));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        // fifths of a decade from four samples to an eighth of the window, no further apart than a third of the first
        // mode's period: beyond, one delay's ringing is another's with the opposite sign
        let (first, last) = (4.0 * scene.interval_s, scene.window_s / 8.0);
        let period = scene.frequency_hz.iter().copied().fold(f64::INFINITY, f64::min).recip();
        let further = |delay: &f64| Some((delay * 10f64.powf(0.2)).min(delay + period.max(1e-3 * last) / 3.0));
        std::iter::successors(Some(first), further)
            .take_while(|delay| *delay <= last)
            .map(|delay| vec![0.005, delay])
            .collect()
    }
}
