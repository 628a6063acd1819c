//! Times of day in a column.

use super::number::bare;
use crate::printed::Printed;

const DAY_NS: i64 = 86_400_000_000_000;

/// The times of a column since its first, row by row; a time that is far below the one before is of the next day.
#[derive(Debug, Clone, Default)]
pub(super) struct Stamps {
    pub(super) seconds: Vec<f64>,
    pub(super) printed: Printed,
    first_ns: i64,
    last_ns: i64,
}

impl Stamps {
    /// Takes the field of a row, if it is a time of day.
    pub(super) fn take(&mut self, field: &str) {
        let Some((ns, decimals)) = time_of_day(bare(field)) else { return };
        let mut ns = ns + self.last_ns.div_euclid(DAY_NS) * DAY_NS;
        if self.seconds.is_empty() {
            self.first_ns = ns;
        } else if ns + DAY_NS / 2 < self.last_ns {
            ns += DAY_NS;
        }
        self.last_ns = ns;
        let seconds = (ns - self.first_ns) as f64 / 1e9;
        self.printed.see(&format!("{seconds:.decimals$}"));
        self.seconds.push(seconds);
    }

    /// Whether each of so many rows has a time and they rise on the whole.
    pub(super) fn tell_time(&self, rows: usize) -> bool {
        rows > 2 && self.seconds.len() == rows && self.last_ns > self.first_ns
    }
}

/// Nanoseconds since midnight and the digits behind the decimal sign: of `12:00:01.5`, `2020-01-01T00:00:01,25+02:00`,
/// `1/31/2020  1:02:03 PM`, `02:03.5` (minutes).
fn time_of_day(text: &str) -> Option<(i64, usize)> {
    let colon = text.find(':')?;
    let begin = text.get(..colon)?.rfind(|c: char| !c.is_ascii_digit()).map_or(0, |at| at + 1);
    let rest = text.get(begin..)?;
    let end = rest.find(|c: char| !(c.is_ascii_digit() || matches!(c, ':' | '.' | ','))).unwrap_or(rest.len());
    let (time, behind) = rest.split_at(end);
    let parts: Vec<&str> = time.split(':').collect();
    let fraction = |part: &str| -> Option<(i64, usize)> {
        let (whole, digits) = part.split_once(['.', ',']).unwrap_or((part, ""));
        let shown = digits.len().min(9);
        let ns = format!("{:0<9}", digits.get(..shown)?).parse::<i64>().ok()?;
        Some((whole.parse::<i64>().ok()?.checked_mul(1_000_000_000)?.checked_add(ns)?, shown))
    };
    let (hours, minutes, seconds) = match parts[..] {
        [hours, minutes, seconds] => (hours, minutes, seconds),
        [minutes, seconds] if seconds.contains(['.', ',']) => ("0", minutes, seconds),
        [hours, minutes] => (hours, minutes, "0"),
        _ => return None,
    };
    let (seconds_ns, decimals) = fraction(seconds)?;
    let (hours, minutes) = (hours.parse::<i64>().ok()?, minutes.parse::<i64>().ok()?);
    let half = behind.trim().to_ascii_lowercase();
    let hours = match (half.starts_with("pm"), half.starts_with("am"), hours) {
        (true, _, 1..=11) => hours + 12,
        (_, true, 12) => 0,
        _ => hours,
    };
    let inside = (0..24).contains(&hours) && (0..60).contains(&minutes) && seconds_ns < 61_000_000_000;
    inside.then_some(((hours * 60 + minutes) * 60_000_000_000 + seconds_ns, decimals))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_of_day_are_read_in_every_form() {
        let second = |text: &str| time_of_day(text).map(|(ns, digits)| (ns as f64 / 1e9, digits));
        for (text, seconds, digits) in [
            ("12:00:01.500", 43_201.5, 3),
            ("2020-01-01T00:00:01,25+02:00", 1.25, 2),
            ("2020-01-01T00:00:01.000001Z", 1.000_001, 6),
            ("2020-01-01 00:01:00-05:00", 60.0, 0),
            ("1/31/2020  1:02:03 PM", 46_923.0, 0),
            ("12:00:05 AM", 5.0, 0),
            ("02:03.5", 123.5, 1),
        ] {
            assert_eq!(second(text), Some((seconds, digits)), "{text}");
        }
        for text in ["2020-01-01", "25:00:00", "a:b", "1:2:3:4", ""] {
            assert_eq!(second(text), None, "{text}");
        }
    }

    #[test]
    fn midnight_begins_another_day() {
        let mut stamps = Stamps::default();
        ["23:59:59.5", "00:00:00.0", "00:00:00.5"].iter().for_each(|text| stamps.take(text));
        assert_eq!(stamps.seconds, [0.0, 0.5, 1.0]);
        assert!(stamps.tell_time(3) && !stamps.tell_time(4));
    }
}
