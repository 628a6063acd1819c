//! Frequency responses of files of any format, read whole.

use std::path::Path;

use afmid_formats::{Degree, FoundChannel, FoundResponse, Parts, hertz, responses};
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
    /// Ascending, sorted if the file has them otherwise.
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
/// Errors: as [`WholeFile`]; none is found; columns that may be one or the other; a frequency that is
/// there twice. Lines that do not ascend are sorted, with a remark.
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
    let stored_hz: Vec<f64> = file.read(&channel)?.into_iter().map(|frequency| frequency * hz).collect();
    let order = ascending(&stored_hz, &found.location)?;
    remarks.extend(found.remarks.iter().cloned());
    if let Some((_, remark)) = &order {
        remarks.push(remark.clone());
    }
    let sorted = |values: Vec<f64>| match &order {
        Some((order, _)) => order.iter().filter_map(|line| values.get(*line).copied()).collect(),
        None => values,
    };
    let read_sorted = |channel: &FoundChannel| file.read(channel).map(sorted);
    let frequency_hz = sorted(stored_hz);
    let [first, second] = [read_sorted(&found.values[0])?, read_sorted(&found.values[1])?];
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
    let coherence = found.coherence.as_ref().map(read_sorted).transpose()?;
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

/// The lines in the order of their frequencies, and that they were not; none where they ascend. Errors: a frequency that
/// is none, or is there twice.
fn ascending(frequency_hz: &[f64], name: &str) -> Result<Option<(Vec<usize>, String)>, StageError> {
    let help = "write each sweep to a file of its own";
    if let Some(line) = frequency_hz.iter().position(|frequency| !frequency.is_finite()) {
        let problem = format!("the frequency of {name} at line {} is no number", line + 1);
        return Err(StageError::new(problem).help("leave out lines without a frequency"));
    }
    if frequency_hz.is_sorted_by(|one, next| one < next) {
        return Ok(None);
    }
    let mut order: Vec<usize> = (0..frequency_hz.len()).collect();
    order.sort_by(|a, b| frequency_hz[*a].total_cmp(&frequency_hz[*b]));
    if let Some(pair) = order.windows(2).find(|pair| frequency_hz[pair[0]] == frequency_hz[pair[1]]) {
        let (one, other) = (pair[0].min(pair[1]), pair[0].max(pair[1]));
        let problem = format!(
            "the frequencies of {name} have {} Hz twice, at lines {} and {}, wanted each once",
            frequency_hz[one],
            one + 1,
            other + 1
        );
        return Err(StageError::new(problem).help(help));
    }
    let how = if frequency_hz.is_sorted_by(|one, next| one > next) { "descend" } else { "do not ascend" };
    Ok(Some((order, format!("the frequencies of {name} {how}: the lines are sorted"))))
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
