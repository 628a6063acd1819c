//! Frequency responses in files: complex values over frequency, of which a file may hold many.
//!
//! - A reader that knows complex numbers lists them as [`FoundResponse`]s beside the channels.
//! - Of columns of real numbers, [`responses`] makes them: a column of frequencies, then real and imaginary part, or
//!   amplitude and phase, of each response. Titles say which (`Re(H)`, `Imaginary`, `Mag (dB)`, `Phase [deg]`,
//!   `Coherence`, `CH2 Gain (dB)`); where there are none, the columns are taken in turn. The generator's amplitude and
//!   other columns of amplitudes without a phase are left out of a Bode table.
//! - Times, frequencies and counters are axes and never a response.

mod columns;
mod role;

pub use columns::{gains_without_phase, responses, says_frequencies};

use crate::{FormatError, FoundChannel, Raw, Source, fail};

/// What the two numbers of each value are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Parts {
    /// Real and imaginary part.
    RealImaginary,
    /// Amplitude and phase: the amplitude in decibels (20 lg) or not, the phase in degrees or in radians.
    AmplitudePhase {
        /// 20 lg of the amplitude.
        decibels: bool,
        /// Degrees, else radians.
        degrees: bool,
    },
}

/// A point with a direction, as a file names it.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Degree {
    /// Name or number of the point.
    pub name: String,
    /// `x`, `y`, `z`, `rx`, `ry`, `rz`; empty if none is stated.
    pub direction: String,
    /// Whether it is against that direction.
    pub against: bool,
}

/// Where the frequencies of a response are.
#[derive(Debug, Clone)]
pub enum Frequencies {
    /// First and step, in the unit beside them.
    Even(f64, f64),
    /// In a channel of their own.
    Listed(FoundChannel),
    /// In an axis of the file that has as many values.
    Beside,
}

/// A frequency response of a file.
#[derive(Debug, Clone)]
pub struct FoundResponse {
    /// How it is named: that of its first part.
    pub location: String,
    /// Where its frequencies are.
    pub frequencies: Frequencies,
    /// Unit of the frequencies; empty if the file states none.
    pub frequency_unit: String,
    /// The two parts, each of as many values as there are frequencies.
    pub values: [FoundChannel; 2],
    /// What they are.
    pub parts: Parts,
    /// Whether `parts` is a guess: neither the file nor its reader says so.
    pub guessed: bool,
    /// The coherence, where the file has it.
    pub coherence: Option<FoundChannel>,
    /// Unit of the values; empty if the file states none.
    pub unit: String,
    /// What responds.
    pub output: Option<Degree>,
    /// What is excited.
    pub input: Option<Degree>,
    /// What is left out beside it.
    pub remarks: Vec<String>,
}

/// The unit of output over input.
pub fn unit_ratio(output: &str, input: &str) -> String {
    let grouped = |unit: &str| if unit.contains('/') { format!("({unit})") } else { unit.to_owned() };
    match (output, input) {
        (output, "" | "1") => output.to_owned(),
        ("" | "1", input) => format!("1/{}", grouped(input)),
        (output, input) if output == input => "1".to_owned(),
        // some writers state the whole ratio with the numerator
        (output, input) if output.ends_with(&format!("/{input}")) => output.to_owned(),
        (output, input) => format!("{}/{}", grouped(output), grouped(input)),
    }
}

/// Evenly spaced numbers that no file has to list.
#[derive(Debug)]
struct Even {
    first: f64,
    step: f64,
    samples: usize,
}

impl Source for Even {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        let end = crate::pinned::stretch_end(start, count, self.samples)?;
        Ok(Raw::Float64((start..end).map(|k| self.first + k as f64 * self.step).collect()))
    }
}

impl FoundResponse {
    /// The frequencies as a channel, those of the file if they have to be found there. Errors: none, or several, of its
    /// length.
    pub fn frequency_channel(&self, channels: &[FoundChannel]) -> Result<FoundChannel, FormatError> {
        let samples = self.values[0].samples;
        match &self.frequencies {
            Frequencies::Listed(channel) => Ok(channel.clone()),
            Frequencies::Even(first, step) => {
                let source = Even { first: *first, step: *step, samples };
                Ok(FoundChannel::new("frequency", samples, "float64", std::sync::Arc::new(source)))
            }
            Frequencies::Beside => {
                columns::frequencies_for(&self.location, samples, channels).cloned().ok_or_else(|| {
                    let problem =
                        format!("{} has {samples} values, no frequencies as many are in the file", self.location);
                    fail::plain(problem, "store them beside it as an array named `frequency`")
                })
            }
        }
    }
}
