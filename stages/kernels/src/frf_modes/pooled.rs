//! Variances that few averages have estimated, made surer by their neighbours.

use crate::statistics::median;

/// Degrees of freedom that a variance shall have: known to 16 %, which costs a weighted mean 1 % of its efficiency.
const DEGREES: f64 = 80.0;
/// How many more variances a median takes to be as sure as a mean, for Gaussian ones.
const MEDIAN: f64 = std::f64::consts::FRAC_PI_2;
/// Lines that are looked at on either side, at most. Why: noise that the input's sensor adds follows the resonances.
const MOST: usize = 20;

/// The variance of each line of a response, estimated from `averages` independent blocks, drawn to the median of its
/// neighbours' as far as it is not known by itself.
///
/// # Model
/// A variance `s` of `n` blocks has `v = 2 (n - 1)` degrees of freedom: chi square over v times the true one, which
/// varies slowly with frequency but for single lines (hum).
/// # Method
/// `(v s + v0 m) / (v + v0)` with `v + v0` = 80: m is the median of 80 degrees of freedom or more, at most of 20 lines on
/// either side, over the median of chi square / v (Wilson and Hilferty). Weights of 1/s would cost a fit of 5 blocks a
/// third of its efficiency, and its weighted squares would be v / (v - 2) times what they promise.
/// # Shapes
/// K lines; values that are not finite stay and count nowhere. From 41 averages on nothing is changed; nor with one.
/// # Source
/// G. K. Smyth, Stat. Appl. Genet. Mol. Biol. 3 (2004) 3 (moderated variances).
pub fn pooled_variance(variance: &[f64], averages: f64) -> Vec<f64> {
    let own = 2.0 * (averages - 1.0);
    if !(own > 0.0 && own < DEGREES) {
        return variance.to_vec();
    }
    let half = ((0.5 * MEDIAN * DEGREES / own).ceil() as usize).min(MOST);
    let low = (1.0 - 2.0 / (9.0 * own)).powi(3);
    let at = |k: usize| {
        let near = &variance[k.saturating_sub(half)..(k + half + 1).min(variance.len())];
        let level = median(&mut near.to_vec()) / low;
        (own * variance[k] + (DEGREES - own) * level) / DEGREES
    };
    (0..variance.len()).map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    /// Sample variances of these degrees of freedom; the true one is 1.
    fn sampled(lines: usize, degrees: usize, seed: u64) -> Vec<f64> {
        let noise = white_noise(lines * degrees, 1.0, seed);
        noise.chunks(degrees).map(|own| own.iter().map(|e| e * e).sum::<f64>() / degrees as f64).collect()
    }

    #[test]
    fn few_blocks_give_the_level_and_a_line_of_hum_stays_one() {
        for (averages, seed) in [(2.0, 1), (3.0, 2), (5.0, 3), (12.0, 4)] {
            let mut variance = sampled(2000, 2 * (averages as usize - 1), seed);
            variance[700] = 1000.0;
            let pooled = pooled_variance(&variance, averages);
            let others: Vec<f64> = (0..2000).filter(|k| *k != 700).map(|k| pooled[k]).collect();
            let mean = others.iter().sum::<f64>() / others.len() as f64;
            let scatter = others.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / others.len() as f64;
            // neighbours share their medians: 2000 lines are 50 independent ones, each known to 0.2
            assert!((mean - 1.0).abs() < 3.0 * 0.2 / 50f64.sqrt(), "{averages}: {mean}");
            // own part and median, 80 and up to 80 degrees of freedom, and a tenth
            assert!(scatter.sqrt() < 1.1 * (2.0 / 80.0 + 2.0 / 80.0_f64).sqrt(), "{averages}: {}", scatter.sqrt());
            assert!(pooled[700] > 20.0 && pooled[699] < 2.0 && pooled[701] < 2.0);
        }
    }

    #[test]
    fn what_is_known_by_itself_or_not_at_all_stays() {
        let variance = sampled(100, 8, 5);
        assert!([1.0, 41.0, 500.0, f64::NAN].iter().all(|averages| pooled_variance(&variance, *averages) == variance));
        let mut holed = variance;
        holed[50] = f64::NAN;
        let pooled = pooled_variance(&holed, 5.0);
        assert!(pooled.iter().enumerate().all(|(k, v)| v.is_finite() == (k != 50)));
        assert!(pooled_variance(&[], 5.0).is_empty());
    }
}
