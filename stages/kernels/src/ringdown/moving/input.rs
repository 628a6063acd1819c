//! Whether the input is one that can be fitted.

use std::f64::consts::PI;

use crate::ringdown::moving::error::MovingError;
use crate::ringdown::moving::follow::{Exponential, Line, Options};

pub(crate) fn check(
    events: &[Vec<&[f64]>],
    interval_s: f64,
    lines: &[Line],
    options: &Options,
) -> Result<(), MovingError> {
    let channels = events.first().map_or(0, Vec::len);
    if channels == 0 {
        return Err(MovingError::Length { what: "channels", found: 0, wanted: 1 });
    }
    for event in events {
        if event.len() != channels {
            return Err(MovingError::Length { what: "channels", found: event.len(), wanted: channels });
        }
        let samples = event[0].len();
        if let Some(row) = event.iter().find(|row| row.len() != samples) {
            return Err(MovingError::Length { what: "samples", found: row.len(), wanted: samples });
        }
        if samples < 16 {
            return Err(MovingError::Length { what: "samples", found: samples, wanted: 16 });
        }
        if event.iter().any(|row| row.iter().filter(|y| y.is_finite()).count() < 16) {
            return Err(MovingError::Degenerate("a record with fewer than 16 finite samples"));
        }
    }
    if !(interval_s > 0.0 && interval_s.is_finite()) {
        return Err(MovingError::Parameter { name: "interval_s", found: interval_s, wanted: "above 0" });
    }
    if lines.is_empty() {
        return Err(MovingError::Length { what: "lines", found: 0, wanted: 1 });
    }
    for line in lines {
        let fine =
            |p: &Exponential| p.rate_per_s.is_finite() && p.turn_rad_per_s > 0.0 && p.turn_rad_per_s * interval_s < PI;
        if line.poles.is_empty() {
            return Err(MovingError::Length { what: "poles", found: 0, wanted: 1 });
        }
        if let Some(pole) = line.poles.iter().find(|p| !fine(p)) {
            let found = if pole.rate_per_s.is_finite() { pole.turn_rad_per_s } else { pole.rate_per_s };
            return Err(MovingError::Parameter {
                name: "poles",
                found,
                wanted: "finite, between 0 and the Nyquist frequency",
            });
        }
    }
    if !(options.false_alarm > 0.0 && options.false_alarm < 1.0) {
        let found = options.false_alarm;
        return Err(MovingError::Parameter { name: "false_alarm", found, wanted: "between 0 and 1" });
    }
    let noise = &options.noise_variance;
    if !noise.is_empty() && noise.len() != channels {
        return Err(MovingError::Length { what: "noise_variance", found: noise.len(), wanted: channels });
    }
    match noise.iter().find(|v| !(**v > 0.0 && v.is_finite())) {
        Some(&found) => Err(MovingError::Parameter { name: "noise_variance", found, wanted: "above 0" }),
        None => Ok(()),
    }
}
