//! `decays`: free decays, a row for each channel of each hit.

use std::ops::Range;

use afmid_pipeline::{Array, Attribute, Axis, StageError, Values};
use serde::{Deserialize, Serialize};

use super::{RateError, SAMPLE_RATE_HZ, sample_rate_of};

const SIGNAL: &str = "signal";
const SAMPLE: &str = "sample";
const SAMPLES: &str = "samples";
const HIT: &str = "hit";
const CHANNEL: &str = "channel";
const CHANNELS: &str = "channels";
const QUIET: &str = "quiet";
const QUIET_ROW: &str = "quiet_row";
const QUIET_SAMPLE: &str = "quiet_sample";
const QUIET_SAMPLES: &str = "quiet_samples";

/// A channel of all hits: a sensor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sensor {
    /// As the file names it.
    pub name: String,
    /// Its unit; empty where it is not known.
    pub unit: String,
}

/// Free decays: `signal` row after row over `sample`, NaN where one is missing; `hit`, `channel` and number of `samples`
/// of each row, hit by hit. `quiet` likewise, where something was quiet before a hit.
#[derive(Debug, Clone)]
pub(crate) struct Decays<'a> {
    pub sample_rate_hz: f64,
    pub rate_error: RateError,
    pub sensors: Vec<Sensor>,
    /// Per hit a stretch of each sensor, of one length.
    pub hits: Vec<Vec<&'a [f64]>>,
    /// Number of each hit, from 0.
    pub numbers: Vec<usize>,
    /// The same of what was before hits.
    pub quiet: Vec<Vec<&'a [f64]>>,
}

impl<'a> Decays<'a> {
    /// Reads an artifact. Errors: not one of these.
    pub fn new(array: &'a Array) -> Result<Self, StageError> {
        let text = array.attributes.get(CHANNELS).and_then(Attribute::as_str).unwrap_or_default();
        let sensors: Vec<Sensor> = serde_json::from_str(text)
            .map_err(|error| StageError::new(format!("attribute `{CHANNELS}` does not list channels: {error}")))?;
        let hits = stretches(array, SIGNAL, SAMPLES, sensors.len())?;
        let (hit, channel) = (whole(array, HIT)?, whole(array, CHANNEL)?);
        let place = |k: usize| (k / sensors.len(), k % sensors.len());
        let at = |k: usize| (hit[k] as usize, channel[k] as usize);
        if hit.len() != channel.len() || !(0..hit.len()).all(|k| at(k) == place(k)) {
            let wanted = format!("wanted hits in order, each of {} channels in order", sensors.len());
            return Err(StageError::new(format!("`{HIT}` and `{CHANNEL}`: {wanted}")));
        }
        let quiet = match array.variable(QUIET) {
            Ok(_) => stretches(array, QUIET, QUIET_SAMPLES, sensors.len())?,
            Err(_) => Vec::new(),
        };
        let numbers = (0..hits.len()).collect();
        let (sample_rate_hz, rate_error) = (sample_rate_of(array)?, RateError::of(array));
        Ok(Self { sample_rate_hz, rate_error, sensors, hits, numbers, quiet })
    }

    /// Leaves out hits with fewer than `least` samples that are there in any channel; their numbers.
    pub fn leave_out_short(&mut self, least: usize) -> Vec<usize> {
        let present = |row: &&[f64]| row.iter().filter(|value| value.is_finite()).count();
        let is_long = |hit: &Vec<&[f64]>| hit.iter().map(present).min().is_some_and(|samples| samples >= least);
        let (kept, short): (Vec<usize>, Vec<usize>) =
            (0..self.hits.len()).partition(|&place| self.hits.get(place).is_some_and(is_long));
        let short = short.into_iter().filter_map(|place| self.numbers.get(place).copied()).collect();
        self.keep(&kept);
        short
    }

    /// Leaves these hits, by their places, ascending.
    pub fn keep(&mut self, places: &[usize]) {
        let mut place = 0..;
        self.hits.retain(|_| place.next().is_some_and(|place| places.contains(&place)));
        let mut place = 0..;
        self.numbers.retain(|_| place.next().is_some_and(|place| places.contains(&place)));
    }

    /// The samples of each stretch that are missing.
    pub fn missing(&self) -> Vec<Vec<Vec<Range<usize>>>> {
        self.hits.iter().map(|hit| hit.iter().map(|row| gaps(row)).collect()).collect()
    }
}

/// The rows of a variable, `channels` at a time, as far as any of these has a value.
fn stretches<'a>(
    array: &'a Array,
    name: &str,
    lengths: &str,
    channels: usize,
) -> Result<Vec<Vec<&'a [f64]>>, StageError> {
    let (mut rest, lengths) = (array.real(name)?, whole(array, lengths)?);
    if channels == 0 || !lengths.len().is_multiple_of(channels) {
        return Err(StageError::new(format!("`{name}` has {} rows, wanted {channels} for each hit", lengths.len())));
    }
    let mut rows: Vec<&'a [f64]> = Vec::with_capacity(lengths.len());
    for &length in lengths {
        let row = usize::try_from(length).ok().and_then(|length| rest.split_at_checked(length));
        let (row, more) = row.ok_or_else(|| StageError::new(format!("`{name}` ends before its rows do")))?;
        rows.push(row);
        rest = more;
    }
    let length = |row: &&[f64]| row.iter().rposition(|value| value.is_finite()).map_or(0, |last| last + 1);
    let stretch = |rows: &[&'a [f64]]| {
        let longest = rows.iter().map(length).max().unwrap_or(0);
        rows.iter().map(|&row| row.get(..longest).unwrap_or(row)).collect()
    };
    Ok(rows.chunks_exact(channels).map(stretch).collect())
}

