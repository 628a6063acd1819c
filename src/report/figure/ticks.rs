//! Where ticks stand and what they read.

use super::svg::superscript;

/// A tick; minor ones have no label.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Tick {
    pub value: f64,
    pub label: Option<String>,
}

/// Ticks at multiples of 1, 2, 2.5 or 5 times a power of ten, about `wanted` of them; labels divided by `factor`.
pub(super) fn linear(low: f64, high: f64, wanted: f64, factor: f64) -> Vec<Tick> {
    let (low, high) = (low / factor, high / factor);
    let rough = (high - low) / wanted.max(1.0);
    if !(rough.is_finite() && rough > 0.0) {
        return Vec::new();
    }
    let power = 10f64.powf(rough.log10().floor());
    let step = [1.0, 2.0, 2.5, 5.0, 10.0]
        .map(|m| m * power)
        .into_iter()
        .find(|step| *step >= rough * 0.999)
        .unwrap_or(power * 10.0);
    stepped(low, high, step, factor)
}

/// Ticks at multiples of 45, 90, 180, ... degrees.
pub(super) fn degrees(low: f64, high: f64, wanted: f64) -> Vec<Tick> {
    let rough = (high - low) / wanted.max(1.0);
    if !(rough.is_finite() && rough > 0.0) || rough < 20.0 {
        return linear(low, high, wanted, 1.0);
    }
    let step = [45.0, 90.0, 180.0, 360.0, 720.0, 1440.0, 3600.0].into_iter().find(|step| *step >= rough);
    step.map_or_else(|| linear(low, high, wanted, 1.0), |step| stepped(low, high, step, 1.0))
}

fn stepped(low: f64, high: f64, step: f64, factor: f64) -> Vec<Tick> {
    let slack = 1e-9 * (high - low);
    let first = ((low - slack) / step).ceil();
    let decimals = decimals(step);
    // `wanted` bounds their number; the cap only guards against rounding at extreme ranges
    (0..1000)
        .map(|k| (first + f64::from(k)) * step)
        .take_while(|value| *value <= high + slack)
        .map(|value| Tick { value: value * factor, label: Some(plain(value, decimals)) })
        .collect()
}

/// Decimals that tell multiples of `step` apart.
fn decimals(step: f64) -> usize {
    (0..12)
        .find(|&n| ((step * 10f64.powi(n)).round() - step * 10f64.powi(n)).abs() < 1e-6 * step * 10f64.powi(n))
        .unwrap_or(12) as usize
}

/// A number with a proper minus sign and narrow spaces between thousands.
fn plain(value: f64, decimals: usize) -> String {
    let text = format!("{:.*}", decimals, value.abs());
    let (whole, fraction) = text.split_once('.').unwrap_or((&text, ""));
    let mut out = String::new();
    if value < 0.0 && text.chars().any(|c| c.is_ascii_digit() && c != '0') {
        out.push('−');
    }
    for (k, c) in whole.chars().enumerate() {
        if k > 0 && (whole.len() - k).is_multiple_of(3) && whole.len() > 4 {
            out.push('\u{202f}');
        }
        out.push(c);
    }
    if !fraction.is_empty() {
        out.push('.');
        out.push_str(fraction);
    }
    out
}

/// Decades, with minor ticks between; below two decades also 2 and 5 are labelled.
pub(super) fn logarithmic(low: f64, high: f64, wanted: f64, label: impl Fn(f64) -> String) -> Vec<Tick> {
    if !(low > 0.0 && high > low && high.is_finite()) {
        return Vec::new();
    }
    let decades = (high / low).log10();
    if decades < 0.7 {
        return linear(low, high, wanted, 1.0)
            .into_iter()
            .map(|tick| Tick { label: Some(label(tick.value)), ..tick })
            .collect();
    }
    let every = ((decades / wanted).ceil() as i32).max(1);
    let labelled: &[u32] = if decades < 1.8 { &[1, 2, 5] } else { &[1] };
    let mut ticks = Vec::new();
    for exponent in low.log10().floor() as i32..=high.log10().ceil() as i32 {
        let minors = if decades <= 8.0 { 9 } else { 1 };
        for digit in 1..=minors {
            let value = f64::from(digit) * 10f64.powi(exponent);
            if value < low * (1.0 - 1e-9) || value > high * (1.0 + 1e-9) {
                continue;
            }
            let major = labelled.contains(&digit) && (digit != 1 || exponent.rem_euclid(every) == 0);
            ticks.push(Tick { value, label: major.then(|| label(value)) });
        }
    }
    ticks
}

