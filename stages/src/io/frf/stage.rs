//! The stage `io.frf`.

use std::path::{Path, PathBuf};

use afmid_pipeline::recording::{FileResponse, Parts, Reading, read_responses};
use afmid_pipeline::{Array, Context, Document, Example, Faults, InputFiles, Port, Ports, Spec, Stage, StageError};
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::assembled::Assembled;
use super::sign::{self, OtherSign};
use crate::artifacts::Quantity;
use crate::io::file_patterns::{Match, matching_files};
use crate::io::repeats::warn_of_copies;
use crate::io::shared_data::moved;

/// Reads measured frequency responses from files of any format.
///
/// # Model
/// Each response is output over input at one pair of points: complex values over frequencies, phase of `exp(+i w t)`.
/// # Method
/// Frequencies with real and imaginary part, or with amplitude and phase, in tables of text (SignalCalc and CutPro
/// among them), universal files 58 and 58b (functions 4 and 5), complex arrays beside frequencies in MATLAB files,
/// records of complex numbers in HDF5; each also packed with gzip. Titles say what columns are, `values` where there
/// are none. Times, frequencies and counters are axes and never a response. Lines that do not ascend are sorted, with a
/// warning. Where the resonances of a file's responses decay only with the other sign of the imaginary parts, these are
/// turned, with a warning; responses in a ratio of like units are not. All responses must have the same
/// frequencies. Of files with the same bytes, and of responses with equal values (more than 100, not all equal) unless
/// files or `positions_m` say that their points are others, the first counts, and a warning names the rest.
/// # Shapes
/// A row for each response, files in natural order and responses in each file's order, over the frequencies in `band_hz`.
/// # Units
/// Hz; displacement, velocity and acceleration over force in m, m/s and m/s^2 per N whatever the files' unit (`mm/N`,
/// `g/N`); other values in the files' unit of output over input.
/// # Accuracy
/// Values as stored; coherence where the files have it. No errors of the values are known: files do not state them.
/// # Errors
/// A pattern without a match; a file without frequencies or with columns that may be one thing or another; a frequency
/// that is there twice; frequencies that differ between responses; responses of both signs in a file; lists of another length than the responses.
/// # Source
/// SDRC, Universal Dataset Number 58; D. J. Ewins, Modal Testing, 2000, sections 1.4 and 3.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Frf {
    /// Files, as patterns relative to the config file (`beam/*.txt`), with the rules of `io.records`; patterns that begin
    /// with `../../shared/data/` begin at the variable `AFMID_DATA` where that is set. Required.
    pub files: Vec<String>,
    /// The files' format: `auto` for what their bytes and names say, or a name as for `io.records`.
    pub format: String,
    /// What two columns of each response hold: `auto` (what their titles say), `real-imaginary`, `amplitude-degrees`,
    /// `amplitude-radians`, `decibels-degrees` (20 lg), `decibels-radians`. Why: titles say it in most tables.
    pub values: ResponseForm,
    /// Sign of the imaginary parts: `auto` (turned where resonances decay only with the other sign, in all responses of
    /// the file), `as-stored`, or `turned` for responses of `exp(-i w t)`. Why: some programs write the conjugate, and
    /// no mode fits it.
    pub phase: PhaseSign,
    /// What goes from point to point where files do not name the points: the `hammer` (the sensor stays) or the
    /// `sensor`. Why: with one sensor it is the hammer that is easier to move.
    pub roving: Roving,
    /// What output over input is. Absent: what the unit says, a `transfer` if that says nothing.
    pub quantity: Option<Quantity>,
    /// Unit of the values in files that state none: `m/N`. Absent: none; an error where a file states another.
    pub unit: Option<String>,
    /// Where the roving points lie, in m, one for each response. Absent: not known.
    pub positions_m: Vec<f64>,
    /// 1, or -1 where output and input point in opposite directions (values change their sign); one for each response
    /// or one for all. Absent: 1.
    pub directions: Vec<f64>,
    /// Number (from 1) of the response whose output and input are one point. Absent: found where files name the points.
    #[schemars(range(min = 1))]
    pub driving_point: Option<usize>,
    /// Lowest and highest frequency that is kept, in Hz. Absent: all.
    pub band_hz: Option<[f64; 2]>,
}

/// What two columns of each response hold.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ResponseForm {
    /// What their titles say.
    #[default]
    Auto,
    /// Real and imaginary part.
    RealImaginary,
    /// Amplitude and phase in degrees.
    AmplitudeDegrees,
    /// Amplitude and phase in radians.
    AmplitudeRadians,
    /// 20 lg of the amplitude, and phase in degrees.
    DecibelsDegrees,
    /// 20 lg of the amplitude, and phase in radians.
    DecibelsRadians,
}

