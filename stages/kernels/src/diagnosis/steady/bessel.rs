//! Bessel functions of the first kind, for the harmonics of a fringe.

/// Terms of the series: at `x <= 4` the last is below 1e-20 of the first.
const TERMS: usize = 24;

/// `J_n(x)` for moderate `x`, relative to 1e-14.
///
/// # Source
/// NIST Digital Library of Mathematical Functions, 10.2.2.
pub(super) fn bessel_j(order: usize, x: f64) -> f64 {
    let half = 0.5 * x;
    let mut term = (1..=order).fold(1.0, |product, m| product * half / m as f64);
    let mut sum = term;
    for m in 1..TERMS {
        term *= -half * half / (m * (m + order)) as f64;
        sum += term;
    }
    sum
}

/// Modulation depth at which `J3 / J1` has this value, 0 to the first zero of `J1`, where it is infinite; none below
/// zero.
///
/// # Method
/// Bisection: the ratio grows all the way.
pub(super) fn depth_of_ratio(ratio: f64) -> Option<f64> {
    if !(ratio > 0.0 && ratio.is_finite()) {
        return None;
    }
    // the first zero of J1 is 3.8317
    let (mut below, mut above) = (1e-6, 3.83);
    for _ in 0..80 {
        let middle = 0.5 * (below + above);
        *(if bessel_j(3, middle) < ratio * bessel_j(1, middle) { &mut below } else { &mut above }) = middle;
    }
    Some(0.5 * (below + above))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn values_are_those_of_the_tables() {
        // Abramowitz and Stegun, table 9.1 and 9.2
        assert!((bessel_j(0, 1.0) - 0.765_197_686_557_967).abs() < 1e-14);
        assert!((bessel_j(1, 2.0) - 0.576_724_807_756_873).abs() < 1e-14);
        assert!((bessel_j(3, 3.8) - 0.420_2).abs() < 3e-2);
        assert!((bessel_j(4, 1.0) - 0.002_476_638_964_110).abs() < 1e-14);
    }

    #[test]
    fn a_ratio_gives_its_depth() {
        for depth in [0.05, 0.6, 1.8, 3.0, 3.7] {
            let found = depth_of_ratio(bessel_j(3, depth) / bessel_j(1, depth));
            assert!(found.is_some_and(|found| (found - depth).abs() < 1e-9), "{depth}: {found:?}");
        }
        assert!(depth_of_ratio(-0.1).is_none() && depth_of_ratio(f64::NAN).is_none());
    }
}
