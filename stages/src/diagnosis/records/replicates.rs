//! Records as replicates: tails and errors that assume nothing of the noise within one.

/// Mean and its standard error from the scatter of replicates; the error is NaN for fewer than two.
pub(super) fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let variance = values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, (variance / n).sqrt())
}

/// A value of each record, and how much it counts.
pub(super) type Weighted = (f64, f64);

/// Most that a replicate may count, in medians of all weights: weights are a guess, and one record must not decide alone.
const MOST_WEIGHT: f64 = 4.0;

/// The same where the replicates' variances are as the inverse of their weights.
pub(super) fn weighted_mean_and_error(values: &[Weighted]) -> (f64, f64) {
    let mut weights: Vec<f64> = values.iter().map(|(_, weight)| *weight).collect();
    let most = MOST_WEIGHT * crate::statistics::median(&mut weights);
    let capped = || values.iter().map(|(value, weight)| (*value, weight.min(most)));
    let sum: f64 = capped().map(|(_, w)| w).sum();
    let mean = capped().map(|(v, w)| w * v).sum::<f64>() / sum;
    let variance = capped().map(|(v, w)| w * (v - mean).powi(2)).sum::<f64>() / (values.len() as f64 - 1.0);
    (mean, (variance / sum).sqrt())
}

/// Two-sided p-value of Student's t test that the mean of the replicates is zero; 1 where it can't be asked (fewer than three).
pub(super) fn t_test(values: &[Weighted]) -> f64 {
    if values.len() < 3 {
        return 1.0;
    }
    let (mean, error) = weighted_mean_and_error(values);
    student_two_sided(mean / error, values.len() as f64 - 1.0)
}

/// Probability that Student's t of that many degrees of freedom exceeds `t` in absolute size.
///
/// # Source
/// NIST Digital Library of Mathematical Functions, 8.17: `I_x(df/2, 1/2)` with `x = df / (df + t^2)`.
pub(super) fn student_two_sided(t: f64, degrees: f64) -> f64 {
    if !t.is_finite() {
        return if t.is_nan() { 1.0 } else { 0.0 };
    }
    incomplete_beta(0.5 * degrees, 0.5, degrees / (degrees + t * t))
}

/// Probability of at least `hits` of `trials`, each with probability `p`.
pub(super) fn binomial_tail(hits: usize, trials: usize, p: f64) -> f64 {
    if hits == 0 {
        return 1.0;
    }
    // DLMF 8.17.5
    incomplete_beta(hits as f64, (trials - hits) as f64 + 1.0, p)
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

/// Regularised incomplete beta function by Lentz's continued fraction (DLMF 8.17.22).
pub(super) fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x.is_nan() {
        return f64::NAN;
    }
    if x <= 0.0 || x >= 1.0 {
        return if x <= 0.0 { 0.0 } else { 1.0 };
    }
    let front = (ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b) + a * x.ln() + b * (-x).ln_1p()).exp();
    if x < (a + 1.0) / (a + b + 2.0) {
        front * beta_fraction(a, b, x) / a
    } else {
        1.0 - front * beta_fraction(b, a, 1.0 - x) / b
    }
}

fn beta_fraction(a: f64, b: f64, x: f64) -> f64 {
    let keep = |v: f64| if v.abs() < 1e-300 { 1e-300 } else { v };
    let (mut c, mut d) = (1.0, 1.0 / keep(1.0 - (a + b) * x / (a + 1.0)));
    let mut h = d;
    for m in 1..10_000 {
        let m = f64::from(m);
        for term in [
            m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m)),
            -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0)),
        ] {
            d = 1.0 / keep(1.0 + term * d);
            c = keep(1.0 + term / c);
            h *= d * c;
        }
        if (d * c - 1.0).abs() < 1e-15 {
            break;
        }
    }
    h
}

/// `ln Gamma(a)`: Stirling's series after shifting above 15.
fn ln_gamma(a: f64) -> f64 {
    let (mut shift, mut z) = (0.0, a);
    while z < 15.0 {
        shift += z.ln();
        z += 1.0;
    }
    let series = 1.0 / (12.0 * z) - 1.0 / (360.0 * z.powi(3)) + 1.0 / (1260.0 * z.powi(5));
    (z - 0.5) * z.ln() - z + 0.5 * std::f64::consts::TAU.ln() + series - shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_agree_with_tables() {
        // scipy.stats: 2 t.sf(2.262157, 9) = 0.05; t with 2 degrees: 1 - t / sqrt(2 + t^2) exactly; binom.sf(7, 10, 0.5) = 56/1024
        assert!((student_two_sided(2.262_157_162_740_992, 9.0) - 0.05).abs() < 1e-9);
        let t: f64 = 20.0;
        let exact = 1.0 - t / (2.0 + t * t).sqrt();
        assert!((student_two_sided(t, 2.0) / exact - 1.0).abs() < 1e-8);
        assert!((binomial_tail(8, 10, 0.5) - 56.0 / 1024.0).abs() < 1e-10);
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
