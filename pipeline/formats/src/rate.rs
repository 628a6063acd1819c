//! The sampling rate, from numbers that are named like one.

use crate::Contents;
use crate::facts::RATE_FROM;
use std::collections::HashMap;

/// Names whose value is a rate in hertz. `IO_rate_[Hz]` and `IO_samp_rate_[Hz]` are those of general-mode AFM files.
const RATES: [&str; 22] = [
    "fs",
    "Fs",
    "f_s",
    "fs_hz",
    "Fs_Hz",
    "samplerate",
    "sample_rate",
    "sampleRate",
    "SampleRate",
    "sample_rate_hz",
    "sampling_rate",
    "samplingRate",
    "SamplingRate",
    "sampling_frequency",
    "SamplingFrequency",
    "Sampling Frequency",
    "Sampling Rate",
    "Sample Rate",
    "sampling_rate_hz",
    "samplerate_hz",
    "IO_samp_rate_[Hz]",
    "IO_rate_[Hz]",
];

/// Names whose value is the time between two samples in seconds. `Tinterval` is PicoScope's.
const INTERVALS: [&str; 10] = [
    "dt",
    "dt_s",
    "Ts",
    "delta_t",
    "Tinterval",
    "sample_interval",
    "sampleInterval",
    "SampleInterval",
    "sampling_interval",
    "SamplingInterval",
];

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

/// Two statements of a rate agree if they differ by less: rates are often written with six digits.
const AGREE: f64 = 1e-5;

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
    let digits =
        |number: f64| format!("{number:e}").chars().take_while(|c| *c != 'e').filter(char::is_ascii_digit).count();
    if digits(round) + 1 < digits(rate) { round } else { rate.recip() }
}

/// A step that is kept in single precision is the shortest decimal number that is rounded to it: instruments have steps
/// of 1, 2 or 5 times a power of ten. One in double precision is taken as it is, unless it was widened from single.
pub(crate) fn shortest(step: f64) -> f64 {
    let single = step as f32;
    if f64::from(single) == step { single.to_string().parse().unwrap_or(step) } else { step }
}

/// A number that is named like a sampling rate or interval.
#[derive(Debug, Clone)]
pub struct Clue {
    location: String,
    value: f64,
    interval: bool,
}

impl Clue {
    /// Whether a number called `name` (at `location`, for messages) is one.
    pub fn of(name: &str, location: &str, value: f64) -> Option<Self> {
        let interval = INTERVALS.contains(&name);
        let wanted = interval || RATES.contains(&name);
        wanted.then(|| Self { location: location.to_owned(), value, interval })
    }

    fn rate_hz(&self) -> Option<f64> {
        let rate = if self.interval { 1.0 / self.value } else { self.value };
        (self.value.is_finite() && is_rate(rate)).then_some(rate)
    }
}

/// What the clues of each scope (a struct, or the file: empty) say about the arrays of one. The nearest scope with a
/// clue decides.
pub fn rate_in(scope: &str, clues: &HashMap<String, Vec<Clue>>) -> (Option<f64>, Option<String>) {
    let mut scope = scope;
    loop {
        if let Some(here) = clues.get(scope) {
            return agreed_rate(here);
        }
        match scope.rfind(['.', '{', '(', '/']) {
            Some(cut) => scope = scope.get(..cut).unwrap_or_default(),
            None => return (None, None),
        }
    }
}

/// The rate that clues give, and what to say of it; none if they disagree or give none.
pub fn agreed_rate(clues: &[Clue]) -> (Option<f64>, Option<String>) {
    let named: Vec<String> =
        clues.iter().map(|clue| format!("{} = {}", clue.location, brief_number(clue.value))).collect();
    let named = named.join(", ");
    let Some(rates) = clues.iter().map(Clue::rate_hz).collect::<Option<Vec<f64>>>() else {
        return (None, Some(format!("{UNKNOWN_RATE}: no rate follows from {named}, wanted {WANTED_RATE}")));
    };
    let first = rates.first().copied().unwrap_or_default();
    if rates.iter().all(|rate| (rate - first).abs() <= AGREE * first) {
        (Some(first), Some(format!("{RATE_FROM} {named}: {first} samples per second")))
    } else {
        (None, Some(format!("{UNKNOWN_RATE} because these disagree: {named}")))
    }
}

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
