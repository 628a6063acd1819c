//! Band-limited interpolation: a signal moved by a fraction of a sample.

use std::f64::consts::PI;

use pulp::Simd;

use crate::signal::bessel_i0;

/// Samples that the kernel reaches to either side.
pub const REACH: usize = 32;

/// Shape parameter of the Kaiser window: side lobes of 1e-5 at the reach above.
const KAISER_BETA: f64 = 10.0;

/// `values` at the positions `start + k + shift`, `k = 0..count`, by windowed-sinc interpolation.
///
/// # Model
/// The signal has no content above 0.9 of half the sample rate. A release through three detector poles has so little
/// there that the error at its onset is 5e-5 of the release, a twentieth of one event's noise (tested).
/// # Method
/// Sinc times a Kaiser window (beta 10) over 64 samples; weights normalised to sum 1, so constants are kept exactly. A
/// whole-sample shift copies. No feedback, so nothing but the 32 samples on either side matters, and an onset cannot
/// ring further ahead than these.
/// # Shapes
/// Needs `REACH` samples on either side of what is asked for; beyond the ends the edge value is held.
/// # Accuracy
/// A sine of up to 0.45 of the sample rate is reproduced to 1e-4 of its amplitude, up to 0.43 to 2e-5 (tested).
/// # Errors
/// None; an empty `values` gives zeros.
/// # Source
/// Smith and Gossett, ICASSP 1984, 19.4; Kaiser, IEEE ISCAS 1974, 20.
pub fn fractional_shift(values: &[f64], start: usize, count: usize, shift: f64) -> Vec<f64> {
    let whole = shift.floor();
    let weights = interpolation_weights(shift - whole);
    let first = start as i64 + whole as i64;
    convolve(values, first, count, &weights)
}

/// The derivative per sample of the same interpolation, at `start + k`, `k = 0..count`.
///
/// # Method
/// The derivative of the kernel above. Accuracy: sines of up to 0.4 of the sample rate to 5e-5 of their amplitude per
/// sample (tested).
pub fn band_limited_derivative(values: &[f64], start: usize, count: usize) -> Vec<f64> {
    let half = 1e-3;
    let (ahead, behind) = (raw_weights(half), raw_weights(-half));
    // central difference of the kernel: its own error is (pi half)^2 / 6 = 2e-6
    let weights: Vec<f64> = ahead.iter().zip(&behind).map(|(a, b)| (a - b) / (2.0 * half)).collect();
    convolve(values, start as i64, count, &weights)
}

/// Weights of the samples `-REACH + 1 ..= REACH` round a position `fraction` (0 to 1) after sample 0.
pub(crate) fn interpolation_weights(fraction: f64) -> Vec<f64> {
    let mut weights = raw_weights(fraction);
    let sum: f64 = weights.iter().sum();
    weights.iter_mut().for_each(|weight| *weight /= sum);
    weights
}

fn raw_weights(fraction: f64) -> Vec<f64> {
    let reach = REACH as f64;
    let norm = bessel_i0(KAISER_BETA);
    (0..2 * REACH)
        .map(|k| {
            let x = fraction - (k as f64 - (reach - 1.0));
            let sinc = if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) };
            let inside = 1.0 - (x / reach) * (x / reach);
            if inside <= 0.0 { 0.0 } else { sinc * bessel_i0(KAISER_BETA * inside.sqrt()) / norm }
        })
        .collect()
}

/// `out[k] = sum_j weights[j] values[first + k + j - REACH + 1]`.
fn convolve(values: &[f64], first: i64, count: usize, weights: &[f64]) -> Vec<f64> {
    let Some(&last) = values.last() else { return vec![0.0; count] };
    let from = first - (REACH as i64 - 1);
    let window = weights.len();
    if let Ok(from) = usize::try_from(from)
        && let Some(stretch) = values.get(from..from + count + window - 1)
    {
        return weighted_sums(stretch, weights);
    }
    let at = |index: i64| match usize::try_from(index) {
        Err(_) => values[0],
        Ok(index) => values.get(index).copied().unwrap_or(last),
    };
    let held: Vec<f64> = (from..from + (count + window) as i64 - 1).map(at).collect();
    weighted_sums(&held, weights)
}

/// `out[k] = sum_j weights[j] values[k + j]`, wherever all of these are.
fn weighted_sums(values: &[f64], weights: &[f64]) -> Vec<f64> {
    let mut out = vec![0.0; (values.len() + 1).saturating_sub(weights.len())];
    pulp::Arch::new().dispatch(Sums { values, weights, out: &mut out });
    out
}

