//! The moment of the event: the latest that leaves the response causal.

use crate::force::error::ForceError;

/// How the onset is looked for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct T0Settings {
    /// Where the event is expected.
    pub near: usize,
    /// How far the onset may lie from there, in samples.
    pub reach: usize,
    /// A departure counts above this multiple of the noise.
    pub departure_sigma: f64,
    /// Share of the load that the signal must have left behind, so that noise is never taken for the event.
    pub sure_share: f64,
}

/// The onset, as far as the data tell.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct T0 {
    /// Last sample that still lies on the line: the latest `t0` for which the response is causal.
    pub latest: usize,
    /// Where power laws of order two to four, through the samples that follow, reach zero at the earliest.
    pub earliest: f64,
}

impl T0 {
    /// Width of the interval of `t0` that the data allow, in samples.
    pub fn ambiguity(&self) -> f64 {
        (self.latest as f64 - self.earliest).max(0.0)
    }
}

/// Finds the latest `t0` compatible with a causal transfer function.
///
/// # Model
/// Up to `t0` the signal follows the extrapolated line; after it, it departs with a power of time that the lever and
/// the detector set together: two for a lever alone, effectively up to four with detector poles below the sampling
/// rate.
///
/// # Method
/// From the first sample that has left the line by `sure_share` of the load, back to the last one within
/// `departure_sigma` standard errors: any later `t0` would have the response come first. An earlier one is compatible
/// too, with a delay in the transfer function instead: lines through the 2nd to 4th root of the first departures give
/// the earliest. A fraction of a sample cannot be distinguished from that delay, so `t0` lies on the grid, where a held
/// input represents it exactly.
///
/// # Shapes
/// `departure` `[time]`, the signal less the line before; `load` the step that is expected, of either sign.
///
/// # Units
/// Samples; `departure`, `load` and `noise_std` in one unit.
///
/// # Accuracy
/// For the paper's lever at a signal to noise ratio of 3000, `latest` lies one to three samples after the truth.
///
/// # Errors
/// No departure within reach.
///
/// # Source
/// Stark et al. 2005: "adjusted to the largest possible value compatible with a causal transfer function".
pub fn find_t0(departure: &[f64], load: f64, noise_std: f64, settings: T0Settings) -> Result<T0, ForceError> {
    let from = settings.near.saturating_sub(settings.reach);
    let to = (settings.near + settings.reach + 1).min(departure.len());
    let sure = settings.sure_share * load.abs();
    let threshold = settings.departure_sigma * noise_std;
    let none = ForceError::NoDeparture { threshold: sure.max(threshold), near: settings.near };
    let Some(left) = (from..to).find(|&k| departure[k].abs() > sure.max(threshold)) else {
        return Err(none);
    };
    // a millionth of the load is less than any converter resolves, and more than rounding leaves in a simulation
    let threshold = threshold.max(1e-6 * load.abs());
    let Some(latest) = (0..left).rev().find(|&k| departure[k].abs() <= threshold) else {
        return Err(none);
    };
    let mut earliest = latest as f64;
    let sign = departure[left].signum();
    let last = (left + 1).max(latest + 3).min(departure.len() - 1);
    for order in 2..=4 {
        let points: Vec<(f64, f64)> = (latest + 1..=last)
            .map(|k| (k as f64, (sign * departure[k]).max(0.0).powf(1.0 / f64::from(order))))
            .collect();
        if let Some(zero) = zero_crossing(&points) {
            earliest = earliest.min(zero);
        }
    }
    Ok(T0 { latest, earliest })
}

/// Where the least-squares line through the points vanishes, if it rises.
fn zero_crossing(points: &[(f64, f64)]) -> Option<f64> {
    let n = points.len() as f64;
    let (mx, my) = (points.iter().map(|p| p.0).sum::<f64>() / n, points.iter().map(|p| p.1).sum::<f64>() / n);
    let xx: f64 = points.iter().map(|p| (p.0 - mx).powi(2)).sum();
    let xy: f64 = points.iter().map(|p| (p.0 - mx) * (p.1 - my)).sum();
    (points.len() > 1 && xx > 0.0 && xy > 0.0).then(|| mx - my * xx / xy)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Lever, white_noise};

    fn settings(near: usize) -> T0Settings {
        T0Settings { near, reach: 40, departure_sigma: 4.0, sure_share: 0.1 }
    }

    #[test]
    fn the_true_moment_lies_in_the_interval() {
        for (seed, t0) in [(1, 500.0), (2, 500.3), (3, 499.6), (4, 501.9)] {
            let noise = white_noise(1200, 2.5e-4, seed);
            let departure: Vec<f64> =
                Lever::paper().release(1200, t0, -0.9).iter().zip(noise).map(|(y, e)| y + 0.9 + e).collect();
            let onset = find_t0(&departure, 0.9, 2.5e-4, settings(505)).unwrap();
            // half a sample for the power laws, which are an extrapolation
            assert!(onset.earliest - 0.5 <= t0 && t0 <= onset.latest as f64 + 1.0, "{t0} {onset:?}");
            assert!(onset.ambiguity() < 5.0, "{onset:?}");
        }
    }

    #[test]
    fn without_noise_the_latest_moment_is_the_true_one() {
        let departure: Vec<f64> = Lever::paper().release(1200, 500.0, -0.9).iter().map(|y| y + 0.9).collect();
        let onset = find_t0(&departure, 0.9, 0.0, settings(505)).unwrap();
        assert_eq!(onset.latest, 500);
    }

    #[test]
    fn a_quiet_signal_has_no_onset() {
        let noise = white_noise(1200, 2.5e-4, 1);
        assert!(matches!(find_t0(&noise, 0.9, 2.5e-4, settings(500)), Err(ForceError::NoDeparture { .. })));
        assert!(matches!(find_t0(&[], 0.9, 2.5e-4, settings(500)), Err(ForceError::NoDeparture { .. })));
    }
}
