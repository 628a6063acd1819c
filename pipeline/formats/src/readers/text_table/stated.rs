//! What the lines above (or beside) the rows say of rate and units.
//!
//! A key has its values in the fields behind it (`Sample Interval,0.0008`; `delta t,2E-6,2E-6`, one for each column),
//! in its own field (`tInc = 2e-7`, `# fs: 1000 Hz`) or below it (`Increment` over `2.0e-05`).

use super::number;
use super::units::{hertz, seconds};
use crate::printed::Printed;
use crate::rate::{AGREE, is_count, unit_that_fits};
use crate::text::{self, brief};

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
/// Of these and of the rates those that are in seconds or hertz by convention: of instruments, and symbols. Of the others
/// without a unit this is a guess.
const CONVENTIONAL: [&str; 11] = [
    "increment",
    "tinc",
    "xincr",
    "xincrement",
    "x increment",
    "delta t",
    "delta_x",
    "hresolution",
    "dt",
    "fs",
    "samples per second",
];
/// Keys whose value is a rate.
const RATES: [&str; 8] = [
    "sampling frequency",
    "sampling rate",
    "sample rate",
    "sample frequency",
    "samplerate",
    "sample_rate",
    "samples per second",
    "fs",
];
/// Others are called so, too: a rate of samples has the unit of one.
const PERHAPS_RATES: [&str; 2] = ["rate", "sampling"];
/// Keys whose value is the unit of the rate or interval in the line above; also behind the name of such a key.
const UNITS_OF_STEPS: [&str; 3] = ["units", "unit", "einheit"];
const TIME_UNITS: [&str; 3] = ["horizontal units", "x units", "xunits"];
const VALUE_UNITS: [&str; 3] = ["vertical units", "y units", "yunits"];
/// Keys whose value is the name of a channel.
const SOURCES: [&str; 1] = ["source"];
/// Keys that stand in a row of titles without being the title of a column.
const OTHERS: [&str; 2] = ["start", "t0"];

/// More statements than this say nothing new.
const MOST: usize = 1000;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Key {
    Interval,
    Rate,
    PerhapsRate,
    StepUnit,
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
    pub(super) known: Known,
    /// Whether a rate is stated.
    pub(super) is_rate: bool,
    /// The words that say so.
    pub(super) words: String,
}

/// How the unit of an interval is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Known {
    /// It is stated, or the key is in seconds or hertz by convention.
    Stated,
    /// It is none, and taken as seconds or hertz.
    Guessed,
    /// It is none, and the interval a whole number: seconds, or anything else.
    Count,
}

/// A number that is stated, in the unit that stands at it or behind it; empty if none does.
#[derive(Debug, Clone)]
struct Statement {
    is_rate: bool,
    conventional: bool,
    number: f64,
    last_place: f64,
    unit: String,
    words: String,
}

impl Statement {
    /// The interval, where `step_unit` and `time_unit` are stated elsewhere. None in a unit of something else.
    fn step(&self, step_unit: &str, time_unit: &str) -> Option<Step> {
        let time_unit = if self.is_rate { "" } else { time_unit };
        let of_one = |unit: &&str| hertz(unit).is_some() || seconds(unit).is_some();
        let elsewhere = [step_unit, time_unit].into_iter().find(of_one).unwrap_or_default();
        let unit = if self.unit.is_empty() { elsewhere } else { &self.unit };
        let as_rate = |hertz: f64| (self.number * hertz).recip();
        let (seconds, unit_s, is_rate) = match (hertz(unit), seconds(unit)) {
            (Some(hertz), _) => (as_rate(hertz), 0.0, true),
            (None, Some(seconds)) => (self.number * seconds, self.last_place * seconds, false),
            (None, None) if !unit.is_empty() => return None,
            (None, None) if self.is_rate => (as_rate(1.0), 0.0, true),
            (None, None) => (self.number, self.last_place, false),
        };
        let known = match unit.is_empty() {
            true if !is_rate && is_count(self.number) => Known::Count,
            true if !self.conventional => Known::Guessed,
            _ => Known::Stated,
        };
        Some(Step { seconds, unit_s, known, is_rate, words: self.words.clone() })
    }
}

