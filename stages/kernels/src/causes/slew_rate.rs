//! An amplifier that follows only so fast.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// `abs(y') <= 1 / inverse_rate`: behind a faster signal the amplifier lags until it has caught up.
pub struct SlewRate;

const ABOUT: About = About {
    id: "slew-rate",
    physics: "a stage of the amplifier charges a capacitor with a limited current: it follows no faster than so many volts \
              per second",
    part: Part::Detector,
    needs: &[Need::Run, Need::OneChannel, Need::ShortRun],
    parameters: &[Parameter {
        name: "inverse_rate",
        unit: "s/V",
        meaning: "time that a change by 1 V takes at least",
        low: 0.0,
        high: 1e9,
    }],
    class: &["slew-rate"],
    resembles: "output-saturation: limits large outputs, slow ones too; quadratic-damping: changes the motion itself",
    next_measurement: "the same amplitude at half the frequency: the flanks are no longer straight",
    identifiable: Identifiable::Shape,
    source: "P. R. Gray et al., Analysis and Design of Analog Integrated Circuits, 5th ed., 2009, section 9.6",
};

/// Steps between samples: the flank's beginning is missed by an eighth of one.
const STEPS: usize = 8;
/// Samples that the signal between two of them is drawn through, three on either side.
const NEAR: usize = 6;

/// Weights of `NEAR` samples in the value at `place`, counted in samples from the first: Lagrange's polynomial.
fn weights(place: f64) -> [f64; NEAR] {
    std::array::from_fn(|i| {
        let others = (0..NEAR).filter(|j| *j != i);
        others.map(|j| (place - j as f64) / (i as f64 - j as f64)).product()
    })
}

/// The samples of what follows a signal by at most `step` in each of [`STEPS`] steps between two of them.
fn followed(step: f64, samples: &mut [f64]) {
    let Some(last) = samples.len().checked_sub(NEAR) else { return };
    let signal = samples.to_vec();
    let at = |before: usize| -> [[f64; NEAR]; STEPS] {
        std::array::from_fn(|i| weights(before as f64 + (i + 1) as f64 / STEPS as f64))
    };
    let tables: Vec<[[f64; NEAR]; STEPS]> = (0..NEAR).map(at).collect();
    let mut seen = signal[0];
    for (k, sample) in samples.iter_mut().enumerate().skip(1) {
        let first = (k - 1).saturating_sub(NEAR / 2 - 1).min(last);
        let near = &signal[first..first + NEAR];
        for weights in &tables[k - 1 - first] {
            let target: f64 = near.iter().zip(weights).map(|(value, weight)| value * weight).sum();
            seen += (target - seen).clamp(-step, step);
        }
        *sample = seen;
    }
}

impl Cause for SlewRate {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let inverse_rate = values[0];
        effects.optics.push(Passage::path(move |times, samples| {
            if let ([first, .., last], true) = (times, inverse_rate > 0.0) {
                let interval_s = (last - first) / (times.len() - 1) as f64;
                followed(interval_s / STEPS as f64 / inverse_rate, samples);
            }
        }));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        // shares of the largest rate of the mode that the signal may follow
        let hz = scene.frequency_hz.first().copied().unwrap_or(0.05 / scene.interval_s);
        let rate = std::f64::consts::TAU * hz * scene.level_v;
        [1.1, 0.85, 0.65, 0.45].iter().map(|share| vec![1.0 / (share * rate)]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::pass;

    fn through(inverse_rate: f64, interval_s: f64, signal: impl Fn(f64) -> f64) -> Vec<f64> {
        let mut effects = Effects::default();
        SlewRate.add(&[inverse_rate], &mut effects);
        let mut values: Vec<f64> = (0..200).map(|k| signal(f64::from(k) * interval_s)).collect();
        pass(&effects.optics, |k| k as f64 * interval_s, &mut values);
        values
    }

    #[test]
    fn a_slow_signal_passes_and_a_fast_one_makes_a_triangle() {
        let sine = |t: f64| (20.0 * t).sin();
        for (k, value) in through(1.0 / 21.0, 0.01, sine).iter().enumerate() {
            // Lagrange's polynomial and the last step of a sine near the limit
            assert!((value - sine(k as f64 * 0.01)).abs() < 2e-3, "{k}: {value}");
        }
        let slow = through(1.0 / 5.0, 0.01, sine);
        let steps: Vec<f64> = slow.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
        assert!(steps.iter().all(|step| *step < 0.05 + 1e-12));
        // all but the reversals are flanks at the limit
        assert!(steps.iter().filter(|step| **step > 0.05 - 1e-12).count() > 150);
    }

    #[test]
    fn the_samples_do_not_depend_on_how_densely_they_lie() {
        let sine = |t: f64| (20.0 * t).sin();
        let coarse = through(1.0 / 14.0, 0.02, sine);
        let fine = through(1.0 / 14.0, 0.02 / 16.0, sine);
        for (k, value) in fine.iter().step_by(16).enumerate() {
            // a step of the coarse one is 0.05 rad: half its square
            assert!((value - coarse[k]).abs() < 2e-3, "{k}: {value} {}", coarse[k]);
        }
    }

    #[test]
    fn no_limit_changes_nothing() {
        let sine = |t: f64| (20.0 * t).sin();
        let samples = through(0.0, 0.01, sine);
        assert!(samples.iter().enumerate().all(|(k, value)| *value == sine(k as f64 * 0.01)));
    }
}
