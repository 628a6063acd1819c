//! Axes: scale, limits, units, ticks.

use super::svg::superscript;
use super::ticks::{self, Tick};

/// How ticks are chosen and written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum TickStyle {
    /// Plain numbers; the unit with its prefix stands in the axis label.
    Plain,
    /// Every tick carries its unit: `10 kHz`.
    Prefixed,
    /// Multiples of 45 or 90 degrees.
    Degrees,
    /// Whole numbers.
    Whole,
}

/// What an axis shows.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Axis {
    pub label: String,
    pub unit: String,
    pub log: bool,
    pub limits: Option<(f64, f64)>,
    pub style: TickStyle,
    pub hide_labels: bool,
}

impl Axis {
    /// A linear axis that fits the data; `unit` as artifacts write it.
    pub fn new(label: &str, unit: &str) -> Self {
        Self {
            label: label.to_owned(),
            unit: unit.to_owned(),
            log: false,
            limits: None,
            style: TickStyle::Plain,
            hide_labels: false,
        }
    }

    /// Frequency in decades, ticks such as `10 kHz`.
    pub fn frequency() -> Self {
        Self { log: true, style: TickStyle::Prefixed, ..Self::new("Frequency", "Hz") }
    }

    /// Phase in degrees.
    pub fn phase() -> Self {
        Self { style: TickStyle::Degrees, ..Self::new("Phase", "°") }
    }

    /// Ticks at whole numbers.
    pub fn whole(mut self) -> Self {
        self.style = TickStyle::Whole;
        self
    }

    /// Logarithmic.
    pub fn log(mut self) -> Self {
        self.log = true;
        self
    }

    /// With fixed limits. Limits that are not finite, or not positive on a logarithmic axis, are ignored.
    pub fn limits(mut self, low: f64, high: f64) -> Self {
        self.limits = Some((low, high));
        self
    }

    /// Without labels: another panel below carries them.
    pub fn bare(mut self) -> Self {
        self.hide_labels = true;
        self
    }

    /// Fits limits to `extent` (of finite data), pads them by a share, and picks the unit's prefix.
    pub(super) fn resolve(&self, extent: Option<(f64, f64)>, padding: f64, length_px: f64) -> Option<Resolved> {
        let good = |(low, high): &(f64, f64)| {
            low.is_finite() && high.is_finite() && low <= high && (!self.log || *low > 0.0) && (high - low).is_finite()
        };
        let fixed = self.limits.filter(good);
        let (low, high) = fixed.or(extent.filter(good))?;
        let (low, high) = widen(low, high, self.log, if fixed.is_some() { 0.0 } else { padding });
        let (factor, unit) = self.display_unit(low, high);
        let spacing_px = match self.style {
            TickStyle::Prefixed => 95.0,
            TickStyle::Degrees => 40.0,
            TickStyle::Plain | TickStyle::Whole => 62.0,
        };
        let wanted = (length_px / spacing_px).max(2.0);
        let ticks = match (self.log, self.style) {
            (true, TickStyle::Prefixed) => {
                ticks::logarithmic(low, high, wanted, |value| ticks::prefixed(value, &self.unit))
            }
            (true, _) => ticks::logarithmic(low, high, wanted, ticks::power_label),
            (false, TickStyle::Degrees) => ticks::degrees(low, high, wanted),
            (false, TickStyle::Whole) => ticks::linear(low, high, wanted.min(high - low), 1.0),
            (false, _) => ticks::linear(low, high, wanted, factor),
        };
        Some(Resolved { log: self.log, low, high, factor, unit, ticks })
    }

