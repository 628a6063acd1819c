//! From a result file's name to the file.

use std::io::ErrorKind;
use std::path::{Path, PathBuf};

use afmid_pipeline::files::open_regular;
use afmid_pipeline::recording::recognised;
use afmid_pipeline::store::{FileKind, file_kind};

use crate::batch::summary::SUMMARY;
use crate::failure::Failure;

/// The file that stands for a folder of results: what a batch, or a run of a sweep, sums up in. The path itself of any
/// other.
pub fn summary_of(path: &Path) -> PathBuf {
    let summary = path.join(SUMMARY);
    if path.is_dir() && summary.is_file() { summary } else { path.to_owned() }
}

/// Sees to it that a path names a file of afmid's, whole or not. Errors, all usage: there is none; what it is instead,
/// and what to do.
pub fn require_result(path: &Path) -> Result<(), Failure> {
    let shown = path.display();
    if path.is_dir() {
        return Err(Failure::usage(format!("{shown} is a folder, wanted a result file"), None));
    }
    if let Err(error) = open_regular(path) {
        let message = match error.kind() {
            ErrorKind::NotFound | ErrorKind::NotADirectory => format!("there is no file {shown}"),
            _ => format!("{shown} cannot be read: {error}"),
        };
        let help = "a result is made by `afmid run CONFIG -o OUT.h5`".to_owned();
        return Err(Failure::usage(message, Some(help)));
    }
    let kind = file_kind(path).map_err(|error| Failure::usage(format!("{shown} cannot be read: {error}"), None))?;
    let help = match kind {
        FileKind::Own => return Ok(()),
        FileKind::Record => {
            "name it in `files` of a config's stage `io.records`; `afmid run CONFIG -o OUT.h5` makes a result"
                .to_owned()
        }
        FileKind::Toml => format!(
            "if it is a config, `afmid run {shown} -o OUT.h5` makes a result, and `afmid check {shown}` checks it"
        ),
        FileKind::Text | FileKind::Other if recognised(path) => {
            let help = format!(
                "`afmid inspect {shown}` says what it holds, `afmid new pipeline {shown}` writes a config for it"
            );
            return Err(Failure::usage(
                format!("{shown} is a recording or a table, wanted a result file of `afmid run`"),
                Some(help),
            ));
        }
        _ => "`afmid run CONFIG -o OUT.h5` makes one".to_owned(),
    };
    Err(Failure::usage(format!("{shown} is {kind}, wanted a result file of `afmid run`"), Some(help)))
}