/// What was stated so far.
#[derive(Debug, Default)]
pub(super) struct Stated {
    statements: Vec<Statement>,
    /// The unit of rates and intervals that have none.
    step_unit: String,
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
            let of_step = matches!(key, Key::Interval | Key::Rate | Key::PerhapsRate);
            if of_step && !values.iter().any(is_number) {
                values = below.get(at).map(|field| (at, *field)).into_iter().collect();
            }
            if of_step && self.step_unit.is_empty() {
                self.step_unit = unit_below(below).unwrap_or_default();
            }
            self.take(key, name, &values, decimal);
        }
    }

    fn take(&mut self, key: Key, name: &str, values: &[(usize, &str)], decimal: char) {
        let own_unit = name
            .rsplit_once(['(', '['])
            .map(|(_, unit)| unit.trim_matches([')', ']', ' ', '=', ':']))
            .unwrap_or_default();
        for (number_of, (at, value)) in values.iter().enumerate() {
            match key {
                Key::Source if self.sources.len() < MOST => self.sources.push(number::bare(value).to_owned()),
                Key::Source | Key::Other => {}
                Key::TimeUnit if self.time_unit.is_empty() => self.time_unit = unit_in(value),
                Key::TimeUnit => {}
                Key::StepUnit if self.step_unit.is_empty() => self.step_unit = unit_in(value),
                Key::StepUnit => {}
                Key::ValueUnit if self.value_units.len() < MOST => self.value_units.push((*at, unit_in(value))),
                Key::ValueUnit => {}
                Key::Interval | Key::Rate | Key::PerhapsRate => {
                    let Some((number, unit)) = quantity(value, decimal) else { continue };
                    let behind = values.get(number_of + 1).map(|(_, field)| unit_in(field)).unwrap_or_default();
                    let is_unit = |unit: &&str| hertz(unit).is_some() || seconds(unit).is_some();
                    let first = [unit, own_unit].into_iter().find(|unit| !unit.is_empty());
                    let unit = first.or(Some(behind.as_str()).filter(is_unit)).unwrap_or_default();
                    let doubtful = key == Key::PerhapsRate && !is_unit(&unit);
                    if doubtful || self.statements.len() >= MOST {
                        continue;
                    }
                    let mut printed = Printed::default();
                    printed.see(value);
                    self.statements.push(Statement {
                        is_rate: key != Key::Interval,
                        conventional: CONVENTIONAL.contains(&bare_key(name).to_lowercase().as_str()),
                        number,
                        last_place: printed.unit_of(number),
                        unit: unit.to_owned(),
                        words: format!("{} {}", brief(bare_key(name), 40), brief(value.trim(), 40)),
                    });
                }
            }
        }
    }

    /// All intervals that are stated, those of a stated unit first.
    fn steps(&self) -> (Vec<Step>, Option<&Statement>) {
        let is_one = |step: &Step| step.seconds.is_finite() && step.seconds > 0.0;
        let of = |statement: &Statement| statement.step(&self.step_unit, &self.time_unit);
        let mut steps: Vec<Step> = self.statements.iter().filter_map(of).filter(is_one).collect();
        steps.sort_by_key(|step| step.known);
        let odd = self.statements.iter().find(|statement| of(statement).is_some_and(|step| !is_one(&step)));
        (steps, odd)
    }

    /// The words of a statement that is no interval, where no other statement is one.
    pub(super) fn odd(&self) -> Option<&str> {
        let (steps, odd) = self.steps();
        odd.filter(|_| steps.is_empty()).map(|odd| odd.words.as_str())
    }

    /// The interval all statements agree on, in seconds, and the words of the first. Errors: what to say of
    /// statements that disagree.
    pub(super) fn step(&self) -> Result<Option<Step>, String> {
        let steps = self.steps().0;
        let Some(first) = steps.first() else { return Ok(None) };
        let agree = |step: &&Step| {
            let same = (step.seconds - first.seconds).abs() <= AGREE * first.seconds;
            same || (first.known == Known::Stated && step.known != Known::Stated && step.fits(first.seconds))
        };
        match steps.iter().find(|step| !agree(step)) {
            Some(other) => Err(format!("no sample rate: the header says «{}» and «{}»", first.words, other.words)),
            None => Ok(Some(first.clone())),
        }
    }
}

