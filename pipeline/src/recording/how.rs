//! What a user says about files that do not say it themselves.

use afmid_formats::RawBinary;
use serde::{Deserialize, Serialize};

use crate::error::StageError;

/// The name of afmid's own records.
pub(super) const NATIVE: &str = "native";
/// The name of other HDF5 files.
pub(super) const HDF5: &str = "hdf5";
/// The name of files without a header.
pub(super) const RAW: &str = "raw";
/// Whatever recognises the file.
pub(super) const AUTO: &str = "auto";

/// How files are to be opened.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct How {
    /// Which reader.
    pub reading: Reading,
    /// Samples per second, where the file states none, or another one.
    pub sample_rate_hz: Option<f64>,
    /// Unit of the channel, where the file states none.
    pub unit: Option<String>,
}

/// Which reader opens a file, and the parameters that it needs: enough to open the file again.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Reading {
    /// `native`, `hdf5`, `raw`, `auto`, or the name of a format of [`super::formats`].
    pub format: String,
    /// What is in a file without a header.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub raw: Option<RawBinary>,
    /// Channels that the file begins at different instants and that are put together: each begins with the last of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub together: Vec<String>,
    /// Whether channels whose clock wanders are put on an even grid.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub resample: bool,
}

impl Default for Reading {
    fn default() -> Self {
        Self { format: NATIVE.to_owned(), raw: None, together: Vec::new(), resample: false }
    }
}

impl Reading {
    /// Whatever recognises a file; raw binary if that is described.
    pub fn of(format: &str, raw: Option<RawBinary>) -> Self {
        let format = if raw.is_some() && format == AUTO { RAW } else { format };
        Self { format: format.to_owned(), raw, ..Self::default() }
    }

    /// The same, with channels whose clock wanders on an even grid.
    #[must_use]
    pub fn resampled(self, resample: bool) -> Self {
        Self { resample, ..self }
    }

    /// All names of formats.
    pub fn names() -> Vec<&'static str> {
        [AUTO].into_iter().chain(super::rows().map(|row| row.name)).collect()
    }

    /// Errors: no such format; a description of raw binary without that format, or the other way round; one that is out
    /// of its range.
    pub fn check(&self) -> Result<(), StageError> {
        if !Self::names().contains(&self.format.as_str()) {
            let names = Self::names().join(", ");
            return Err(StageError::new(format!("`format` is \"{}\", wanted one of: {names}", self.format)));
        }
        match (&self.raw, self.format == RAW) {
            (Some(raw), true) => raw.check().map_err(|error| StageError::new(format!("`raw`: {}", error.problem))),
            (None, false) => Ok(()),
            (Some(_), false) => Err(StageError::new(format!(
                "`raw` describes a file without a header, and `format` is \"{}\": leave one of them out",
                self.format
            ))),
            (None, true) => {
                Err(StageError::new("`format` is \"raw\" and `raw` is missing: nothing says what is in the files")
                    .help("raw = { sample = \"int16\", channels = 1 }, with `sample_rate_hz` and `unit`"))
            }
        }
    }

    pub(super) fn is_native(&self) -> bool {
        self.format == NATIVE
    }
}