/// Carries the sums to the vector units: each lane has its own, so their order is that of the weights in every one.
struct Sums<'a> {
    values: &'a [f64],
    weights: &'a [f64],
    out: &'a mut [f64],
}

/// Vectors of sums at once: enough to hide the latency of an addition.
const VECTORS: usize = 8;

impl pulp::WithSimd for Sums<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { values, weights, out } = self;
        let width = VECTORS * S::F64_LANES;
        for (first, out) in (0..).step_by(width).zip(out.chunks_mut(width)) {
            if out.len() < width {
                for (k, out) in (first..).zip(out) {
                    let products = values[k..].iter().zip(weights);
                    *out = products.fold(0.0, |sum, (value, weight)| f64::mul_add(*value, *weight, sum));
                }
                break;
            }
            let mut sums = [simd.splat_f64s(0.0); VECTORS];
            for (j, &weight) in weights.iter().enumerate() {
                let weight = simd.splat_f64s(weight);
                let (values, _) = S::as_simd_f64s(&values[first + j..first + j + width]);
                for (sum, value) in sums.iter_mut().zip(values) {
                    *sum = simd.mul_add_e_f64s(*value, weight, *sum);
                }
            }
            for (out, sum) in out.chunks_exact_mut(S::F64_LANES).zip(sums) {
                simd.partial_store_f64s(out, sum);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::Lever;

    fn sine(cycles_per_sample: f64, shift: f64) -> Vec<f64> {
        (0..512).map(|k| (2.0 * PI * cycles_per_sample * (f64::from(k) + shift) + 0.3).sin()).collect()
    }

    fn largest_difference(a: &[f64], b: &[f64]) -> f64 {
        a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    }

    #[test]
    fn sines_are_moved_exactly_up_to_nearly_half_the_sample_rate() {
        for shift in [-3.7, -0.5, 0.02, 0.31, 0.5, 0.99, 12.25] {
            for (frequency, tolerance) in [(0.01, 1e-5), (0.2265, 1e-5), (0.28, 1e-5), (0.43, 2e-5), (0.45, 1e-4)] {
                let moved = fractional_shift(&sine(frequency, 0.0), 100, 300, shift);
                let error = largest_difference(&moved, &sine(frequency, shift)[100..400]);
                assert!(error < tolerance, "{frequency} by {shift}: {error:.1e}");
            }
        }
    }

    #[test]
    fn a_release_is_neither_blurred_nor_rung_ahead() {
        let lever = Lever::paper();
        let early = lever.release(4096, 1000.0, -0.9);
        for shift in [0.1, 0.25, 0.5, 0.8] {
            let moved = fractional_shift(&early, 100, 3800, shift);
            let truth = &lever.release(4096, 1000.0 - shift, -0.9)[100..3900];
            let error = largest_difference(&moved, truth);
            let ahead = largest_difference(&moved[..898], &truth[..898]);
            let later = largest_difference(&moved[940..], &truth[940..]);
            println!("shift {shift}: onset {error:.1e} V, ahead {ahead:.1e} V, later {later:.1e} V of 0.9 V");
            // noise of one event is 1.2e-3 V, of the mean of 24 it is 2.5e-4 V
            assert!(error < 2e-4 && ahead < 5e-5, "{error:.1e} {ahead:.1e}");
            // mode 4 (1.05 MHz, 5.5 mV): its thousandth would be 5e-6
            assert!(later < 5e-6, "{later:.1e}");
        }
    }

    #[test]
    fn derivative_of_sines() {
        for frequency in [0.01, 0.2265, 0.4] {
            let w = 2.0 * PI * frequency;
            let truth: Vec<f64> = (100..400).map(|k| w * (w * f64::from(k) + 0.3).cos()).collect();
            let error = largest_difference(&band_limited_derivative(&sine(frequency, 0.0), 100, 300), &truth);
            assert!(error < 5e-5, "{frequency}: {error:.1e}");
        }
    }

    #[test]
    fn whole_shifts_copy_and_ends_are_held() {
        let values: Vec<f64> = (0..100).map(|k| f64::from(k * k % 37)).collect();
        assert!(largest_difference(&fractional_shift(&values, 40, 10, 3.0), &values[43..53]) < 1e-12);
        let held = fractional_shift(&[2.0; 10], 0, 10, -40.5);
        // weights sum to one
        assert!(held.iter().all(|value| (value - 2.0).abs() < 1e-14));
        assert_eq!(fractional_shift(&[], 3, 2, 0.5), vec![0.0; 2]);
    }
}
