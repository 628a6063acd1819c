//! Codes of a converter.

/// Smallest step between values of a channel: one code of its converter; 0 where values are not codes.
pub fn code_step(values: &[f64]) -> f64 {
    let mut sorted: Vec<f64> = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
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
