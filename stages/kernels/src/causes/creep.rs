//! A piezo actuator that goes on after each step.

use super::{About, Cause, Identifiable, Need, Parameter, Part, Scene};
use crate::effects::{Effects, Passage};

/// `u + share sum_i u / (1 + s time 10^i)`: after a step the actuator goes on by a share of it in each decade of time.
pub struct Creep;

const ABOUT: About = About {
    id: "creep",
    physics: "domains of a piezo actuator turn late: after a step of its drive it goes on as the logarithm of time",
    part: Part::Input,
    needs: &[Need::Input, Need::ShortRun],
    parameters: &[
        Parameter {
            name: "share",
            unit: "1",
            meaning: "share of a step that each decade of time adds",
            low: 0.0,
            high: 1.0,
        },
        Parameter {
            name: "time_s",
            unit: "s",
            meaning: "time constant of the first decade; below it the actuator follows at once",
            low: 1e-9,
            high: 1e6,
        },
    ],
    class: &["creep"],
    resembles: "a slow pole of the system: one decade of it; backlash: a loop as well, of a width that no speed changes",
    next_measurement: "step the drive and wait: the actuator moves on by the same amount in each decade of time",
    identifiable: Identifiable::Shape,
    source: "H. Jung, D.-G. Gweon, Rev. Sci. Instrum. 71 (2000) 1896; K. Kuhnen, P. Krejci, IEEE Trans. Autom. Control \
             54 (2009) 537",
};

/// Decades of time that are followed: from the fastest of an actuator's drive to hours.
const DECADES: i32 = 6;
/// Distances of two values that differ by less than this share are the same.
const SAME: f64 = 1e-6;

/// A first-order lag of a signal that is straight between its values.
struct Lag {
    time_constant_s: f64,
    state: f64,
    /// Share of the state, of the first and of the second value that is left after `distance_s`.
    weights: [f64; 3],
    distance_s: f64,
}

impl Lag {
    /// At rest at zero.
    fn new(time_constant_s: f64) -> Self {
        Self { time_constant_s, state: 0.0, weights: [1.0, 0.0, 0.0], distance_s: 0.0 }
    }

    /// Its state when the signal has run from one value to the next.
    fn after(&mut self, distance_s: f64, from: f64, to: f64) -> f64 {
        if distance_s > 0.0 {
            if (distance_s - self.distance_s).abs() > SAME * distance_s {
                let x = distance_s / self.time_constant_s;
                let left = (-x).exp();
                let mean = -(-x).exp_m1() / x;
                (self.weights, self.distance_s) = ([left, mean - left, 1.0 - mean], distance_s);
            }
            let [own, first, second] = self.weights;
            self.state = own * self.state + first * from + second * to;
        }
        self.state
    }
}

/// The actuator's way under a drive that was zero before: at any other value the slow decades would be a constant that
/// is no creep to see, but an offset.
fn creeping(share: f64, time_s: f64, times: &[f64], drive: &mut [f64]) {
    let (Some(first), Some(begin)) = (drive.first().copied(), times.first().copied()) else { return };
    let mut lags: Vec<Lag> = (0..DECADES).map(|i| Lag::new(time_s * 10f64.powi(i))).collect();
    let (mut before, mut from) = (begin, first);
    for (u, time) in drive.iter_mut().zip(times) {
        let to = *u;
        let crept: f64 = lags.iter_mut().map(|lag| lag.after(time - before, from, to)).sum();
        *u = to + share * crept;
        (before, from) = (*time, to);
    }
}

impl Cause for Creep {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (share, time_s) = (values[0], values[1].abs().max(f64::MIN_POSITIVE));
        effects.input.push(Passage::path(move |times, drive| creeping(share, time_s, times, drive)));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        // a tenth of the record and shorter, down to the samples
        let times = (0..6).map(|i| 0.1 * scene.window_s * 5f64.powi(-i));
        times.filter(|time_s| *time_s > 0.3 * scene.interval_s).map(|time_s| vec![0.02, time_s]).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::effects::pass;

    #[test]
    fn a_step_goes_on_by_the_same_amount_in_each_decade() {
        let mut effects = Effects::default();
        Creep.add(&[0.03, 1e-3], &mut effects);
        let mut drive: Vec<f64> = (0..100_001).map(|k| if k == 0 { 0.0 } else { 1.0 }).collect();
        pass(&effects.input, |k| k as f64 * 1e-4, &mut drive);
        for decade in 0..3 {
            let at = |time_s: f64| drive[(time_s * 1e4).round() as usize];
            let (early, late) = (at(3e-3 * 10f64.powi(decade)), at(3e-2 * 10f64.powi(decade)));
            // the lags' sum ripples about the logarithm by some per cent of a decade's share
            assert!((late - early - 0.03).abs() < 0.003, "{decade}: {}", late - early);
        }
    }

    #[test]
    fn a_lag_follows_a_ramp_exactly_at_any_distance() {
        let (tau, mut coarse, mut fine) = (0.7, Lag::new(0.7), Lag::new(0.7));
        let one = coarse.after(2.0, 0.0, 2.0);
        let mut many = 0.0;
        for k in 0..2000 {
            many = fine.after(1e-3, f64::from(k) * 1e-3, f64::from(k + 1) * 1e-3);
        }
        let exact = 2.0 - tau + tau * (-2.0f64 / tau).exp();
        assert!((one - exact).abs() < 1e-12 && (many - exact).abs() < 1e-9, "{one} {many} {exact}");
        // values at one time are a jump, which takes no time
        assert_eq!(coarse.after(0.0, 2.0, 5.0), one);
    }

    #[test]
    fn without_a_share_nothing_creeps() {
        let mut effects = Effects::default();
        Creep.add(&[0.0, 1e-2], &mut effects);
        let mut drive = vec![0.0, 2.0, -1.0];
        pass(&effects.input, |k| k as f64 * 1e-3, &mut drive);
        assert_eq!(drive, [0.0, 2.0, -1.0]);
    }
}
