//! Channels of a file of any format, read whole.

use std::path::Path;
use std::sync::Arc;

use super::contents::{format_of, open_packed};
use super::how::Reading;
use super::inflated::Inflated;
use super::input_files::{HashedFile, InputFiles};
use super::opened_files::contents;
use super::{Contents, FoundChannel, most_inflated};
use crate::error::StageError;

/// A file that is small enough for its channels to be read whole: measured input and output, not an archive.
#[derive(Debug)]
pub struct WholeFile {
    hashed: HashedFile,
    contents: Arc<Contents>,
    /// What a packed file holds, as long as its channels may be read.
    _inflated: Option<Inflated>,
}

impl WholeFile {
    /// Opens it, also packed with gzip. Errors: as [`super::open_contents`]; it cannot be unpacked.
    pub fn open(files: &InputFiles, path: &Path, reading: &Reading) -> Result<Self, StageError> {
        reading.check()?;
        let hashed = files.hashed(path)?;
        if let Some((inflated, _, contents)) = open_packed(files, path, reading)? {
            return Ok(Self { hashed, contents: Arc::new(contents), _inflated: Some(inflated) });
        }
        let reading = Reading { format: format_of(files, path, reading)?.to_owned(), ..reading.clone() };
        let contents = contents(files, path, hashed.state(), &reading)?;
        Ok(Self { hashed, contents, _inflated: None })
    }

    /// What it holds.
    pub fn contents(&self) -> &Contents {
        &self.contents
    }

    /// BLAKE3 hash of the bytes that were opened.
    pub(super) fn blake3(&self) -> &str {
        self.hashed.blake3()
    }

    /// All values of a channel in its unit, NaN where samples are missing: stored * scale_factor + add_offset.
    ///
    /// Errors: numbers of more than half of what compressed data of a file of that size may come to; as
    /// [`super::Source::read`]; the file is no longer the one that was hashed.
    pub fn read(&self, channel: &FoundChannel) -> Result<Vec<f64>, StageError> {
        // a channel that is read whole is kept several times: as read, without its level, in parts
        let most = most_inflated(self.hashed.size()) / 16;
        if channel.samples as u64 > most {
            let problem =
                format!("{} has {} samples, wanted at most {most} at once", channel.location, channel.samples);
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
