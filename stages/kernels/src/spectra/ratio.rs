//! The empirical transfer function estimate.

use std::f64::consts::TAU;

use rustfft::num_complex::Complex64;

use super::Intersample;
use super::error::{finite, positive};
use crate::spectra::error::SpectrumError;
use crate::spectra::fourier::{bin_frequencies, transform};

/// What the series are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum EndTreatment {
    /// Force and response as they are, multiplied by a window that makes their ends meet (the paper).
    Windowed,
    /// First differences of both, from [`difference`]: the step has become a pulse, and the jump from the end of the
    /// window to its start is never seen.
    Differenced,
}

/// Settings of the estimate.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EtfeSettings {
    /// Sample rate.
    pub sample_rate_hz: f64,
    /// Bins above are undefined.
    pub bandwidth_hz: f64,
    /// Bins whose input is smaller than this share of the median around them are undefined.
    pub vanishing_ratio: f64,
    /// Treatment of the ends.
    pub ends: EndTreatment,
    /// Input between samples.
    pub intersample: Intersample,
    /// Divides by the quasi-static gain found in the data.
    pub normalise: bool,
}

/// The estimate.
#[derive(Debug, Clone, PartialEq)]
pub struct TransferEstimate {
    /// Bins in hertz.
    pub frequency_hz: Vec<f64>,
    /// `Y / U`; NaN where undefined.
    pub transfer: Vec<Complex64>,
    /// Expected squared error of the complex value; NaN where undefined.
    pub variance: Vec<f64>,
    /// Quasi-static gain that was found (and divided by, if asked for).
    pub static_gain: f64,
    /// Bins inside the band that are undefined because the input vanishes.
    pub vanishing: usize,
}

/// Bins on either side whose median the input is compared with.
const MEDIAN_REACH: usize = 32;

/// Ratio of the transforms of response and force.
///
/// # Model
/// `y = G u + e` with `e` white of standard deviation `noise_std` per sample (windowed like `y`).
///
/// # Method
/// `G = Y / U` (Eqs. 5 to 7). Windowed: the tapered response to a force is not the response to the tapered force; for a
/// Tukey window with alpha = 0.1 over 8192 samples this costs 1.5 % at the paper's first resonance, and up to half of
/// the value at antiresonances. Differenced: the ratio is the same for a linear system, the input's spectrum is flat
/// and has no zeros, and only what still rings at the end is missing (0.7 %), as a transient that
/// [`local_rational`](super::local_rational()) takes out to 1e-5. Held input: `G` is multiplied by `i w T / (1 - exp(-i
/// w T))`. The quasi-static gain is the regression of the response on the force with Hann weights, which suppress the
/// ringing: over the stretch where the force acts, or, from differences, over either side of the largest step.
///
/// # Shapes
/// `force`, `response`, `noise_std` `[N]`; results `[N/2 + 1]`.
///
/// # Units
/// Response over force.
///
/// # Accuracy
/// `variance = phi / |U|^2` with `phi` the noise's transform squared (times `|1 - exp(-i w T)|^2 + 2 / N` when
/// differenced). Real and imaginary parts hold half each. Folding about half the sample rate is not corrected: below
/// 3e-5 of the static gain up to 1.2 MHz for the paper's lever at 5 MS/s, which is 12 % of the value at the
/// antiresonance near 900 kHz.
///
/// # Errors
/// Under eight samples, unequal lengths, values not finite, settings out of range, a force that is zero throughout.
///
/// # Source
/// Stark et al. 2005, Eqs. 5 to 7 and 10; Ljung, System Identification, ch. 6.
pub fn etfe(
    force: &[f64],
    response: &[f64],
    noise_std: &[f64],
    settings: EtfeSettings,
) -> Result<TransferEstimate, SpectrumError> {
    check(force, response, noise_std, settings)?;
    let n = force.len();
    let differenced = settings.ends == EndTreatment::Differenced;
    let static_gain = if differenced { summed_gain(force, response) } else { static_gain(force, response) };
    let gain = if settings.normalise { static_gain } else { 1.0 };
    if !gain.is_finite() || gain == 0.0 {
        return Err(SpectrumError::NoInput);
    }
    let spectra = transform(&[force, response])?;
    let (u, y) = (&spectra[0], &spectra[1]);
    let floor = vanishing_floor(u, settings.vanishing_ratio);
    let phi = noise_std.iter().map(|s| s * s).sum::<f64>() / n as f64;

    let frequency_hz = bin_frequencies(n, settings.sample_rate_hz);
    let undefined = Complex64::new(f64::NAN, f64::NAN);
    let mut result =
        TransferEstimate { frequency_hz, transfer: Vec::new(), variance: Vec::new(), static_gain, vanishing: 0 };
    for k in 0..u.len() {
        let inside = result.frequency_hz[k] <= settings.bandwidth_hz;
        let power = u[k].norm_sqr();
        if !inside || power == 0.0 || power.sqrt() < floor[k] {
            result.vanishing += usize::from(inside);
            result.transfer.push(undefined);
            result.variance.push(f64::NAN);
            continue;
        }
        let step = 1.0 - Complex64::from_polar(1.0, -TAU * k as f64 / n as f64);
        let coloured = if differenced { phi * (step.norm_sqr() + 2.0 / n as f64) } else { phi };
        let between = settings.intersample.correction(k as f64, 1.0 / n as f64);
        result.transfer.push(y[k] / u[k] * between / gain); // Eq. 7
        result.variance.push(coloured / power * between.norm_sqr() / (gain * gain)); // Eq. 10
    }
    Ok(result)
}