fn whole<'a>(array: &'a Array, name: &str) -> Result<&'a [i64], StageError> {
    match &array.variable(name)?.values {
        Values::Integer(values) => Ok(values),
        _ => Err(StageError::new(format!("variable `{name}`: wanted whole numbers"))),
    }
}

/// Stretches without finite values.
fn gaps(values: &[f64]) -> Vec<Range<usize>> {
    let mut gaps: Vec<Range<usize>> = Vec::new();
    for (k, _) in values.iter().enumerate().filter(|(_, value)| !value.is_finite()) {
        match gaps.last_mut() {
            Some(last) if last.end == k => last.end = k + 1,
            _ => gaps.push(k..k + 1),
        }
    }
    gaps
}

/// The artifact of these hits and of what was before hits, each a stretch of every sensor.
pub(crate) fn decay_array(
    hits: &[Vec<Vec<f64>>],
    quiet: &[Vec<Vec<f64>>],
    sensors: &[Sensor],
    sample_rate_hz: f64,
) -> Result<Array, StageError> {
    let names = serde_json::to_string(sensors).map_err(StageError::from_error)?;
    let unit = sensors.first().map_or("", |first| &first.unit);
    let unit = if sensors.iter().all(|sensor| sensor.unit == unit) { unit } else { "" };
    let places = || hits.iter().enumerate().flat_map(|(hit, rows)| (0..rows.len()).map(move |channel| (hit, channel)));
    let (hit, channel): (Vec<i64>, Vec<i64>) = places().map(|(hit, channel)| (hit as i64, channel as i64)).unzip();
    let numbers = |count: usize| (0..count).map(|k| k as f64).collect();
    let (signal, samples) = joined(hits);
    let mut axes = vec![
        Axis::new("row", "1", "channel of a hit", numbers(hit.len())),
        Axis::new(SAMPLE, "1", "sample, row after row", numbers(signal.len())),
    ];
    let (before, quiet_samples) = joined(quiet);
    if !before.is_empty() {
        axes.push(Axis::new(QUIET_ROW, "1", "channel before a hit", numbers(quiet_samples.len())));
        axes.push(Axis::new(QUIET_SAMPLE, "1", "sample, row after row", numbers(before.len())));
    }
    let array = Array::over(axes)
        .with(SIGNAL, unit, "free decay", &[SAMPLE], signal)
        .with(SAMPLES, "1", "samples of the row", &["row"], samples)
        .with(HIT, "1", "number of the hit", &["row"], hit)
        .with(CHANNEL, "1", "number of the channel", &["row"], channel)
        .attribute(SAMPLE_RATE_HZ, sample_rate_hz)
        .attribute(CHANNELS, names);
    if before.is_empty() {
        return Ok(array);
    }
    Ok(array.with(QUIET, unit, "what was before a hit", &[QUIET_SAMPLE], before).with(
        QUIET_SAMPLES,
        "1",
        "samples of the row",
        &[QUIET_ROW],
        quiet_samples,
    ))
}

/// All stretches one after the other, and how many samples each has.
fn joined(stretches: &[Vec<Vec<f64>>]) -> (Vec<f64>, Vec<i64>) {
    let rows = || stretches.iter().flatten();
    (rows().flatten().copied().collect(), rows().map(|row| row.len() as i64).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hits_of_unequal_length_with_gaps_come_back_as_they_were_written() {
        let sensor = |name: &str| Sensor { name: name.to_owned(), unit: "V".to_owned() };
        let sensors = [sensor("a"), sensor("b")];
        let hits = vec![vec![vec![1.0, f64::NAN, 3.0], vec![4.0, 5.0, 6.0]], vec![vec![7.0, 8.0], vec![9.0, f64::NAN]]];
        let before = vec![vec![vec![0.5, 0.6], vec![0.7, 0.8]]];
        for quiet in [&[][..], &before[..]] {
            let array = decay_array(&hits, quiet, &sensors, 10.0).unwrap();
            array.validate().unwrap();
            assert_eq!(Decays::new(&array).unwrap().quiet.len(), quiet.len());
        }
        let array = decay_array(&hits, &before, &sensors, 10.0).unwrap();
        let read = Decays::new(&array).unwrap();
        assert_eq!((read.sample_rate_hz, &read.sensors[..]), (10.0, &sensors[..]));
        assert_eq!(read.hits[1][0], [7.0, 8.0]);
        let missing: Vec<Vec<usize>> =
            read.missing().into_iter().flatten().map(|gaps| gaps.into_iter().flatten().collect()).collect();
        assert_eq!(missing, [vec![1], vec![], vec![], vec![1]]);
        let mut read = read;
        assert_eq!(read.leave_out_short(2), [1]);
        assert_eq!((read.hits.len(), &read.numbers[..]), (1, &[0][..]));
    }
}
