//! Whether a channel can carry a ringdown.

use super::channel::{Channel, MOST_CODES, Values};

/// Least sample rate that `io.records` accepts by default.
pub const LEAST_RATE_HZ: f64 = 200e3;

/// A ringdown of a few samples identifies nothing: the shipped configs take windows of 8192, the shortest useful ones
/// have an eighth.
const LEAST_SAMPLES: usize = 1024;

/// Samples in a period of a ring that is still well sampled.
const PERIOD_SAMPLES: f64 = 20.0;

/// Fewer distinct codes are those of a switch or a counter.
const LEAST_CODES: usize = 16;

/// More samples at the ends of the range than this share: what rang is cut off.
const MOST_SATURATED: f64 = 0.5;

/// Whether a ringdown can be in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Answer {
    /// It cannot.
    No,
    /// The file does not say enough.
    Unknown,
    /// Nothing speaks against it.
    Yes,
}

impl Answer {
    /// For people and for JSON.
    pub fn word(self) -> &'static str {
        match self {
            Self::No => "no",
            Self::Unknown => "unknown",
            Self::Yes => "yes",
        }
    }
}

/// An answer and its reason.
#[derive(Debug, Clone)]
pub struct Verdict {
    pub answer: Answer,
    pub reason: String,
    /// Index of the channel that it is about.
    pub channel: Option<usize>,
}

/// The verdict on a file: that on its best channel; of equals the one that is named like a deflection, else the first.
pub fn of_file(channels: &[Channel]) -> Verdict {
    let named = |channel: &Channel| channel.location.to_ascii_lowercase().contains("defl");
    let judged = channels.iter().enumerate().map(|(index, channel)| (of_channel(channel), index, channel));
    // of equals max_by_key takes the last, so the order is turned
    let best = judged.rev().max_by_key(|((answer, _), _, channel)| (*answer, named(channel)));
    match best {
        Some(((answer, reason), index, _)) => Verdict { answer, reason, channel: Some(index) },
        None => Verdict { answer: Answer::No, reason: "the file has no channel of numbers".to_owned(), channel: None },
    }
}

fn of_channel(channel: &Channel) -> (Answer, String) {
    if channel.is_axis {
        return (Answer::No, "it is an axis, no signal".to_owned());
    }
    let longest = channel.longest_stretch();
    if longest < LEAST_SAMPLES {
        let reason = format!("{longest} samples without interruption, wanted at least {LEAST_SAMPLES}");
        return (Answer::No, reason);
    }
    if let Some(reason) = channel.values.as_ref().and_then(|values| unusable(values, channel.samples)) {
        return (Answer::No, reason);
    }
    match channel.sample_rate_hz {
        None => (Answer::Unknown, "the file states no sample rate: give `sample_rate_hz`".to_owned()),
        Some(rate) if rate < LEAST_RATE_HZ => (
            Answer::No,
            format!(
                "{rate} samples per second, wanted at least {LEAST_RATE_HZ}: a lever rings at 10 kHz and more. At this \
                 rate a ring of up to {} Hz could be sampled: if the resonator is that slow, set `min_sample_rate_hz`",
                rate / PERIOD_SAMPLES
            ),
        ),
        Some(rate) if channel.values.is_none() => (
            Answer::Unknown,
            format!(
                "{rate} samples per second, {longest} samples without interruption; not read, the file has too many \
                 channels"
            ),
        ),
        Some(rate) => (
            Answer::Yes,
            format!(
                "{rate} samples per second, {longest} samples without interruption: enough for a lever's first mode of \
                 up to {} Hz",
                rate / PERIOD_SAMPLES
            ),
        ),
    }
}

/// Why values can be no recorded ring.
fn unusable(values: &Values, samples: usize) -> Option<String> {
    let valid = samples.saturating_sub(values.missing);
    if valid < LEAST_SAMPLES {
        return Some(format!("{} of {samples} samples are missing", values.missing));
    }
    if values.codes < LEAST_CODES.min(MOST_CODES) {
        return Some(format!("only {} different values, wanted at least {LEAST_CODES}", values.codes));
    }
    let share = values.saturated as f64 / valid as f64;
    (share > MOST_SATURATED)
        .then(|| format!("{:.0} % of the samples are clipped at an end of their range", 100.0 * share))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn channel(location: &str, rate: Option<f64>, samples: usize) -> Channel {
        let values = Some(Values { least: -1.0, largest: 1.0, codes: 200, missing: 0, saturated: 0 });
        let (location, unit) = (location.to_owned(), "V".to_owned());
        Channel {
            location,
            samples,
            sample_rate_hz: rate,
            unit,
            stored_as: "int16",
            gaps: Vec::new(),
            is_axis: false,
            values,
        }
    }

    #[test]
    fn each_reason_is_given() {
        let good = || channel("/a", Some(5e6), 90_000);
        let with = |values: Values| Channel { values: Some(values), ..good() };
        let values = |codes, missing, saturated| Values { least: 0.0, largest: 1.0, codes, missing, saturated };
        for (channel, answer, word) in [
            (good(), Answer::Yes, "first mode of up to 250000 Hz"),
            (channel("/a", Some(1e4), 90_000), Answer::No, "min_sample_rate_hz"),
            (channel("/a", None, 90_000), Answer::Unknown, "sample_rate_hz"),
            (channel("/a", Some(5e6), 500), Answer::No, "500 samples"),
            (Channel { is_axis: true, ..good() }, Answer::No, "an axis, no signal"),
            (Channel { gaps: (0..90_000).step_by(1000).collect(), ..good() }, Answer::No, "1000 samples"),
            (with(values(2, 0, 0)), Answer::No, "different values"),
            (with(values(200, 0, 60_000)), Answer::No, "67 % of the samples are clipped"),
            (with(values(200, 89_500, 0)), Answer::No, "89500 of 90000 samples are missing"),
            (Channel { values: None, ..good() }, Answer::Unknown, "not read"),
        ] {
            let verdict = of_file(&[channel]);
            assert!(verdict.answer == answer && verdict.reason.contains(word), "{verdict:?}");
        }
        assert_eq!(of_file(&[]).answer, Answer::No);
    }

    #[test]
    fn the_best_channel_decides_and_a_deflection_goes_first() {
        let slow = || channel("/slow", Some(1e3), 90_000);
        let (first, named) = (channel("/a", Some(5e6), 90_000), channel("/Deflection", Some(5e6), 90_000));
        assert_eq!(of_file(&[slow(), first, named]).channel, Some(2));
        assert_eq!(
            of_file(&[slow(), channel("/a", Some(5e6), 90_000), channel("/b", Some(5e6), 90_000)]).channel,
            Some(1)
        );
    }
}
