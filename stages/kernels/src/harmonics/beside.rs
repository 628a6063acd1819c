//! Free decays beside a steady line: hum that is stronger than the ringing.

use num_complex::Complex64;
use std::f64::consts::TAU;

use super::{HarmonicFit, HarmonicOptions, fit_harmonics};
use crate::events::decay::{DecaySearch, DecaySearchError, DecaySearchOptions, FreeDecay, find_decays};

/// Least peak of a decay, in amplitudes of the line: of a drive that is steady to less what is left is none.
const LEAST_PEAK: f64 = 0.2;
/// What is closer to a multiple of the line, relative, is the line's own: its start, its modulation.
const OWN: f64 = 0.03;

/// The decays of a record; where there is nothing but a steady oscillation, those beside it.
///
/// # Model
/// Decays in noise, and a line of one frequency with harmonics throughout the record.
/// # Method
/// As [`find_decays`]. If it finds a steady oscillation and no decay, line and harmonics are fitted to each channel and taken
/// off for a second search. Its decays count if each is larger than a fifth of the line and none is at a multiple of it; the
/// steady oscillation stays among what was found. Ranges are those of the record, in which the line still is.
/// # Errors
/// Those of [`find_decays`].
/// # Source
/// IEEE Std 1057-2017 (sine fit).
pub fn find_decays_beside_lines(
    channels: &[&[f64]],
    sample_rate_hz: f64,
    options: &DecaySearchOptions,
) -> Result<DecaySearch, DecaySearchError> {
    let found = find_decays(channels, sample_rate_hz, options)?;
    let driven = options.trigger.left_out().is_some();
    let Some(steady) = found.steady.first().filter(|_| found.decays.is_empty() && !driven) else { return Ok(found) };
    let line_hz = steady.frequency_hz;
    let near = HarmonicOptions { near_hz: Some(line_hz), ..HarmonicOptions::default() };
    let mut rest: Vec<Vec<f64>> = Vec::with_capacity(channels.len());
    let mut largest = 0.0_f64;
    for values in channels {
        match fit_harmonics(values, sample_rate_hz, &near) {
            Ok(fit) => {
                largest = largest.max(fit.harmonics.first().map_or(0.0, |first| first.amplitude));
                rest.push(without(values, &fit, sample_rate_hz));
            }
            Err(_) => rest.push(values.to_vec()),
        }
    }
    let slices: Vec<&[f64]> = rest.iter().map(Vec::as_slice).collect();
    let second = find_decays(&slices, sample_rate_hz, options)?;
    let own = |frequency_hz: f64| {
        let multiple = frequency_hz / line_hz;
        multiple.round() >= 1.0 && (multiple - multiple.round()).abs() < OWN * multiple
    };
    let large = |peak: f64| peak.abs() >= LEAST_PEAK * largest;
    let beside = !second.decays.is_empty()
        && second
            .decays
            .iter()
            .all(|decay| !own(decay.frequency_hz) && decay.channels.iter().any(|channel| large(channel.peak)));
    match beside {
        true => {
            let steady = found.steady.into_iter().filter(|steady| own(steady.frequency_hz)).collect();
            // in the record the line rings there, too: what came before says nothing of the noise
            let decays = second.decays.into_iter().map(|decay| FreeDecay { quiet: None, ..decay }).collect();
            Ok(DecaySearch { steady, decays, ..second })
        }
        false => Ok(found),
    }
}

/// A channel without its line and harmonics.
fn without(values: &[f64], fit: &HarmonicFit, sample_rate_hz: f64) -> Vec<f64> {
    let step = TAU * fit.frequency_hz / sample_rate_hz;
    let line = |k: usize| -> f64 {
        let of = |h: &super::Harmonic| {
            Complex64::from_polar(h.amplitude, h.phase_rad + h.number as f64 * step * k as f64).re
        };
        fit.harmonics.iter().map(of).sum()
    };
    values.iter().enumerate().map(|(k, value)| value - line(k)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    const RATE: f64 = 2000.0;

    /// Three modes from 0.3 s on beside hum of this amplitude at 50 Hz with a third harmonic.
    fn record(ring: f64, hum: f64, seed: u64) -> Vec<f64> {
        let noise = white_noise(6000, 0.02, seed);
        let y = |k: usize| {
            let t = k as f64 / RATE;
            let mode = |[f, z, a]: [f64; 3]| {
                let since = t - 0.3;
                if since < 0.0 { 0.0 } else { a * (-z * TAU * f * since).exp() * (TAU * f * since).sin() }
            };
            let modes = [[36.4, 0.01, 5.0], [97.2, 0.008, 3.0], [188.5, 0.005, 2.0]];
            let hum = hum * ((TAU * 50.0 * t + seed as f64).sin() + 0.2 * (TAU * 150.0 * t).sin());
            ring * modes.map(mode).iter().sum::<f64>() + hum + noise[k]
        };
        (0..6000).map(y).collect()
    }

    #[test]
    fn a_decay_is_found_beside_hum_that_is_as_strong_and_stronger() {
        for (seed, hum) in [(1, 0.5), (2, 3.0), (3, 5.0), (4, 10.0)] {
            let y = record(1.0, hum, seed);
            let found = find_decays_beside_lines(&[&y], RATE, &DecaySearchOptions::default()).unwrap();
            let [decay] = &found.decays[..] else { panic!("hum {hum}: {found:?}") };
            assert!((decay.frequency_hz / 36.4 - 1.0).abs() < 0.01, "hum {hum}: {} Hz", decay.frequency_hz);
            // a period of the slowest mode has 55 samples
            assert!(decay.range.start.abs_diff(600) < 28, "hum {hum}: {:?}", decay.range);
        }
        let y = record(1.0, 5.0, 5);
        assert!(find_decays(&[&y], RATE, &DecaySearchOptions::default()).unwrap().decays.is_empty());
    }

    #[test]
    fn a_line_alone_stays_steady() {
        for seed in 0..20 {
            let y = record(0.0, 3.0, seed);
            let modulated: Vec<f64> =
                y.iter().enumerate().map(|(k, y)| y * (1.0 + 0.1 * (0.003 * k as f64).sin())).collect();
            let begun: Vec<f64> = y.iter().enumerate().map(|(k, y)| if k < 1000 { 0.01 * y } else { *y }).collect();
            for (what, y) in [("steady", y), ("modulated", modulated), ("begun", begun)] {
                let found = find_decays_beside_lines(&[&y], RATE, &DecaySearchOptions::default()).unwrap();
                let first = find_decays(&[&y], RATE, &DecaySearchOptions::default()).unwrap();
                assert_eq!(found.decays.len(), first.decays.len(), "{what}, seed {seed}: {:?}", found.decays);
            }
        }
    }
}