impl Step {
    /// Whether this statement without a unit is of an interval that is stated elsewhere, in another unit.
    pub(super) fn fits(&self, seconds: f64) -> bool {
        unit_that_fits(self.seconds, seconds).is_some()
    }
}

/// The unit in a line that states nothing else: `Unit: us`, or `Unit` and `us` in two fields.
fn unit_below(below: &[&str]) -> Option<String> {
    let first = below.iter().position(|field| !number::bare(field).is_empty())?;
    let (name, inside) = split_value(below.get(first)?);
    let value = inside.or_else(|| below.get(first + 1).copied())?;
    let unit = unit_in(value);
    let is_unit = hertz(&unit).is_some() || seconds(&unit).is_some();
    (is_unit && UNITS_OF_STEPS.contains(&bare_key(name).to_lowercase().as_str())).then_some(unit)
}

/// Whether a field is a key: no title of a column.
pub(super) fn is_key(field: &str) -> bool {
    // channels are titled by their sources
    let (name, inside) = split_value(field);
    key(name).is_some_and(|key| key != Key::Source && (key != Key::PerhapsRate || inside.is_some()))
}

fn key(name: &str) -> Option<Key> {
    let name = bare_key(name).to_lowercase();
    let keys = [
        (INTERVALS.as_slice(), Key::Interval),
        (&RATES, Key::Rate),
        (&PERHAPS_RATES, Key::PerhapsRate),
        (&TIME_UNITS, Key::TimeUnit),
        (&VALUE_UNITS, Key::ValueUnit),
        (&SOURCES, Key::Source),
        (&OTHERS, Key::Other),
    ];
    let find = |name: &str| keys.iter().find(|(names, _)| names.contains(&name)).map(|(_, key)| *key);
    let of_unit = |end: &&str| {
        let of = name.strip_suffix(*end).map(|of| of.trim_end_matches([' ', '_'])).and_then(find);
        matches!(of, Some(Key::Interval | Key::Rate))
    };
    find(&name).or_else(|| UNITS_OF_STEPS.iter().any(of_unit).then_some(Key::StepUnit))
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
    text::quantity(text, |text| number::parse(text, decimal))
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
        assert_eq!(step(&[&["Rate: 10 ms"]]), Ok(Some(0.01)));
        assert_eq!(step(&[&["Rate", "10", "ms"]]), Ok(Some(0.01)));
        assert_eq!(step(&[&["Sample interval: 100 Hz"]]), Ok(Some(0.01)));
        assert_eq!(step(&[&["Rate: 72"]]), Ok(None));
        for lines in [
            [&["Sample period: 100"][..], &["Unit: us"][..]],
            [&["Sample period", "100"], &["Unit", "us"]],
            [&["Sample period", "100", "us"], &[""]],
            [&["Sample period", "100"], &["Sample period unit", "us"]],
            [&["Sample period: 100"], &["Horizontal Units: us"]],
        ] {
            assert_eq!(step(&lines), Ok(Some(100.0 * 1e-6)), "{lines:?}");
        }
        // a whole number without a unit may be in any
        assert_eq!(step(&[&["Sample period: 100"], &["Rate: 10 kHz"]]), Ok(Some(1e-4)));
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
