//! Whether a file holds a ringdown.

use afmid_pipeline::recording::FoundChannel;

use super::channel::{Channel, MOST_CODES, Values};
use super::ringing::{longest_stretch, ringdown};

/// Fewer samples hold no two periods and the noise to tell them from.
pub const LEAST_SAMPLES: usize = 64;

/// Fewer distinct codes are those of a switch or a counter.
pub const LEAST_CODES: usize = 16;

/// More samples at the ends of the range than this share: what rang is cut off.
const MOST_SATURATED: f64 = 0.5;

/// Channels of a file that are searched for a ringdown, at most.
const MOST_SEARCHED: usize = 16;

/// Whether a ringdown is in it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Answer {
    /// None.
    No,
    /// The file does not say enough.
    Unknown,
    /// At least one.
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

/// The verdict on a file: that on its first channel with a ringdown, those named like a deflection before the others;
/// without one that on the first channel which could hold one.
pub fn of_file(channels: &[Channel], found: &[FoundChannel]) -> Verdict {
    let named = |channel: &Channel| channel.location.to_ascii_lowercase().contains("defl");
    let mut order: Vec<usize> = (0..channels.len().min(found.len())).collect();
    let last = |channel: &Channel| (unusable(channel).is_some(), channel.is_axis, !named(channel));
    order.sort_by_key(|&index| last(&channels[index]));
    let mut best: Option<Verdict> = None;
    for index in order.into_iter().take(MOST_SEARCHED) {
        let (answer, reason) = match unusable(&channels[index]) {
            Some(reason) => (Answer::No, reason),
            None => ringdown(&found[index]),
        };
        if best.as_ref().is_none_or(|best| answer > best.answer) {
            best = Some(Verdict { answer, reason, channel: Some(index) });
        }
        // without a rate no other channel tells more
        if answer == Answer::Yes || (answer == Answer::Unknown && found[index].sample_rate_hz.is_none()) {
            break;
        }
    }
    let none = || "the file has no channel of numbers".to_owned();
    best.unwrap_or_else(|| Verdict { answer: Answer::No, reason: none(), channel: None })
}

/// Why a channel can hold no ringdown, whatever its samples do.
fn unusable(channel: &Channel) -> Option<String> {
    if channel.is_axis {
        return Some("it is an axis, no signal".to_owned());
    }
    if let Some(why) = &channel.no_sensor {
        return Some(format!("it is no sensor: it is {why}").replace("it is rises", "it rises"));
    }
    let longest = longest_stretch(channel.samples, &channel.gaps).len();
    if longest < LEAST_SAMPLES {
        return Some(format!("{longest} samples without interruption, wanted at least {LEAST_SAMPLES}"));
    }
    channel.values.as_ref().and_then(|values| unusable_values(values, channel.samples))
}

