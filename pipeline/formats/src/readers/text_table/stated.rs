//! What the lines above (or beside) the rows say of rate and units.
//!
//! A key has its values in the fields behind it (`Sample Interval,0.0008`; `delta t,2E-6,2E-6`, one for each column),
//! in its own field (`tInc = 2e-7`, `# fs: 1000 Hz`) or below it (`Increment` over `2.0e-05`).

use super::number;
use super::units::{hertz, seconds};
use crate::printed::Printed;
use crate::text::brief;

/// Keys whose value is the time between two samples: Tektronix and Siglent, Rigol, LabVIEW, Yokogawa, and plain words.
const INTERVALS: [&str; 14] = [
    "sample interval",
    "sampling interval",
    "increment",
    "tinc",
    "xincr",
    "xincrement",
    "x increment",
    "time increment",
    "delta t",
    "delta_x",
    "hresolution",
    "sample period",
    "sampling period",
    "dt",
];
/// Keys whose value is a rate.
const RATES: [&str; 7] =
    ["sampling frequency", "sampling rate", "sample rate", "sample frequency", "samplerate", "sample_rate", "fs"];
const TIME_UNITS: [&str; 3] = ["horizontal units", "x units", "xunits"];
const VALUE_UNITS: [&str; 3] = ["vertical units", "y units", "yunits"];
/// Keys whose value is the name of a channel.
const SOURCES: [&str; 1] = ["source"];
/// Keys that stand in a row of titles without being the title of a column.
const OTHERS: [&str; 2] = ["start", "t0"];

/// Two statements of an interval agree if they differ by less: rates are printed with six digits and more.
const AGREE: f64 = 1e-5;
/// More statements than this say nothing new.
const MOST: usize = 1000;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Key {
    Interval,
    Rate,
    TimeUnit,
    ValueUnit,
    Source,
    Other,
}

/// An interval that is stated.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Step {
    pub(super) seconds: f64,
    /// One unit of its last place; 0 where a rate is stated instead.
    pub(super) unit_s: f64,
    /// The words that say so.
    pub(super) words: String,
}

/// What was stated so far.
#[derive(Debug, Default)]
pub(super) struct Stated {
    /// Seconds between samples, one unit of their last place, and the words that say so.
    steps: Vec<Step>,
    /// Words that state an interval or a rate which is none.
    odd: Option<String>,
    /// The unit of the axis of time; empty if none is stated.
    pub(super) time_unit: String,
    /// Units and the fields they stand in.
    pub(super) value_units: Vec<(usize, String)>,
    /// Names of channels.
    pub(super) sources: Vec<String>,
}

impl Stated {
    /// Reads a line; `below` are the fields of the header line below it.
    pub(super) fn read(&mut self, fields: &[&str], below: &[&str], decimal: char) {
        for (at, field) in fields.iter().enumerate() {
            let (name, inside) = split_value(field);
            let Some(key) = key(name) else { continue };
            let behind = fields.get(at + 1..).unwrap_or_default();
            let behind = behind.iter().enumerate().map(|(index, field)| (at + 1 + index, *field));
            let mut values: Vec<(usize, &str)> = match inside {
                Some(value) => vec![(at, value)],
                None => behind.take_while(|(_, field)| !number::bare(field).is_empty()).collect(),
            };
            let is_number = |value: &(usize, &str)| quantity(value.1, decimal).is_some();
            if matches!(key, Key::Interval | Key::Rate) && !values.iter().any(is_number) {
                values = below.get(at).map(|field| (at, *field)).into_iter().collect();
            }
            self.take(key, name, &values, decimal);
        }
    }

    fn take(&mut self, key: Key, name: &str, values: &[(usize, &str)], decimal: char) {
        let own_unit = name
            .rsplit_once(['(', '['])
            .map(|(_, unit)| unit.trim_matches([')', ']', ' ', '=', ':']))
            .unwrap_or_default();
        for (at, value) in values {
            match key {
                Key::Source if self.sources.len() < MOST => self.sources.push(number::bare(value).to_owned()),
                Key::Source | Key::Other => {}
                Key::TimeUnit if self.time_unit.is_empty() => self.time_unit = unit_in(value),
                Key::TimeUnit => {}
                Key::ValueUnit if self.value_units.len() < MOST => self.value_units.push((*at, unit_in(value))),
                Key::ValueUnit => {}
                Key::Interval | Key::Rate => {
                    let Some((number, unit)) = quantity(value, decimal) else { continue };
                    let unit = if unit.is_empty() { own_unit } else { unit };
                    let mut printed = Printed::default();
                    printed.see(value);
                    let last_place = printed.unit_of(number);
                    let step = match (key, unit) {
                        (Key::Rate, "") => Some((number.recip(), 0.0)),
                        (Key::Rate, unit) => hertz(unit).map(|hertz| ((number * hertz).recip(), 0.0)),
                        (_, "") => Some((number, last_place)),
                        (_, unit) => seconds(unit).map(|seconds| (number * seconds, last_place * seconds)),
                    };
                    let words = || format!("{} {}", brief(bare_key(name), 40), brief(value.trim(), 40));
                    match step.filter(|(step, _)| step.is_finite() && *step > 0.0) {
                        Some((seconds, unit_s)) if self.steps.len() < MOST => {
                            self.steps.push(Step { seconds, unit_s, words: words() });
                        }
                        None if step.is_some() && self.odd.is_none() => self.odd = Some(words()),
                        _ => {}
                    }
                }
            }
        }
    }

