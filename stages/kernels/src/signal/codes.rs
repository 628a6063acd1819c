//! Codes of a converter.

/// Bits of a number as a whole number that is larger for larger numbers, and back.
fn ordered(bits: i64) -> i64 {
    bits ^ ((bits >> 63) & i64::MAX)
}

/// Smallest step between values of a channel: one code of its converter; 0 where values are not codes.
pub fn code_step(values: &[f64]) -> f64 {
    // whole numbers in the values' order: they sort in half the time
    let mut sorted: Vec<i64> = values.iter().map(|value| ordered(value.to_bits().cast_signed())).collect();
    sorted.sort_unstable();
    let mut sorted: Vec<f64> = sorted.into_iter().map(|key| f64::from_bits(ordered(key).cast_unsigned())).collect();
    let (Some(first), Some(last)) = (sorted.first(), sorted.last()) else { return 0.0 };
    let range = last - first;
    sorted.dedup();
    // as many values as samples: no codes
    if sorted.len() * 4 > 3 * values.len() {
        return 0.0;
    }
    let steps = sorted.windows(2).map(|w| w[1] - w[0]).filter(|s| *s > 1e-9 * range);
    let least = steps.fold(f64::INFINITY, f64::min);
    if least.is_finite() { least } else { 0.0 }
}
