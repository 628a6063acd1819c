//! Tails of the F distribution.

/// Probability of an F variable of `above` and `below` degrees of freedom beyond `value`.
///
/// # Method
/// The regularised incomplete beta function by its continued fraction; accurate far into the tail, where 1 - cdf would be 0.
/// # Source
/// M. Abramowitz, I. Stegun, Handbook of Mathematical Functions, 26.5.8 and 26.6.2.
pub(super) fn f_tail(value: f64, above: f64, below: f64) -> f64 {
    if value.is_nan() {
        return 1.0;
    }
    if value <= 0.0 {
        return 1.0;
    }
    incomplete_beta(below / (below + above * value), 0.5 * below, 0.5 * above)
}

/// `I_x(a, b)`.
fn incomplete_beta(x: f64, a: f64, b: f64) -> f64 {
    if x <= 0.0 || x >= 1.0 {
        return if x <= 0.0 { 0.0 } else { 1.0 };
    }
    let front = (a * x.ln() + b * (-x).ln_1p() + log_gamma(a + b) - log_gamma(a) - log_gamma(b)).exp();
    // the fraction converges fast on this side of the mean
    if x < (a + 1.0) / (a + b + 2.0) {
        front * fraction(x, a, b) / a
    } else {
        1.0 - front * fraction(1.0 - x, b, a) / b
    }
}

/// The continued fraction by Lentz's method.
fn fraction(x: f64, a: f64, b: f64) -> f64 {
    let guard = |value: f64| if value.abs() < 1e-300 { 1e-300 } else { value };
    let (mut c, mut d) = (1.0, 1.0 / guard(1.0 - (a + b) * x / (a + 1.0)));
    let mut result = d;
    for m in 1..300 {
        let m = f64::from(m);
        let even = m * (b - m) * x / ((a + 2.0 * m - 1.0) * (a + 2.0 * m));
        let odd = -(a + m) * (a + b + m) * x / ((a + 2.0 * m) * (a + 2.0 * m + 1.0));
        for term in [even, odd] {
            d = 1.0 / guard(1.0 + term * d);
            c = guard(1.0 + term / c);
            result *= d * c;
        }
        if (d * c - 1.0).abs() < 1e-15 {
            break;
        }
    }
    result
}

/// Logarithm of the gamma function for x > 0: Stirling's series above 8, the recurrence below.
fn log_gamma(x: f64) -> f64 {
    if x < 8.0 {
        return log_gamma(x + 1.0) - x.ln();
    }
    let inverse = 1.0 / (x * x);
    let series = (1.0 / 12.0 - inverse * (1.0 / 360.0 - inverse * (1.0 / 1260.0 - inverse / 1680.0))) / x;
    (x - 0.5) * x.ln() - x + 0.5 * (2.0 * std::f64::consts::PI).ln() + series
}

#[cfg(test)]
mod tests {
    use super::f_tail;

    #[test]
    fn the_tail_has_its_tabulated_values() {
        // Abramowitz, Stegun, table 26.9: upper points of F
        for (value, above, below, p) in [(4.00, 1.0, 60.0, 0.05), (7.08, 1.0, 60.0, 0.01), (3.07, 3.0, 24.0, 0.0471)] {
            assert!((f_tail(value, above, below) - p).abs() < 0.02 * p, "{value}: {}", f_tail(value, above, below));
        }
        // of 2 degrees above it is (1 + 2 x / n)^(-n/2)
        assert!((f_tail(50.0, 2.0, 40.0) / 3.5_f64.powi(-20) - 1.0).abs() < 1e-10);
    }
}
