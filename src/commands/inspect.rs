//! `afmid inspect`: what recorded files hold, and whether they can carry a ringdown.

use std::path::{Path, PathBuf};

use afmid_pipeline::InputFiles;
use rayon::prelude::*;
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::inspect::{Inspected, Outcome, file_text, files_of, folder_text, inspect, inspected_json};
use crate::output::print;
use crate::show::pretty;

/// Looks at files, and at the files of folders. Errors: some could not be read; all are reported before. What is no
/// recording is an error where it was named itself; beside the recordings of a folder it is listed.
pub fn run(paths: &[PathBuf], resample: bool, as_json: bool) -> Result<(), Failure> {
    let (mut looked, mut refused) = (Vec::new(), 0);
    for path in paths {
        let cannot =
            |error: std::io::Error| Failure::failed(format!("{} cannot be listed: {error}", path.display()), None);
        let files = if path.is_dir() { files_of(path).map_err(cannot)? } else { vec![path.clone()] };
        // in parallel, printed in their order
        let inspected: Vec<Inspected> =
            files.par_iter().map(|file| inspect(file, &InputFiles::new(), resample)).collect();
        if !as_json {
            print(&text(path, &inspected))?;
        }
        let is_error = |inspected: &&Inspected| match inspected.outcome {
            Outcome::Refused { no_recording, .. } => !(no_recording && path.is_dir()),
            Outcome::Read(_) | Outcome::Own => false,
        };
        refused += inspected.iter().filter(is_error).count();
        looked.extend(inspected);
    }
    if as_json {
        let files: Vec<Value> = looked.iter().map(inspected_json).collect();
        print(&pretty(&json!({ "files": files }))?)?;
    }
    match refused {
        0 => Ok(()),
        _ => Err(Failure::failed(format!("{refused} of {} files could not be read", looked.len()), None)),
    }
}

fn text(path: &Path, inspected: &[Inspected]) -> String {
    if path.is_dir() { folder_text(path, inspected) } else { inspected.iter().map(file_text).collect() }
}
