//! Whether an input is one sine: then nothing is known of the system elsewhere.

use std::f64::consts::TAU;

use faer::Mat;

use crate::linear_algebra::{least_squares, product};
use crate::signal::{hann, mean_periodogram};
use crate::statistics::f_tail;

/// An input that is one sine.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SingleSine {
    /// Its frequency in cycles per sample.
    pub cycles_per_sample: f64,
    /// Share of the input's energy, level and slope taken off, that it leaves.
    pub rest: f64,
    /// Probability that noise makes what follows the rest of the input in the output.
    pub p_value: f64,
}

/// Share of the energy up to which the rest beside a sine may be noise of a sensor or of a converter.
const LARGEST_REST: f64 = 0.01;
/// Probability below which the output follows the rest of the input.
const FOLLOWS: f64 = 1e-3;
/// Lags of the input that the output may follow, and samples for each at least.
const LAGS: (usize, usize) = (20, 20);
/// Steps of the frequency's refinement.
const STEPS: usize = 12;

/// The sine that an input is, where nothing else of it shows in the output; none where there is more.
///
/// # Model
/// `u = a cos(w k + p) + level + slope k + rest`. A linear system's answer to the sine says what it does at w alone: any
/// model with two free parameters fits it.
/// # Method
/// w by Gauss-Newton from the largest bin; both records without the sine, level and slope; F test of the output's rest
/// on 20 lags of the input's.
/// # Shapes
/// As many samples of input as of output, 64 at least; otherwise none.
/// # Accuracy
/// A sine of three periods and more. An input of two sines or of a sine and noise of more than 1 % of its energy is no
/// single sine, whatever the output.
/// # Source
/// L. Ljung, System Identification, 1999, 13.2: persistence of excitation.
pub fn single_sine(input: &[f64], output: &[f64]) -> Option<SingleSine> {
    let samples = input.len();
    if samples != output.len() || samples < LEAST_SAMPLES || !input.iter().chain(output).all(|v| v.is_finite()) {
        return None;
    }
    let turn = refined(input, line(input)?)?;
    let columns = sine_columns(samples, turn, None);
    let plain = Mat::from_fn(samples, 2, |k, j| if j == 0 { 1.0 } else { centred(samples, k) });
    let (rest_in, rest_out) = (without(&columns, input), without(&columns, output));
    let energy = |rows: &[f64]| rows.iter().map(|v| v * v).sum::<f64>();
    let all = energy(&without(&plain, input));
    let rest = energy(&rest_in) / all;
    if rest.is_nan() || rest > LARGEST_REST {
        return None;
    }
    let lags = LAGS.0.min(samples / LAGS.1);
    let rows = samples - lags;
    let past = Mat::from_fn(rows, lags, |k, j| rest_in[k + lags - j]);
    let now: Vec<f64> = rest_out[lags..].to_vec();
    let (left, total) = (energy(&without(&past, &now)), energy(&now));
    let freedom = (rows - lags - columns.ncols()) as f64;
    let f = (total - left).max(0.0) / lags as f64 / (left / freedom);
    let p_value = if f.is_finite() { f_tail(f, lags as f64, freedom) } else { 1.0 };
    (p_value > FOLLOWS).then_some(SingleSine { cycles_per_sample: turn / TAU, rest, p_value })
}

/// Samples of a record, at least.
const LEAST_SAMPLES: usize = 64;

fn centred(samples: usize, k: usize) -> f64 {
    k as f64 - 0.5 * (samples - 1) as f64
}

/// Frequency of the largest bin, rad per sample; none where most of the energy is elsewhere, or what is slow is no more
/// than a drift.
fn line(input: &[f64]) -> Option<f64> {
    let samples = input.len();
    let mean = input.iter().sum::<f64>() / samples as f64;
    let rows = vec![input.iter().map(|u| u - mean).collect::<Vec<f64>>()];
    let power = mean_periodogram(&rows, &hann(samples, 0.0));
    let best = (1..power.len()).max_by(|&a, &b| power[a].total_cmp(&power[b]))?;
    // a Hann window's line is within two bins of its place
    let near = power[best.saturating_sub(2)..(best + 3).min(power.len())].iter().sum::<f64>();
    (best >= LEAST_PERIODS && near > 0.5 * power.iter().sum::<f64>()).then(|| TAU * best as f64 / samples as f64)
}

/// Periods of a sine in the record, at least.
const LEAST_PERIODS: usize = 3;

