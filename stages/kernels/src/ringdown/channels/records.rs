//! What is fitted: one record per event and channel, whitened by its channel's noise.

use std::borrow::Cow;

use crate::model::ModelError;
use crate::ringdown::RingdownNoise;
use crate::ringdown::compressed::whiten;
use crate::ringdown::gaps::Gaps;
use crate::ringdown::whitener::Whitener;

use super::options::ChannelOptions;
use crate::signal::{TransformPlans, code_step};

/// One channel of one event.
pub(super) struct Record<'a> {
    pub event: usize,
    pub channel: usize,
    /// Finite throughout; what stands in a gap is never used.
    pub values: Cow<'a, [f64]>,
    /// Which samples are missing; empty where none is.
    pub mask: Vec<bool>,
}

impl Record<'_> {
    pub fn present(&self, sample: usize) -> bool {
        !self.mask.get(sample).copied().unwrap_or(false)
    }

    /// Samples that are there.
    pub fn observed(&self) -> usize {
        self.values.len() - self.mask.iter().filter(|missing| **missing).count()
    }
}

/// All records.
pub(super) struct Records<'a> {
    pub all: Vec<Record<'a>>,
    pub channels: usize,
    pub events: usize,
    pub interval_s: f64,
    /// Samples of the longest.
    pub longest: usize,
    pub drift: bool,
    /// Variance of each channel's rounding, which its noise is not below: of its codes, or of numbers of 30 bits. A
    /// channel that is one number throughout has that weight.
    pub rounding: Vec<f64>,
    pub plans: TransformPlans,
}

