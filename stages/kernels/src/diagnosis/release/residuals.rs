//! What a fit leaves: residuals in volts, whitened, and over time and frequency.

use crate::signal::RealTransform;
use rayon::prelude::*;

use super::problem::Problem;
use super::state::State;
use super::stepper::{Pace, differences};
use crate::ringdown::internals::{LANES, Whitener, signal};
use crate::statistics::chi_square_tail;

/// Residuals of every event, V.
pub fn residuals(problem: &Problem<'_>, state: &State, starts: &[usize]) -> Vec<Vec<f64>> {
    let exponentials = state.lever.release();
    let effects = state.effects();
    let cut = problem.cut;
    let one = |event: usize| {
        let (own, window) = (&state.events[event], &problem.windows[event]);
        let measured = &window.values[starts[event]..starts[event] + cut.samples];
        let centre = 0.5 * (cut.samples.max(2) - 1) as f64;
        let mut plain = *own;
        (plain.offset, plain.slope) = (0.0, 0.0);
        let ringing = signal(&exponentials, &plain, cut.interval_s, cut.samples - cut.before);
        let mut modelled = vec![-own.amplitude; cut.before];
        modelled.extend(ringing);
        if !state.hypotheses.is_empty() {
            let release = problem.release(own);
            let moved = effects.frequency_change(&window.first);
            let change = differences(&state.lever, std::iter::once((&effects, release, moved)), Pace::FINE);
            modelled.iter_mut().zip(change.iter().flatten()).for_each(|(m, c)| *m += c);
        }
        let line = |k: usize| own.offset + own.slope * (k as f64 - centre) / centre;
        measured.iter().zip(modelled).enumerate().map(|(k, (y, m))| y - m - line(k)).collect()
    };
    (0..state.events.len()).into_par_iter().map(one).collect()
}

/// Whitens residuals: unit variance where the noise model holds.
pub fn whitened(problem: &Problem<'_>, residuals: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let whitener = Whitener::new(&problem.noise, problem.cut.interval_s, problem.cut.samples, &[]);
    let mut out = residuals.to_vec();
    out.par_chunks_mut(LANES).for_each(|chunk| {
        let mut lanes: Vec<&mut [f64]> = chunk.iter_mut().map(Vec::as_mut_slice).collect();
        whitener.apply(&mut lanes);
    });
    out
}

/// Sum over the events weighted by their amplitudes, of unit variance where nothing is common to them.
pub fn common(state: &State, whitened: &[Vec<f64>]) -> Vec<f64> {
    let norm = state.events.iter().map(|e| e.amplitude * e.amplitude).sum::<f64>().sqrt().max(f64::MIN_POSITIVE);
    let mut sum = vec![0.0; whitened.first().map_or(0, Vec::len)];
    for (event, values) in state.events.iter().zip(whitened) {
        sum.iter_mut().zip(values).for_each(|(s, v)| *s += event.amplitude / norm * v);
    }
    sum
}

/// A part of the plane of time and frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tile {
    /// Since the release, s.
    pub from_s: f64,
    /// Until then, s.
    pub to_s: f64,
    /// From this frequency on, Hz.
    pub low_hz: f64,
    /// Up to this one, Hz.
    pub high_hz: f64,
    /// Frequency of its strongest line, Hz.
    pub peak_hz: f64,
    /// Energy over what white noise of unit variance has.
    pub excess: f64,
    /// Degrees of freedom.
    pub degrees: usize,
    /// Probability of so much energy in white noise, this tile alone.
    pub p_value: f64,
}

impl Tile {
    /// The same where the noise has `level` times unit variance.
    pub fn against(self, level: f64) -> Self {
        let excess = self.excess / level;
        Self { excess, p_value: chi_square_tail(excess * self.degrees as f64, self.degrees), ..self }
    }
}

/// Frequency bins of a tile.
const BAND: usize = 8;

/// Energy of a white signal over tiles: time in stretches that double, frequency in bands of eight bins.
///
/// Model: a stretch of n samples has n/2 - 1 independent periodogram values, each chi-square with two degrees of
/// freedom.
pub fn tiles(values: &[f64], before: usize, interval_s: f64) -> Vec<Tile> {
    let mut out = Vec::new();
    let (mut from, mut length) = (0usize, 256usize);
    while from + length <= values.len() {
        let spectrum = RealTransform::new(length).forward(values[from..from + length].iter().copied());
        // chi-square with two degrees of freedom
        let power: Vec<f64> = spectrum.iter().map(|z| 2.0 * z.norm_sqr() / length as f64).collect();
        let resolution = 1.0 / (length as f64 * interval_s);
        for first in (1..length / 2).step_by(BAND) {
            let last = (first + BAND).min(length / 2);
            let energy: f64 = power[first..last].iter().sum();
            let peak = (first..last).max_by(|&a, &b| power[a].total_cmp(&power[b])).unwrap_or(first);
            let degrees = 2 * (last - first);
            out.push(Tile {
                from_s: (from as f64 - before as f64) * interval_s,
                to_s: ((from + length) as f64 - before as f64) * interval_s,
                low_hz: first as f64 * resolution,
                high_hz: last as f64 * resolution,
                peak_hz: peak as f64 * resolution,
                excess: energy / degrees as f64,
                degrees,
                p_value: chi_square_tail(energy, degrees),
            });
        }
        from += length;
        length *= 2;
    }
    out
}

/// Frequencies at which a white signal's long-time periodogram stands out, strongest first, Hz.
pub fn peaks(values: &[f64], interval_s: f64, count: usize) -> Vec<f64> {
    let length = values.len() - values.len() % 2;
    if length < 16 {
        return Vec::new();
    }
    let spectrum = RealTransform::new(length).forward(values[..length].iter().copied());
    // resonances that are worth a mode are wider than a bin: three together
    let power: Vec<f64> = spectrum.windows(3).map(|w| w.iter().map(|z| z.norm_sqr()).sum()).collect();
    let mut order: Vec<usize> = (1..power.len().saturating_sub(1)).collect();
    order.sort_by(|&a, &b| power[b].total_cmp(&power[a]));
    let mut chosen: Vec<usize> = Vec::new();
    for k in order {
        if chosen.len() == count {
            break;
        }
        if chosen.iter().all(|&c| c.abs_diff(k) > 8) {
            chosen.push(k);
        }
    }
    chosen.into_iter().map(|k| (k + 1) as f64 / (length as f64 * interval_s)).collect()
}
