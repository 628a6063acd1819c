//! Whether a number says anything, for whatever shows it.

/// What stands in the place of a number that says nothing.
pub const UNDETERMINED: &str = "undetermined";

/// Names of what is above zero; of zeros in the right half plane below it.
const ABOVE_ZERO: [&str; 5] = ["frequency", "frequency_hz", "quality_factor", "damping_ratio", "decay_rate"];

/// Whether a quantity that is not zero is known: its standard error is smaller than itself. Without an error it is.
pub fn is_determined(value: f64, std: f64) -> bool {
    !(std.is_finite() && value.is_finite()) || std < value.abs()
}

/// Whether the value of that name is known; what may be negative (differences, shares, parts of shapes) always is.
pub fn says(name: &str, value: f64, std: f64) -> bool {
    !ABOVE_ZERO.contains(&name) || is_determined(value, std)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_above_zero_is_known_where_its_error_is_smaller_than_itself() {
        assert!(says("frequency_hz", 46_300.0, 0.4) && says("frequency_hz", 1.0, f64::NAN));
        assert!(!says("frequency_hz", 0.0, 6300.0) && !says("quality_factor", 1e8, 4.6e9));
        assert!(!says("damping_ratio", 0.008, 0.016) && says("quality_factor", -3.0, 1.0));
        assert!(says("static_share", -0.1, 0.4) && says("frequency_difference", -1.0, 3.0));
        assert!(says("re", 0.01, 0.4) && says("frequency_z", 0.1, 1.0));
    }
}
