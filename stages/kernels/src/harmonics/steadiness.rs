//! Whether parts of a record agree in amplitude and phase.

use num_complex::Complex64;

use super::Steadiness;
use crate::statistics::chi_square_tail;

/// Periods of a part at least: fewer blur its amplitude by its neighbours'.
const LEAST_PERIODS: f64 = 4.0;

/// The fundamental's amplitude and phase, part by part, against their noise.
pub(super) struct Parts {
    pub amplitude: Steadiness,
    pub phase: Steadiness,
    /// Standard error of the angular frequency, rad per sample, by the scatter of the parts' phases; 0 where it is not
    /// larger than the noise's.
    pub omega_std: f64,
}

/// Compares parts of `y`, the record less its level and its further harmonics.
///
/// # Method
/// In each part the least-squares amplitude `z` at `omega`; noise variance `4 s / M` of its modulus squared for M
/// samples. Amplitudes scatter about their mean, phases about the straight line that the frequency's error is: both as
/// chi-square.
pub(super) fn parts(y: &[f64], omega: f64, noise_variance: f64, count: usize) -> Parts {
    let steady = Steadiness { p_value: 1.0, wander: 0.0 };
    let length = y.len() / count.max(1);
    if (length as f64) * omega < LEAST_PERIODS * std::f64::consts::TAU {
        return Parts { amplitude: steady, phase: steady, omega_std: 0.0 };
    }
    let part = |p: usize| tone(&y[p * length..(p + 1) * length], p * length, omega);
    let tones: Vec<Complex64> = (0..count).map(part).collect();
    let mean = tones.iter().sum::<Complex64>() / count as f64;
    let sizes: Vec<f64> = tones.iter().map(|z| z.norm()).collect();
    let amplitude = sizes.iter().sum::<f64>() / count as f64;
    // var a = var b = 2 s / M
    let variance = 2.0 * noise_variance / length as f64;
    let squares: f64 = sizes.iter().map(|a| (a - amplitude).powi(2)).sum();
    let angles: Vec<f64> = tones.iter().map(|z| (z / mean).arg()).collect();
    let centre = 0.5 * (count as f64 - 1.0);
    let places: Vec<f64> = (0..count).map(|p| p as f64 - centre).collect();
    let level = angles.iter().sum::<f64>() / count as f64;
    let weight: f64 = places.iter().map(|p| p * p).sum();
    let slope = places.iter().zip(&angles).map(|(p, a)| p * a).sum::<f64>() / weight;
    let about: f64 = places.iter().zip(&angles).map(|(p, a)| (a - level - slope * p).powi(2)).sum();
    let phase_variance = variance / amplitude.powi(2).max(f64::MIN_POSITIVE);
    let judged = |squares: f64, variance: f64, freedom: usize, scale: f64| Steadiness {
        p_value: chi_square_tail(squares / variance.max(f64::MIN_POSITIVE), freedom),
        wander: (squares / freedom as f64 - variance).max(0.0).sqrt() / scale,
    };
    let phase = judged(about, phase_variance, count - 2, 1.0);
    let scatter = about / (count - 2) as f64;
    Parts {
        amplitude: judged(squares, variance, count - 1, amplitude.max(f64::MIN_POSITIVE)),
        phase,
        omega_std: if scatter > phase_variance { (scatter / weight).sqrt() / length as f64 } else { 0.0 },
    }
}

/// Least-squares cosine and sine of a part that begins at sample `first`: `Re(z exp(i omega k))`.
fn tone(y: &[f64], first: usize, omega: f64) -> Complex64 {
    let (mut cc, mut cs, mut ss, mut yc, mut ys) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (k, value) in y.iter().enumerate() {
        let (sin, cos) = (omega * (first + k) as f64).sin_cos();
        cc += cos * cos;
        cs += cos * sin;
        ss += sin * sin;
        yc += value * cos;
        ys += value * sin;
    }
    let determinant = cc * ss - cs * cs;
    Complex64::new((yc * ss - ys * cs) / determinant, -(ys * cc - yc * cs) / determinant)
}
