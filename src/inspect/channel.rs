//! What the samples of a channel are, in one streamed pass.

use std::collections::BTreeSet;

use afmid_pipeline::StageError;
use afmid_pipeline::recording::{FormatError, FoundChannel};
use afmid_stages::io::{CensusSettings, ChannelCensus};

/// Distinct codes are counted up to here: more do not matter.
pub const MOST_CODES: usize = 256;

/// A channel and what its samples are.
#[derive(Debug)]
pub struct Channel {
    pub location: String,
    pub samples: usize,
    pub sample_rate_hz: Option<f64>,
    /// Whether that is of times without a unit, taken as seconds.
    pub rate_is_guess: bool,
    /// Standard error of the rate, relative.
    pub rate_std: f64,
    pub unit: String,
    pub stored_as: &'static str,
    /// Samples before which the recording was interrupted.
    pub gaps: Vec<usize>,
    /// Whether it is an axis and no signal.
    pub is_axis: bool,
    /// Why it is no sensor: a clock, a function of others.
    pub no_sensor: Option<String>,
    /// What the samples are; none for channels behind the first ones of a file with very many, which are listed only.
    pub values: Option<Values>,
}

/// What one pass through the samples tells.
#[derive(Debug)]
pub struct Values {
    /// Smallest and largest finite value, in the channel's unit; NaN if there is none.
    pub least: f64,
    pub largest: f64,
    /// Distinct codes, at most [`MOST_CODES`].
    pub codes: usize,
    /// Samples that differ from the one before.
    pub changes: usize,
    /// NaN, infinities and the declared fill code.
    pub missing: usize,
    /// Samples piled up at either end of the range.
    pub saturated: usize,
}

impl Channel {
    /// Reads a channel through, or only lists it. Errors: samples cannot be read.
    pub fn of(found: &FoundChannel, read: bool) -> Result<Self, StageError> {
        let values = if read { Some(values(found)?) } else { None };
        Ok(Self {
            location: found.location.clone(),
            samples: found.samples,
            sample_rate_hz: found.sample_rate_hz,
            rate_is_guess: found.rate_is_guess,
            rate_std: found.rate_relative_std,
            unit: found.unit.clone(),
            stored_as: found.stored_as,
            gaps: found.gaps.clone(),
            is_axis: found.is_axis,
            no_sensor: None,
            values,
        })
    }
}

fn values(found: &FoundChannel) -> Result<Values, FormatError> {
    let sample_rate_hz = found.sample_rate_hz.unwrap_or(f64::NAN);
    let settings = CensusSettings { fill_code: found.fill_code, sentinels: Vec::new(), sample_rate_hz };
    let mut census = ChannelCensus::new(settings);
    let mut codes = BTreeSet::new();
    let (mut changes, mut before) = (0, None);
    let chunk = found.source.preferred_samples().clamp(1, 1 << 20);
    for start in (0..found.samples).step_by(chunk) {
        let samples = found.source.read(start, chunk.min(found.samples - start))?.widened();
        if codes.len() < MOST_CODES {
            let new = samples.iter().filter(|code| code.is_finite()).map(|code| code.to_bits());
            for code in new {
                codes.insert(code);
                if codes.len() == MOST_CODES {
                    break;
                }
            }
        }
        for &code in &samples {
            changes += usize::from(before.is_some_and(|before| before != code));
            before = Some(code);
        }
        census.push(samples);
    }
    let census = census.finish();
    let value = |code: f64| code * found.scale_factor + found.add_offset;
    let ends = [value(census.least), value(census.largest)];
    // a negative scale turns the ends round
    Ok(Values {
        least: ends[0].min(ends[1]),
        largest: ends[0].max(ends[1]),
        codes: codes.len(),
        changes,
        missing: census.not_finite + census.fill,
        saturated: census.saturated_low + census.saturated_high,
    })
}
