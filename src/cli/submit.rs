//! The arguments of `afmid submit`.

use std::num::NonZeroU32;
use std::path::PathBuf;

use clap::{Args, Subcommand};

use super::{AllowArgs, ConfigArgs, SetsArgs};
use crate::batch::slurm::{Field, Passed};

/// Which kind of cluster.
#[derive(Debug, Subcommand)]
pub enum SubmitTo {
    /// Write the job scripts of a batch for Slurm, and send them with --send.
    Slurm(Box<SlurmArgs>),
}

/// What to submit to Slurm, and how.
#[derive(Debug, Args)]
pub struct SlurmArgs {
    /// The config, with a stage `records`, and what changes it.
    #[command(flatten)]
    pub config: ConfigArgs,
    /// What to run it on.
    #[command(flatten)]
    pub sets: SetsArgs,
    /// Parts of the data sets, each a task of the job array.
    #[arg(long, value_name = "N")]
    pub shards: NonZeroU32,
    /// Folder of the results, as for `batch`; all nodes must see it. The scripts and logs go to `slurm` in it.
    #[arg(short, long, value_name = "FOLDER")]
    pub output: PathBuf,
    /// Where stage results are kept, as for `run`; nodes may share it or each have their own.
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Run data sets again that failed, though nothing has changed.
    #[arg(long)]
    pub retry_failed: bool,
    /// Partition of the cluster [default: the cluster's].
    #[arg(long, value_name = "NAME")]
    pub partition: Option<Field>,
    /// Time limit of a task, such as 30 (minutes), 2:00:00 or 1-00 (days-hours) [default: the partition's].
    #[arg(long, value_name = "TIME")]
    pub time: Option<Field>,
    /// Memory of a task, such as 4G [default: the partition's].
    #[arg(long, value_name = "SIZE")]
    pub memory: Option<Field>,
    /// Processors of a task, and data sets at once in it.
    #[arg(long, value_name = "N", default_value = "1", value_parser = super::threads)]
    pub cpus: std::num::NonZeroU16,
    /// Account to charge [default: the user's].
    #[arg(long, value_name = "NAME")]
    pub account: Option<Field>,
    /// Any other option of sbatch, for both jobs: --sbatch=--nice=100.
    #[arg(long, value_name = "OPTION", allow_hyphen_values = true)]
    pub sbatch: Vec<Passed>,
    /// Whether plugins may start.
    #[command(flatten)]
    pub plugins: AllowArgs,
    /// Send both jobs with sbatch.
    #[arg(long)]
    pub send: bool,
    /// As JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}
