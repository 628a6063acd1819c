//! Products of vectors.

/// Inner product of `a` and `b` over the shorter one's length, summed from the first element to the last.
///
/// # Accuracy
/// The rounding error is at most `n` times 1.1e-16 of the sum of the products' sizes.
#[inline]
pub fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Partial sums of [`dot_in_lanes`].
const LANES: usize = 8;

/// Inner product of two slices of one length in eight partial sums, for the processor's vector units. Another order of
/// summing: other last bits than [`dot`].
#[inline]
pub fn dot_in_lanes(a: &[f64], b: &[f64]) -> f64 {
    let ((a, a_rest), (b, b_rest)) = (a.as_chunks::<LANES>(), b.as_chunks::<LANES>());
    let mut lanes = [0.0; LANES];
    for (a, b) in a.iter().zip(b) {
        (0..LANES).for_each(|l| lanes[l] += a[l] * b[l]);
    }
    lanes.iter().sum::<f64>() + dot(a_rest, b_rest)
}

#[cfg(test)]
mod tests {
    use super::{dot, dot_in_lanes};

    #[test]
    fn products_are_summed() {
        assert_eq!(dot(&[1.0, 2.0, 3.0], &[4.0, -5.0, 6.0]), 12.0);
        assert_eq!(dot(&[], &[]), 0.0);
        // whole numbers are summed without rounding, in any order
        let a: Vec<f64> = (0..37).map(f64::from).collect();
        for count in [0, 1, 7, 8, 9, 37] {
            assert_eq!(dot_in_lanes(&a[..count], &a[..count]), dot(&a[..count], &a[..count]));
        }
    }
}
