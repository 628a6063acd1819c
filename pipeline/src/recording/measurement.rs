//! Files of one measurement, read whole: input and output that lie in files of their own.

use std::path::PathBuf;

use afmid_formats::{joined, names_of_files};

use super::how::Reading;
use super::input_files::InputFiles;
use super::whole::WholeFile;
use super::{Contents, FoundChannel};
use crate::error::StageError;

/// Files that are small enough to be read whole, with their channels as those of one file: `FILE:CHANNEL` where there
/// are several.
#[derive(Debug)]
pub struct Measurement {
    names: Vec<String>,
    files: Vec<WholeFile>,
    contents: Contents,
}

impl Measurement {
    /// Opens all files. Errors: as [`WholeFile::open`]; two hold the same bytes or have one name; their dates do not say
    /// how they go together.
    pub fn open(files: &InputFiles, paths: &[PathBuf], reading: &Reading) -> Result<Self, StageError> {
        let names = names_of_files(paths)?;
        let mut opened: Vec<WholeFile> = Vec::with_capacity(paths.len());
        for (path, name) in paths.iter().zip(&names) {
            let file = WholeFile::open(files, path, reading)?;
            if let Some(same) = opened.iter().position(|earlier| earlier.blake3() == file.blake3()) {
                let same = names.get(same).map_or("", String::as_str);
                let problem = format!("{name} and {same} hold the same bytes, wanted files with other channels each");
                return Err(StageError::new(problem).help("name each file once"));
            }
            opened.push(file);
        }
        let each = names.iter().cloned().zip(opened.iter().map(|file| file.contents().clone())).collect();
        Ok(Self { contents: joined(each)?, names, files: opened })
    }

    /// What they hold together.
    pub fn contents(&self) -> &Contents {
        &self.contents
    }

    /// Whether there are several files.
    pub fn is_joined(&self) -> bool {
        self.files.len() > 1
    }

    /// As [`WholeFile::read`], of the file that has the channel.
    pub fn read(&self, channel: &FoundChannel) -> Result<Vec<f64>, StageError> {
        let has =
            |name: &String| channel.location.strip_prefix(name.as_str()).is_some_and(|rest| rest.starts_with(':'));
        let number = if self.is_joined() { self.names.iter().position(has) } else { Some(0) };
        let file = number.and_then(|number| self.files.get(number));
        file.ok_or_else(|| StageError::new(format!("{} is of none of the files", channel.location)))?.read(channel)
    }
}
