//! Tail probabilities of the chi-square and the normal distribution.

/// Probability that a chi-square variable of `degrees` exceeds `value`.
///
/// # Method
/// Upper regularised incomplete gamma function: series below `degrees/2 + 1`, Lentz's continued fraction above.
///
/// # Accuracy
/// About 1e-12 relative for up to a thousand degrees.
///
/// # Source
/// NIST Digital Library of Mathematical Functions, 8.7.1 and 8.9.2.
pub fn chi_square_tail(value: f64, degrees: usize) -> f64 {
    if degrees == 0 || value.is_nan() {
        return f64::NAN;
    }
    gamma_tail(0.5 * degrees as f64, 0.5 * value)
}

/// Value that a chi-square variable exceeds with that probability. Bisection of [`chi_square_tail`], to rounding.
pub fn chi_square_level(probability: f64, degrees: usize) -> f64 {
    // at ten times the degrees and 1500 the tail is below the least number
    let (mut low, mut high) = (0.0, 10.0 * degrees as f64 + 1500.0);
    for _ in 0..80 {
        let middle = 0.5 * (low + high);
        if chi_square_tail(middle, degrees) > probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

/// Probability that a gamma variable of shape `a >= 0.5` and scale one exceeds `x`: the mean of `K` periodograms over
/// its expectation is one of shape `K`, divided by `K`.
///
/// # Method
/// As [`chi_square_tail`].
///
/// # Accuracy
/// About 1e-12 relative for shapes up to a thousand.
pub fn gamma_tail(a: f64, x: f64) -> f64 {
    if a.is_nan() || x.is_nan() || a < 0.5 {
        return f64::NAN;
    }
    if x <= 0.0 {
        return 1.0;
    }
    let front = (a * x.ln() - x - ln_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        while term > 1e-17 * sum {
            n += 1.0;
            term *= x / n;
            sum += term;
        }
        (1.0 - front * sum).clamp(0.0, 1.0)
    } else {
        let tiny = 1e-300;
        let mut b = x + 1.0 - a;
        let (mut c, mut d) = (1.0 / tiny, 1.0 / b);
        let mut h = d;
        for i in 1..10_000 {
            let i = f64::from(i);
            let an = -i * (i - a);
            b += 2.0;
            let keep = |v: f64| if v.abs() < tiny { tiny } else { v };
            d = 1.0 / keep(an * d + b);
            c = keep(b + an / c);
            h *= d * c;
            if (d * c - 1.0).abs() < 1e-15 {
                break;
            }
        }
        front * h
    }
}

/// Probability that a standard normal variable exceeds `value` in absolute size.
pub fn normal_two_sided(value: f64) -> f64 {
    chi_square_tail(value * value, 1)
}

/// `ln Gamma(a)` for `a > 0`.
///
/// # Method
/// Stirling's series after shifting above 15.
///
/// # Accuracy
/// 1e-14 absolute, or 1e-15 relative where that is more.
///
/// # Source
/// NIST Digital Library of Mathematical Functions, 5.11.1.
pub fn ln_gamma(a: f64) -> f64 {
    let (mut shift, mut z) = (0.0, a);
    while z < 15.0 {
        shift += z.ln();
        z += 1.0;
    }
    let inverse = 1.0 / (z * z);
    let terms = [1.0 / 1188.0, -1.0 / 1680.0, 1.0 / 1260.0, -1.0 / 360.0, 1.0 / 12.0];
    let series = terms.iter().fold(0.0, |sum, term| sum * inverse + term) / z;
    (z - 0.5) * z.ln() - z + 0.5 * std::f64::consts::TAU.ln() + series - shift
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gamma_function_is_the_factorial_and_doubles() {
        let mut factorial = 0.0;
        for n in 1..150 {
            let n = f64::from(n);
            assert!((ln_gamma(n) - factorial).abs() < 2e-14 * factorial.max(1.0), "{n}");
            factorial += n.ln();
        }
        // DLMF 5.5.5: Gamma(2 z) = 2^(2 z - 1) Gamma(z) Gamma(z + 1/2) / sqrt(pi)
        for z in [0.25, 0.7, 3.3, 40.1] {
            let doubled =
                (2.0 * z - 1.0) * 2.0_f64.ln() + ln_gamma(z) + ln_gamma(z + 0.5) - 0.5 * std::f64::consts::PI.ln();
            assert!((ln_gamma(2.0 * z) - doubled).abs() < 1e-13 * doubled.abs().max(1.0), "{z}");
        }
    }

    #[test]
    fn a_level_is_exceeded_with_its_probability() {
        // scipy.stats.chi2.isf
        for (probability, degrees, value) in [(1e-3, 1, 10.827_566_170_662_733), (1e-3, 100, 149.449_252_779_038_9)] {
            assert!((chi_square_level(probability, degrees) / value - 1.0).abs() < 1e-9, "{degrees}");
        }
    }

    #[test]
    fn tails_agree_with_tables() {
        // scipy.stats.chi2.sf
        for (value, degrees, tail) in
            [(3.841_458_820_694_124, 1, 0.05), (18.307_038_053_275_146, 10, 0.05), (2.0, 2, 0.367_879_441_171_442_3)]
        {
            assert!((chi_square_tail(value, degrees) / tail - 1.0).abs() < 1e-10, "{value}");
        }
        // two degrees: exp(-x/2) exactly, far out
        assert!((chi_square_tail(100.0, 2) / (-50.0f64).exp() - 1.0).abs() < 1e-10);
        assert!((normal_two_sided(1.959_963_984_540_054) - 0.05).abs() < 1e-12);
        assert_eq!(chi_square_tail(0.0, 3), 1.0);
    }
}
