//! Lines: bins that no chance explains.

use crate::spectra::seen_oscillator::SeenThrough;
use crate::statistics::gamma_tail;

/// When a bin counts as a line.
#[derive(Debug, Clone, Copy)]
pub(super) struct LineRule {
    /// Density over the fitted one above which a bin is a line.
    pub threshold: f64,
    reach: usize,
}

impl LineRule {
    /// `false_alarm`: probability that any of `bins` is taken for a line by chance (Bonferroni); 0: never.
    pub fn new(averages: f64, bins: usize, false_alarm: f64, through: SeenThrough) -> Self {
        let threshold = if false_alarm > 0.0 { quantile(averages, false_alarm / bins as f64) } else { f64::INFINITY };
        Self { threshold, reach: through.line_reach() }
    }

    /// The same with a threshold so many times as high.
    pub fn times(self, factor: f64) -> Self {
        Self { threshold: factor * self.threshold, ..self }
    }

    /// The highest bin of each run of bins above the threshold; runs closer than the window's reach are one line.
    pub fn lines(&self, density: &[f64], model: &[f64]) -> Vec<usize> {
        let ratio = |k: usize| density[k] / model[k];
        let mut lines: Vec<(usize, usize)> = Vec::new();
        for k in (0..density.len()).filter(|&k| ratio(k) > self.threshold) {
            match lines.last_mut() {
                Some((top, last)) if k - *last <= self.reach + 1 => {
                    if ratio(k) > ratio(*top) {
                        *top = k;
                    }
                    *last = k;
                }
                _ => lines.push((k, k)),
            }
        }
        lines.into_iter().map(|line| line.0).collect()
    }
}

/// Which bins are no part of a line.
pub(super) fn flagged(density: &[f64], model: &[f64], rule: &LineRule) -> Vec<bool> {
    let mut used = vec![true; density.len()];
    for k in (0..density.len()).filter(|&k| density[k] > rule.threshold * model[k]) {
        let to = (k + rule.reach + 1).min(used.len());
        used[k.saturating_sub(rule.reach)..to].fill(false);
    }
    used
}

/// What the mean of `averages` exponentials of mean one exceeds with probability `tail`.
fn quantile(averages: f64, tail: f64) -> f64 {
    // a gamma variable of shape below 1/2 has no use here: a mean of one spectrum has shape 1
    let shape = averages.max(0.5);
    let exceeds = |ratio: f64| gamma_tail(shape, shape * ratio) > tail;
    let (mut low, mut high) = (1.0, 2.0);
    while exceeds(high) && high < 1e6 {
        high *= 2.0;
    }
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if exceeds(middle) { low = middle } else { high = middle }
    }
    high
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_threshold_is_the_gamma_quantile() {
        // one spectrum: exp(-x) = 1e-4
        let rule = LineRule::new(1.0, 100, 0.01, SeenThrough::Rectangular);
        assert!((rule.threshold - 1e4_f64.ln()).abs() < 1e-9);
        // Octave: gammaincinv(1e-6, 32, "upper") / 32
        let rule = LineRule::new(32.0, 1000, 1e-3, SeenThrough::Hann);
        assert!((rule.threshold - 2.0748045).abs() < 1e-6, "{}", rule.threshold);
        assert!(LineRule::new(32.0, 1000, 0.0, SeenThrough::Hann).threshold.is_infinite());
    }
}
