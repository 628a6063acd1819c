//! The sampling rate, from numbers that are named like one.

use crate::Contents;
use crate::facts::RATE_FROM;
use crate::frequency::rate_unit;
use crate::printed::Printed;
use crate::text::{number, quantity};
use crate::time_units::seconds;
use std::collections::HashMap;

/// Names whose value is a rate, in hertz unless a unit is stated, in lower case and without blanks, `-` and `_`.
/// `IO_rate_[Hz]` and `IO_samp_rate_[Hz]` are those of general-mode AFM files.
const RATES: [&str; 11] = [
    "fs",
    "samplerate",
    "samplingrate",
    "samplefrequency",
    "samplingfrequency",
    "samplingfreq",
    "samplefreq",
    "iosamprate",
    "iorate",
    "framerate",
    "samplespersecond",
];

/// Names whose value is the time between two samples, in seconds unless a unit is stated, likewise. `Tinterval` is
/// PicoScope's.
const INTERVALS: [&str; 10] = [
    "dt",
    "deltat",
    "tinterval",
    "sampleinterval",
    "samplinginterval",
    "sampleperiod",
    "samplingperiod",
    "sampletime",
    "samplingtime",
    "timeincrement",
];
/// In this way of writing alone: other `ts` are stamps.
const SAMPLING_TIME: &str = "Ts";

/// Names whose value is the instant of the first sample, in seconds unless a unit is stated, likewise. `Tstart` is
/// PicoScope's, `wf_start_offset` NI's.
const STARTS: [&str; 6] = ["t0", "tstart", "start", "starttime", "startoffset", "wfstartoffset"];
/// One of them that may also be the number of a sample or of a row: it is an instant where a rate stands beside it.
const PERHAPS_START: &str = "start";
/// Not in this way of writing: it is a temperature.
const TEMPERATURE: &str = "T0";
/// Units in which intervals are given, in seconds.
pub(crate) const INTERVAL_UNITS: [f64; 4] = [1.0, 1e-3, 1e-6, 1e-9];
/// Ends of the names of units: `sampling_rate_units`.
const UNIT_ENDS: [&str; 6] = ["_units", "_unit", "Units", "Unit", ".units", ".unit"];

/// The names that a text with the unit of a number of this name may have.
pub fn unit_names(name: &str) -> Vec<String> {
    UNIT_ENDS.iter().map(|end| format!("{name}{end}")).collect()
}

/// Whether a name is that of the unit of a rate or an interval.
pub(crate) fn is_unit_of_clue(name: &str) -> bool {
    UNIT_ENDS.iter().filter_map(|end| name.strip_suffix(end)).any(|name| Clue::of(name, "", 1.0).is_some())
}

/// The least rate that is one: a sample every thirty years. Slower series are no recordings.
pub const LEAST_RATE_HZ: f64 = 1e-9;

/// The largest rate that is one: a sample every femtosecond, a thousand times as many as any converter takes. Squares
/// and products of rates far beyond it would leave the range of numbers.
pub const MOST_RATE_HZ: f64 = 1e15;

/// What a rate must be, in words that follow «wanted».
pub const WANTED_RATE: &str = "1e-9 to 1e15 samples per second";

/// Whether a number can be a sample rate in Hz: neither 0, negative, infinite nor NaN, nor beyond what is sampled.
pub fn is_rate(rate_hz: f64) -> bool {
    (LEAST_RATE_HZ..=MOST_RATE_HZ).contains(&rate_hz)
}

/// A number that may be of any size, in few digits.
pub fn brief_number(number: f64) -> String {
    let plain = number == 0.0 || !number.is_finite() || (1e-15..1e16).contains(&number.abs());
    if plain { number.to_string() } else { format!("{number:e}") }
}

impl Contents {
    /// Takes rates away that are none, with a remark on each.
    pub fn refuse_odd_rates(&mut self) {
        for channel in &mut self.channels {
            let Some(rate) = channel.sample_rate_hz.filter(|rate| !is_rate(*rate)) else { continue };
            channel.sample_rate_hz = None;
            let (location, found) = (&channel.location, brief_number(rate));
            let remark = format!("{location}: no sample rate: {found} Hz follows from the file, wanted {WANTED_RATE}");
            self.remarks.push(remark);
        }
    }

