//! Whether the input is one that can be fitted.

use std::f64::consts::PI;

use crate::model::ModelError;
use crate::ringdown::moving::blocks::COLUMNS;
use crate::ringdown::moving::follow::{Exponential, Line, Options};

/// Samples of a record that are there, at least: twice what a line has in one block.
const LEAST_SAMPLES: usize = 2 * COLUMNS;

/// Errors: what cannot be fitted.
pub(crate) fn check(
    events: &[Vec<&[f64]>],
    interval_s: f64,
    lines: &[Line],
    options: &Options,
) -> Result<(), ModelError> {
    let channels = events.first().map_or(0, Vec::len);
    if channels == 0 {
        return Err(ModelError::NoExperiment);
    }
    for event in events {
        if event.len() != channels {
            return Err(ModelError::Length { what: "channels", found: event.len(), wanted: channels });
        }
        let samples = event[0].len();
        if let Some(row) = event.iter().find(|row| row.len() != samples) {
            return Err(ModelError::Length { what: "channel", found: row.len(), wanted: samples });
        }
        let observed = event.iter().map(|row| row.iter().filter(|y| y.is_finite()).count());
        if let Some(found) = observed.min().filter(|found| *found < LEAST_SAMPLES) {
            return Err(ModelError::TooShort { found, wanted: LEAST_SAMPLES });
        }
    }
    if !(interval_s > 0.0 && interval_s.is_finite()) {
        return Err(ModelError::Parameter { name: "interval_s", found: interval_s, wanted: "above 0" });
    }
    if lines.is_empty() {
        return Err(ModelError::Parameter { name: "lines", found: 0.0, wanted: "at least 1" });
    }
    for line in lines {
        let fine =
            |p: &Exponential| p.rate_per_s.is_finite() && p.turn_rad_per_s > 0.0 && p.turn_rad_per_s * interval_s < PI;
        if line.poles.is_empty() {
            return Err(ModelError::Parameter { name: "poles", found: 0.0, wanted: "at least 1 for each line" });
        }
        if let Some(pole) = line.poles.iter().find(|p| !fine(p)) {
            let found = if pole.rate_per_s.is_finite() { pole.turn_rad_per_s } else { pole.rate_per_s };
            return Err(ModelError::Parameter {
                name: "poles",
                found,
                wanted: "finite, between 0 and the Nyquist frequency",
            });
        }
    }
    if !(options.false_alarm > 0.0 && options.false_alarm < 1.0) {
        let found = options.false_alarm;
        return Err(ModelError::Parameter { name: "false_alarm", found, wanted: "between 0 and 1" });
    }
    let noise = &options.noise_variance;
    if !noise.is_empty() && noise.len() != channels {
        return Err(ModelError::Length { what: "noise_variance", found: noise.len(), wanted: channels });
    }
    match noise.iter().find(|v| !(**v > 0.0 && v.is_finite())) {
        Some(&found) => Err(ModelError::Parameter { name: "noise_variance", found, wanted: "above 0" }),
        None => Ok(()),
    }
}
