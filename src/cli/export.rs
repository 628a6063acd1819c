//! The arguments of `afmid export`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// What to export, and as what.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The result file.
    pub result: PathBuf,
    /// A state-space model, in this format.
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub model: ModelFormat,
    /// Of which stage [default: the only one that has a model, or else `model`]; ID.PORT if it has several.
    #[arg(long, value_name = "ID")]
    pub stage: Option<String>,
    /// The file [default: the result file's and the stage's name, with `.mat` or `.json`, in the working directory].
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// What was written, as JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}

/// A format for models.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ModelFormat {
    /// A MATLAB file (level 5): MATLAB, Octave, scipy, MAT.jl.
    Mat,
    /// JSON, for anything else.
    Json,
}

impl ModelFormat {
    /// Ending of a file's name.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Mat => "mat",
            Self::Json => "json",
        }
    }
}
