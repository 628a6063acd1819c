//! What a search finds.

use std::ops::Range;

use crate::statistics::{normal_two_sided, student_limit};

/// Why a decay ends where it does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum DecayEnd {
    /// The ringing of a period is smaller than the noise; half as long again, to the next event at most, is taken along.
    Noise,
    /// The next event begins.
    NextEvent,
    /// The record ends first: it never drowns.
    RecordEnd,
}

/// Slope of the logarithm of an oscillation's amplitude.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Decline {
    /// Decay rate, 1/s; negative: it grows.
    pub rate_per_s: f64,
    /// Its standard error, from the scatter round the straight line; infinite where there are too few periods.
    pub std_per_s: f64,
    /// Degrees of freedom of that error; 0 where it is infinite.
    pub freedom: usize,
}

impl Decline {
    /// The rate that a steady oscillation exceeds as rarely as a normal variable exceeds so many standard deviations: of
    /// few segments the error is hardly known, and the rate over it has Student's distribution.
    pub(super) fn limit_per_s(&self, deviations: f64) -> f64 {
        if self.freedom == 0 {
            return self.std_per_s;
        }
        // a number that is not 0: beyond 37 deviations there is none
        let tail = normal_two_sided(deviations).max(f64::MIN_POSITIVE);
        self.std_per_s * student_limit(tail, self.freedom as f64)
    }
}

/// What one channel shows of a decay.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelDecay {
    /// Largest departure from the level within the decay, in the channel's unit, with its sign.
    pub peak: f64,
    /// Sample of the record where it is.
    pub peak_sample: usize,
    /// Clipped samples within the decay's range, as samples of the record: to be left out of a fit.
    pub clipped: Vec<Range<usize>>,
    /// Level of the quiet stretch before the event, in the channel's unit; none where there is none.
    pub level_before: Option<f64>,
    /// Standard deviation of the noise before the event; none where there is no quiet stretch.
    pub noise_before: Option<f64>,
    /// The same after the decay.
    pub noise_after: Option<f64>,
}

/// A free decay.
#[derive(Debug, Clone, PartialEq)]
pub struct FreeDecay {
    /// First sample of the event: where the signal leaves what was before.
    pub onset: usize,
    /// First sample of the free, linear decay to the sample after its last.
    pub range: Range<usize>,
    /// Why it ends there.
    pub end: DecayEnd,
    /// Quiet samples before the event; none where the record or the decay before it begins too late.
    pub quiet: Option<Range<usize>>,
    /// Strongest frequency, Hz; to the width of a line, not a fit's.
    pub frequency_hz: f64,
    /// Decline of that frequency's amplitude.
    pub decline: Decline,
    /// Per channel, the drive's left out.
    pub channels: Vec<ChannelDecay>,
}

/// An oscillation whose amplitude does not decay: frequency and amplitude are all that can be had from it.
#[derive(Debug, Clone, PartialEq)]
pub struct Steady {
    /// Samples of it.
    pub range: Range<usize>,
    /// Its frequency, Hz.
    pub frequency_hz: f64,
    /// Amplitude per channel, in the channel's unit, the drive's left out.
    pub amplitude: Vec<f64>,
    /// Slope of its amplitude.
    pub decline: Decline,
    /// Whether it grows by more than its error allows.
    pub growing: bool,
}

impl Steady {
    /// What it means.
    pub fn statement(&self) -> String {
        let Decline { rate_per_s, std_per_s, .. } = self.decline;
        let shape = if self.growing { "grows" } else { "does not decay" };
        // six digits
        let decimals = (5.0 - self.frequency_hz.abs().log10().floor()).clamp(0.0, 12.0) as usize;
        let rate = match std_per_s.is_finite() {
            true => format!(" (decay rate {rate_per_s:.3e} +- {std_per_s:.1e} 1/s)"),
            false => String::new(),
        };
        format!(
            "steady oscillation at {:.decimals$} Hz: its amplitude {shape}{rate}, so Q cannot be had from it",
            self.frequency_hz
        )
    }
}

