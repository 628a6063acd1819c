//! Integrals of an exponential over a sample, which every exact discretisation is made of.

use faer::c64;

/// Below this the recurrence loses digits to cancellation, and the series has few terms.
const SERIES_BELOW: f64 = 2.0;
/// Terms of the series: `2^30 / 30!` is below rounding.
const TERMS: usize = 30;

/// `I_m(x) = integral of v^m exp(x v) from 0 to 1`, m = 0, 1, 2.
pub(super) fn moments(x: c64) -> [c64; 3] {
    if x.norm() < SERIES_BELOW {
        return [0.0, 1.0, 2.0].map(|m| series(x, m));
    }
    let top = x.exp();
    let first = (top - 1.0) / x;
    let second = (top - first) / x;
    [first, second, (top - second * 2.0) / x]
}

/// `sum x^j / (j! (m + j + 1))`.
fn series(x: c64, m: f64) -> c64 {
    let mut power = c64::new(1.0, 0.0);
    let mut sum = c64::new(0.0, 0.0);
    for j in 0..TERMS {
        sum += power / (m + j as f64 + 1.0);
        power = power * x / (j as f64 + 1.0);
    }
    sum
}

#[cfg(test)]
#[test]
fn series_and_recurrence_agree_where_they_meet() {
    for x in [c64::new(-1.2, 1.7), c64::new(0.3, -2.0), c64::new(-2.05, 0.0)] {
        let [a, b, c] = moments(x);
        for (m, found) in [a, b, c].into_iter().enumerate() {
            // rounding of thirty terms, or of a difference that loses one digit
            assert!((found - series(x, m as f64)).norm() < 1e-14, "{x} {m}");
        }
    }
}
