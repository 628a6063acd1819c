//! Median and scale that outliers cannot move.

/// Median of the finite values; NaN if there are none. Reorders `values`. Cost: O(n).
///
/// Of an even number, the mean of the two middle values.
pub fn median(values: &mut [f64]) -> f64 {
    let finite = partition_finite(values);
    let values = &mut values[..finite];
    if values.is_empty() {
        return f64::NAN;
    }
    let middle = values.len() / 2;
    let even = values.len().is_multiple_of(2);
    let (below, &mut upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    match below.iter().copied().max_by(f64::total_cmp) {
        Some(lower) if even => 0.5 * (lower + upper),
        _ => upper,
    }
}

/// Median and robust standard deviation of the finite values; NaN if there are none. Overwrites `values`. Cost: O(n).
///
/// # Method
/// 1.4826 times the median absolute deviation, the standard deviation of a Gaussian; up to half of the values may be
/// arbitrary. Codes of a coarse converter make it 0 where more than half of the values agree: callers put a floor under
/// it.
/// # Source
/// Hampel, J. Am. Stat. Assoc. 69 (1974) 383.
pub fn median_and_scale(values: &mut [f64]) -> (f64, f64) {
    let center = median(values);
    for value in values.iter_mut() {
        *value = (*value - center).abs();
    }
    (center, 1.4826 * median(values))
}

fn partition_finite(values: &mut [f64]) -> usize {
    let mut kept = 0;
    for index in 0..values.len() {
        if values[index].is_finite() {
            values.swap(kept, index);
            kept += 1;
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn median_of_odd_even_and_no_values() {
        assert_eq!(median(&mut [3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&mut [4.0, 1.0, f64::NAN, 2.0, 3.0]), 2.5);
        assert!(median(&mut [f64::NAN]).is_nan());
    }

    #[test]
    fn scale_is_the_gaussian_standard_deviation_despite_a_fifth_of_outliers() {
        for seed in 0..5 {
            let mut values = white_noise(10_000, 2.0, seed);
            for value in values.iter_mut().step_by(5) {
                *value = 1e6;
            }
            let (center, scale) = median_and_scale(&mut values);
            // a fifth of one-sided outliers moves the median to the 62nd percentile (0.32 sigma) and widens the scale
            // by 1.35
            assert!(center.abs() < 0.4 * 2.0, "{center}");
            assert!((scale / 2.0 - 1.35).abs() < 0.1, "{scale}");
        }
    }
}
