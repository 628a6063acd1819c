//! Frequency response of an ensemble, with what scatters between its events.

use std::f64::consts::TAU;

use rustfft::num_complex::Complex64;

use super::error::positive;
use crate::spectra::error::SpectrumError;
use crate::spectra::fourier::transform;

/// An ensemble's frequency response. Levels are squares of transforms (`N^(-1/2)` scaled) of one event's response.
#[derive(Debug, Clone, PartialEq)]
pub struct EnsembleResponse {
    /// Response over input.
    pub transfer: Vec<Complex64>,
    /// Expected squared error of the transfer, from the scatter between events.
    pub variance: Vec<f64>,
    /// Ordinary coherence, one where nothing scatters.
    pub coherence: Vec<f64>,
    /// Whole scatter between events about the linear response.
    pub scatter: Vec<f64>,
    /// Part of it that is neither timing nor amplitude: noise.
    pub noise: Vec<f64>,
    /// Part of it that is a shift in time of whole events.
    pub timing: Vec<f64>,
    /// Part of it that goes with the input's size: distortion, which no linear response has; its noise taken off.
    pub distortion: Vec<f64>,
    /// Chance of so much distortion in a bin without any.
    pub distortion_p: Vec<f64>,
    /// How much later than the mean each event came, samples.
    pub lag: Vec<f64>,
}

/// Settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EnsembleResponseSettings {
    /// Bins on either side over which levels are averaged, 0 for none.
    pub half_width_bins: usize,
    /// Bins used for the lags: the first so many.
    pub band_bins: usize,
}

/// Estimates a frequency response from several events with inputs of their own size.
///
/// # Model
/// `Y_i = G U_i (1 - i w l_i) + a_i U_i D + N_i`: linear response, a lag of each event, a distortion in proportion to
/// the input's deviation `a_i` from the mean size (the first term that a nonlinearity adds), and noise.
///
/// # Method
/// `G = sum Y U* / sum |U|^2`; the scatter `Y - G U` over `n - 1`; lags by least squares over all bins weighted with
/// the scatter; distortion by regression on `a_i U_i`, its expected noise subtracted, its chance from the F
/// distribution with 2 and 2 (n - 3) degrees of freedom.
///
/// # Shapes
/// `inputs`, `responses`: events of equal length N; results `[N/2 + 1]`.
///
/// # Units
/// Response over input; levels in the response's unit squared.
///
/// # Accuracy
/// The variance of a bin has a relative standard error of `1 / sqrt((n - 1) (2 h + 1))` for h bins on either side. An
/// input that is itself scaled by the response holds the mean amplitude's noise, a share of 1/N. What rings beyond the
/// window's end is in all events alike and not in the variance.
///
/// # Errors
/// Fewer than four events, unequal lengths, values not finite, an input that is zero.
///
/// # Source
/// R. Pintelon, J. Schoukens, System Identification (2012), ch. 2 and 4; J. S. Bendat, A. G. Piersol, Random Data
/// (2010), ch. 9.
pub fn ensemble_response(
    inputs: &[Vec<f64>],
    responses: &[Vec<f64>],
    settings: EnsembleResponseSettings,
) -> Result<EnsembleResponse, SpectrumError> {
    let events = responses.len();
    if events < 4 {
        return Err(SpectrumError::TooShort { got: events, wanted: 4 });
    }
    if inputs.len() != events {
        return Err(SpectrumError::Lengths { name: "the inputs", got: inputs.len(), wanted: events });
    }
    let u = transform(&inputs.iter().map(Vec::as_slice).collect::<Vec<&[f64]>>())?;
    let y = transform(&responses.iter().map(Vec::as_slice).collect::<Vec<&[f64]>>())?;
    let (bins, samples) = (u[0].len(), inputs[0].len());
    if y[0].len() != bins {
        return Err(SpectrumError::Lengths { name: "a response", got: responses[0].len(), wanted: samples });
    }
    let sum = |of: &dyn Fn(usize) -> f64| (0..events).map(of).sum::<f64>();
    let n = events as f64;
    let power: Vec<f64> = (0..bins).map(|k| sum(&|i| u[i][k].norm_sqr())).collect();
    positive("the input's power", power.iter().sum())?;
    let unknown = Complex64::new(f64::NAN, f64::NAN);
    let transfer: Vec<Complex64> = (0..bins)
        .map(|k| {
            let cross: Complex64 = (0..events).map(|i| y[i][k] * u[i][k].conj()).sum();
            if power[k] > 0.0 { cross / power[k] } else { unknown }
        })
        .collect();
    let left: Vec<Vec<Complex64>> =
        (0..events).map(|i| (0..bins).map(|k| y[i][k] - transfer[k] * u[i][k]).collect()).collect();
    let raw: Vec<f64> = (0..bins).map(|k| sum(&|i| left[i][k].norm_sqr()) / (n - 1.0)).collect();
    let scatter = averaged(&raw, settings.half_width_bins);
    let turn = |k: usize| Complex64::new(0.0, -TAU * k as f64 / samples as f64);
    let shift = |i: usize, k: usize| turn(k) * transfer[k] * u[i][k];
    let band = 1..settings.band_bins.min(bins);
    let lag: Vec<f64> = (0..events)
        .map(|i| {
            let known = band.clone().filter(|&k| scatter[k] > 0.0);
            let (mut along, mut size) = (0.0, 0.0);
            for k in known {
                along += (left[i][k] * shift(i, k).conj()).re / scatter[k];
                size += shift(i, k).norm_sqr() / scatter[k];
            }
            if size > 0.0 { along / size } else { 0.0 }
        })
        .collect();
    let timing: Vec<f64> = (0..bins).map(|k| sum(&|i| (lag[i] * shift(i, k)).norm_sqr()) / (n - 1.0)).collect();
    let excess = sizes(&u, settings.band_bins);
    let mut levels = vec![[0.0; 2]; bins]; // distortion's sum of squares, noise's
    for (k, level) in levels.iter_mut().enumerate() {
        let rest = |i: usize| left[i][k] - lag[i] * shift(i, k);
        let column = |i: usize| excess[i] * u[i][k];
        // U is the first column: what of the second is not along it
        let share: Complex64 = (0..events).map(|i| column(i) * u[i][k].conj()).sum::<Complex64>() / power[k];
        let own = |i: usize| column(i) - share * u[i][k];
        let size = sum(&|i| own(i).norm_sqr());
        let along: Complex64 = (0..events).map(|i| rest(i) * own(i).conj()).sum();
        let explained = if size > 1e-20 * power[k] { along.norm_sqr() / size } else { 0.0 };
        *level = [explained, (sum(&|i| rest(i).norm_sqr()) - explained).max(0.0) / (n - 2.0)];
    }
    let noise = averaged(&levels.iter().map(|l| l[1]).collect::<Vec<f64>>(), settings.half_width_bins);
    // the regression itself takes up the noise of one complex coefficient
    let distortion = averaged(&levels.iter().map(|l| l[0]).collect::<Vec<f64>>(), settings.half_width_bins)
        .iter()
        .zip(&noise)
        .map(|(explained, noise)| (explained - noise).max(0.0) / (n - 1.0))
        .collect();
    let distortion_p = levels.iter().map(|l| tail(l[0] / l[1], n - 2.0)).collect();
    let response_power: Vec<f64> = (0..bins).map(|k| sum(&|i| y[i][k].norm_sqr())).collect();
    Ok(EnsembleResponse {
        variance: (0..bins).map(|k| scatter[k] / power[k]).collect(),
        coherence: (0..bins).map(|k| transfer[k].norm_sqr() * power[k] / response_power[k]).collect(),
        transfer,
        scatter,
        noise,
        timing,
        distortion,
        distortion_p,
        lag,
    })
}

