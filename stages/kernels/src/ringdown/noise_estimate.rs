//! Noise variances from what the fit leaves and from stretches without an event.

use faer::c64;

use super::fitted::Fitted;
use super::modal_form::{Exponential, signal};
use super::noise::{RingdownNoise, ThermalMode, Wander};
use super::normal::Freedom;
use super::records::Records;
use super::search::Point;
use super::whittle::{expected_parts, hann, variances};
use crate::signal::{autocorrelation, mean_periodogram};

/// Thermal motion of every mode and a ladder of wander from the window's own frequency upwards, a decade apart.
pub(super) fn parts_of(exponentials: &[Exponential], white: f64, interval_s: f64, samples: usize) -> RingdownNoise {
    let lowest = std::f64::consts::TAU / (samples as f64 * interval_s);
    let highest = 0.5 / interval_s;
    let wander = (0..12)
        .map(|decade| lowest * 10f64.powi(decade))
        .take_while(|rate| *rate < highest)
        .map(|rate_per_s| Wander { rate_per_s, variance: 0.0 })
        .collect();
    let thermal = exponentials
        .iter()
        .filter(|e| e.oscillates())
        .map(|e| ThermalMode { pole: c64::new(e.pole.re, e.pole.im), variance: 0.0 })
        .collect();
    RingdownNoise { white, thermal, wander }
}

/// Events less their fits; zero in gaps, the rest scaled for `taper` ([`Gaps::apply`](super::gaps::Gaps::apply)).
pub(super) fn residuals(records: &Records<'_>, point: &Point, taper: &[f64]) -> Vec<Vec<f64>> {
    let events = records.events.iter().zip(&point.events).enumerate();
    events
        .map(|(number, (y, own))| {
            let fitted = signal(&point.exponentials, own, records.interval_s, y.len());
            let mut residual: Vec<f64> = y.iter().zip(fitted).map(|(y, s)| y - s).collect();
            records.gaps.apply(number, &mut residual, taper);
            residual
        })
        .collect()
}

/// The noise under which the residuals, what the fit absorbed added back, and the free stretches are likeliest.
///
/// Gaps are cut out of the taper, event by event, and the expected periodogram is that of the same tapers: it stays
/// without bias.
pub(super) fn estimated(
    records: &Records<'_>,
    point: &Point,
    last: &RingdownNoise,
    absorbed: Option<&Fitted>,
    freedom: &Freedom,
) -> RingdownNoise {
    let (samples, interval_s) = (records.samples(), records.interval_s);
    let parts = parts_of(&point.exponentials, last.white, interval_s, samples);
    let taper = hann(samples);
    let residuals = residuals(records, point, &taper);
    let mut observed = mean_periodogram(&residuals, &taper);
    if let Some(fitted) = absorbed {
        let missing = fitted.absorbed(&point.exponentials, freedom, records, &taper);
        observed.iter_mut().zip(missing).for_each(|(o, m)| *o += m);
    }
    let stretches = chunks(records.free, samples);
    let mut lag_weights = records.gaps.lag_weights(&taper);
    if !stretches.is_empty() {
        // events and stretches count by their number
        let (own, other) = (residuals.len() as f64, stretches.len() as f64);
        let quiet = mean_periodogram(&stretches, &taper);
        observed.iter_mut().zip(quiet).for_each(|(o, q)| *o = (own * *o + other * q) / (own + other));
        if records.gaps.any() {
            let whole = autocorrelation(&taper);
            lag_weights.iter_mut().zip(whole).for_each(|(l, w)| *l = (own * *l + other * w) / (own + other));
        }
    }
    likeliest(&observed, &parts, interval_s, &lag_weights)
}

/// Least number of windows in free stretches from which alone the noise is estimated: a quarter of a line's power is
/// its scatter then.
const ALONE: usize = 16;

/// The noise of free stretches alone: what a fit to the events leaves unexplained is not in it. None where they hold
/// too few windows of `samples`.
///
/// Thermal motion at the oscillating ones of `exponentials`, wander and white noise, as in a fit of ringdowns.
pub fn noise_of_stretches(
    free: &[&[f64]],
    samples: usize,
    interval_s: f64,
    exponentials: &[Exponential],
) -> Option<RingdownNoise> {
    let stretches = chunks(free, samples);
    if stretches.len() < ALONE {
        return None;
    }
    let taper = hann(samples);
    let observed = mean_periodogram(&stretches, &taper);
    let white = observed.iter().skip(1).sum::<f64>() / (observed.len() - 1) as f64;
    let parts = parts_of(exponentials, white, interval_s, samples);
    Some(likeliest(&observed, &parts, interval_s, &autocorrelation(&taper)))
}

/// Windows of free stretches, their means taken off.
fn chunks(free: &[&[f64]], samples: usize) -> Vec<Vec<f64>> {
    free.iter()
        .flat_map(|stretch| stretch.chunks_exact(samples))
        .map(|chunk| {
            let mean = chunk.iter().sum::<f64>() / samples as f64;
            chunk.iter().map(|v| v - mean).collect()
        })
        .collect()
}

/// Variances of the parts under which a mean periodogram is likeliest.
fn likeliest(observed: &[f64], parts: &RingdownNoise, interval_s: f64, lag_weights: &[f64]) -> RingdownNoise {
    let unit = expected_parts(parts, interval_s, lag_weights);
    let mean = observed.iter().skip(1).sum::<f64>() / (observed.len() - 1) as f64;
    let first: Vec<f64> = unit
        .iter()
        .enumerate()
        .map(|(i, part)| {
            let peak = part.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            if i == 0 { parts.white.min(mean) } else { 0.1 * mean / peak }
        })
        .collect();
    let mut values = variances(observed, &unit, &first);
    // without white noise the filter has no floor: rounding of the records is always there
    values[0] = values[0].max(1e-6 * mean);
    parts.with_variances(&values)
}