    /// What the reader said of a channel's rate, if it has none: that of the channel itself, else of the whole file.
    pub fn why_no_rate(&self, location: &str) -> Option<&str> {
        let mut said = self.remarks.iter().filter(|remark| {
            [NO_RATE, "gives no sample rate", UNKNOWN_RATE].iter().any(|words| remark.contains(words))
        });
        let of_another = |remark: &&String| {
            let mut others = self.channels.iter().filter(|channel| channel.location != location);
            others.any(|channel| !channel.is_axis && remark.starts_with(&channel.location))
        };
        let own = said.clone().find(|remark| remark.starts_with(location));
        own.or_else(|| said.find(|remark| !of_another(remark))).map(String::as_str)
    }
}

/// In remarks on channels without a rate.
const NO_RATE: &str = "no sample rate";

/// In remarks on clues that give no rate.
const UNKNOWN_RATE: &str = "the sampling rate is left unknown";

/// Digits of intervals that instruments are set to: 1, 2, 5, 1.25, 2.5.
const ROUND_DIGITS: usize = 2;
/// A number exactly between two that can be printed counts for both, whatever the arithmetic's last bits are.
const TIE: f64 = 1.001;
/// Digits of an interval that was computed and not cut.
const ALL_DIGITS: usize = 12;
/// Rates that clocks are set to have fewer digits than this.
const ROUND_RATE_DIGITS: usize = 7;

/// Two statements of a rate agree if they differ by less: rates are often written with six digits.
pub(crate) const AGREE: f64 = 1e-5;
/// Two rates are one if they differ by less: what is printed to seven digits.
const SAME_RATE: f64 = 1e-6;
/// Standard errors by which two statements of one rate differ at most.
const MOST_STDS: f64 = 4.0;
/// Largest relative difference of two clocks that tell the same time: those of crystals differ by 1e-4.
pub(crate) const ONE_CLOCK: f64 = 1e-3;

/// Whether two rates are one, but for their printing and four of their standard errors together, relative.
pub fn rates_agree(a: f64, b: f64, relative_std: f64) -> bool {
    (a / b - 1.0).abs() <= SAME_RATE.max(MOST_STDS * relative_std)
}

/// The unit of time in which an interval without a unit is that which is stated elsewhere in seconds, if it is one.
pub(crate) fn unit_that_fits(interval: f64, seconds: f64) -> Option<f64> {
    let fits = |unit: &f64| (interval * unit / seconds - 1.0).abs() <= AGREE;
    INTERVAL_UNITS.into_iter().find(fits)
}

/// Whether an interval without a unit counts samples, or is in units that are not known: whole numbers of seconds.
pub(crate) fn is_count(interval: f64) -> bool {
    interval >= 1.0 && interval.fract() == 0.0
}

/// The rate of a step in seconds, to twelve digits: a difference of two times has no more.
pub(crate) fn of_step(step_s: f64) -> f64 {
    let rate = step_s.recip();
    format!("{rate:.11e}").parse().unwrap_or(rate)
}

/// Of the numbers within an uncertainty (relative) of this one, that with the fewest digits: times that are rounded
/// allow several rates.
pub(crate) fn fewest_digits(number: f64, uncertainty: f64) -> f64 {
    let rounded = (0..12).filter_map(|digits: usize| format!("{number:.digits$e}").parse::<f64>().ok());
    let mut within = rounded.filter(|rounded| (rounded - number).abs() <= uncertainty * number.abs());
    within.next().unwrap_or(number)
}

/// Of the steps within an uncertainty (relative) of this one, that whose rate has the fewest digits, or that which has two
/// fewer itself: clocks are set to round rates, some to round steps.
pub(crate) fn roundest_step(step: f64, uncertainty: f64) -> f64 {
    let (rate, round) = (fewest_digits(of_step(step), uncertainty), fewest_digits(step, uncertainty));
    if digits_of(round) + 1 < digits_of(rate) { round } else { rate.recip() }
}

