//! Channels whose file is opened when samples are asked for: those of foreign formats, and those of stored recordings.

use std::path::{Path, PathBuf};
use std::sync::OnceLock;

use super::how::Reading;
use super::opened_files::contents;
use super::source::Hdf5Source;
use super::{FormatError, InputFiles, Raw, Source};
use crate::files::FileState;

/// A stretch of a channel of a file.
#[derive(Debug)]
pub(crate) struct LazySource {
    path: PathBuf,
    file_size: u64,
    blake3: String,
    location: String,
    /// Sample of the file's channel that is the stretch's first.
    first: usize,
    samples: usize,
    reading: Reading,
    native: OnceLock<Hdf5Source>,
    /// The state in which the file was found to have its hash.
    state: OnceLock<FileState>,
    files: InputFiles,
}

impl LazySource {
    /// A whole channel of a native record, whose file had this size and hash.
    pub(crate) fn new(
        files: &InputFiles,
        path: &Path,
        (file_size, blake3): (u64, &str),
        location: &str,
        samples: usize,
    ) -> Self {
        Self {
            path: path.to_owned(),
            file_size,
            blake3: blake3.to_owned(),
            location: location.to_owned(),
            first: 0,
            samples,
            reading: Reading::default(),
            native: OnceLock::new(),
            state: OnceLock::new(),
            files: files.clone(),
        }
    }

    /// The same of a file of another format, from sample `first` on.
    pub(crate) fn of_stretch(self, first: usize, reading: &Reading) -> Self {
        Self { first, reading: reading.clone(), ..self }
    }

    /// Native records keep where their samples lie.
    fn native(&self) -> Result<&Hdf5Source, FormatError> {
        if let Some(source) = self.native.get() {
            return Ok(source);
        }
        let source = super::native::open_source(&self.files, &self.path, self.state()?, &self.location, None)?;
        if source.samples != self.samples {
            return Err(self.error("the file is not the one that was recorded: its channel has another length"));
        }
        Ok(self.native.get_or_init(|| source))
    }

    /// The file's state, in which it has the recorded hash. Each later opening compares with it.
    fn state(&self) -> Result<FileState, FormatError> {
        if let Some(state) = self.state.get() {
            return Ok(*state);
        }
        let metadata =
            std::fs::metadata(&self.path).map_err(|error| self.error(&format!("the file cannot be read: {error}")))?;
        if metadata.len() != self.file_size {
            return Err(self.error("the file is not the one that was recorded: its size differs"));
        }
        let (state, inspected) = self.files.inspect(&self.path)?;
        if inspected.blake3 != self.blake3 {
            return Err(self.error("the file is not the one that was recorded: its bytes have changed"));
        }
        Ok(*self.state.get_or_init(|| state))
    }

    fn error(&self, problem: &str) -> FormatError {
        FormatError::new(format!("{}: {problem}", self.location), "run again, so that it is opened again")
            .in_file(&self.path)
    }
}

impl Source for LazySource {
    fn is_direct(&self) -> bool {
        self.reading.is_native() && self.native().is_ok_and(|source| source.is_direct())
    }

    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        if self.reading.is_native() {
            return self.native()?.read(start, count);
        }
        if start.checked_add(count).is_none_or(|end| end > self.samples) {
            let problem = format!("samples {start} to {start} + {count} asked for, there are {}", self.samples);
            return Err(self.error(&problem));
        }
        let contents = contents(&self.files, &self.path, self.state()?, &self.reading)?;
        let channel = contents.channels.iter().find(|channel| channel.location == self.location);
        let end = self.first.saturating_add(self.samples);
        let channel = channel.filter(|channel| channel.samples >= end).ok_or_else(|| {
            self.error("the file is not the one that was recorded: it lacks the channel, or it is shorter")
        })?;
        channel.source.read(self.first + start, count).map_err(|error| error.in_file(&self.path))
    }
}
