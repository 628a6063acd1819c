//! The chi-square distribution for degrees that are no whole number: mean values over blocks.

/// Probability that a chi-square variable of `degrees` exceeds `value`.
///
/// Method: incomplete gamma function, series or continued fraction (Lentz).
/// Source: Abramowitz and Stegun 6.5.
pub fn chi_square_tail(value: f64, degrees: f64) -> f64 {
    let both = value > 0.0 && degrees > 0.0;
    if !both {
        return 1.0;
    }
    let (a, x) = (0.5 * degrees, 0.5 * value);
    let front = (a * x.ln() - x - log_gamma(a)).exp();
    if x < a + 1.0 {
        let (mut term, mut sum, mut n) = (1.0 / a, 1.0 / a, a);
        for _ in 0..10_000 {
            n += 1.0;
            term *= x / n;
            sum += term;
            if term < sum * 1e-14 {
                break;
            }
        }
        return (1.0 - front * sum).clamp(0.0, 1.0);
    }
    let mut b = x + 1.0 - a;
    let mut c = 1e300;
    let mut d = 1.0 / b;
    let mut h = d;
    for i in 1..10_000 {
        let an = -(i as f64) * (i as f64 - a);
        b += 2.0;
        d = 1.0 / (an * d + b);
        c = b + an / c;
        let step = d * c;
        h *= step;
        if (step - 1.0).abs() < 1e-14 {
            break;
        }
    }
    (front * h).clamp(0.0, 1.0)
}

/// Value that a chi-square variable exceeds with that probability. Method: bisection.
pub fn chi_square_level(probability: f64, degrees: f64) -> f64 {
    let (mut low, mut high) = (0.0, 10.0 * degrees + 1500.0);
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

/// Logarithm of the gamma function (Stirling, shifted to x > 8).
fn log_gamma(x: f64) -> f64 {
    let (mut x, mut shift) = (x, 0.0);
    while x < 8.0 {
        shift -= x.ln();
        x += 1.0;
    }
    let y = 1.0 / (x * x);
    let series = (1.0 / 12.0 - y * (1.0 / 360.0 - y * (1.0 / 1260.0 - y / 1680.0))) / x;
    shift + (x - 0.5) * x.ln() - x + 0.918_938_533_204_672_8 + series
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tails_are_those_of_the_tables() {
        // two degrees: exp(-x/2); one degree: 10.828 at a thousandth; 100 degrees: 149.449 at a thousandth
        assert!((chi_square_tail(4.0, 2.0) - (-2.0_f64).exp()).abs() < 1e-12);
        assert!((chi_square_level(1e-3, 1.0) - 10.8276).abs() < 1e-3);
        assert!((chi_square_level(1e-3, 100.0) - 149.4493).abs() < 1e-3);
    }
}