/// The rate of an interval that a file states to one unit of its last place, and its standard error, relative. An
/// interval that was cut to few digits
/// (0.000977 s of 1024 Hz) allows several rates: of these that with the fewest digits.
///
/// An interval is taken for exact where it has at most [`ROUND_DIGITS`] digits, as instruments are set, where it has all
/// digits of its type, or where its rate has few.
pub(crate) fn rate_of_interval(step_s: f64, unit_s: f64) -> (f64, f64) {
    let (rate, digits) = (of_step(step_s), digits_of(step_s));
    if digits <= ROUND_DIGITS || digits >= ALL_DIGITS || digits_of(rate) < ROUND_RATE_DIGITS {
        return (rate, 0.0);
    }
    // half a unit on either side, all of it equally likely; a digit 5 behind the last one is rounded to it, too
    let half = 0.5 * unit_s / step_s;
    let round = fewest_digits(rate, TIE * half);
    (if digits_of(round) < ROUND_RATE_DIGITS { round } else { rate }, half / 3_f64.sqrt())
}

/// One unit of the last digit of the shortest number that is read as this one.
pub(crate) fn unit_of_shortest(number: f64) -> f64 {
    let mut printed = Printed::default();
    printed.see(&number.to_string());
    printed.unit_of(number)
}

/// Significant digits of the shortest number that is read as this one.
fn digits_of(number: f64) -> usize {
    let shown = format!("{number:e}");
    shown.chars().take_while(|c| *c != 'e').filter(char::is_ascii_digit).count()
}

/// A step that is kept in single precision is the shortest decimal number that is rounded to it: instruments have steps
/// of 1, 2 or 5 times a power of ten. One in double precision is taken as it is, unless it was widened from single.
pub(crate) fn shortest(step: f64) -> f64 {
    let single = step as f32;
    if f64::from(single) == step { single.to_string().parse().unwrap_or(step) } else { step }
}

/// The number that all of several are: of each channel the same rate. What is no number is one too, so that it is said.
pub fn one_number(numbers: &[f64]) -> Option<f64> {
    let first = *numbers.first()?;
    let same = |number: &f64| *number == first || number.is_nan() && first.is_nan();
    numbers.iter().all(same).then_some(first)
}

/// A number that is named like a sampling rate, an interval or the instant of the first sample.
#[derive(Debug, Clone)]
pub struct Clue {
    location: String,
    value: f64,
    what: What,
    /// Hertz or seconds in its unit; none if that is none of a rate or a time.
    scale: Option<f64>,
    unit: String,
    /// Whether its unit is stated, in its name or beside it.
    has_unit: bool,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum What {
    Rate,
    Interval,
    Start,
    /// A start if a rate stands beside it.
    PerhapsStart,
}

impl What {
    fn named(name: &str) -> Option<Self> {
        let letters: String = name.chars().filter(|c| c.is_alphanumeric()).collect();
        let lower = letters.to_lowercase();
        if INTERVALS.contains(&lower.as_str()) || letters == SAMPLING_TIME {
            Some(Self::Interval)
        } else if RATES.contains(&lower.as_str()) {
            Some(Self::Rate)
        } else if lower == PERHAPS_START {
            Some(Self::PerhapsStart)
        } else {
            (STARTS.contains(&lower.as_str()) && letters != TEMPERATURE).then_some(Self::Start)
        }
    }

    fn is_start(self) -> bool {
        matches!(self, Self::Start | Self::PerhapsStart)
    }
}

impl Clue {
    /// Whether a number called `name` (at `location`, for messages) is one. The name may end with its unit: `rate_khz`,
    /// `dt [ms]`.
    pub fn of(name: &str, location: &str, value: f64) -> Option<Self> {
        let (bare, unit) = split_unit(name);
        [(name, ""), (bare, unit)].into_iter().find_map(|(name, unit)| {
            let what = What::named(name)?;
            let location = location.to_owned();
            let clue = Self { location, value, what, scale: Some(1.0), unit: String::new(), has_unit: false };
            // the name says its unit, no message needs to
            Some(Self { unit: String::new(), ..clue.in_unit(unit) })
        })
    }

    /// The same of a text: a number, which may have its unit behind it (`10 kHz`).
    pub fn of_text(name: &str, location: &str, text: &str) -> Option<Self> {
        let (value, unit) = quantity(text, number)?;
        Some(Self::of(name, location, value)?.in_unit(unit))
    }

