//! What an uncertain t0 does to a mode's static share.

use faer::c64;

/// Steps of Simpson's rule per radian of the mode's phase: its error is below 1e-8 of the share, since the fourth power
/// of a step of 1/32 is 1e-6 and its factor 1/180.
const STEPS_PER_RADIAN: f64 = 32.0;

/// Root mean square error of a mode's static share when t0 may have been anywhere in the `width_s` before the one that
/// was assumed.
///
/// # Model
/// After t0 a mode rings as `2 Re(A exp(s (t - t0)))` for a load of one, and its share of the static response is `2
/// Re(A)`. If the event was `d` earlier, its amplitude then was `A exp(-s d)`. `d` is uniform from 0 to `width_s`.
/// # Method
/// `sqrt(mean over d of (2 Re(A exp(-s d)) - 2 Re(A))^2)`, by Simpson's rule: a phase of radians at the highest modes,
/// where first order is no use. About the share that is stated, not about the mean over d, since it is the stated one
/// that may be wrong.
/// # Shapes
/// Scalars; `amplitude` and `pole` are those of the upper one of a pair, or of a real pole.
/// # Units
/// `pole` in rad/s, `width_s` in seconds; amplitude and result are parts of the static response.
/// # Accuracy
/// 1e-8 of the amplitude.
/// # Errors
/// None; 0 for a width that is not above 0.
/// # Source
/// Shift theorem of the Laplace transform; Stark et al. 2005, where t0 is known to some samples.
pub fn share_error_from_onset(amplitude: c64, pole: c64, width_s: f64) -> f64 {
    if !(width_s > 0.0 && width_s.is_finite()) {
        return 0.0;
    }
    let square = |d: f64| (2.0 * (amplitude * (-pole * d).exp() - amplitude).re).powi(2);
    let half_steps = (0.5 * STEPS_PER_RADIAN * pole.norm() * width_s).ceil().clamp(4.0, 5e4) as usize;
    let step = width_s / (2 * half_steps) as f64;
    let sum: f64 = (0..half_steps)
        .map(|k| {
            let at = |j: usize| square((2 * k + j) as f64 * step);
            at(0) + 4.0 * at(1) + at(2)
        })
        .sum();
    (sum / (6 * half_steps) as f64).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_shifts_are_first_order_and_large_ones_saturate() {
        let (amplitude, pole) = (c64::new(0.01, 0.03), c64::new(-6e3, 6.6e6));
        // first order: |2 Re(A s)| times the rms of a uniform shift, w / sqrt(3); second order is 4e-3 of it
        let small = 1e-9;
        let first = (2.0 * (amplitude * pole).re).abs() * small / 3f64.sqrt();
        assert!((share_error_from_onset(amplitude, pole, small) / first - 1.0).abs() < 1e-2);
        // many turns: the mean square of 2 |A| cos(...) - 2 Re(A) is 2 |A|^2 + 4 Re(A)^2; damping takes 1 % in a
        // microsecond
        let many = share_error_from_onset(amplitude, pole, 4e-6);
        let limit = (2.0 * amplitude.norm_sqr() + 4.0 * amplitude.re.powi(2)).sqrt();
        assert!((many / limit - 1.0).abs() < 0.05, "{many} {limit}");
        assert_eq!(share_error_from_onset(amplitude, pole, 0.0), 0.0);
        assert_eq!(share_error_from_onset(amplitude, pole, f64::NAN), 0.0);
    }

    #[test]
    fn it_agrees_with_a_sum_over_many_shifts() {
        let (amplitude, pole, width) = (c64::new(-0.002, 0.004), c64::new(-6e3, 6.6e6), 3.8e-7);
        let count = 200_000;
        let sum: f64 = (0..count)
            .map(|k| width * (f64::from(k) + 0.5) / f64::from(count))
            .map(|d| (2.0 * (amplitude * (-pole * d).exp() - amplitude).re).powi(2))
            .sum();
        let slow = (sum / f64::from(count)).sqrt();
        // the midpoint rule's own error is 1e-10
        assert!((share_error_from_onset(amplitude, pole, width) / slow - 1.0).abs() < 1e-7);
    }
}