/// Relative deviation of each event's input from the mean size.
fn sizes(u: &[Vec<Complex64>], band: usize) -> Vec<f64> {
    let size: Vec<f64> =
        u.iter().map(|u| u.iter().take(band.max(2)).map(|u| u.norm_sqr()).sum::<f64>().sqrt()).collect();
    let mean = size.iter().sum::<f64>() / size.len() as f64;
    size.iter().map(|s| s / mean - 1.0).collect()
}

/// Mean over neighbours, fewer at the ends; what is not finite is left out.
fn averaged(values: &[f64], half_width: usize) -> Vec<f64> {
    (0..values.len())
        .map(|k| {
            let near = &values[k.saturating_sub(half_width)..(k + half_width + 1).min(values.len())];
            let known = near.iter().filter(|v| v.is_finite());
            let count = known.clone().count();
            if count == 0 { f64::NAN } else { known.sum::<f64>() / count as f64 }
        })
        .collect()
}

/// Upper tail of F with 2 and `2 m` degrees of freedom at `ratio`: `(1 + ratio / m)^-m`.
fn tail(ratio: f64, m: f64) -> f64 {
    if ratio.is_nan() { f64::NAN } else { (1.0 + ratio / m).powf(-m) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Lever, white_noise};
    use crate::spectra::ratio::difference;

    const N: usize = 4096;
    const EVENTS: usize = 24;
    const SETTINGS: EnsembleResponseSettings = EnsembleResponseSettings { half_width_bins: 2, band_bins: 900 };

    /// Differences of releases of the paper's lever, adhesion scattered by a fifth, through a detector `v = s + a2
    /// s^2`.
    fn ensemble(noise: f64, a2: f64, seed: u64) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
        let shape = Lever::paper().release(N, 500.0, -0.9);
        let amplitude = white_noise(EVENTS, 0.2, 40 + seed);
        let event = |i: usize| {
            let e = white_noise(N, noise, 1000 * seed + i as u64);
            let size = 1.0 + amplitude[i];
            let v = |k: usize| size * shape[k] + a2 * (size * shape[k]).powi(2) + e[k];
            let force: Vec<f64> = (0..N).map(|k| if k < 500 { -0.9 * size } else { 0.0 }).collect();
            (difference(&force), difference(&(0..N).map(v).collect::<Vec<f64>>()))
        };
        (0..EVENTS).map(event).unzip()
    }

    #[test]
    fn the_variance_is_the_error_over_seeds_and_nothing_else_is_found() {
        let (clean_u, clean_y) = ensemble(0.0, 0.0, 1);
        let clean = ensemble_response(&clean_u, &clean_y, SETTINGS).unwrap();
        let (mut ratio, mut small, mut level, mut count) = (0.0, 0.0, 0.0, 0.0);
        for seed in 0..40 {
            let (u, y) = ensemble(1e-3, 0.0, seed);
            let got = ensemble_response(&u, &y, SETTINGS).unwrap();
            for k in 20..900 {
                ratio += (got.transfer[k] - clean.transfer[k]).norm_sqr() / got.variance[k];
                small += f64::from(u8::from(got.distortion_p[k] < 0.01));
                // differences of white noise: 4 sin^2(pi k / N) 1e-6
                let white = 4e-6 * (0.5 * TAU * k as f64 / N as f64).sin().powi(2);
                level += got.noise[k] / white;
                count += 1.0;
            }
            assert!(got.lag.iter().all(|l| l.abs() < 0.02), "{:?}", got.lag);
        }
        println!("ratio {:.4}, p < 0.01: {:.4}, noise {:.4}", ratio / count, small / count, level / count);
        // 35200 exponential values: 0.5 %, and 1 / 115 since the variance is itself of 115 squares; four of them
        assert!((ratio / count - 1.0).abs() < 0.03);
        assert!((small / count - 0.01).abs() < 0.003);
        // lags take up a share of 1 / 880 of the noise
        assert!((level / count - 1.0).abs() < 0.02);
    }

    #[test]
    fn a_quadratic_detector_is_distortion_and_a_shift_is_timing() {
        let (u, mut y) = ensemble(1e-4, 0.05, 7);
        // level bin by bin: the harmonic is two bins wide
        let got = ensemble_response(&u, &y, EnsembleResponseSettings { half_width_bins: 0, ..SETTINGS }).unwrap();
        // second harmonic of the first mode, 92.6 kHz, and its neighbours
        let k = (92.6e3_f64 / 5e6 * N as f64).round() as usize;
        assert!(got.distortion_p[k] < 1e-6 && got.distortion[k] > 10.0 * got.noise[k]);
        // (Y - G U) of event i is a2 S (size^2 - size w): level (a2 S)^2 times the variance of size (size - w), w the
        // power-weighted mean size
        let square: Vec<f64> = Lever::paper().release(N, 500.0, -0.9).iter().map(|s| s * s).collect();
        let s2 = transform(&[&difference(&square)]).unwrap().remove(0)[k].norm_sqr() * 0.05 * 0.05;
        let size: Vec<f64> = white_noise(EVENTS, 0.2, 47).iter().map(|a| 1.0 + a).collect();
        let (p2, p3) = (size.iter().map(|s| s.powi(2)).sum::<f64>(), size.iter().map(|s| s.powi(3)).sum::<f64>());
        let expected = s2 * size.iter().map(|s| (s * s - s * p3 / p2).powi(2)).sum::<f64>() / (EVENTS as f64 - 1.0);
        // noise of 1e-4 makes a hundredth of it; the lag takes up a part that is in phase with it, and size stands for
        // size (size - w)
        assert!((got.distortion[k] / expected - 1.0).abs() < 0.15, "{} {expected}", got.distortion[k]);
        // one event half a sample late: Nyquist apart, a shift by interpolation of its neighbours at low frequencies
        let late: Vec<f64> = (0..N).map(|k| 0.5 * (y[3][k] + y[3][k.saturating_sub(1)])).collect();
        y[3] = late;
        let moved = ensemble_response(&u, &y, SETTINGS).unwrap();
        assert!((moved.lag[3] - moved.lag[4] - 0.5).abs() < 0.05, "{:?}", moved.lag);
    }

    #[test]
    fn impossible_ensembles_are_refused() {
        let (u, y) = ensemble(1e-3, 0.0, 1);
        assert!(ensemble_response(&u[..3], &y[..3], SETTINGS).is_err());
        assert!(ensemble_response(&u[..5], &y, SETTINGS).is_err());
        assert!(ensemble_response(&vec![vec![0.0; N]; EVENTS], &y, SETTINGS).is_err());
        let short: Vec<Vec<f64>> = u.iter().map(|u| u[..100].to_vec()).collect();
        assert!(ensemble_response(&short, &y, SETTINGS).is_err());
    }
}
