//! The arguments of `afmid diagnose`.

use std::num::NonZeroU16;
use std::path::PathBuf;

use clap::Args;

use super::{RecordingsArgs, threads};

/// What to diagnose, and where to write it.
#[derive(Debug, Args)]
pub struct DiagnoseArgs {
    /// The recordings, and what is known of them.
    #[command(flatten)]
    pub recordings: RecordingsArgs,
    /// The result file; the config and the page have its name with `.toml` and `.html`. A config that is there must be
    /// the same [default: the first file's name with `.diagnosis.h5`, in the working directory].
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
    /// The stored diagnosis with the three paths, as JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}
