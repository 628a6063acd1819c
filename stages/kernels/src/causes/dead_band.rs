//! A sensor that does not see what is small.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// A share of what lies within the band is lost: `y = q - share clamp(q, -width, width)`.
pub struct DeadBand;

const ABOUT: About = About {
    id: "dead-band",
    physics: "the sensor sticks or its amplifier crosses over: a share of what lies within a band around zero is lost",
    part: Part::Detector,
    needs: &[Need::Run, Need::OneChannel],
    parameters: &[
        Parameter { name: "share", unit: "1", meaning: "share that is lost within the band", low: 0.0, high: 2.0 },
        Parameter { name: "width", unit: "V", meaning: "half width of the band", low: 0.0, high: 1e6 },
    ],
    class: &["dead-band"],
    resembles: "input-dead-zone: keeps small inputs from acting, whatever the output; output-cubic: bends large outputs too",
    next_measurement: "move the sensor's zero by a constant: the band stays at the sensor's zero, not at the motion's",
    identifiable: Identifiable::Shape,
    source: "R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed., 2012, chapter 3",
};

impl Cause for DeadBand {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (share, width) = (values[0], values[1].abs());
        effects.optics.push(Passage::map(move |v| v - share * v.max(-width).min(width)));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        [0.03, 0.08, 0.2, 0.4].iter().map(|part| vec![0.1, part * scene.level_v]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_band_is_not_seen_and_the_rest_is_shifted() {
        let mut effects = Effects::default();
        DeadBand.add(&[1.0, 0.2], &mut effects);
        for (q, y) in [(0.1, 0.0), (-0.15, 0.0), (0.5, 0.3), (-0.7, -0.5)] {
            assert!((effects.seen(q) - y).abs() < 1e-15, "{q}");
        }
        let mut none = Effects::default();
        DeadBand.add(&[0.0, 0.2], &mut none);
        assert_eq!(none.seen(0.1), 0.1);
    }
}
