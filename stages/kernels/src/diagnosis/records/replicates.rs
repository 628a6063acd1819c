//! Records as replicates: errors that assume nothing of the noise within one.

use crate::statistics::{median, student_two_sided};

/// Mean and its standard error from the scatter of replicates; the error is NaN for fewer than two.
pub(super) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// A value of each record, and how much it counts.
pub(super) type Weighted = (f64, f64);

/// Most that a replicate may count, in medians of all weights: weights are a guess, and one record must not decide
/// alone.
const MOST_WEIGHT: f64 = 4.0;

/// The same where the replicates' variances are as the inverse of their weights.
pub(super) fn weighted_mean_and_error(values: &[Weighted]) -> (f64, f64) {
    let mut weights: Vec<f64> = values.iter().map(|(_, weight)| *weight).collect();
    let most = MOST_WEIGHT * median(&mut weights);
    let capped = || values.iter().map(|(value, weight)| (*value, weight.min(most)));
    let sum: f64 = capped().map(|(_, w)| w).sum();
    let mean = capped().map(|(v, w)| w * v).sum::<f64>() / sum;
    let variance = capped().map(|(v, w)| w * (v - mean).powi(2)).sum::<f64>() / (values.len() as f64 - 1.0);
    (mean, (variance / sum).sqrt())
}

/// Two-sided p-value of Student's t test that the mean of the replicates is zero; 1 where it can't be asked (fewer than
/// three).
pub(super) fn t_test(values: &[Weighted]) -> f64 {
    if values.len() < 3 {
        return 1.0;
    }
    let (mean, error) = weighted_mean_and_error(values);
    student_two_sided(mean / error, values.len() as f64 - 1.0)
}

/// Standard error of a statistic from its values with one record left out each (B. Efron, Ann. Stat. 7 (1979) 1).
pub(super) fn jackknife(left_out: &[f64]) -> f64 {
    let n = left_out.len() as f64;
    if n < 2.0 {
        return f64::NAN;
    }
    let mean = left_out.iter().sum::<f64>() / n;
    (left_out.iter().map(|value| (value - mean).powi(2)).sum::<f64>() * (n - 1.0) / n).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_few_replicates_cannot_be_asked() {
        assert_eq!(t_test(&[(1.0, 1.0), (1.1, 1.0)]), 1.0);
    }

    #[test]
    fn the_jackknife_of_a_mean_is_its_standard_error() {
        let values = [1.0, 4.0, 2.0, 7.0, 3.5];
        let sum: f64 = values.iter().sum();
        let left_out: Vec<f64> = values.iter().map(|value| (sum - value) / 4.0).collect();
        assert!((jackknife(&left_out) - mean_and_error(&values).1).abs() < 1e-12);
    }
}
