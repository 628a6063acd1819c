//! A coupling capacitor: the free level sinks as what was measured before adds up.

use std::f64::consts::TAU;

use super::free_level::{FEWEST_RECORDS, FreeLevel, FreeRecord, HeldOut};
use super::position::Candidate;
use super::replicates::{Weighted, t_test, weighted_mean_and_error};
use super::sign::{RecordSign, gain, value};

/// A high-pass of first order, alike in all records.
///
/// # Model
/// `y = x - s`, `s' = w x - w s = w y`: while the lever is free (`x` constant) `y` falls by `w` times the integral of
/// `y` itself, which holds the whole record before, contact and rupture included. No start value is needed: it is in
/// the stretch's offset.
/// # Method
/// The factor of that integral in each record, a t test over records; it must be negative.
pub(super) fn droop(level: &FreeLevel) -> Option<Candidate> {
    let all: Vec<&FreeRecord> = level.records.iter().collect();
    // a drift of each record's own costs the weak their curvature and takes the wander off the strong: whichever is
    // surer
    let ways = [false, true].map(|drifting| (drifting, factors(&all, drifting)));
    let error = |factors: &[Weighted]| weighted_mean_and_error(factors).1;
    let surer = ways.iter().filter(|(_, factors)| factors.len() >= FEWEST_RECORDS);
    let (drifting, factors) = surer.min_by(|a, b| error(&a.1).total_cmp(&error(&b.1)))?;
    let (factor, error) = weighted_mean_and_error(factors);
    if factor.is_nan() || factor >= 0.0 {
        return None;
    }
    let halves = [1, 0].map(|other| weighted_mean_and_error(&self::factors(&level.half(other), *drifting)).0);
    let held_out =
        HeldOut::new(level, |parity, record| Some(record.integral_vs.iter().map(|i| halves[parity] * i).collect()));
    let (before, after) = held_out.rms();
    let sign = RecordSign {
        id: "ac-coupling",
        p_value: (2.0 * t_test(factors)).min(1.0),
        parameters: vec![("corner_hz", value(-factor / TAU, error / TAU, "Hz"))],
        evidence: format!(
            "the free level sinks with the integral of the deflection, by {:.3} of it a second, alike in {} records",
            -factor,
            level.records.len()
        ),
        gain: gain(before, after, "free stretches of the other half of the records"),
        runner_up: None,
        tied: false,
    };
    Some(Candidate { sign, held_out, columns: Box::new(|record| vec![record.integral_vs.clone()]) })
}

fn factors(records: &[&FreeRecord], drifting: bool) -> Vec<Weighted> {
    let lower = |record: &FreeRecord| if drifting { vec![record.time_s.clone()] } else { Vec::new() };
    records.iter().filter_map(|record| record.factor(&record.integral_vs, &lower(record))).collect()
}

/// The signal before a coupling capacitor of that corner, but for a constant.
///
/// `x = y + w (sum of y so far)`, by the trapezoidal rule.
pub fn without_droop(values: &[f64], corner_hz: f64, interval_s: f64) -> Vec<f64> {
    let rate = TAU * corner_hz * interval_s;
    let mut sum = 0.0;
    let restored = values.iter().map(|y| {
        sum += y;
        y + rate * (sum - 0.5 * y)
    });
    restored.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_step_is_flat_again() {
        let (corner, interval) = (20.0, 1e-4);
        // a unit step behind s / (s + w), in closed form
        let step: Vec<f64> = (0..500).map(|k| (-TAU * corner * interval * f64::from(k)).exp()).collect();
        let restored = without_droop(&step, corner, interval);
        // the trapezoidal rule: (w dt)^2 / 12 of the droop; its first sample counts half
        let level = restored[0];
        assert!(restored.iter().all(|x| (x - level).abs() < 2e-5), "{:?}", &restored[490..]);
    }
}