    /// The same in a unit that the file states beside it; an empty one says nothing.
    #[must_use]
    pub fn in_unit(self, unit: &str) -> Self {
        if unit.is_empty() {
            return self;
        }
        let scale = if self.what == What::Rate { rate_unit(unit) } else { seconds(unit) };
        Self { scale, unit: unit.to_owned(), has_unit: true, ..self }
    }

    /// Where it is.
    pub(crate) fn location(&self) -> &str {
        &self.location
    }

    /// Whether it is of a rate or an interval.
    pub fn is_of_rate(&self) -> bool {
        !self.what.is_start()
    }

    /// It and its value, for messages.
    fn shown(&self) -> String {
        let unit = if self.unit.is_empty() { String::new() } else { format!(" {}", self.unit) };
        format!("{} = {}{unit}", self.location, brief_number(self.value))
    }

    /// Whether it is an interval in whole numbers without a unit.
    fn counts(&self) -> bool {
        self.what == What::Interval && !self.has_unit && is_count(self.value)
    }

    fn rate_hz(&self) -> Option<f64> {
        let value = self.value * self.scale?;
        let rate = if self.what == What::Interval {
            rate_of_interval(value, unit_of_shortest(self.value) * self.scale.unwrap_or(1.0)).0
        } else {
            value
        };
        (self.value.is_finite() && is_rate(rate)).then_some(rate)
    }
}

/// A name without the unit that it ends with, and that unit: `rate_khz`, `dt [ms]`, `Sampling Rate (Hz)`.
fn split_unit(name: &str) -> (&str, &str) {
    let bracketed = name.strip_suffix([')', ']']).and_then(|name| name.rsplit_once(['(', '[']));
    let parts = bracketed.or_else(|| name.rsplit_once(['_', ' ', '/']));
    let is_unit = |unit: &str| seconds(unit).is_some() || rate_unit(unit).is_some();
    parts.filter(|(_, unit)| is_unit(unit)).unwrap_or((name, ""))
}

/// What the nearest scope that says anything says: the scope itself, or one around it.
fn nearest<T>(scope: &str, clues: &HashMap<String, Vec<Clue>>, said: impl Fn(&[Clue]) -> Option<T>) -> Option<T> {
    let mut scope = scope;
    loop {
        if let Some(found) = clues.get(scope).and_then(|here| said(here)) {
            return Some(found);
        }
        scope = scope.get(..scope.rfind(['.', '{', '(', '/'])?).unwrap_or_default();
    }
}

/// What the clues of each scope (a struct, or the file: empty) say about the arrays of one. The nearest scope with a
/// clue decides.
pub fn rate_in(scope: &str, clues: &HashMap<String, Vec<Clue>>) -> (Option<f64>, Option<String>) {
    let said = |here: &[Clue]| here.iter().any(Clue::is_of_rate).then(|| agreed_rate(here));
    nearest(scope, clues, said).unwrap_or_default()
}

/// The same of the instant of their first sample.
pub fn start_in(scope: &str, clues: &HashMap<String, Vec<Clue>>) -> (Option<f64>, Option<String>) {
    nearest(scope, clues, agreed_start).unwrap_or_default()
}

/// The rate that clues give, and what to say of it; none if they disagree or give none.
pub fn agreed_rate(clues: &[Clue]) -> (Option<f64>, Option<String>) {
    let clues: Vec<&Clue> = clues.iter().filter(|clue| clue.is_of_rate()).collect();
    let named = clues.iter().map(|clue| clue.shown()).collect::<Vec<String>>().join(", ");
    let (counts, clear): (Vec<&Clue>, Vec<&Clue>) = clues.iter().partition(|clue| clue.counts());
    let Some(rates) = clear.iter().map(|clue| clue.rate_hz()).collect::<Option<Vec<f64>>>() else {
        return (None, Some(format!("{UNKNOWN_RATE}: no rate follows from {named}, wanted {WANTED_RATE}")));
    };
    let Some(&first) = rates.first() else {
        let why = (!counts.is_empty()).then(|| format!("{UNKNOWN_RATE}: {named} is a whole number without a unit"));
        return (None, why);
    };
    let other_unit = |clue: &&Clue| unit_that_fits(clue.value, first.recip()).is_some();
    if rates.iter().all(|rate| (rate - first).abs() <= AGREE * first) && counts.iter().all(other_unit) {
        (Some(first), Some(format!("{RATE_FROM} {named}: {first} samples per second")))
    } else {
        (None, Some(format!("{UNKNOWN_RATE} because these disagree: {named}")))
    }
}

/// The instant of the first sample, in seconds, that clues give, and what to say where they disagree or are in a unit that
/// is not known; nothing where none is of a start.
pub fn agreed_start(clues: &[Clue]) -> Option<(Option<f64>, Option<String>)> {
    let rated = clues.iter().any(Clue::is_of_rate);
    let is_start = |clue: &&Clue| clue.what == What::Start || (clue.what == What::PerhapsStart && rated);
    let starts: Vec<&Clue> = clues.iter().filter(is_start).collect();
    let named = starts.iter().map(|clue| clue.shown()).collect::<Vec<String>>().join(", ");
    let instant = |clue: &&Clue| clue.scale.map(|scale| clue.value * scale).filter(|start| start.is_finite());
    let instants: Option<Vec<f64>> = starts.iter().map(instant).collect();
    let first = *starts.first().map(|_| instants.as_ref().and_then(|all| all.first()))?.unwrap_or(&f64::NAN);
    // neighbours in float64 are one
    let same = |other: &f64| (other - first).abs() <= 4.0 * f64::EPSILON * first.abs();
    if instants.is_some_and(|all| all.iter().all(same)) {
        return Some((Some(first), None));
    }
    Some((None, Some(format!("it is not known when the first sample was taken: {UNKNOWN_START} {named}"))))
}

/// In remarks on clues that give no start.
const UNKNOWN_START: &str = "no instant, or more than one, follows from";

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rate_lies_in_its_range_and_clues_say_what_they_found() {
        for rate in [1e-9, 0.1, 5e6, 1e15] {
            assert!(is_rate(rate), "{rate:e}");
        }
        for rate in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e300, 1.1e15, 9e-10, 1e-300] {
            assert!(!is_rate(rate), "{rate:e}");
            let clue = Clue::of("fs", "/g/fs", rate).unwrap();
            let (found, remark) = agreed_rate(&[clue]);
            let stated = format!("/g/fs = {},", brief_number(rate));
            assert!(found.is_none() && remark.unwrap().contains(&stated), "{stated}");
        }
        assert_eq!(
            (brief_number(1e300), brief_number(-1.0), brief_number(5e6)),
            ("1e300".into(), "-1".into(), "5000000".into())
        );
    }

    #[test]
    fn intervals_in_few_digits_have_the_round_rate_that_they_allow_and_an_error() {
        for (interval, rate) in
            [(0.000_977, 1024.0), (1.953_13e-5, 51_200.0), (0.000_333, 3000.0), (2.267_57e-5, 44_100.0)]
        {
            let (found, std) = rate_of_interval(interval, unit_of_shortest(interval));
            assert_eq!(found, rate);
            assert!((interval.recip() / rate - 1.0).abs() <= TIE * 3_f64.sqrt() * std, "{interval} {std}");
        }
        for (interval, rate) in [(1e-3, 1e3), (2.5e-6, 4e5), (0.00125, 800.0), (1.0 / 44_100.0, 44_100.0)] {
            assert_eq!(rate_of_interval(interval, unit_of_shortest(interval)), (rate, 0.0));
        }
        // 0.003 s is set, not 1/333.33
        assert_eq!(rate_of_interval(0.003, 1e-3), (of_step(0.003), 0.0));
        // zeros behind the last digit are digits, too
        assert_eq!(rate_of_interval(1.65e-6, 1e-12).0, of_step(1.65e-6));
    }

    #[test]
    fn steps_of_single_precision_are_the_decimal_number_that_was_meant() {
        // none of these is exact in binary
        for (step, meant) in [(1e-9_f32, 1e-9_f64), (5e-6, 5e-6), (2.5e-3, 2.5e-3), (4e-7, 4e-7), (8e-4, 8e-4)] {
            assert_ne!(f64::from(step), meant);
            assert_eq!(shortest(f64::from(step)), meant);
        }
        assert_eq!(of_step(shortest(f64::from(1e-9_f32))), 1e9);
        assert_eq!(shortest(1e-9), 1e-9);
        assert_eq!(shortest(0.5), 0.5);
    }
}