impl<'a> Records<'a> {
    /// Errors: no event, unequal numbers of channels or lengths within an event, too few samples, values that are not
    /// finite.
    pub fn of(events: &[Vec<&'a [f64]>], interval_s: f64, options: &ChannelOptions) -> Result<Self, ModelError> {
        let channels = events.first().map_or(0, Vec::len);
        if channels == 0 {
            return Err(ModelError::NoExperiment);
        }
        if !(interval_s > 0.0 && interval_s.is_finite()) {
            return Err(ModelError::Parameter { name: "interval_s", found: interval_s, wanted: "above 0" });
        }
        options.check(channels)?;
        if !options.missing.is_empty() && options.missing.len() != events.len() {
            let found = options.missing.len();
            return Err(ModelError::Length { what: "missing", found, wanted: events.len() });
        }
        let mut all = Vec::new();
        for (event, records) in events.iter().enumerate() {
            if records.len() != channels {
                return Err(ModelError::Length { what: "channels", found: records.len(), wanted: channels });
            }
            let samples = records[0].len();
            if let Some(other) = records.iter().find(|values| values.len() != samples) {
                return Err(ModelError::Length { what: "channel", found: other.len(), wanted: samples });
            }
            let missing = options.missing.get(event).map_or(&[][..], Vec::as_slice);
            let gaps = Gaps::of(missing, channels, samples)?;
            for (channel, values) in gaps.bridged(records).into_iter().enumerate() {
                let record = Record { event, channel, values, mask: gaps.mask(channel).to_vec() };
                if record.observed() < LEAST_SAMPLES {
                    return Err(ModelError::TooShort { found: record.observed(), wanted: LEAST_SAMPLES });
                }
                if let Some(index) = record.values.iter().position(|y| !y.is_finite()) {
                    return Err(ModelError::NotFinite { what: "event", index });
                }
                all.push(record);
            }
        }
        if all.iter().all(|record| record.values.iter().all(|y| *y == record.values[0])) {
            return Err(ModelError::ConstantOutput);
        }
        let longest = all.iter().map(|record| record.values.len()).max().unwrap_or(0);
        let rounding = (0..channels).map(|c| rounding(&all, c)).collect();
        let plans = TransformPlans::default();
        Ok(Self { all, channels, events: events.len(), interval_s, longest, drift: options.drift, rounding, plans })
    }

    /// Samples of a channel that are there.
    pub fn observed(&self, channel: usize) -> usize {
        self.all.iter().filter(|record| record.channel == channel).map(Record::observed).sum()
    }
}

/// Least samples of a record.
pub(super) const LEAST_SAMPLES: usize = 24;

/// Share of a channel's mean square that is rounding at least: numbers of 30 bits.
const ROUNDED: f64 = 1e-18;

/// Variance of a channel's rounding: a twelfth of the square of its codes' step.
fn rounding(all: &[Record<'_>], channel: usize) -> f64 {
    let own = || all.iter().filter(|record| record.channel == channel);
    let step = own().map(|record| code_step(&record.values)).filter(|step| *step > 0.0).reduce(f64::min);
    let square: f64 = own().flat_map(|record| record.values.iter()).map(|y| y * y).sum();
    let count = own().map(|record| record.values.len()).sum::<usize>().max(1) as f64;
    let codes = step.unwrap_or(0.0).powi(2) / 12.0;
    codes.max(ROUNDED * square / count).max(f64::MIN_POSITIVE.sqrt())
}

/// Records of one length, one pattern of gaps and one shape of noise: they share filter and basis.
pub(super) struct Group {
    whitener: Option<Whitener>,
    mask: Vec<bool>,
    pub samples: usize,
    pub members: Vec<usize>,
    /// Whitened, one per member.
    pub signals: Vec<Vec<f64>>,
    /// What the members' whitened amplitudes are multiplied by to be in their channels' units.
    pub scale: Vec<f64>,
    /// Twice the logarithm of the whitening's volume, per member: what its noise adds to minus twice the
    /// log-likelihood.
    pub log_variance: Vec<f64>,
}

impl Group {
    /// Whether noise is white and no sample is missing.
    pub fn is_plain(&self) -> bool {
        self.whitener.is_none() && self.mask.is_empty()
    }

    /// Whitens signals in place, as the members were, but for their scale.
    pub fn whiten(&self, signals: &mut [Vec<f64>]) {
        match &self.whitener {
            Some(whitener) => whiten(whitener, signals),
            None if self.mask.is_empty() => {}
            None => signals.iter_mut().for_each(|signal| {
                signal.iter_mut().zip(&self.mask).filter(|(_, missing)| **missing).for_each(|(y, _)| *y = 0.0);
            }),
        }
    }
}

/// Groups of all records under the noise of each channel.
///
/// Method: white channels differ by a factor only and share a group.
pub(super) fn groups(records: &Records<'_>, noise: &[RingdownNoise]) -> Vec<Group> {
    let colour = |record: &Record<'_>| (!noise[record.channel].is_white()).then_some(record.channel);
    let mut patterns: Vec<Vec<usize>> = Vec::new();
    for (i, record) in records.all.iter().enumerate() {
        let same = |members: &&mut Vec<usize>| {
            let other = &records.all[members[0]];
            other.values.len() == record.values.len() && other.mask == record.mask && colour(other) == colour(record)
        };
        match patterns.iter_mut().find(same) {
            Some(members) => members.push(i),
            None => patterns.push(vec![i]),
        }
    }
    let group = |members: Vec<usize>| {
        let first = &records.all[members[0]];
        let (samples, mask) = (first.values.len(), first.mask.clone());
        let whitener = colour(first).map(|channel| Whitener::new(&noise[channel], records.interval_s, samples, &mask));
        let none = (Vec::new(), Vec::new(), Vec::new());
        let (signals, scale, log_variance) = none;
        let mut group = Group { whitener, mask, samples, members, signals, scale, log_variance };
        let mut signals: Vec<Vec<f64>> = Vec::new();
        for member in group.members.clone() {
            let record = &records.all[member];
            let white = noise[record.channel].white;
            let scale = if group.whitener.is_some() { 1.0 } else { white.sqrt() };
            signals.push(record.values.iter().map(|y| y / scale).collect());
            group.scale.push(scale);
            group.log_variance.push(match &group.whitener {
                Some(whitener) => whitener.log_variance(samples),
                None => record.observed() as f64 * white.ln(),
            });
        }
        group.whiten(&mut signals);
        group.signals = signals;
        group
    };
    patterns.into_iter().map(group).collect()
}
