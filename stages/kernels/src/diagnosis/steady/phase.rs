//! The phase of the oscillation, sample by sample.

use std::f64::consts::TAU;
use std::ops::Range;

use crate::c64;
use crate::harmonics::{HarmonicOptions, fit_harmonics};
use crate::signal::{RealTransform, hann};

use super::NotSteady;

/// Periods of a record at least: four blocks of four.
const LEAST_PERIODS: usize = 16;
/// Periods from which the phase is followed; below, one frequency is fitted to the record.
const FOLLOWED: f64 = 400.0;
/// Amplitude of a line at half the strongest frequency from which it is the fundamental: a detector near the extremum
/// of its fringe doubles the frequency, while a period doubling of a motion begins small.
const HALF: f64 = 0.1;
/// Standard deviations of the filter's response in time that are dropped at the ends: `exp(-18)` is left of the jump
/// from the record's end to its start.
const ENDS: f64 = 6.0;

/// The oscillation's phase over the stretch where it is known.
pub(super) struct Track {
    /// First sample of the record that has a phase.
    pub first: usize,
    /// rad.
    pub phase: Vec<f64>,
    /// Amplitude of the filtered fundamental; empty where one frequency was fitted.
    pub envelope: Vec<f64>,
    /// Mean frequency, cycles per sample.
    pub frequency: f64,
    /// Standard deviation of the Gaussian filter, cycles per sample; 0 where one frequency was fitted.
    pub bandwidth: f64,
}

impl Track {
    /// Phase and amplitude, that relative to its mean, of a stretch; the amplitude is one where it was not followed.
    pub fn stretch(&self, range: &Range<usize>) -> Vec<(f64, f64)> {
        let phase = self.phase.get(range.clone()).unwrap_or(&[]);
        match self.envelope.get(range.clone()) {
            Some(envelope) if !envelope.is_empty() => {
                let mean = envelope.iter().sum::<f64>() / envelope.len() as f64;
                phase.iter().zip(envelope).map(|(phase, a)| (*phase, a / mean.max(f64::MIN_POSITIVE))).collect()
            }
            _ => phase.iter().map(|phase| (*phase, 1.0)).collect(),
        }
    }
}

/// Follows the phase of the fundamental of `y`, whose mean is zero.
///
/// # Method
/// Strongest line under a Hann window, or half of it; a Gaussian about it in the transform, positive frequencies only;
/// argument and absolute value of the analytic signal. The filter's width is a 200th of the frequency, wider where that
/// is not 20 bins, and never more than a 20th of the frequency, an eighth of the distance to half the sample rate.
pub(super) fn track(y: &[f64]) -> Result<Track, NotSteady> {
    let start = fundamental(y)?;
    let samples = y.len() as f64;
    let bandwidth = (start / 200.0).max(20.0 / samples).min(start / 20.0).min((0.5 - start) / 8.0);
    if start * samples < FOLLOWED || bandwidth * samples < 10.0 {
        return one_frequency(y, start);
    }
    let plan = RealTransform::new(y.len());
    let mut bins = plan.forward(y.iter().copied());
    for (k, bin) in bins.iter_mut().enumerate() {
        let off = (k as f64 / samples - start) / bandwidth;
        *bin *= (-0.5 * off * off).exp() / samples;
    }
    let quadrature = plan.inverse(bins.iter().map(|bin| bin * c64::new(0.0, -1.0)).collect());
    let in_phase = plan.inverse(bins);
    let ends = (ENDS / (TAU * bandwidth)).ceil() as usize;
    if 2 * ends >= y.len() {
        return Err(NotSteady::TooShort { periods: start * samples });
    }
    let inside = ends..y.len() - ends;
    let analytic: Vec<c64> = inside.filter_map(|k| Some(c64::new(*in_phase.get(k)?, *quadrature.get(k)?))).collect();
    let mut phase = Vec::with_capacity(analytic.len());
    let turn = c64::from_polar(1.0, -TAU * start);
    let mut now = analytic.first().map_or(0.0, |z| z.arg());
    phase.push(now);
    for pair in analytic.windows(2) {
        let [before, after] = pair else { continue };
        now += TAU * start + (after * before.conj() * turn).arg();
        phase.push(now);
    }
    let turns = (now - phase.first().copied().unwrap_or(0.0)) / TAU;
    let frequency = turns / (phase.len().max(2) - 1) as f64;
    Ok(Track { first: ends, phase, envelope: analytic.iter().map(|z| z.norm()).collect(), frequency, bandwidth })
}

/// One frequency for the record.
fn one_frequency(y: &[f64], near: f64) -> Result<Track, NotSteady> {
    let options = HarmonicOptions { near_hz: Some(near), ..HarmonicOptions::default() };
    let fit = fit_harmonics(y, 1.0, &options).map_err(|_| NotSteady::NoLine)?;
    let frequency = fit.frequency_hz;
    if !(frequency > 0.0 && frequency < 0.5) {
        return Err(NotSteady::NoLine);
    }
    let start = fit.harmonics.first().map_or(0.0, |first| first.phase_rad);
    let phase = (0..y.len()).map(|k| start + TAU * frequency * k as f64).collect();
    Ok(Track { first: 0, phase, envelope: Vec::new(), frequency, bandwidth: 0.0 })
}

/// Frequency of the fundamental, cycles per sample.
fn fundamental(y: &[f64]) -> Result<f64, NotSteady> {
    let plan = RealTransform::new(y.len());
    let power = plan.power(y.iter().zip(hann(y.len(), 0.5)).map(|(y, w)| w * y));
    let strongest = |from: usize, to: usize| {
        let range = power.get(from..=to.min(power.len().saturating_sub(2)))?;
        let (at, _) = range.iter().enumerate().max_by(|a, b| a.1.total_cmp(b.1))?;
        Some(from + at)
    };
    let of = |k: usize| power.get(k).copied().unwrap_or(0.0);
    // a drift of the level is no oscillation: it lies below the least number of periods
    let peak = strongest(LEAST_PERIODS / 2, power.len()).ok_or(NotSteady::NoLine)?;
    if of(peak) <= 0.0 {
        return Err(NotSteady::NoLine);
    }
    // a frequency that wanders is broader than a bin
    let half = peak / 2;
    let width = 2 + peak / 400;
    let line = strongest(half.saturating_sub(width), half + width)
        .filter(|&k| k >= LEAST_PERIODS && of(k) > HALF * HALF * of(peak) && k.abs_diff(half) < width);
    let chosen = line.unwrap_or(peak);
    if chosen < LEAST_PERIODS {
        return Err(NotSteady::TooShort { periods: chosen as f64 });
    }
    Ok((chosen as f64 + offset(&power, chosen)) / y.len() as f64)
}

/// Place of a peak between bins, by the parabola through the logarithms of three.
fn offset(power: &[f64], k: usize) -> f64 {
    let at = |j: usize| power.get(j).copied().unwrap_or(0.0).max(f64::MIN_POSITIVE).ln();
    let (below, here, above) = (at(k.saturating_sub(1)), at(k), at(k + 1));
    let bend = below - 2.0 * here + above;
    let place = 0.5 * (below - above) / bend;
    if place.is_finite() { place.clamp(-0.5, 0.5) } else { 0.0 }
}

/// Where a frequency is seen after sampling, cycles per sample, 0 to 0.5.
pub(super) fn alias(frequency: f64) -> f64 {
    let rest = frequency.abs().fract();
    rest.min(1.0 - rest)
}
