//! `decays`: free decays, a row for each channel of each hit.

use std::ops::Range;

use afmid_pipeline::{Array, Attribute, Axis, StageError, Values};
use serde::{Deserialize, Serialize};

use super::SAMPLE_RATE_HZ;

const SIGNAL: &str = "signal";
const HIT: &str = "hit";
const CHANNEL: &str = "channel";
const CHANNELS: &str = "channels";
const QUIET: &str = "quiet";
const QUIET_ROW: &str = "quiet_row";
const QUIET_TIME: &str = "quiet_time";

/// A channel of all hits: a sensor.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Sensor {
    /// As the file names it.
    pub name: String,
    pub unit: String,
}

/// Free decays: `signal` over `row` and `time`, NaN where a sample is missing and behind a decay's end; `hit` and
/// `channel` of each row, hit by hit. `quiet` likewise, where something was quiet before a hit.
#[derive(Debug, Clone)]
pub(crate) struct Decays<'a> {
    pub sample_rate_hz: f64,
    pub sensors: Vec<Sensor>,
    /// Per hit a stretch of each sensor, of one length.
    pub hits: Vec<Vec<&'a [f64]>>,
    /// The same of what was before hits.
    pub quiet: Vec<Vec<&'a [f64]>>,
}

impl<'a> Decays<'a> {
    /// Reads an artifact. Errors: not one of these.
    pub fn new(array: &'a Array) -> Result<Self, StageError> {
        let text = array.attributes.get(CHANNELS).and_then(Attribute::as_str).unwrap_or_default();
        let sensors: Vec<Sensor> = serde_json::from_str(text)
            .map_err(|error| StageError::new(format!("attribute `{CHANNELS}` does not list channels: {error}")))?;
        let hits = stretches(array, SIGNAL, "time", sensors.len())?;
        let (hit, channel) = (whole(array, HIT)?, whole(array, CHANNEL)?);
        let place = |k: usize| (k / sensors.len(), k % sensors.len());
        let at = |k: usize| (hit[k] as usize, channel[k] as usize);
        if hit.len() != channel.len() || !(0..hit.len()).all(|k| at(k) == place(k)) {
            let wanted = format!("wanted hits in order, each of {} channels in order", sensors.len());
            return Err(StageError::new(format!("`{HIT}` and `{CHANNEL}`: {wanted}")));
        }
        let quiet = match array.variable(QUIET) {
            Ok(_) => stretches(array, QUIET, QUIET_TIME, sensors.len())?,
            Err(_) => Vec::new(),
        };
        Ok(Self { sample_rate_hz: array.number(SAMPLE_RATE_HZ)?, sensors, hits, quiet })
    }

    /// The samples of each stretch that are missing.
    pub fn missing(&self) -> Vec<Vec<Vec<Range<usize>>>> {
        self.hits.iter().map(|hit| hit.iter().map(|row| gaps(row)).collect()).collect()
    }
}

/// The rows of a variable, `channels` at a time, as far as any of these has a value.
fn stretches<'a>(array: &'a Array, name: &str, time: &str, channels: usize) -> Result<Vec<Vec<&'a [f64]>>, StageError> {
    let samples = array.axis(time)?.values.len();
    let rows: Vec<&[f64]> = array.real(name)?.chunks_exact(samples.max(1)).collect();
    if channels == 0 || !rows.len().is_multiple_of(channels) {
        return Err(StageError::new(format!("`{name}` has {} rows, wanted {channels} for each hit", rows.len())));
    }
    let length = |row: &&[f64]| row.iter().rposition(|value| value.is_finite()).map_or(0, |last| last + 1);
    let stretch = |rows: &[&'a [f64]]| {
        let longest = rows.iter().map(length).max().unwrap_or(0);
        rows.iter().map(|row| &row[..longest]).collect()
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
    let seconds = |samples: usize| (0..samples).map(|k| k as f64 / sample_rate_hz).collect();
    let numbers = |rows: usize| (0..rows).map(|k| k as f64).collect();
    let (signal, samples) = padded(hits);
    let mut axes = vec![
        Axis::new("row", "1", "channel of a hit", numbers(hit.len())),
        Axis::new("time", "s", "time since the first free sample", seconds(samples)),
    ];
    let (before, quiet_samples) = padded(quiet);
    if quiet_samples > 0 {
        axes.push(Axis::new(QUIET_ROW, "1", "channel before a hit", numbers(quiet.iter().map(Vec::len).sum())));
        axes.push(Axis::new(QUIET_TIME, "s", "time since the stretch's first sample", seconds(quiet_samples)));
    }
    let array = Array::over(axes)
        .with(SIGNAL, unit, "free decay", &["row", "time"], signal)
        .with(HIT, "1", "number of the hit", &["row"], hit)
        .with(CHANNEL, "1", "number of the channel", &["row"], channel)
        .attribute(SAMPLE_RATE_HZ, sample_rate_hz)
        .attribute(CHANNELS, names);
    Ok(match quiet_samples {
        0 => array,
        _ => array.with(QUIET, unit, "what was before a hit", &[QUIET_ROW, QUIET_TIME], before),
    })
}

/// All stretches one after the other, NaN behind the ends of those that are shorter than the longest; its length.
fn padded(stretches: &[Vec<Vec<f64>>]) -> (Vec<f64>, usize) {
    let longest = stretches.iter().flatten().map(Vec::len).max().unwrap_or(0);
    let mut all = Vec::new();
    for row in stretches.iter().flatten() {
        all.extend_from_slice(row);
        all.resize(all.len() + longest - row.len(), f64::NAN);
    }
    (all, longest)
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
    }
}
