//! The stage `io.columns`.

use std::path::{Path, PathBuf};

use afmid_pipeline::recording::{Measurement, RawBinary, Reading, is_of_resampling};
use afmid_pipeline::{Array, Context, Document, Example, Faults, InputFiles, Port, Ports, Spec, Stage, StageError};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::part::Part;
use super::selection::Column;
use super::series::Series;
use super::stretch::Removal;
use crate::io::file_patterns::matching_files;
use crate::io::repeats::{CopyOf, each_file_once, name_beside, warn_of_copies};
use crate::io::shared_data::moved;

/// Reads measured input and output from the channels of a file, and splits them into a stretch to fit and one to judge
/// on; of several files, hits or takes of the same channels, all in a row.
///
/// # Model
/// Equally sampled inputs u and an output y, or several, channels of a file of any format that `io.records` opens: columns of a
/// table, variables of a MATLAB file, datasets, channels of an oscilloscope or recorder (docs/archives.md). They may lie
/// in files of their own (`joined_files`), which were recorded at the same time.
/// # Method
/// Two stretches of time, identification and verification. Mean or line are taken off with the constants of the
/// identification stretch alone, also from the other, which so stays unseen. Missing samples (empty, NaN, the given
/// codes) stay missing: nothing is interpolated. Of several files each is a record: from each its own mean or line is
/// taken off; the first is the identification stretch, the last the verification. Of files with the same bytes, or with
/// equal samples of all channels (more than 100, an output that varies), the first counts, and a warning names the
/// others.
///
/// Channels are put together at one sample rate. Those that begin later than others, by their times or by dates that are
/// finer than a sample, begin with the last of them: by whole samples and, for the rest, by interpolation. Channels of
/// several files end with the first that ends. A warning says both.
/// # Shapes
/// `response`, `force` over `time`, the whole record; the same with `_identification` and `_verification` over axes of
/// their own, which may differ in length. With several inputs `force` is over (`input`, time), with several outputs
/// `response` over (`output`, time). Of several files `first_sample` over `record` is where each begins. The attributes
/// `inputs` and `outputs` name the channels.
/// # Units
/// Those of the file, times `input_scale` and `output_scale`.
/// # Accuracy
/// Numbers as in the file; 64-bit integers beyond 2^53 are rounded.
/// # Errors
/// A file of no format or damaged; a channel that is not there; no sample rate, two that differ, of several files one
/// without; dates that are too coarse; files that do not overlap in time; times that are not equally spaced; files of unlike rates or units; stretches beyond the record or across an interruption; missing
/// inputs; an output that is missing altogether.
/// # Source
/// L. Ljung, System Identification, 1999, sections 14.1 and 16.5; docs/archives.md for the formats.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Columns {
    /// The file, relative to the config file. A path that begins with `../../shared/data/` begins at the variable
    /// `AFMID_DATA` where that is set. Required, or `files`.
    pub file: String,
    /// Several files with the same channels, instead of `file`: hits or takes, each recorded by itself, as patterns
    /// likewise, with the rules of `io.records`. Default: none. Why: `spectrum.measured_frf` averages over all; other
    /// stages take one record.
    pub files: Vec<String>,
    /// Further files of the measurement in `file`, recorded at the same time: input and output in files of their own.
    /// Channels are then named `FILE:CHANNEL` (`u.csv:force`), or numbered through all files in this order. Default: none.
    /// Why: mostly all channels are in one file.
    pub joined_files: Vec<String>,
    /// Channels of the inputs, at least one. Default: the first.
    pub inputs: Vec<Column>,
    /// Channel of the output. Default: the second.
    pub output: Column,
    /// Channels of several outputs, instead of `output`: sensors of one unit that were recorded with the same inputs.
    /// Default: none. Why: `spectrum.measured_frf` makes a response of each, and mode shapes are over them; other stages
    /// take one output.
    pub outputs: Vec<Column>,
    /// The file's format, as for `io.records`.
    pub format: String,
    /// What is in a file without a header, as for `io.records`.
    pub raw: Option<RawBinary>,
    /// Sample rate in Hz, of a file that states none. Absent: the file's, or from `time`. Where it is not known, 1
    /// makes frequencies cycles per sample.
    #[schemars(range(min = 1e-9, max = 1e15))]
    pub sample_rate_hz: Option<f64>,
    /// Channel of the time in seconds, for the sample rate; equally spaced to 1 %, or to half a unit of its last
    /// digit. For files whose time axis is not titled as one.
    pub time: Option<Column>,
    /// Whether samples of a clock that wanders, a stamp by more than a hundredth of a step, are put on an even grid by
    /// interpolation (docs/archives.md): amplitudes are right to 1 % up to a quarter of the rate; gaps stay gaps. Default:
    /// false. Why: the true times of such stamps are not known to be right.
    pub resample: bool,
    /// Stretch to fit, as first sample (from 0) and one past the last. Absent: the first half.
    pub identification: Option<[usize; 2]>,
    /// Stretch to judge on. Absent: the second half.
    pub verification: Option<[usize; 2]>,
    /// What is taken off inputs and output: `none`, `mean`, `line`; with the identification stretch's constants. Why:
    /// since models are about an operating point.
    pub remove: Removal,
    /// Values that stand for no value, such as -9999.
    pub missing: Vec<f64>,
    /// Factor of the inputs: a sensitivity. The unit is then `input_unit`.
    #[schemars(extend("not" = { "const": 0.0 }))]
    pub input_scale: f64,
    /// Factor of the output. The unit is then `output_unit`.
    #[schemars(extend("not" = { "const": 0.0 }))]
    pub output_scale: f64,
    /// Unit of the inputs, where the file states none or they are scaled; of inputs in several units, such as a set point
    /// and a drive, the one that counts. Absent: the file's, or 1.
    pub input_unit: Option<String>,
    /// Unit of the output, likewise.
    pub output_unit: Option<String>,
}

