//! Numbers as people read them.

use super::figure::superscript;

/// A dash for what is unknown.
pub(crate) const UNKNOWN: &str = "–";

/// A number with at most six significant digits: `46300.1`, `1.2·10⁻⁹`.
pub(crate) fn number(value: f64) -> String {
    if value.is_nan() {
        return UNKNOWN.to_owned();
    }
    if value.is_infinite() {
        return if value > 0.0 { "∞" } else { "−∞" }.to_owned();
    }
    if value == 0.0 {
        return "0".to_owned();
    }
    let exponent = exponent_of(value);
    if (-4..9).contains(&exponent) {
        let decimals = usize::try_from(5 - exponent).unwrap_or(0);
        return minus(trim(&format!("{value:.decimals$}")));
    }
    let (mantissa, exponent) = split_exponent(value, 5);
    minus(format!("{}·10{}", trim(&mantissa), superscript(exponent)))
}

/// A whole number with narrow spaces between thousands.
pub(crate) fn integer(value: i64) -> String {
    let digits = value.unsigned_abs().to_string();
    let mut out = if value < 0 { "−".to_owned() } else { String::new() };
    for (k, c) in digits.chars().enumerate() {
        if k > 0 && (digits.len() - k).is_multiple_of(3) && digits.len() > 4 {
            out.push('\u{202f}');
        }
        out.push(c);
    }
    out
}

/// A value with its standard error in units of its last digits: `46.30012(4)`.
///
/// Method: the error keeps two digits if they are below 36, otherwise one (the Particle Data Group's rule, simplified).
/// Without a finite, positive error the value stands alone.
pub(crate) fn with_error(value: f64, error: f64) -> String {
    if !(value.is_finite() && error.is_finite() && error > 0.0) {
        return number(value);
    }
    let mut exponent = exponent_of(error);
    let mut digits = error / 10f64.powi(exponent - 1);
    let two = digits.round() < 36.0;
    if two {
        exponent -= 1;
    } else {
        digits = (digits / 10.0).round();
        if digits >= 9.5 {
            // 0.96 rounds to 1.0: one place up, two digits
            digits = 10.0;
        }
    }
    let in_last = digits.round();
    if exponent > 0 || value.abs() >= 1e9 || (value != 0.0 && value.abs() < 1e-4) {
        return in_powers(value, error);
    }
    // a double holds some 17 digits: more decimals would be invented
    let decimals = usize::try_from(-exponent).unwrap_or(0).min(20);
    minus(format!("{value:.decimals$}({in_last:.0})"))
}

/// `1.23(4)·10⁶` where decimals cannot show the error.
fn in_powers(value: f64, error: f64) -> String {
    let exponent = exponent_of(if value == 0.0 { error } else { value }).max(exponent_of(error));
    let scale = 10f64.powi(exponent);
    // powers of ten that a double cannot hold, and errors that vanish beside the value
    if exponent == 0 || exponent.abs() > 290 || error < 1e-15 * value.abs() || error > 1e15 * value.abs() {
        return minus(format!("{} ± {}", number(value), number(error)));
    }
    if value.abs() < 1e6 && value.abs() >= 1e-4 {
        // 1230(60): plain digits read better than a power
        let place = 10f64.powi(exponent_of(error) - i32::from(error / 10f64.powi(exponent_of(error)) < 3.55));
        let round = |x: f64| (x / place).round() * place;
        return minus(format!("{:.0}({:.0})", round(value), round(error)));
    }
    format!("{}·10{}", with_error(value / scale, error / scale), superscript(exponent))
}

/// A value with its unit and an SI prefix, error in brackets: `46.30012(4) kHz`.
pub(crate) fn quantity(value: f64, error: f64, unit: &str) -> String {
    if !value.is_finite() {
        return UNKNOWN.to_owned();
    }
    let (factor, prefix) = prefix(value, unit);
    format!("{} {prefix}{}", with_error(value / factor, error / factor), super::figure::pretty_unit(unit))
        .trim_end()
        .to_owned()
}

/// A value with so many significant digits, its unit and an SI prefix: `46.30 kHz`.
pub(crate) fn rounded(value: f64, digits: usize, unit: &str) -> String {
    if !value.is_finite() {
        return UNKNOWN.to_owned();
    }
    let (factor, prefix) = prefix(value, unit);
    let value = value / factor;
    let whole = format!("{:.0}", value.abs().trunc()).len();
    let decimals = digits.saturating_sub(whole).min(20);
    minus(format!("{value:.decimals$} {prefix}{}", super::figure::pretty_unit(unit)).trim_end().to_owned())
}

