//! Titles and units of columns.

use super::number::bare;
use std::collections::HashMap;

/// A column's title and unit.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Title {
    pub(super) name: String,
    pub(super) unit: String,
}

/// Units that make a row of short words a row of units.
const KNOWN_UNITS: [&str; 27] = [
    "s", "sec", "ms", "us", "µs", "ns", "min", "V", "mV", "uV", "µV", "A", "mA", "nA", "pA", "N", "nN", "pN", "m",
    "mm", "um", "µm", "nm", "pm", "Hz", "kHz", "deg",
];

/// Splits `Deflection (V)` or `Deflection [V]`; without brackets, the title is the name.
pub(super) fn split_unit(text: &str) -> Title {
    let text = bare(text);
    for (open, close) in [('(', ')'), ('[', ']')] {
        if let Some((name, unit)) = text.strip_suffix(close).and_then(|t| t.rsplit_once(open)) {
            return Title { name: name.trim().to_owned(), unit: unit.trim().to_owned() };
        }
    }
    Title { name: text.to_owned(), unit: String::new() }
}

/// Whether a row of fields names units only.
pub(super) fn are_units(fields: &[String]) -> bool {
    let mut filled = fields.iter().map(|f| bare(f)).filter(|f| !f.is_empty()).peekable();
    if filled.peek().is_none() {
        return false;
    }
    let bracketed = |f: &&str| (f.starts_with('[') && f.ends_with(']')) || (f.starts_with('(') && f.ends_with(')'));
    let all: Vec<&str> = filled.collect();
    all.iter().all(bracketed)
        || (all.iter().any(|f| KNOWN_UNITS.contains(f))
            && all.iter().all(|f| f.chars().count() <= 8 && !f.contains(' ')))
}

/// Seconds in the unit of a time; none if it is no unit of time.
pub(super) fn seconds(unit: &str) -> Option<f64> {
    Some(match unit.to_lowercase().trim_end_matches('.') {
        "s" | "sec" | "secs" | "second" | "seconds" => 1.0,
        "ms" | "msec" | "milliseconds" => 1e-3,
        "us" | "µs" | "μs" | "usec" | "microseconds" => 1e-6,
        "ns" | "nsec" | "nanoseconds" => 1e-9,
        "min" | "minutes" => 60.0,
        "h" | "hours" => 3600.0,
        _ => return None,
    })
}

/// Whether a title is that of time.
pub(super) fn is_time(title: &Title) -> bool {
    let name = title.name.to_lowercase();
    let words = ["time", "t", "zeit", "temps", "elapsed time", "x_value", "timestamp", "relative time"];
    words.contains(&name.as_str()) || (name.starts_with("time") && seconds(&title.unit).is_some())
}

/// Locations: the title, `column_3` without one, `Title[2]` for the second of a title.
pub(super) fn locations(names: &[&str]) -> Vec<String> {
    let mut seen: HashMap<String, usize> = HashMap::new();
    let of = |(number, name): (usize, &&str)| {
        let name = if name.is_empty() { format!("column_{}", number + 1) } else { (*name).to_owned() };
        let times = seen.entry(name.clone()).and_modify(|n| *n += 1).or_insert(1);
        if *times == 1 { name } else { format!("{name}[{times}]") }
    };
    names.iter().enumerate().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_split_from_titles() {
        let title = |name: &str, unit: &str| Title { name: name.to_owned(), unit: unit.to_owned() };
        assert_eq!(split_unit("Deflection (V)"), title("Deflection", "V"));
        assert_eq!(split_unit("\"Height [nm]\""), title("Height", "nm"));
        assert_eq!(split_unit("PressCo ABS. (MPa)"), title("PressCo ABS.", "MPa"));
        assert_eq!(split_unit("[V]"), title("", "V"));
        assert_eq!(split_unit("Plain"), title("Plain", ""));
    }

    #[test]
    fn locations_are_distinct() {
        assert_eq!(locations(&["a", "", "a"]), ["a", "column_2", "a[2]"]);
    }
}