/// Why values can be no recorded ring.
fn unusable_values(values: &Values, samples: usize) -> Option<String> {
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
    use std::sync::Arc;

    use afmid_pipeline::recording::{FormatError, Raw, Source};

    use super::*;

    #[derive(Debug)]
    struct Values64(Vec<f64>);

    impl Source for Values64 {
        fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
            Ok(Raw::Float64(self.0[start..start + count].to_vec()))
        }
    }

    /// A channel with these samples.
    fn channel(location: &str, rate: Option<f64>, y: Vec<f64>) -> (Channel, FoundChannel) {
        let mut found = FoundChannel::new(location, y.len(), "float64", Arc::new(Values64(y)));
        found.sample_rate_hz = rate;
        (Channel::of(&found, true).expect("samples"), found)
    }

    /// Quiet, then 100 periods of 20 samples that decay with Q = 30 or do not.
    fn rings(decays: bool) -> Vec<f64> {
        let noise = |k: usize| 1e-3 * ((k * k) as f64).sin();
        let ring = |k: usize| {
            let t = k as f64 - 1000.0;
            if t < 0.0 && decays { 0.0 } else { (if decays { -t / 191.0 } else { 0.0 }).exp() * (t * 0.314_159).sin() }
        };
        (0..3000).map(|k| ring(k) + noise(k)).collect()
    }

    fn verdict(channels: Vec<(Channel, FoundChannel)>) -> Verdict {
        let (channels, found): (Vec<Channel>, Vec<FoundChannel>) = channels.into_iter().unzip();
        of_file(&channels, &found)
    }

    #[test]
    fn each_reason_is_given() {
        let good = |rate| channel("/a", rate, rings(true));
        let changed = |change: &dyn Fn(&mut Channel)| {
            let mut channel = good(Some(5e3));
            change(&mut channel.0);
            channel
        };
        let values =
            |codes, missing, saturated| Values { least: 0.0, largest: 1.0, codes, changes: codes, missing, saturated };
        let noise: Vec<f64> = rings(true)[..1000].to_vec();
        let lacking = |k: usize, mut y: Vec<f64>| {
            y[k] = f64::NAN;
            y
        };
        let scattered = |mut y: Vec<f64>| {
            (0..y.len()).step_by(40).for_each(|k| y[k] = f64::NAN);
            y
        };
        for (channel, answer, word) in [
            (good(Some(5e3)), Answer::Yes, "a free decay from 0.2"),
            (good(Some(5e3)), Answer::Yes, "at about 250 Hz"),
            (good(None), Answer::Unknown, "20.0 samples a period; the file states no sample rate"),
            (channel("/a", Some(5e3), rings(false)), Answer::No, "steady oscillation at 250"),
            (channel("/a", None, rings(false)), Answer::No, "steady oscillation of 20.0 samples a period"),
            (channel("/a", Some(5e3), noise), Answer::No, "noise alone"),
            (channel("/a", Some(5e3), lacking(30, rings(true))), Answer::Yes, "from 0.2"),
            (channel("/a", Some(5e3), lacking(30, rings(true))), Answer::Yes, "3000 samples those from 31 to 2999"),
            (channel("/a", Some(5e3), lacking(2900, rings(true))), Answer::Yes, "from 0.2"),
            (channel("/a", None, lacking(30, rings(true))), Answer::Unknown, "20.0 samples a period"),
            (channel("/a", Some(5e3), lacking(999, rings(true)[..1100].to_vec())), Answer::Unknown, "noise alone"),
            (channel("/a", Some(5e3), scattered(rings(true))), Answer::Unknown, "39 samples, wanted at least 64"),
            (channel("/a", Some(5e3), vec![0.5; 60]), Answer::No, "60 samples without interruption"),
            (changed(&|c| c.is_axis = true), Answer::No, "an axis, no signal"),
            (changed(&|c| c.gaps = (0..3000).step_by(50).collect()), Answer::No, "50 samples"),
            (changed(&|c| c.values = Some(values(2, 0, 0))), Answer::No, "different values"),
            (changed(&|c| c.values = Some(values(200, 0, 2000))), Answer::No, "67 % of the samples are clipped"),
            (changed(&|c| c.values = Some(values(200, 2950, 0))), Answer::No, "2950 of 3000 samples are missing"),
        ] {
            let verdict = verdict(vec![channel]);
            assert!(verdict.answer == answer && verdict.reason.contains(word), "{verdict:?}");
        }
        assert_eq!(of_file(&[], &[]).answer, Answer::No);
    }

    #[test]
    fn the_channel_that_rings_decides_and_a_deflection_goes_first() {
        let (still, first) = (|| channel("/still", Some(5e3), rings(false)), channel("/a", Some(5e3), rings(true)));
        let named = channel("/Deflection", Some(5e3), rings(true));
        assert_eq!(verdict(vec![still(), first, named]).channel, Some(2));
        let (mut time, constant) = (channel("/t", None, vec![0.0; 3000]), channel("/c", None, vec![0.0; 3000]));
        time.0.is_axis = true;
        assert_eq!(verdict(vec![time, constant]).channel, Some(1));
        let [a, b] = ["/a", "/b"].map(|name| channel(name, Some(5e3), rings(true)));
        assert_eq!(verdict(vec![still(), a, b]).channel, Some(1));
    }
}
