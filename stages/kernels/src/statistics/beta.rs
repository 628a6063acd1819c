//! Tails of the F, Student's t and the binomial distribution.

use super::gamma::ln_gamma;

/// Probability that an F variable of `above` and `below` degrees of freedom exceeds `value`; 1 if that is no number.
///
/// # Source
/// M. Abramowitz, I. Stegun, Handbook of Mathematical Functions, 26.6.2.
pub fn f_tail(value: f64, above: f64, below: f64) -> f64 {
    if value.is_nan() || value <= 0.0 {
        return 1.0;
    }
    incomplete_beta(0.5 * below, 0.5 * above, below / (below + above * value))
}

/// Probability that Student's t of that many degrees of freedom exceeds `t` in absolute size; 1 if that is no number.
///
/// # Source
/// NIST Digital Library of Mathematical Functions, 8.17: `I_x(df/2, 1/2)` with `x = df / (df + t^2)`.
pub fn student_two_sided(t: f64, degrees: f64) -> f64 {
    if !t.is_finite() {
        return if t.is_nan() { 1.0 } else { 0.0 };
    }
    incomplete_beta(0.5 * degrees, 0.5, degrees / (degrees + t * t))
}

/// What Student's t of that many degrees of freedom exceeds in absolute size with probability `p`; 0 for `p` of 1 and
/// more, infinite for 0 and less.
///
/// # Method
/// Bisection of [`student_two_sided`] in the logarithm, to 1e-12.
///
/// # Source
/// NIST Digital Library of Mathematical Functions, 8.17.
pub fn student_limit(p: f64, degrees: f64) -> f64 {
    if p.is_nan() || p >= 1.0 || p <= 0.0 {
        return if p <= 0.0 { f64::INFINITY } else { 0.0 };
    }
    // ln t: below, so small that all exceeds it; above, none of the tails of doubles does
    let (mut below, mut above) = (-700.0_f64, 700.0_f64);
    while above - below > 1e-12 {
        let middle = 0.5 * (below + above);
        if middle <= below || middle >= above {
            break;
        }
        *(if student_two_sided(middle.exp(), degrees) > p { &mut below } else { &mut above }) = middle;
    }
    (0.5 * (below + above)).exp()
}

/// Probability of at least `hits` of `trials`, each with probability `p`.
///
/// # Source
/// NIST Digital Library of Mathematical Functions, 8.17.5.
pub fn binomial_tail(hits: usize, trials: usize, p: f64) -> f64 {
    if hits == 0 {
        return 1.0;
    }
    incomplete_beta(hits as f64, (trials - hits) as f64 + 1.0, p)
}

/// The regularised incomplete beta function `I_x(a, b)`; NaN if `x` is.
///
/// # Method
/// Its continued fraction by Lentz's method, on the side where that converges fast: accurate far into the tail, where 1
/// - cdf would be 0.
///
/// # Accuracy
/// 1e-12 relative for `a` and `b` up to a thousand.
///
/// # Source
/// NIST Digital Library of Mathematical Functions, 8.17.22.
pub fn incomplete_beta(a: f64, b: f64, x: f64) -> f64 {
    if x.is_nan() {
        return f64::NAN;
    }
    if x <= 0.0 || x >= 1.0 {
        return if x <= 0.0 { 0.0 } else { 1.0 };
    }
    let front = (a * x.ln() + b * (-x).ln_1p() + ln_gamma(a + b) - ln_gamma(a) - ln_gamma(b)).exp();
    if x < (a + 1.0) / (a + b + 2.0) {
        front * continued_fraction(a, b, x) / a
    } else {
        1.0 - front * continued_fraction(b, a, 1.0 - x) / b
    }
}

fn continued_fraction(a: f64, b: f64, x: f64) -> f64 {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_have_their_tabulated_values() {
        // Abramowitz, Stegun, table 26.9: upper points of F
        for (value, above, below, p) in [(4.00, 1.0, 60.0, 0.05), (7.08, 1.0, 60.0, 0.01), (3.07, 3.0, 24.0, 0.0471)] {
            assert!((f_tail(value, above, below) - p).abs() < 0.02 * p, "{value}: {}", f_tail(value, above, below));
        }
        // scipy.stats: 2 t.sf(2.262157, 9) = 0.05; binom.sf(7, 10, 0.5) = 56/1024
        assert!((student_two_sided(2.262_157_162_740_992, 9.0) - 0.05).abs() < 1e-9);
        assert!((binomial_tail(8, 10, 0.5) - 56.0 / 1024.0).abs() < 1e-12);
        assert_eq!((f_tail(f64::NAN, 1.0, 1.0), student_two_sided(f64::INFINITY, 3.0)), (1.0, 0.0));
    }

    #[test]
    fn closed_forms_hold_far_into_the_tail_and_for_many_degrees() {
        // of 2 degrees above, F has the tail (1 + 2 x / n)^(-n/2)
        for below in [1.0_f64, 3.0, 40.0, 1001.0] {
            for value in [0.3, 5.0, 50.0] {
                let exact = (1.0 + 2.0 * value / below).powf(-0.5 * below);
                let found = f_tail(value, 2.0, below);
                assert!((found / exact - 1.0).abs() < 1e-11, "{below} {value}: {found} {exact}");
            }
        }
        // t with 2 degrees: 1 - t / sqrt(2 + t^2), as 2 / (s (s + t)) with s = sqrt(2 + t^2), which loses no digits
        for t in [0.1_f64, 2.0, 20.0, 2000.0] {
            let s = (2.0 + t * t).sqrt();
            assert!((student_two_sided(t, 2.0) * s * (s + t) / 2.0 - 1.0).abs() < 1e-11, "{t}");
        }
        for (p, degrees) in [(0.05, 3.0), (6.3e-5, 4.0), (1e-9, 30.0), (0.9, 1.0)] {
            let back = student_two_sided(student_limit(p, degrees), degrees);
            assert!((back / p - 1.0).abs() < 1e-9, "{p} {degrees}: {back}");
        }
        assert_eq!((student_limit(1.0, 3.0), student_limit(0.0, 3.0)), (0.0, f64::INFINITY));
        // half of it lies on each side of the middle
        for a in [0.5, 7.0, 300.0] {
            assert!((incomplete_beta(a, a, 0.5) - 0.5).abs() < 1e-12, "{a}");
        }
    }
}