fn check(force: &[f64], response: &[f64], noise_std: &[f64], settings: EtfeSettings) -> Result<(), SpectrumError> {
    let n = force.len();
    if n < 8 {
        return Err(SpectrumError::TooShort { got: n, wanted: 8 });
    }
    for (name, values) in [("the force", force), ("the response", response), ("the standard error", noise_std)] {
        if values.len() != n {
            return Err(SpectrumError::Lengths { name, got: values.len(), wanted: n });
        }
        finite(name, values)?;
    }
    positive("sample_rate_hz", settings.sample_rate_hz)?;
    positive("bandwidth_hz", settings.bandwidth_hz)?;
    if !(0.0..1.0).contains(&settings.vanishing_ratio) {
        let (got, wanted) = (settings.vanishing_ratio, "0 to below 1");
        return Err(SpectrumError::Setting { name: "vanishing_ratio", got, wanted });
    }
    if force.iter().all(|u| *u == 0.0) {
        return Err(SpectrumError::NoInput);
    }
    Ok(())
}

/// First differences, `d_n = x_n - x_(n-1)`, `d_0 = 0`: a step becomes a pulse.
pub fn difference(x: &[f64]) -> Vec<f64> {
    std::iter::once(0.0).take(x.len()).chain(x.windows(2).map(|w| w[1] - w[0])).collect()
}

/// Regression of the response on the force where the force acts, ringing weighted away.
fn static_gain(force: &[f64], response: &[f64]) -> f64 {
    let acts = |u: &f64| *u != 0.0;
    let (Some(from), Some(last)) = (force.iter().position(acts), force.iter().rposition(acts)) else {
        return f64::NAN;
    };
    let n = (last + 1 - from) as f64;
    let (mut uu, mut uy) = (0.0, 0.0);
    for (k, (u, y)) in force[from..=last].iter().zip(&response[from..=last]).enumerate() {
        let w = (std::f64::consts::PI * (k as f64 + 0.5) / n).sin().powi(2);
        uu += w * u * u;
        uy += w * u * y;
    }
    uy / uu
}

/// The same from differences: their sums are regressed with a free offset, Hann weights on either side of the largest
/// step.
fn summed_gain(force: &[f64], response: &[f64]) -> f64 {
    let event = (0..force.len()).max_by(|&a, &b| force[a].abs().total_cmp(&force[b].abs())).unwrap_or(0);
    let (mut u, mut y) = (0.0, 0.0);
    let [mut w0, mut wu, mut wy, mut wuu, mut wuy] = [0.0; 5];
    for k in 0..force.len() {
        u += force[k];
        y += response[k];
        let (from, to) = if k < event { (0, event) } else { (event, force.len()) };
        let w = (std::f64::consts::PI * ((k - from) as f64 + 0.5) / (to - from) as f64).sin().powi(2);
        w0 += w;
        wu += w * u;
        wy += w * y;
        wuu += w * u * u;
        wuy += w * u * y;
    }
    (w0 * wuy - wu * wy) / (w0 * wuu - wu * wu)
}

/// Below this the input counts as vanishing: a share of the median around each bin.
fn vanishing_floor(u: &[Complex64], ratio: f64) -> Vec<f64> {
    let size: Vec<f64> = u.iter().map(|u| u.norm()).collect();
    (0..size.len())
        .map(|k| {
            let mut near = size[k.saturating_sub(MEDIAN_REACH)..(k + MEDIAN_REACH + 1).min(size.len())].to_vec();
            near.sort_by(f64::total_cmp);
            ratio * near[near.len() / 2]
        })
        .collect()
}

#[cfg(test)]
mod tests;
