//! `afmid diff`: what differs between two result files.

use std::path::Path;

use afmid_pipeline::store::ResultFile;

use super::compare::of;
use super::open::require_result;
use crate::batch::shell::quoted;
use crate::cli::DiffArgs;
use crate::failure::{Failure, Message};
use crate::output::print;
use crate::provenance::diff::Diff;
use crate::provenance::differences::{counts_datasets, diff_text};
use crate::show::{compared_text, pretty};

/// Compares two result files.
pub fn run(args: &DiffArgs) -> Result<(), Failure> {
    let (a, b) = (open(&args.a)?, open(&args.b)?);
    let diff = Diff::of(&a, &b).map_err(|error| Failure::failed(&error, error.help.clone()))?;
    let modes = || compared(&args.a, &args.b, &diff);
    let more = match !args.all && counts_datasets(&diff) {
        true => format!("every dataset, by how much: afmid diff {} {} --all\n", quoted(&args.a), quoted(&args.b)),
        false => String::new(),
    };
    let json = || serde_json::to_value(&diff).map_err(|error| Failure::failed(error, None));
    print(&if args.json { pretty(&json()?)? } else { modes()? + &diff_text(&diff, args.all) + &more })?;
    // what was printed says all
    if args.exit_code && !diff.equal { Err(Failure::Failed(Message::Rendered(String::new()))) } else { Ok(()) }
}

/// The modes of both side by side; nothing where no stage differs, or neither has any. Errors: a file is damaged.
fn compared(a: &Path, b: &Path, diff: &Diff) -> Result<String, Failure> {
    if diff.results_equal {
        return Ok(String::new());
    }
    let both = [of(a)?, of(b)?];
    let any = both.iter().any(|result| !result.modes.is_empty());
    Ok(if any { compared_text(&both) + "\n" } else { String::new() })
}

/// Opens a result file. Errors: usage if it is none; it is damaged.
pub fn open(path: &Path) -> Result<ResultFile, Failure> {
    require_result(path)?;
    ResultFile::open(path).map_err(|error| Failure::failed(&error, error.help.clone()))
}
