//! Frequency responses of files of any format, read whole.

use std::path::Path;

use afmid_formats::{Degree, FoundResponse, Parts, hertz, responses};
use num_complex::Complex64;

use super::how::Reading;
use super::input_files::InputFiles;
use super::whole::WholeFile;
use crate::error::StageError;

/// A frequency response as a file has it.
#[derive(Debug, Clone)]
pub struct FileResponse {
    /// How the file names it.
    pub location: String,
    /// Ascending.
    pub frequency_hz: Vec<f64>,
    /// NaN where the file has none.
    pub values: Vec<Complex64>,
    /// Ordinary coherence, where the file has it.
    pub coherence: Option<Vec<f64>>,
    /// Unit of the values; empty if the file states none.
    pub unit: String,
    /// What responds.
    pub output: Option<Degree>,
    /// What is excited.
    pub input: Option<Degree>,
    /// What was taken for granted about it.
    pub remarks: Vec<String>,
}

/// How to say what columns hold. `<this stage>` is [`crate::THIS_STAGE`].
const VALUES: &str = "`--set <this stage>.values=amplitude-degrees` if the columns of each response are amplitude and \
                      phase in degrees, likewise `amplitude-radians`, `decibels-degrees`, `decibels-radians`, \
                      `real-imaginary`";

/// Reads all frequency responses of a file. `parts` says what its columns are; none: their titles say it.
///
/// Errors: as [`WholeFile`]; none is found; columns that may be one or the other; frequencies that do not ascend.
pub fn read_responses(
    files: &InputFiles,
    path: &Path,
    reading: &Reading,
    parts: Option<Parts>,
) -> Result<Vec<FileResponse>, StageError> {
    let file = WholeFile::open(files, path, reading)?;
    let found = responses(file.contents(), parts).map_err(|error| {
        let mut error = error.in_file(path);
        if parts.is_none() {
            error.help = Some(error.help.map_or_else(|| VALUES.to_owned(), |help| format!("{help}; {VALUES}")));
        }
        error
    })?;
    found.iter().map(|response| read(&file, response).map_err(|error| error.at(path))).collect()
}

fn read(file: &WholeFile, found: &FoundResponse) -> Result<FileResponse, StageError> {
    let channel = found.frequency_channel(&file.contents().channels)?;
    let mut remarks = Vec::new();
    let unit = if found.frequency_unit.is_empty() { &channel.unit } else { &found.frequency_unit };
    let hz = hertz(unit).unwrap_or_else(|| {
        remarks.push(format!("the frequencies {} have no unit that is known: taken as hertz", channel.location));
        1.0
    });
    let frequency_hz: Vec<f64> = file.read(&channel)?.into_iter().map(|frequency| frequency * hz).collect();
    let ascending = |pair: &[f64]| pair[0] < pair[1];
    if let Some(at) = frequency_hz.windows(2).position(|pair| !ascending(pair)) {
        let (one, next) = (frequency_hz[at], frequency_hz[at + 1]);
        return Err(StageError::new(format!(
            "the frequencies of {} go from {one} to {next} Hz at line {}, wanted ascending ones",
            found.location,
            at + 2
        ))
        .help("sort the lines, or write each sweep to a file of its own"));
    }
    let [first, second] = [file.read(&found.values[0])?, file.read(&found.values[1])?];
    if found.guessed {
        if first.iter().all(|value| *value >= 0.0) {
            return Err(StageError::new(format!(
                "{} and {} may be amplitude and phase or real and imaginary part: the file does not say, and the \
                 first is nowhere negative",
                found.values[0].location, found.values[1].location
            ))
            .help(VALUES));
        }
        remarks.push(format!(
            "{} and {} are taken as real and imaginary part: the file does not say",
            found.values[0].location, found.values[1].location
        ));
    }
    let values = first.iter().zip(&second).map(|(a, b)| value(found.parts, *a, *b)).collect();
    let coherence = found.coherence.as_ref().map(|channel| file.read(channel)).transpose()?;
    Ok(FileResponse {
        location: found.location.clone(),
        frequency_hz,
        values,
        coherence: coherence.filter(|coherence| coherence.len() == first.len()),
        unit: found.unit.clone(),
        output: found.output.clone(),
        input: found.input.clone(),
        remarks,
    })
}

fn value(parts: Parts, first: f64, second: f64) -> Complex64 {
    match parts {
        Parts::RealImaginary => Complex64::new(first, second),
        Parts::AmplitudePhase { decibels, degrees } => {
            let amplitude = if decibels { 10_f64.powf(first / 20.0) } else { first };
            Complex64::from_polar(amplitude, if degrees { second.to_radians() } else { second })
        }
    }
}
