//! Numbers for people.

use crate::determined::{UNDETERMINED, says};

/// A number with six significant digits; what is unknown (NaN) is `-`.
pub fn number(value: f64) -> String {
    if value.is_nan() {
        return "-".to_owned();
    }
    if value == 0.0 || value.is_infinite() {
        return format!("{value}");
    }
    let exponent = value.abs().log10().floor() as i32;
    if (-4..7).contains(&exponent) {
        let decimals = usize::try_from(5 - exponent).unwrap_or(0);
        let text = format!("{value:.decimals$}");
        return if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text };
    }
    let text = format!("{value:.5e}");
    match text.split_once('e') {
        Some((digits, power)) => format!("{}e{power}", digits.trim_end_matches('0').trim_end_matches('.')),
        None => text,
    }
}

/// A number that was looked at and not estimated: `about` and three significant digits.
pub fn about(value: f64) -> String {
    let rounded = format!("{value:.2e}").parse().unwrap_or(value);
    format!("about {}", number(rounded))
}

/// The value of that name with its standard deviation, where it says anything.
pub fn named_with_std(name: &str, value: f64, std: f64) -> String {
    if says(name, value, std) { with_std(value, std) } else { UNDETERMINED.to_owned() }
}

/// A value with its standard deviation in its last two digits: `46300.10(40)` is 46300.10 +- 0.40.
pub fn with_std(value: f64, std: f64) -> String {
    if !value.is_finite() || !std.is_finite() || std <= 0.0 {
        return number(value);
    }
    let exponent = value.abs().max(std).log10().floor() as i32;
    let power = if (-4..7).contains(&exponent) { 0 } else { exponent };
    let scale = 10f64.powi(-power);
    let (scaled, std) = (value * scale, std * scale);
    let decimals = 1 - std.log10().floor() as i32;
    // beyond the digits of a float there is nothing to show
    if decimals > 15 {
        return number(value);
    }
    let unit = 10f64.powi(decimals);
    let text = match usize::try_from(decimals) {
        Ok(decimals) => format!("{scaled:.decimals$}({:.0})", std * unit),
        Err(_) => format!("{:.0}({:.0})", (scaled * unit).round() / unit, (std * unit).round() / unit),
    };
    if power == 0 { text } else { format!("{text}e{power}") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_have_six_digits() {
        let cases = [
            (46300.123, "46300.1"),
            (0.000_123_456_78, "0.000123457"),
            (1.0, "1"),
            (5e6, "5000000"),
            (1.5e-9, "1.5e-9"),
            (0.0, "0"),
            (f64::NAN, "-"),
        ];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
        assert_eq!([about(47.126_8), about(762_615.0)], ["about 47.1", "about 763000"]);
    }

    #[test]
    fn standard_deviations_stand_in_the_last_two_digits() {
        let cases = [
            (46300.123, 0.4, "46300.12(40)"),
            (40.8, 0.05, "40.800(50)"),
            (1234.4, 12.3, "1234(12)"),
            (1234.5, 123.0, "1230(120)"),
            (3.3e-7, 2e-9, "3.300(20)e-7"),
            (0.0, 0.1, "0.00(10)"),
            (2.0, f64::NAN, "2"),
            (f64::NAN, 1.0, "-"),
        ];
        for (value, std, text) in cases {
            assert_eq!(with_std(value, std), text);
        }
    }
}
