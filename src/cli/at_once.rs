//! The arguments of commands that go from recordings to an answer: `afmid modes`, `afmid diagnose`.

use std::num::NonZeroU16;
use std::path::PathBuf;

use clap::Args;

use super::{Goal, RecordingsArgs, threads};

/// Of which recordings, and where config, result and page go.
#[derive(Debug, Args)]
pub struct AtOnceArgs {
    /// The recordings, and what is known of them.
    #[command(flatten)]
    pub recordings: RecordingsArgs,
    /// The result file; the config and the page have its name with `.toml` and `.html`. A config that is there must be
    /// the same [default: the first file's name with `.modes.h5` or `.diagnosis.h5`, as the command, in the working
    /// directory].
    #[arg(short, long, value_name = "OUT.h5")]
    pub output: Option<PathBuf>,
    /// Threads [default: one per processor]; results don't depend on it.
    #[arg(short, long, value_name = "N", value_parser = threads)]
    pub jobs: Option<NonZeroU16>,
    /// Reuse nothing.
    #[arg(long)]
    pub fresh: bool,
    /// Where stage results are kept, as for `run`.
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// What is stored of the answer with the three paths, as JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Of which recordings the modes are wanted, and how.
#[derive(Debug, Args)]
pub struct ModesArgs {
    /// Recordings and files.
    #[command(flatten)]
    pub at_once: AtOnceArgs,
    /// What to find [default: what the recordings look like].
    #[arg(long, value_enum)]
    pub goal: Option<Goal>,
}
