//! A coupling capacitor: the free level sinks as what was measured before adds up.

use std::f64::consts::TAU;

use super::free_level::{FEWEST_RECORDS, FreeLevel, FreeRecord, HeldOut};
use super::position::Candidate;
use super::replicates::{Weighted, t_test, weighted_mean_and_error};
use super::sign::{RecordSign, gain, value};

/// A high-pass of first order, alike in all records.
///
/// # Model
/// `y = x - s`, `s' = w x - w s = w y`: while the lever is free (`x` constant) `y` falls by `w` times the integral of `y` itself, which holds the whole record
/// before, contact and rupture included. No start value is needed: it is in the stretch's offset.
/// # Method
/// The factor of that integral in each record, a t test over records; it must be negative.
pub(super) fn droop(level: &FreeLevel) -> Option<Candidate> {
    let factors = factors(&level.records.iter().collect::<Vec<_>>());
    if factors.len() < FEWEST_RECORDS {
        return None;
    }
    let (factor, error) = weighted_mean_and_error(&factors);
    if factor.is_nan() || factor >= 0.0 {
        return None;
    }
    let halves = [1, 0].map(|other| weighted_mean_and_error(&self::factors(&level.half(other))).0);
    let held_out =
        HeldOut::new(level, |parity, record| Some(record.integral_vs.iter().map(|i| halves[parity] * i).collect()));
    let (before, after) = held_out.rms();
    let sign = RecordSign {
        id: "ac-coupling",
        p_value: t_test(&factors),
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

fn factors(records: &[&FreeRecord]) -> Vec<Weighted> {
    records.iter().filter_map(|record| record.factor(&record.integral_vs, &[])).collect()
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
