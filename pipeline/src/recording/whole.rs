//! Channels of a file of any format, read whole.

use std::path::Path;
use std::sync::Arc;

use super::contents::format_of;
use super::how::Reading;
use super::input_files::{HashedFile, InputFiles};
use super::opened_files::contents;
use super::{Contents, FoundChannel};
use crate::error::StageError;

/// Most samples of a channel that is read whole: half a gigabyte of them.
const LONGEST: usize = 1 << 26;

/// A file that is small enough for its channels to be read whole: measured input and output, not an archive.
#[derive(Debug)]
pub struct WholeFile {
    hashed: HashedFile,
    contents: Arc<Contents>,
}

impl WholeFile {
    /// Opens it. Errors: as [`super::open_contents`].
    pub fn open(files: &InputFiles, path: &Path, reading: &Reading) -> Result<Self, StageError> {
        reading.check()?;
        let hashed = files.hashed(path)?;
        let reading = Reading { format: format_of(files, path, reading)?.to_owned(), raw: reading.raw.clone() };
        let contents = contents(files, path, hashed.state(), &reading)?;
        Ok(Self { hashed, contents })
    }

    /// What it holds.
    pub fn contents(&self) -> &Contents {
        &self.contents
    }

    /// All values of a channel in its unit, NaN where samples are missing: stored * scale_factor + add_offset.
    ///
    /// Errors: more than 2^26 samples; as [`super::Source::read`]; the file is no longer the one that was hashed.
    pub fn read(&self, channel: &FoundChannel) -> Result<Vec<f64>, StageError> {
        if channel.samples > LONGEST {
            let problem =
                format!("{} has {} samples, wanted at most {LONGEST} at once", channel.location, channel.samples);
            return Err(StageError::new(problem).at(self.hashed.path()).help("cut the file into shorter ones"));
        }
        let stored = channel.source.read(0, channel.samples).map_err(|error| error.in_file(self.hashed.path()))?;
        let (scale, offset) = (channel.scale_factor, channel.add_offset);
        let value = |stored: f64| if channel.fill_code == Some(stored) { f64::NAN } else { stored * scale + offset };
        let values = stored.widened().into_iter().map(value).collect();
        self.hashed.check_unchanged()?;
        Ok(values)
    }
}