/// Why a start was not taken for a decay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum DismissedReason {
    /// Too few samples before it drowns or the next event begins: less than two periods.
    TooShort,
    /// Nothing there exceeds the noise.
    NoRinging,
    /// No larger than stationary noise of its band becomes by itself.
    Excursion {
        /// Its largest energy over the mean one there.
        ratio: f64,
        /// The ratio that noise exceeds in one record of a thousand.
        limit: f64,
    },
    /// One of many rises and falls of a random vibration.
    Random,
    /// Part of a random walk.
    Walk,
    /// A few periods that a far larger event ends: what was done to make it.
    Handling {
        /// Its energy over that of those periods.
        ratio: f64,
    },
}

/// A start that was not taken for a decay.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DismissedDecay {
    /// Where.
    pub onset: usize,
    /// Why.
    pub reason: DismissedReason,
}

/// What a record holds.
#[derive(Debug, Clone, PartialEq)]
pub struct DecaySearch {
    /// Decays in order of time.
    pub decays: Vec<FreeDecay>,
    /// Oscillations that do not decay.
    pub steady: Vec<Steady>,
    /// Starts that are neither.
    pub dismissed: Vec<DismissedDecay>,
    /// Standard deviation of each channel's noise, the drive's left out.
    pub noise_std: Vec<f64>,
    /// Largest energy over a period, in units of the noise's: 1 is noise.
    pub largest_energy: f64,
    /// Numbers of the channels that are searched: all but the drive's.
    pub channels: Vec<usize>,
    /// Whether what rises and falls is a random vibration: no rise is larger than stationary noise has them, or there are
    /// many in a signal that is normally distributed.
    pub random: bool,
}

impl DecaySearch {
    /// That what rises and falls is stationary noise; none where it is not.
    pub fn noise(&self) -> Option<String> {
        if !self.random {
            return None;
        }
        let rises = match self.decays_of_noise().count() {
            0 => "an oscillation that its own fluctuations sustain".to_owned(),
            1 => "a rise and fall".to_owned(),
            many => format!("{many} rises and falls"),
        };
        let ratio = |dismissed: &DismissedDecay| match dismissed.reason {
            DismissedReason::Excursion { ratio, limit } => Some((ratio, limit)),
            _ => None,
        };
        let largest = self.dismissed.iter().filter_map(ratio).max_by(|a, b| a.0.total_cmp(&b.0));
        let size = largest.map(|(ratio, limit)| {
            format!(
                ", the largest of {ratio:.1} times the mean energy of its band; stationary noise exceeds {limit:.0} times \
                 in one record of a thousand"
            )
        });
        Some(format!("stationary noise: {rises}{}", size.unwrap_or_default()))
    }

    fn decays_of_noise(&self) -> impl Iterator<Item = &DismissedDecay> {
        self.dismissed
            .iter()
            .filter(|dismissed| matches!(dismissed.reason, DismissedReason::Excursion { .. } | DismissedReason::Random))
    }

    /// Why nothing was found, where that is so.
    pub fn reason(&self) -> Option<String> {
        if !self.decays.is_empty() {
            return None;
        }
        if let Some(noise) = self.noise() {
            return Some(noise);
        }
        if self.dismissed.iter().any(|dismissed| dismissed.reason == DismissedReason::Walk) {
            let walk =
                "a random walk: samples differ by the root of their distance, and no oscillation stands out of it";
            return Some(walk.to_owned());
        }
        if let Some(steady) = self.steady.first() {
            return Some(steady.statement());
        }
        let largest = self.largest_energy.max(0.0).sqrt();
        Some(match self.dismissed.first() {
            Some(first) => format!(
                "{} starts, none with a decay; the first, at sample {}, {}",
                self.dismissed.len(),
                first.onset,
                match first.reason {
                    DismissedReason::TooShort => "is followed by less than two periods above the noise",
                    DismissedReason::NoRinging => "is followed by noise alone",
                    DismissedReason::Excursion { .. } => "is no larger than stationary noise becomes",
                    DismissedReason::Random => "is one of a random vibration's",
                    DismissedReason::Walk => "is part of a random walk",
                    DismissedReason::Handling { .. } => "is a few periods before a far larger event",
                }
            ),
            None => format!("noise alone: no period's rms exceeds {largest:.1} times the noise's"),
        })
    }
}
