//! What units and names say of times.

use crate::text::{number, quantity};

/// Units of time in seconds, in lower case, as files write them.
const SECONDS: [(&str, f64); 35] = [
    ("s", 1.0),
    ("sec", 1.0),
    ("secs", 1.0),
    ("second", 1.0),
    ("seconds", 1.0),
    ("sekunde", 1.0),
    ("sekunden", 1.0),
    ("ms", 1e-3),
    ("msec", 1e-3),
    ("msecs", 1e-3),
    ("millis", 1e-3),
    ("millisecond", 1e-3),
    ("milliseconds", 1e-3),
    ("us", 1e-6),
    ("µs", 1e-6),
    ("μs", 1e-6),
    ("usec", 1e-6),
    ("usecs", 1e-6),
    ("micros", 1e-6),
    ("microsecond", 1e-6),
    ("microseconds", 1e-6),
    ("ns", 1e-9),
    ("nsec", 1e-9),
    ("nanos", 1e-9),
    ("nanosecond", 1e-9),
    ("nanoseconds", 1e-9),
    ("ps", 1e-12),
    ("min", 60.0),
    ("minute", 60.0),
    ("minutes", 60.0),
    ("h", 3600.0),
    ("hour", 3600.0),
    ("hours", 3600.0),
    ("day", 86_400.0),
    ("days", 86_400.0),
];
/// Units that are long enough to be a name of times by themselves.
const LEAST_UNIT_NAME: usize = 6;
/// Words that name times.
const WORDS: [&str; 12] = [
    "time",
    "times",
    "zeit",
    "temps",
    "tiempo",
    "tout",
    "tvec",
    "timestamp",
    "timestamps",
    "elapsed",
    "timeaxis",
    "timevec",
];
/// Words beside them that change nothing.
const FILLERS: [&str; 14] = [
    "axis", "relative", "absolute", "since", "start", "stamp", "vector", "values", "value", "unix", "epoch", "system",
    "utc", "column",
];
/// What pandas calls the times in HDF5: of a table or a series, and of a fixed frame.
const PANDAS: [&str; 2] = ["index", "axis1"];

/// What a name says of times.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct TimeName {
    /// Seconds in its unit, if the name states one.
    pub(crate) seconds: Option<f64>,
    /// A word that is none of times: `in` of `t_in`, `b` of `Time B`. Others may be named so.
    pub(crate) label: Option<String>,
}

/// Seconds in the unit of a time; none if it is no unit of time. `milliseconds since 2020-01-01` is the CF conventions',
/// `1e-3 s` a unit with its factor.
pub fn seconds(unit: &str) -> Option<f64> {
    let lower = unit.trim().trim_matches(['(', ')', '[', ']', '.', ' ']).to_lowercase();
    let bare = lower.split_once(" since ").map_or(lower.as_str(), |(bare, _)| bare).trim();
    let of_name = |unit: &str| SECONDS.iter().find(|(name, _)| *name == unit).map(|(_, seconds)| *seconds);
    let with_factor = || {
        let (factor, unit) = quantity(bare, number)?;
        Some(factor * of_name(unit)?).filter(|seconds| *seconds > 0.0)
    };
    of_name(bare).or_else(with_factor)
}

/// What a name says, if it is one of times. A capital `T` alone is a temperature or a period, unless `any_case`.
pub(crate) fn time_name(name: &str, any_case: bool) -> Option<TimeName> {
    if PANDAS.contains(&name.to_lowercase().as_str()) {
        return Some(TimeName { seconds: None, label: None });
    }
    let words = words(name);
    let is_t = |at: usize, word: &str| at == 0 && (word == "t" || (word == "T" && any_case));
    let (mut stated, mut label, mut of_time) = (None, None, false);
    for (at, word) in words.iter().enumerate() {
        let lower = word.to_lowercase();
        let unit = seconds(&lower);
        if is_t(at, word) || WORDS.contains(&lower.as_str()) {
            of_time = true;
        } else if let Some(unit) = unit.filter(|_| at > 0 || lower.len() >= LEAST_UNIT_NAME) {
            of_time |= lower.len() >= LEAST_UNIT_NAME && at == 0;
            stated = stated.or(Some(unit));
        } else if FILLERS.contains(&lower.as_str()) {
        } else if label.replace(lower).is_some() || at == 0 {
            return None;
        }
    }
    of_time.then_some(TimeName { seconds: stated, label })
}

/// Whether an array of this name holds times.
pub fn names_times(name: &str) -> bool {
    time_name(name, false).is_some_and(|name| name.label.is_none())
}

/// A name's words: set apart by anything that is no letter or digit, by a capital letter behind a small one, by a digit
/// behind a letter.
fn words(name: &str) -> Vec<String> {
    let mut words: Vec<String> = Vec::new();
    let (mut word, mut before) = (String::new(), ' ');
    for letter in name.chars() {
        let begins =
            (letter.is_uppercase() && before.is_lowercase()) || (letter.is_ascii_digit() && before.is_alphabetic());
        if (!letter.is_alphanumeric() || begins) && !word.is_empty() {
            words.push(std::mem::take(&mut word));
        }
        if letter.is_alphanumeric() {
            word.push(letter);
        }
        before = letter;
    }
    words.extend((!word.is_empty()).then_some(word));
    words
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_time_are_known_however_they_are_written() {
        for (unit, wanted) in [
            ("s", 1.0),
            ("S", 1.0),
            ("[ms]", 1e-3),
            ("(us)", 1e-6),
            ("µs", 1e-6),
            ("nanoseconds since 1970-01-01 00:00:00", 1e-9),
            ("Milliseconds", 1e-3),
            ("sec.", 1.0),
            ("1e-3 s", 1e-3),
            ("10 us", 1e1 * 1e-6),
            ("days since 2020-01-01", 86_400.0),
        ] {
            assert_eq!(seconds(unit), Some(wanted), "{unit}");
        }
        for unit in ["", "V", "Hz", "m", "since 1970", "mm", "3", "0 s", "-1 s"] {
            assert_eq!(seconds(unit), None, "{unit}");
        }
    }

    #[test]
    fn names_of_times_state_their_unit_or_none() {
        for (name, unit) in [
            ("time", None),
            ("Time", None),
            ("t", None),
            ("t_ms", Some(1e-3)),
            ("time/ms", Some(1e-3)),
            ("t [us]", Some(1e-6)),
            ("Time (s)", Some(1.0)),
            ("seconds_elapsed", Some(1.0)),
            ("elapsed time", None),
            ("timestamp_ns", Some(1e-9)),
            ("timeMs", Some(1e-3)),
            ("millis", Some(1e-3)),
            ("time_axis", None),
            ("Relative time", None),
            ("index", None),
        ] {
            assert_eq!(time_name(name, false), Some(TimeName { seconds: unit, label: None }), "{name}");
        }
        for name in ["T", "s", "ms", "y", "xTime constant a", "lifetime", "rise time", "Fs", "", "period", "tank"] {
            assert!(!names_times(name), "{name}");
        }
        assert_eq!(time_name("T", true), Some(TimeName { seconds: None, label: None }));
        assert_eq!(time_name("t2 (ms)", false), Some(TimeName { seconds: Some(1e-3), label: Some("2".to_owned()) }));
        let label = |name: &str| time_name(name, false).and_then(|name| name.label);
        assert_eq!((label("Time A (s)"), label("t_in (s)")), (Some("a".to_owned()), Some("in".to_owned())));
    }
}