/// `0.1`, `2` and `50` as they are, what is smaller or larger as `1.5·10⁻⁶`.
pub(super) fn power_label(value: f64) -> String {
    let text = format!("{value:.3e}");
    let (digits, exponent) = text.split_once('e').unwrap_or((&text, "0"));
    let exponent: i32 = exponent.parse().unwrap_or(0);
    let digits = if digits.contains('.') { digits.trim_end_matches('0').trim_end_matches('.') } else { digits };
    if (-1..=1).contains(&exponent) {
        let decimals = digits.len().saturating_sub(2) as i32 - exponent;
        return plain(value, usize::try_from(decimals).unwrap_or(0));
    }
    if digits == "1" {
        format!("10{}", superscript(exponent))
    } else {
        format!("{digits}·10{}", superscript(exponent))
    }
}

/// A value with an SI prefix: `46.3 kHz`.
pub(super) fn prefixed(value: f64, unit: &str) -> String {
    let (factor, prefix) = prefix_of(value);
    let number = format!("{:.4}", value / factor);
    let number = number.trim_end_matches('0').trim_end_matches('.');
    format!("{number} {prefix}{unit}")
}

/// The SI prefix that makes a value lie between 1 and 1000.
pub(super) fn prefix_of(value: f64) -> (f64, &'static str) {
    const PREFIXES: [(f64, &str); 11] = [
        (1e12, "T"),
        (1e9, "G"),
        (1e6, "M"),
        (1e3, "k"),
        (1.0, ""),
        (1e-3, "m"),
        (1e-6, "µ"),
        (1e-9, "n"),
        (1e-12, "p"),
        (1e-15, "f"),
        (1e-18, "a"),
    ];
    let size = value.abs() * (1.0 + 1e-9);
    if size.is_nan() || size <= 1e-19 {
        return (1.0, "");
    }
    PREFIXES.into_iter().find(|(factor, _)| size >= *factor).unwrap_or((1e-18, "a"))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn labels(ticks: &[Tick]) -> Vec<String> {
        ticks.iter().filter_map(|tick| tick.label.clone()).collect()
    }

    #[test]
    fn linear_ticks_are_round() {
        assert_eq!(labels(&linear(-0.7, 1.1, 5.0, 1.0)), ["−0.5", "0.0", "0.5", "1.0"]);
        assert_eq!(labels(&linear(0.0, 3e-6, 4.0, 1e-6)), ["0", "1", "2", "3"]);
        assert_eq!(labels(&linear(0.0, 30_000.0, 3.0, 1.0)), ["0", "10\u{202f}000", "20\u{202f}000", "30\u{202f}000"]);
        assert!(linear(1.0, 1.0, 5.0, 1.0).is_empty());
        assert!(linear(f64::NAN, 1.0, 5.0, 1.0).is_empty());
    }

    #[test]
    fn phase_ticks_are_quarter_turns() {
        assert_eq!(labels(&degrees(-400.0, 10.0, 5.0)), ["−360", "−270", "−180", "−90", "0"]);
    }

    #[test]
    fn decades_are_labelled_and_others_minor() {
        let ticks = logarithmic(3e-4, 30.0, 6.0, power_label);
        assert_eq!(labels(&ticks), ["10⁻³", "10⁻²", "0.1", "1", "10"]);
        assert!(ticks.len() > 30);
        assert_eq!(
            ["1", "0.5", "0.15", "20", "12.5", "10⁻³", "2.5·10⁶"],
            [1.0, 0.5, 0.15, 20.0, 12.5, 1e-3, 2.5e6].map(power_label)
        );
        assert_eq!(
            labels(&logarithmic(2.1e-6, 2.9e-6, 4.0, power_label)),
            ["2.2·10⁻⁶", "2.4·10⁻⁶", "2.6·10⁻⁶", "2.8·10⁻⁶"]
        );
        assert_eq!(labels(&logarithmic(1e-30, 1.0, 6.0, power_label)).len(), 7);
        assert!(logarithmic(0.0, 1.0, 5.0, power_label).is_empty());
    }

    #[test]
    fn prefixes_follow_the_size() {
        assert_eq!(prefixed(46_300.0, "Hz"), "46.3 kHz");
        assert_eq!(prefixed(1e6, "Hz"), "1 MHz");
        assert_eq!(prefix_of(0.0), (1.0, ""));
        assert_eq!(prefix_of(1e-30), (1.0, ""));
    }
}