impl Default for Columns {
    fn default() -> Self {
        Self {
            file: String::new(),
            files: Vec::new(),
            joined_files: Vec::new(),
            inputs: vec![Column::Number(1)],
            output: Column::Number(2),
            outputs: Vec::new(),
            format: "auto".to_owned(),
            raw: None,
            sample_rate_hz: None,
            time: None,
            resample: false,
            identification: None,
            verification: None,
            remove: Removal::Mean,
            missing: Vec::new(),
            input_scale: 1.0,
            output_scale: 1.0,
            input_unit: None,
            output_unit: None,
        }
    }
}

pub(super) const PAIR: Port<Array> =
    Port::new("pair", "pair", "inputs and output over time, whole and the two stretches");
pub(super) const SUMMARY: Port<Document> =
    Port::new("summary", "summary", "samples, stretches, what is missing and what was taken off");

impl Stage for Columns {
    const SPEC: Spec = Spec {
        name: "io.columns",
        version: 11,
        summary: "reads measured input and output from the channels of a file of any format",
        inputs: &[],
        outputs: &[PAIR.spec(), SUMMARY.spec()],
        source: "L. Ljung, System Identification, 1999, sections 14.1 and 16.5",
        ..Spec::STORED
    };

    fn check(&self, faults: &mut Faults) {
        faults.require(!self.file.is_empty() || !self.files.is_empty(), || {
            "`file` is empty, wanted a file such as \"data/flutter.dat\"".to_owned()
        });
        faults.require(self.file.is_empty() || self.files.is_empty(), || {
            "`file` and `files` are both given, wanted one of them".to_owned()
        });
        faults.require(self.joined_files.is_empty() || self.files.is_empty(), || {
            "`files` and `joined_files` are both given, wanted one measurement: a `file` with its `joined_files`"
                .to_owned()
        });
        faults.require(self.joined_files.iter().all(|file| !file.is_empty()), || {
            "`joined_files` has an empty name, wanted files such as \"u.csv\"".to_owned()
        });
        faults.require(self.joined_files.is_empty() || self.time.is_none(), || {
            "`time` and `joined_files` are both given, wanted `sample_rate_hz`, or times that each file states"
                .to_owned()
        });
        faults.require(!self.inputs.is_empty(), || "`inputs` is empty, wanted at least one channel".to_owned());
        self.inputs.iter().for_each(|column| faults.take(column.check("inputs")));
        faults.take(self.output.check("output"));
        for (number, column) in self.outputs.iter().enumerate() {
            faults.take(column.check("outputs"));
            faults.require(!self.outputs[..number].contains(column), || {
                format!("`outputs` has {column} twice, wanted each channel once")
            });
        }
        self.time.iter().for_each(|column| faults.take(column.check("time")));
        faults.take(Reading::of(&self.format, self.raw.clone()).check());
        for (name, scale) in [("input_scale", self.input_scale), ("output_scale", self.output_scale)] {
            faults
                .require(scale != 0.0 && scale.is_finite(), || format!("`{name}` is {scale}, wanted any other number"));
        }
        for (name, stretch) in [("identification", self.identification), ("verification", self.verification)] {
            if let Some([first, end]) = stretch {
                faults.require(first < end, || {
                    format!("`{name}` is [{first}, {end}], wanted the first sample and one past the last")
                });
            }
        }
    }

