//! The noise at a frequency, from the residual.

use crate::signal::RealTransform;

/// Bins on either side that the noise at a harmonic is taken from. Why: forty bins know a density to a sixth.
const BINS: usize = 20;
/// Bins next to the harmonic that the fit has taken its part from.
const NEXT: usize = 2;

/// Density of the residual near each harmonic: the variance that white noise of that density would have.
pub(super) fn noise_variance(residual: &[f64], frequency: f64, harmonics: usize) -> Vec<f64> {
    let samples = residual.len() as f64;
    let power = RealTransform::new(residual.len()).power(residual.iter().copied());
    let last = power.len().saturating_sub(1);
    (1..=harmonics)
        .map(|h| {
            let bin = (h as f64 * frequency * samples).round() as usize;
            // other harmonics closer than the stretch are left out, too
            let of_harmonic = |k: usize| {
                let nearest = (k as f64 / (frequency * samples)).round().max(0.0) * frequency * samples;
                (k as f64 - nearest).abs() <= NEXT as f64
            };
            let stretch = bin.saturating_sub(BINS).max(1)..=(bin + BINS).min(last);
            let inside: Vec<f64> = stretch.filter(|&k| !of_harmonic(k)).map(|k| power[k]).collect();
            match inside.len() {
                0 => residual.iter().map(|e| e * e).sum::<f64>() / samples,
                count => inside.iter().sum::<f64>() / (count as f64 * samples),
            }
        })
        .collect()
}