fn prefix(value: f64, unit: &str) -> (f64, &'static str) {
    const PREFIXES: [(f64, &str); 8] =
        [(1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"), (1e-12, "p")];
    if !matches!(unit, "V" | "s" | "Hz" | "N" | "m" | "A" | "J") || value == 0.0 {
        return (1.0, "");
    }
    PREFIXES.into_iter().find(|(factor, _)| value.abs() >= *factor).unwrap_or((1e-12, "p"))
}

/// Seconds as people say them.
pub(crate) fn duration(seconds: f64) -> String {
    match seconds {
        s if !s.is_finite() || s < 0.0 => UNKNOWN.to_owned(),
        s if s < 1.0 => format!("{:.0} ms", 1e3 * s),
        s if s < 60.0 => format!("{s:.1} s"),
        s => format!("{:.0} min {:02.0} s", (s / 60.0).floor(), (s % 60.0).floor()),
    }
}

/// Bytes as people say them.
pub(crate) fn bytes(count: u64) -> String {
    let count = count as f64;
    match count {
        b if b < 1e3 => format!("{b:.0} B"),
        b if b < 1e6 => format!("{:.1} kB", b / 1e3),
        b if b < 1e9 => format!("{:.1} MB", b / 1e6),
        b => format!("{:.2} GB", b / 1e9),
    }
}

/// Decimal exponent after rounding to six digits.
fn exponent_of(value: f64) -> i32 {
    format!("{value:.5e}").rsplit('e').next().and_then(|exponent| exponent.parse().ok()).unwrap_or(0)
}

fn split_exponent(value: f64, decimals: usize) -> (String, i32) {
    let text = format!("{value:.decimals$e}");
    let (mantissa, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    (mantissa.to_owned(), exponent.parse().unwrap_or(0))
}

fn trim(text: &str) -> String {
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text.to_owned() }
}

fn minus(text: String) -> String {
    text.replacen('-', "−", 1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_six_digits() {
        assert_eq!(number(46_300.123), "46300.1");
        assert_eq!(number(-0.00012345678), "−0.000123457");
        assert_eq!(number(1.5e-12), "1.5·10⁻¹²");
        assert_eq!(number(-1.5e12), "−1.5·10¹²");
        assert_eq!(number(0.999_999_9), "1");
        assert_eq!(number(f64::NAN), "–");
        assert_eq!(number(1_051_200.0), "1051200");
        assert_eq!(integer(-3_000_000), "−3\u{202f}000\u{202f}000");
    }

    #[test]
    fn errors_stand_in_brackets() {
        assert_eq!(with_error(46_300.123, 0.4), "46300.1(4)");
        assert_eq!(with_error(46_300.123, 0.14), "46300.12(14)");
        assert_eq!(with_error(40.8, 0.0521), "40.80(5)");
        assert_eq!(with_error(-330.2, 6.6), "−330(7)");
        assert_eq!(with_error(503.8, 0.96), "503.8(10)");
        assert_eq!(with_error(1_234.0, 56.0), "1230(60)");
        assert_eq!(with_error(12.0, f64::NAN), "12");
        assert_eq!(with_error(12.0, 0.0), "12");
        assert_eq!(with_error(1.5e-9, 2e-11), "1.500(20)·10⁻⁹");
        assert_eq!(with_error(f64::NAN, 1.0), "–");
    }

    #[test]
    fn quantities_have_prefixes() {
        assert_eq!(quantity(46_300.1, 0.4, "Hz"), "46.3001(4) kHz");
        assert_eq!(quantity(3.8, 0.4, "N/m"), "3.8(4) N/m");
        assert_eq!(quantity(-330e-9, 4e-9, "N"), "−330(4) nN");
        assert_eq!(quantity(f64::NAN, 1.0, "N"), "–");
        assert_eq!(rounded(46_300.1, 4, "Hz"), "46.30 kHz");
        assert_eq!(rounded(1_051_234.0, 4, "Hz"), "1.051 MHz");
    }

    #[test]
    fn every_double_can_be_written() {
        for value in [f64::MAX, f64::MIN, f64::MIN_POSITIVE, 5e-324, -1e-300, 1e22, 999_999.95] {
            for error in [0.0, 5e-324, 1e-300, 1e-5, 1.0, 1e10, f64::MAX, f64::INFINITY] {
                let text = with_error(value, error);
                assert!(!text.is_empty() && !text.contains("inf") && !text.contains("NaN"), "{text}");
                assert!(quantity(value, error, "Hz").len() < 700);
            }
        }
    }
}