/// Level, slope, cosine and sine of a frequency; with its amplitudes what a change of the frequency adds.
fn sine_columns(samples: usize, turn: f64, amplitudes: Option<(f64, f64)>) -> Mat<f64> {
    Mat::from_fn(samples, 4 + usize::from(amplitudes.is_some()), |k, j| {
        let at = centred(samples, k);
        let (sin, cos) = (turn * at).sin_cos();
        match j {
            0 => 1.0,
            1 => 2.0 * at / samples as f64,
            2 => cos,
            3 => sin,
            _ => amplitudes.map_or(0.0, |(a, b)| at * (b * cos - a * sin)),
        }
    })
}

/// The frequency of the sine nearest to an input, rad per sample; none where the search leaves the line.
fn refined(input: &[f64], begin: f64) -> Option<f64> {
    let samples = input.len();
    let values = Mat::from_fn(samples, 1, |k, _| input[k]);
    let bin = TAU / samples as f64;
    let mut turn = begin;
    let mut amplitudes = None;
    for _ in 0..STEPS {
        let found = least_squares(&sine_columns(samples, turn, amplitudes), &values, DEPENDENT).ok()?;
        if amplitudes.is_some() {
            turn += found[(4, 0)].clamp(-0.5 * bin, 0.5 * bin);
        }
        amplitudes = Some((found[(2, 0)], found[(3, 0)]));
    }
    ((turn - begin).abs() < 2.0 * bin).then_some(turn)
}

/// What a record leaves beside these columns.
fn without(columns: &Mat<f64>, record: &[f64]) -> Vec<f64> {
    let values = Mat::from_fn(record.len(), 1, |k, _| record[k]);
    match least_squares(columns, &values, DEPENDENT) {
        Ok(found) => {
            let model = product(columns.as_ref(), found.as_ref());
            record.iter().enumerate().map(|(k, v)| v - model[(k, 0)]).collect()
        }
        Err(_) => record.to_vec(),
    }
}

/// Singular value over the largest below which a column says nothing of its own.
const DEPENDENT: f64 = 1e-10;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    /// A resonance at 0.13 cycles per sample, from rest.
    fn answer(input: &[f64]) -> Vec<f64> {
        let (a1, a2) = (-2.0 * 0.9 * (TAU * 0.13).cos(), 0.81);
        let mut y = vec![0.0; input.len()];
        for k in 2..input.len() {
            y[k] = input[k - 1] - a1 * y[k - 1] - a2 * y[k - 2];
        }
        y
    }

    fn noisy(record: &[f64], std: f64, seed: u64) -> Vec<f64> {
        record.iter().zip(white_noise(record.len(), std, seed)).map(|(v, n)| v + n).collect()
    }

    #[test]
    fn a_sine_is_one_whatever_the_sensors_noise_level_and_slope() {
        let mut found = 0;
        for seed in 0..40_u64 {
            let cycles = 0.011 + 0.0093 * seed as f64;
            let sine: Vec<f64> =
                (0..1500).map(|k| 0.3 + 1e-4 * k as f64 + (TAU * cycles * k as f64 + 0.4).sin()).collect();
            let sensed = [0.0, 1e-4, 0.03][(seed % 3) as usize];
            // the answer without its beginning: the sine had been on for long
            let (input, output) = (noisy(&sine, sensed, 2 * seed), noisy(&answer(&sine), 0.01, 2 * seed + 1));
            if let Some(one) = single_sine(&input[300..], &output[300..]) {
                assert!((one.cycles_per_sample - cycles).abs() < 1e-4, "{seed}: {one:?}");
                found += 1;
            }
        }
        // noise follows the rest of the input once in a thousand records
        assert!(found >= 39, "{found} of 40");
    }

    #[test]
    fn what_excites_more_than_a_line_is_no_sine() {
        for seed in 0..12_u64 {
            let sine = |cycles: f64| (0..1500).map(move |k| (TAU * cycles * k as f64).sin());
            let weak = white_noise(1500, 0.03, seed);
            let inputs: [Vec<f64>; 4] = [
                sine(0.05).zip(sine(0.09)).map(|(a, b)| a + 0.3 * b).collect(),
                // noise of a thousandth of the energy that the system answers
                sine(0.05).zip(&weak).map(|(a, n)| a + n).collect(),
                (0..1500).map(|k| f64::from(u8::from(k > 200))).collect(),
                white_noise(1500, 1.0, 100 + seed),
            ];
            for (kind, input) in inputs.iter().enumerate() {
                let output = noisy(&answer(input), 0.01, 200 + seed);
                assert_eq!(single_sine(input, &output), None, "{kind}, {seed}");
            }
        }
    }

    #[test]
    fn records_that_say_nothing_are_no_sines() {
        let still = vec![1.0; 500];
        assert_eq!(single_sine(&still, &still), None);
        assert_eq!(single_sine(&still[..10], &still[..10]), None);
        let mut holed = still.clone();
        holed[7] = f64::NAN;
        assert_eq!(single_sine(&still, &holed), None);
    }
}