    fn display_unit(&self, low: f64, high: f64) -> (f64, String) {
        let pretty = pretty_unit(&self.unit);
        if self.log || self.style != TickStyle::Plain {
            return (1.0, if self.style == TickStyle::Prefixed { String::new() } else { pretty });
        }
        let size = low.abs().max(high.abs());
        if matches!(self.unit.as_str(), "V" | "s" | "Hz" | "N" | "m" | "A" | "W" | "Pa" | "J") {
            let (factor, prefix) = ticks::prefix_of(size);
            return (factor, format!("{prefix}{pretty}"));
        }
        if size == 0.0 || (1e-2..1e5).contains(&size) {
            return (1.0, pretty);
        }
        let exponent = 3 * (size.log10() / 3.0).floor() as i32;
        if exponent.abs() > 300 {
            return (1.0, pretty);
        }
        (10f64.powi(exponent), format!("10{} {pretty}", superscript(exponent)).trim_end().to_owned())
    }
}

fn widen(low: f64, high: f64, log: bool, padding: f64) -> (f64, f64) {
    if log {
        let ratio = (high / low).max(1.0);
        let factor = if ratio < 1.0 + 1e-9 { 2.0 } else { ratio.powf(padding) };
        return (low / factor, high * factor);
    }
    let span = high - low;
    // below this a double cannot hold ten distinct ticks
    if span <= 1e-12 * low.abs().max(high.abs()) {
        let room = if low == 0.0 { 1.0 } else { 0.05 * low.abs().max(high.abs()) };
        return (low - room, high + room);
    }
    (low - padding * span, high + padding * span)
}

/// An axis with its limits, unit and ticks.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Resolved {
    pub log: bool,
    pub low: f64,
    pub high: f64,
    /// What values are divided by before they are written, as `unit` says.
    pub factor: f64,
    pub unit: String,
    pub ticks: Vec<Tick>,
}

impl Resolved {
    /// Where a value lies, 0 at the low end and 1 at the high end; none if it has no place (not finite, not positive on
    /// a logarithmic axis).
    pub fn place(&self, value: f64) -> Option<f64> {
        let place = if self.log {
            if value <= 0.0 {
                return None;
            }
            (value / self.low).ln() / (self.high / self.low).ln()
        } else {
            (value - self.low) / (self.high - self.low)
        };
        place.is_finite().then_some(place)
    }
}

/// A unit as people write it: `V^2/Hz` becomes `V²/Hz`, `1` nothing.
pub(crate) fn pretty_unit(unit: &str) -> String {
    if unit == "1" {
        return String::new();
    }
    let mut out = String::new();
    let mut raised = false;
    for c in unit.chars() {
        match c {
            '^' => raised = true,
            '*' => out.push('·'),
            '-' if raised => out.push('⁻'),
            c if raised && c.is_ascii_digit() => out.push_str(&superscript(c as i32 - '0' as i32)),
            c => {
                raised = false;
                out.push(c);
            }
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_written_for_people() {
        assert_eq!(pretty_unit("V^2/Hz"), "V²/Hz");
        assert_eq!(pretty_unit("s^-1"), "s⁻¹");
        assert_eq!(pretty_unit("1"), "");
    }

    #[test]
    fn a_constant_signal_still_has_an_axis() {
        for value in [0.0, -3.5, 1e-300] {
            let axis = Axis::new("y", "V").resolve(Some((value, value)), 0.05, 300.0).expect("limits");
            assert!(axis.low < axis.high, "{axis:?}");
        }
    }

    #[test]
    fn microseconds_are_shown_as_such() {
        let axis = Axis::new("Time", "s").resolve(Some((-1e-5, 8e-5)), 0.0, 600.0).expect("limits");
        assert_eq!(axis.unit, "µs");
        assert!(axis.ticks.iter().any(|tick| tick.label.as_deref() == Some("0")));
    }

    #[test]
    fn limits_that_make_no_sense_are_ignored() {
        let axis = Axis::new("y", "1").log().limits(-1.0, 1.0);
        assert!(axis.resolve(None, 0.0, 100.0).is_none());
        assert!(axis.resolve(Some((1.0, 10.0)), 0.0, 100.0).is_some());
        assert!(Axis::new("y", "1").resolve(Some((f64::NAN, 1.0)), 0.0, 100.0).is_none());
        assert!(Axis::new("y", "1").resolve(Some((f64::MIN, f64::MAX)), 0.0, 100.0).is_none());
    }
}
