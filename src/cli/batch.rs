//! The arguments of `afmid batch`.

use std::num::NonZeroU16;
use std::path::PathBuf;

use clap::Args;

use super::{AllowArgs, ConfigArgs, threads};
use crate::batch::shard::Shard;

/// Data sets.
#[derive(Debug, Args)]
pub struct SetsArgs {
    /// Data sets: folders of records, or files, each a run of its own.
    #[arg(value_name = "DATASET")]
    pub paths: Vec<PathBuf>,
    /// More data sets, one a line: {"name": "a", "files": ["a/*.h5"], "set": {"stage.param": 1}}.
    #[arg(long, value_name = "M.jsonl")]
    pub manifest: Vec<PathBuf>,
}

/// What to run a config on, and how.
#[derive(Debug, Args)]
pub struct BatchArgs {
    /// The config, with a stage `records` or `data`, and what changes it.
    #[command(flatten)]
    pub config: ConfigArgs,
    /// What to run it on.
    #[command(flatten)]
    pub sets: SetsArgs,
    /// Folder of the results (NAME.h5; of a data set that fails NAME.failed.h5, with the stages that went through), the
    /// ledger and the summary [default: the config's file name, in the working directory].
    #[arg(short, long, value_name = "FOLDER")]
    pub output: Option<PathBuf>,
    /// Data sets at once, and threads [default: one per processor]; results don't depend on it.
    #[arg(short, long, value_name = "N", value_parser = threads)]
    pub jobs: Option<NonZeroU16>,
    /// Reuse nothing.
    #[arg(long)]
    pub fresh: bool,
    /// Where stage results are kept, as for `run`.
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Only part I of N of the data sets; no summary.
    #[arg(long, value_name = "I/N")]
    pub shard: Option<Shard>,
    /// Run data sets again that failed, though nothing has changed.
    #[arg(long)]
    pub retry_failed: bool,
    /// Run nothing: make the summary from what the ledger holds of these data sets; what has changed since its run
    /// counts as failed.
    #[arg(long, conflicts_with_all = ["shard", "fresh", "retry_failed"])]
    pub collect: bool,
    /// Whether plugins may start.
    #[command(flatten)]
    pub plugins: AllowArgs,
    /// Start the plugins whose seals this file holds: what `afmid submit` hands to its jobs.
    #[arg(long, value_name = "FILE", hide = true)]
    pub agreed_plugins: Option<PathBuf>,
    /// As JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}