    /// The words of a statement that is no interval, where no other statement is one.
    pub(super) fn odd(&self) -> Option<&str> {
        self.odd.as_deref().filter(|_| self.steps.is_empty())
    }

    /// The interval all statements agree on, in seconds, and the words of the first. Errors: what to say of
    /// statements that disagree.
    pub(super) fn step(&self) -> Result<Option<&Step>, String> {
        let Some(first) = self.steps.first() else { return Ok(None) };
        match self.steps.iter().find(|step| (step.seconds - first.seconds).abs() > AGREE * first.seconds) {
            Some(other) => Err(format!("no sample rate: the header says «{}» and «{}»", first.words, other.words)),
            None => Ok(Some(first)),
        }
    }
}

/// Whether a field is a key: no title of a column.
pub(super) fn is_key(field: &str) -> bool {
    // channels are titled by their sources
    key(split_value(field).0).is_some_and(|key| key != Key::Source)
}

fn key(name: &str) -> Option<Key> {
    let name = bare_key(name).to_lowercase();
    let keys = [
        (INTERVALS.as_slice(), Key::Interval),
        (&RATES, Key::Rate),
        (&TIME_UNITS, Key::TimeUnit),
        (&VALUE_UNITS, Key::ValueUnit),
        (&SOURCES, Key::Source),
        (&OTHERS, Key::Other),
    ];
    keys.into_iter().find(|(names, _)| names.contains(&name.as_str())).map(|(_, key)| key)
}

/// A key without a unit in brackets and without `=` or `:` behind it.
fn bare_key(name: &str) -> &str {
    let name = number::bare(name).trim_end_matches(['=', ':', ' ']);
    name.split_once(['(', '[']).map_or(name, |(name, _)| name).trim()
}

/// `tInc = 2e-7`: the key and its value; a key alone has none.
fn split_value(field: &str) -> (&str, Option<&str>) {
    let field = number::bare(field);
    match field.split_once(['=', ':']) {
        Some((name, value)) if !number::bare(value).is_empty() => (name.trim(), Some(value.trim())),
        _ => (field, None),
    }
}

/// A number with its unit, if one is there: `4E-9`, `1000 Hz`, `Analog:4E-9` (Siglent names the source).
fn quantity(text: &str, decimal: char) -> Option<(f64, &str)> {
    let text = number::bare(text);
    let text = text.rsplit_once(':').map_or(text, |(_, behind)| behind).trim();
    if let Some(number) = number::parse(text, decimal) {
        return Some((number, ""));
    }
    let unit = text.trim_start_matches(|c: char| !c.is_alphabetic() || matches!(c, 'e' | 'E'));
    let number = number::parse(text.strip_suffix(unit)?, decimal)?;
    Some((number, unit.trim()))
}

/// A unit, without the source that Siglent names (`CH1:V`) and without brackets.
fn unit_in(text: &str) -> String {
    let text = number::bare(text);
    let text = text.rsplit_once(':').map_or(text, |(_, behind)| behind);
    brief(text.trim_matches(['(', ')', '[', ']', ' ']), 20)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn step(lines: &[&[&str]]) -> Result<Option<f64>, String> {
        let mut stated = Stated::default();
        for (number, line) in lines.iter().enumerate() {
            stated.read(line, lines.get(number + 1).copied().unwrap_or_default(), '.');
        }
        stated.step().map(|step| step.map(|step| step.seconds))
    }

    #[test]
    fn intervals_are_found_wherever_writers_put_them() {
        assert_eq!(step(&[&["Sample Interval", "0.0008"]]), Ok(Some(8e-4)));
        assert_eq!(step(&[&["Sample Interval", "Analog:0.000000004"]]), Ok(Some(4e-9)));
        assert_eq!(step(&[&["delta t", "2E-6", "2E-6"]]), Ok(Some(2e-6)));
        assert_eq!(step(&[&["CH1(V)", "t0 =-5e-05", " tInc = 1e-08"]]), Ok(Some(1e-8)));
        assert_eq!(
            step(&[&["X", "CH1", "Start", "Increment"], &["Sequence", "Volt", "-2e-3", "2e-5"]]),
            Ok(Some(2e-5))
        );
        assert_eq!(step(&[&["\"Sampling Frequency (Hz)=\"", "500000000", ""]]), Ok(Some(2e-9)));
        assert_eq!(step(&[&["fs: 2 kHz"]]), Ok(Some(5e-4)));
        assert_eq!(step(&[&["Time Scale (s/DIV) =", "1E-7"], &["Record Length", "2000"]]), Ok(None));
        assert!(step(&[&["dt", "1e-3"], &["fs", "2000"]]).is_err());
        assert_eq!(step(&[&["Sample Interval", "0"]]), Ok(None));
    }

    #[test]
    fn units_are_found() {
        let mut stated = Stated::default();
        stated.read(&["Horizontal Units", "S"], &[], '.');
        stated.read(&["Vertical Units", "CH1:V", "CH2:A"], &[], '.');
        assert_eq!(stated.time_unit, "S");
        assert_eq!(stated.value_units, [(1, "V".to_owned()), (2, "A".to_owned())]);
    }
}