impl ResponseForm {
    fn parts(self) -> Option<Parts> {
        let polar = |decibels, degrees| Some(Parts::AmplitudePhase { decibels, degrees });
        match self {
            Self::Auto => None,
            Self::RealImaginary => Some(Parts::RealImaginary),
            Self::AmplitudeDegrees => polar(false, true),
            Self::AmplitudeRadians => polar(false, false),
            Self::DecibelsDegrees => polar(true, true),
            Self::DecibelsRadians => polar(true, false),
        }
    }
}

/// Sign of the imaginary parts.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PhaseSign {
    /// What lets the resonances decay.
    #[default]
    Auto,
    /// As the file has it.
    AsStored,
    /// The other one.
    Turned,
}

/// What goes from point to point.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Roving {
    /// The excitation.
    #[default]
    Hammer,
    /// The sensor.
    Sensor,
}

impl Default for Frf {
    fn default() -> Self {
        Self {
            files: Vec::new(),
            format: "auto".to_owned(),
            values: ResponseForm::Auto,
            phase: PhaseSign::Auto,
            roving: Roving::Hammer,
            quantity: None,
            unit: None,
            positions_m: Vec::new(),
            directions: Vec::new(),
            driving_point: None,
            band_hz: None,
        }
    }
}

pub(crate) const FRF: Port<Array> =
    Port::new("frf", "frf", "measured frequency responses, a row for each pair of points");
pub(super) const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "responses, their points, frequencies, quantity and unit");

impl Stage for Frf {
    const SPEC: Spec = Spec {
        name: "io.frf",
        version: 5,
        summary: "reads measured frequency responses from files of any format",
        inputs: &[],
        outputs: &[FRF.spec(), SUMMARY.spec()],
        source: "SDRC, Universal Dataset Number 58; D. J. Ewins, Modal Testing, 2000",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        faults.require(!self.files.is_empty(), || {
            "`files` is empty, wanted at least one pattern such as \"beam/*.txt\"".to_owned()
        });
        faults.take(Reading::of(&self.format, None).check());
        faults.require(self.directions.iter().all(|sign| sign.abs() == 1.0), || {
            format!("`directions` is {:?}, wanted 1 or -1 of each", self.directions)
        });
        faults.require(self.positions_m.iter().all(|position| position.is_finite()), || {
            format!("`positions_m` is {:?}, wanted finite numbers", self.positions_m)
        });
        faults.require(self.driving_point != Some(0), || "`driving_point` is 0, responses count from 1".to_owned());
        if let Some([low, high]) = self.band_hz {
            faults.require(low >= 0.0 && low < high, || {
                format!("`band_hz` is [{low}, {high}], wanted the lowest and the highest frequency")
            });
        }
        let blank = self.unit.as_deref().is_some_and(|unit| unit.trim().is_empty());
        faults.require(!blank, || "`unit` is empty, wanted a unit such as \"m/N\"".to_owned());
    }

    fn sources(&self, base: &Path, files: &InputFiles) -> Result<Vec<PathBuf>, StageError> {
        let root = std::env::var_os("AFMID_DATA");
        let root = root.as_deref().map(Path::new);
        let patterns: Vec<String> = self.files.iter().map(|pattern| moved(pattern, root)).collect();
        let matches = matching_files(&patterns, base, files)?;
        let paths: Vec<PathBuf> =
            matches.into_iter().filter(|found| !found.is_result).map(|Match { path, .. }| path).collect();
        match paths.is_empty() {
            true => Err(StageError::new("all files that match `files` are results of afmid's, wanted measured ones")),
            false => Ok(paths),
        }
    }

    fn location_params() -> &'static [&'static str] {
        &["files"]
    }

    fn run(&self, _inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let paths = self.sources(cx.base(), cx.files())?;
        cx.expect(paths.len());
        let reading = Reading::of(&self.format, None);
        let one = |path: &PathBuf| -> Result<(Vec<FileResponse>, Option<OtherSign>), StageError> {
            let mut responses = read_responses(cx.files(), path, &reading, self.values.parts())?;
            let sign = sign::settle(path, &mut responses, self.phase)?;
            cx.tick();
            Ok((responses, sign))
        };
        let read = paths.par_iter().map(one).collect::<Result<Vec<_>, StageError>>()?;
        let (read, signs): (Vec<Vec<FileResponse>>, Vec<Option<OtherSign>>) = read.into_iter().unzip();
        let hashes = paths.par_iter().map(|path| cx.files().hash(path)).collect::<Result<Vec<String>, _>>()?;
        let assembled = Assembled::new(self, &paths, &hashes, read)?;
        sign::remarks(&paths, &signs).iter().for_each(|remark| cx.warn(remark));
        warn_of_copies(cx, &assembled.copies, "their values are equal");
        assembled.remarks.iter().for_each(|remark| cx.warn(remark));
        let summary = assembled.summary()?;
        Ok(Ports::new().with(&FRF, assembled.frf.array()?).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::example::examples()
    }
}
