//! The stage `io.columns`.

use std::path::{Path, PathBuf};

use afmid_pipeline::{
    Array, Caching, Context, Document, Example, Faults, InputFiles, Port, Ports, Spec, Stage, StageError,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::selection::Column;
use super::series::Series;
use super::stretch::Removal;
use super::table::read_columns;
use super::text::Separator;
use crate::io::shared_data::moved;

/// Reads measured input and output from the columns of a file, and splits them into a stretch to fit and one to judge
/// on.
///
/// # Model
/// Equally sampled inputs u and one output y, in columns of a CSV, DAT, LVM or other text file, or variables of a
/// MATLAB file (version 5 to 7).
/// # Method
/// Two stretches of time, identification and verification. Mean or line are taken off with the constants of the
/// identification stretch alone, also from the other, which so stays unseen. Missing samples (empty, NaN, the given
/// codes) stay missing: nothing is interpolated.
/// # Shapes
/// `response`, `force` over `time`, the whole record; the same with `_identification` and `_verification` over axes of
/// their own, which may differ in length. With several inputs `force` is over (`input`, time).
/// # Units
/// Those given; no conversion.
/// # Accuracy
/// Numbers as in the file; 64-bit integers beyond 2^53 are rounded.
/// # Errors
/// A file that is no table or damaged, MATLAB 7.3; a column that is not there or holds text; no sample rate, a time
/// column that is not equally spaced; stretches beyond the record; missing inputs; an output that is missing
/// altogether.
/// # Source
/// L. Ljung, System Identification, 1999, sections 14.1 and 16.5; MathWorks, MAT-File Format, Level 5.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Columns {
    /// The file, relative to the config file; `.mat` is MATLAB, anything else text. A path that begins with
    /// `../../shared/data/` begins at the variable `AFMID_DATA` where that is set. Required.
    pub file: String,
    /// Columns of the inputs, each a number from 1 or a name, at least one. Default: the first column.
    pub inputs: Vec<Column>,
    /// Column of the output. Default: the second.
    pub output: Column,
    /// Sample rate in Hz. Absent: from `time`, or an LVM header. Where it is not known, 1 makes frequencies cycles per
    /// sample.
    #[schemars(extend("exclusiveMinimum" = 0.0))]
    pub sample_rate_hz: Option<f64>,
    /// Column of the time in seconds, for the sample rate; equally spaced to 1 %.
    pub time: Option<Column>,
    /// What separates columns of a text file: `auto`, `comma`, `semicolon`, `tab`, `whitespace`.
    pub separator: Separator,
    /// Stretch to fit, as first sample (from 0) and one past the last. Absent: the first half.
    pub identification: Option<[usize; 2]>,
    /// Stretch to judge on. Absent: the second half.
    pub verification: Option<[usize; 2]>,
    /// What is taken off inputs and output: `none`, `mean`, `line`; with the identification stretch's constants. Why:
    /// since models are about an operating point.
    pub remove: Removal,
    /// Values that stand for no value, such as -9999.
    pub missing: Vec<f64>,
    /// Unit of the inputs.
    pub input_unit: String,
    /// Unit of the output.
    pub output_unit: String,
}

impl Default for Columns {
    fn default() -> Self {
        Self {
            file: String::new(),
            inputs: vec![Column::Number(1)],
            output: Column::Number(2),
            sample_rate_hz: None,
            time: None,
            separator: Separator::Auto,
            identification: None,
            verification: None,
            remove: Removal::Mean,
            missing: Vec::new(),
            input_unit: "1".to_owned(),
            output_unit: "1".to_owned(),
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
        version: 1,
        summary: "reads measured input and output from columns of text or MATLAB files",
        inputs: &[],
        outputs: &[PAIR.spec(), SUMMARY.spec()],
        caching: Caching::Stored,
        seeded: false,
        source: "L. Ljung, System Identification, 1999; MathWorks, MAT-File Format, Level 5",
    };

    fn check(&self, faults: &mut Faults) {
        faults.require(!self.file.is_empty(), || {
            "`file` is empty, wanted a file such as \"data/flutter.dat\"".to_owned()
        });
        faults.require(!self.inputs.is_empty(), || "`inputs` is empty, wanted at least one column".to_owned());
        self.inputs.iter().for_each(|column| faults.take(column.check("inputs")));
        faults.take(self.output.check("output"));
        self.time.iter().for_each(|column| faults.take(column.check("time")));
        for (name, stretch) in [("identification", self.identification), ("verification", self.verification)] {
            if let Some([first, end]) = stretch {
                faults.require(first < end, || {
                    format!("`{name}` is [{first}, {end}], wanted the first sample and one past the last")
                });
            }
        }
    }

    fn sources(&self, base: &Path, _files: &InputFiles) -> Result<Vec<PathBuf>, StageError> {
        let path = self.path(base);
        if path.is_file() {
            return Ok(vec![path]);
        }
        Err(StageError::new(format!("`file` is {}, which is not there", path.display())))
    }

    fn location_params() -> &'static [&'static str] {
        &["file"]
    }

    fn run(&self, _inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let path = self.path(cx.base());
        let place = |error: String| StageError::new(format!("{}: {error}", path.display()));
        let bytes = cx.files().read(&path)?;
        let table = read_columns(&self.file, &bytes, self.separator).map_err(|error| place(error.to_string()))?;
        drop(bytes);
        let series = Series::new(self, &table)?;
        drop(table);
        let (pair, summary) = series.split(self)?;
        series.warnings().into_iter().for_each(|warning| cx.warn(warning));
        Ok(Ports::new().with(&PAIR, pair).with(&SUMMARY, summary))
    }

    fn examples() -> Vec<Example> {
        super::example::examples()
    }
}

impl Columns {
    fn path(&self, base: &Path) -> PathBuf {
        let root = std::env::var_os("AFMID_DATA");
        base.join(moved(&self.file, root.as_deref().map(Path::new)))
    }
}
