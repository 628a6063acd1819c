//! What wanders slower than pulses.

use super::median;

/// Stretches whose medians the wander is drawn through. Why: up to half of a stretch may be pulses.
const STRETCHES: usize = 32;
/// Least samples of a stretch.
const LEAST_SAMPLES: usize = 16;

/// Pulses without offset, drift and slow wander: less the straight lines between the medians of 32 stretches.
///
/// Shapes: N samples, finite. Cost: O(N).
pub fn without_slow(values: &[f64]) -> Vec<f64> {
    let length = (values.len() / STRETCHES).max(LEAST_SAMPLES);
    let levels: Vec<f64> = values.chunks(length).map(|stretch| median(&mut stretch.to_vec())).collect();
    // the last stretch may be short
    let centre = |stretch: usize| (stretch * length + ((stretch + 1) * length).min(values.len())) as f64 / 2.0 - 0.5;
    let level = |k: usize| {
        let at = k as f64;
        let own = k / length;
        let first = if at < centre(own) { own.saturating_sub(1) } else { own }.min(levels.len().saturating_sub(2));
        let (Some(&one), Some(&two)) = (levels.get(first), levels.get(first + 1)) else { return levels[0] };
        one + (two - one) * ((at - centre(first)) / (centre(first + 1) - centre(first))).clamp(0.0, 1.0)
    };
    values.iter().enumerate().map(|(k, value)| value - level(k)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pulses_stay_and_a_drift_goes() {
        for samples in [4000, 4001, 40, 20, 7, 1] {
            let pulse = |k: usize| if k % 500 == 20 { 10.0 } else { 0.0 };
            let values: Vec<f64> = (0..samples).map(|k| 3.0 + 2e-3 * k as f64 + pulse(k)).collect();
            for (k, value) in without_slow(&values).into_iter().enumerate() {
                // half a stretch at either end has its median alone
                assert!((value - pulse(k)).abs() < 2e-3 * 64.0, "{samples}, {k}: {value}");
            }
        }
        assert!(without_slow(&[]).is_empty());
    }
}
