//! The arguments of `afmid new`.

use std::path::PathBuf;

use clap::{Args, Subcommand, ValueEnum};

/// What to begin.
#[derive(Debug, Subcommand)]
pub enum New {
    /// Write a config for recordings, from what they hold; what they don't say is asked for by name.
    Pipeline(NewPipelineArgs),
}

/// For which recordings, and to find what.
#[derive(Debug, Args)]
pub struct NewPipelineArgs {
    /// Recordings: a folder of files of one kind, or files.
    #[arg(required = true, value_name = "RECORDINGS")]
    pub recordings: Vec<PathBuf>,
    /// What to find.
    #[arg(long, value_enum, default_value = "modes")]
    pub goal: Goal,
    /// The deflection signal, as `afmid inspect` names it [default: the channel that can carry a ringdown and is named most like a deflection].
    #[arg(long, value_name = "NAME")]
    pub channel: Option<String>,
    /// Samples per second in Hz, of files that state none.
    #[arg(long, value_name = "HZ")]
    pub rate: Option<f64>,
    /// Unit of the signal, of files that state none.
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<String>,
    /// The config [default: the goal's name with `.toml`, in the working directory]; a file that is there is left alone.
    #[arg(short, long, value_name = "CONFIG.toml")]
    pub output: Option<PathBuf>,
}

/// What a pipeline is to find.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Goal {
    /// Transfer function and modes of the free lever, from averaged snap-offs, as in the paper.
    Modes,
    /// Frequencies and quality factors from all snap-offs jointly, no average: the best errors.
    Ringdown,
    /// What a linear simulation gets wrong, by name.
    Diagnosis,
    /// The lever in contact beside the free one: snap-ins as well.
    Coupled,
}
