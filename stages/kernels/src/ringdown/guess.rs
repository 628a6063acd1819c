//! First values of the search: exponentials of the mean, and each event's share of it.

use super::knowledge::obey;
use super::modal_form::{EventParameters, Exponential, signal};
use super::options::RingdownOptions;
use super::records::Records;
use super::search::Point;
use super::start::{amplitudes, start};
use crate::model::ModelError;

/// Noise that is white at the highest frequencies: second differences of the quieter half.
pub(super) fn white_variance(records: &Records<'_>) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for (number, event) in records.events.iter().enumerate() {
        for (k, w) in event.windows(3).enumerate().skip(event.len() / 2) {
            if (k..k + 3).any(|k| records.gaps.missing(number, k)) {
                continue;
            }
            sum += (w[0] - 2.0 * w[1] + w[2]).powi(2);
            count += 1;
        }
    }
    (sum / (6.0 * count.max(1) as f64)).max(f64::MIN_POSITIVE)
}

/// Exponentials of the mean, and each event's share of it.
pub(super) fn first_guess(events: &[&[f64]], interval_s: f64, options: &RingdownOptions) -> Result<Point, ModelError> {
    let samples = events[0].len();
    let mean: Vec<f64> = (0..samples).map(|k| events.iter().map(|e| e[k]).sum::<f64>() / events.len() as f64).collect();
    if mean.iter().all(|v| *v == mean[0]) {
        return Err(ModelError::ConstantOutput);
    }
    let early: Vec<f64> = match options.start_samples {
        Some(count) => {
            let line = line_of_second_half(&mean);
            mean.iter().zip(&line.values(samples)).map(|(y, l)| y - l).take(count).collect()
        }
        None => mean,
    };
    let exponentials = match &options.start {
        Some(given) => {
            let mut given = given.clone();
            amplitudes(&mut given, &early, interval_s);
            given
        }
        None => start(&early, interval_s, options.modes, options.real_poles, options.block_rows)?,
    };
    let mut exponentials = exponentials;
    if !options.known.is_empty() {
        obey(&mut exponentials, &options.known)?;
        amplitudes(&mut exponentials, &early, interval_s);
    }
    let events = shares(events, &exponentials, interval_s, options);
    Ok(Point { exponentials, events })
}

/// Each event's amplitude of a shape, with its level.
pub(super) fn shares(
    events: &[&[f64]],
    exponentials: &[Exponential],
    interval_s: f64,
    options: &RingdownOptions,
) -> Vec<EventParameters> {
    let samples = events.first().map_or(0, |event| event.len());
    let tail = samples - samples / 4;
    let shape = {
        let unit = EventParameters { amplitude: 1.0, onset_s: 0.0, offset: 0.0, slope: 0.0 };
        signal(exponentials, &unit, interval_s, samples)
    };
    events
        .iter()
        .map(|event| {
            let line = if options.start_samples.is_some() && options.drift {
                line_of_second_half(event)
            } else {
                Line { offset: event[tail..].iter().sum::<f64>() / (samples - tail) as f64, slope: 0.0 }
            };
            let (mut up, mut down) = (0.0, 0.0);
            for ((y, l), s) in event.iter().zip(line.values(samples)).zip(&shape) {
                up += (y - l) * s;
                down += s * s;
            }
            let amplitude = up / down.max(f64::MIN_POSITIVE);
            EventParameters { amplitude, onset_s: 0.0, offset: line.offset, slope: line.slope }
        })
        .collect()
}

/// Level in the middle of a window and its change over half of it, V.
struct Line {
    offset: f64,
    slope: f64,
}

impl Line {
    fn values(&self, samples: usize) -> Vec<f64> {
        let centre = 0.5 * (samples.max(2) - 1) as f64;
        (0..samples).map(|k| self.offset + self.slope * (k as f64 - centre) / centre).collect()
    }
}

/// The least-squares line through the second half of a window.
fn line_of_second_half(values: &[f64]) -> Line {
    let (samples, first) = (values.len(), values.len() / 2);
    let centre = 0.5 * (samples.max(2) - 1) as f64;
    let count = (samples - first) as f64;
    let x: Vec<f64> = (first..samples).map(|k| (k as f64 - centre) / centre).collect();
    let (mean_x, mean_y) = (x.iter().sum::<f64>() / count, values[first..].iter().sum::<f64>() / count);
    let up: f64 = x.iter().zip(&values[first..]).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let down: f64 = x.iter().map(|x| (x - mean_x).powi(2)).sum();
    let slope = up / down.max(f64::MIN_POSITIVE);
    Line { offset: mean_y - slope * mean_x, slope }
}