    fn sources(&self, base: &Path, files: &InputFiles) -> Result<Vec<PathBuf>, StageError> {
        let paths = self.paths(base, files)?;
        let gone = paths.iter().position(|path| self.files.is_empty() && !path.is_file());
        match gone.and_then(|number| Some((number, paths.get(number)?))) {
            Some((number, path)) => {
                let name = if number == 0 { "file" } else { "joined_files" };
                Err(StageError::new(format!("`{name}` is {}, which is not there", path.display())))
            }
            None => Ok(paths),
        }
    }

    fn location_params() -> &'static [&'static str] {
        &["file", "files", "joined_files"]
    }

    fn run(&self, _inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let parts = self.parts(cx)?;
        let series = Series::of(self, parts)?;
        let (pair, summary) = series.split(self)?;
        series.warnings().into_iter().for_each(|warning| cx.warn(warning));
        Ok(Ports::new().with(&PAIR, pair).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::example::examples()
    }
}

impl Columns {
    /// What the files hold, each recording once: says which copies are left out. Errors: see the stage.
    fn parts(&self, cx: &Context) -> Result<Vec<Part>, StageError> {
        let paths = self.paths(cx.base(), cx.files())?;
        let measurements: Vec<Vec<PathBuf>> = match self.joined_files.is_empty() {
            true => each_file_once(paths, cx)?.into_iter().map(|path| vec![path]).collect(),
            false => vec![paths],
        };
        let mut parts: Vec<(PathBuf, Part)> = Vec::with_capacity(measurements.len());
        let mut copies: Vec<CopyOf> = Vec::new();
        for paths in measurements {
            let reading = Reading::of(&self.format, self.raw.clone()).resampled(self.resample);
            let file = Measurement::open(cx.files(), &paths, &reading)?;
            let wander = file.contents().remarks.iter().filter(|remark| self.resample && is_of_resampling(remark));
            wander.for_each(|remark| cx.warn(remark.clone()));
            let path = paths.into_iter().next().unwrap_or_default();
            let part = Part::read(self, &file).and_then(|part| part.like(parts.first().map(|(_, first)| first)));
            // channels of several files are named with theirs
            let part = part.map_err(|error| if file.is_joined() { error } else { error.at(&path) })?;
            if let Some((of, _)) = parts.iter().find(|(_, earlier)| part.is_copy_of(earlier)) {
                copies.push((name_beside(&path, of), name_beside(of, &path)));
                continue;
            }
            part.remarks.iter().for_each(|remark| cx.warn(remark.clone()));
            parts.push((path, part));
        }
        warn_of_copies(cx, &copies, "all samples of their channels are equal");
        Ok(parts.into_iter().map(|(_, part)| part).collect())
    }

    /// The channels of the outputs, one at least.
    pub(super) fn all_outputs(&self) -> &[Column] {
        if self.outputs.is_empty() { std::slice::from_ref(&self.output) } else { &self.outputs }
    }

    /// The files, one at least. Errors: a pattern without a match.
    fn paths(&self, base: &Path, files: &InputFiles) -> Result<Vec<PathBuf>, StageError> {
        let root = std::env::var_os("AFMID_DATA");
        let moved = |path: &String| moved(path, root.as_deref().map(Path::new));
        if self.files.is_empty() {
            return Ok([&self.file].into_iter().chain(&self.joined_files).map(|file| base.join(moved(file))).collect());
        }
        let found = matching_files(&self.files.iter().map(moved).collect::<Vec<_>>(), base, files)?;
        let records: Vec<PathBuf> = found.into_iter().filter(|file| !file.is_result).map(|file| file.path).collect();
        match records.is_empty() {
            true => Err(StageError::new("`files` matches results of afmid's alone, wanted recordings")),
            false => Ok(records),
        }
    }
}
