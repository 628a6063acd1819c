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
    let slow = Slow::of(values);
    values.iter().enumerate().map(|(k, value)| value - slow.at(k)).collect()
}

/// What leaves its level and comes back to it: as [`without_slow`], of a step nothing. Each sample is less that line, or
/// the median of its own stretch or of one beside it, whichever is nearest.
///
/// Shapes: N samples, finite. Cost: O(N).
pub fn without_steps(values: &[f64]) -> Vec<f64> {
    let slow = Slow::of(values);
    let nearest = |(k, value): (usize, &f64)| {
        let levels = slow.beside(k).iter().chain([&slow.at(k)]).map(|level| value - level).collect::<Vec<f64>>();
        levels.into_iter().min_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap_or_default()
    };
    values.iter().enumerate().map(nearest).collect()
}

/// Medians of stretches.
struct Slow {
    samples: usize,
    length: usize,
    levels: Vec<f64>,
}

impl Slow {
    fn of(values: &[f64]) -> Self {
        let length = (values.len() / STRETCHES).max(LEAST_SAMPLES);
        let levels = values.chunks(length).map(|stretch| median(&mut stretch.to_vec())).collect();
        Self { samples: values.len(), length, levels }
    }

    /// The middle of a stretch; the last one may be short.
    fn centre(&self, stretch: usize) -> f64 {
        let end = ((stretch + 1) * self.length).min(self.samples);
        (stretch * self.length + end) as f64 / 2.0 - 0.5
    }

    /// On the straight line between the medians of the two stretches about a sample.
    fn at(&self, k: usize) -> f64 {
        let (at, own) = (k as f64, k / self.length);
        let first = if at < self.centre(own) { own.saturating_sub(1) } else { own };
        let first = first.min(self.levels.len().saturating_sub(2));
        let (Some(&one), Some(&two)) = (self.levels.get(first), self.levels.get(first + 1)) else {
            return self.levels[0];
        };
        let (from, to) = (self.centre(first), self.centre(first + 1));
        one + (two - one) * ((at - from) / (to - from)).clamp(0.0, 1.0)
    }

    /// The median of a sample's own stretch and of those beside it.
    fn beside(&self, k: usize) -> &[f64] {
        let own = k / self.length;
        &self.levels[own.saturating_sub(1)..(own + 2).min(self.levels.len())]
    }
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
        assert!(without_slow(&[]).is_empty() && without_steps(&[]).is_empty());
    }

    #[test]
    fn of_a_step_nothing_is_left_and_a_pulse_stays() {
        for at in [300, 1777, 1999, 2000, 2001, 3990] {
            let pulse = |k: usize| if k == 1200 { 10.0 } else { 0.0 };
            let values: Vec<f64> = (0..4000).map(|k| f64::from(u8::from(k >= at)) + pulse(k)).collect();
            for (k, value) in without_steps(&values).into_iter().enumerate() {
                // ten samples at the end are no level of their own
                assert!(
                    k >= 3990 || (value.abs() - pulse(k)).abs() <= 1.0 && (pulse(k) > 0.0 || value == 0.0),
                    "{at}, {k}: {value}"
                );
            }
        }
    }
}
