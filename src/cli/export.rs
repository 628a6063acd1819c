//! The arguments of `afmid export`.

use std::path::PathBuf;

use clap::{Args, ValueEnum};

/// What to export, and as what.
#[derive(Debug, Args)]
pub struct ExportArgs {
    /// The result file.
    pub result: PathBuf,
    /// What is exported.
    #[command(flatten)]
    pub what: ExportWhat,
    /// Of which stage [default: the only one that has such a thing, or else `model` or `modes`]; ID.PORT if it has
    /// several models.
    #[arg(long, value_name = "ID")]
    pub stage: Option<String>,
    /// The file [default: the result file's and the stage's name, with `.mat`, `.json` or `.unv`, in the working
    /// directory].
    #[arg(short, long, value_name = "FILE")]
    pub output: Option<PathBuf>,
    /// What was written, as JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}

/// One of these.
#[derive(Debug, Args)]
#[group(required = true, multiple = false)]
pub struct ExportWhat {
    /// A state-space model, in this format.
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub model: Option<ModelFormat>,
    /// Modes with their shapes, in this format.
    #[arg(long, value_enum, value_name = "FORMAT")]
    pub shapes: Option<ShapeFormat>,
}

/// What, in which format.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ExportFormat {
    /// A state-space model.
    Model(ModelFormat),
    /// Modes with their shapes.
    Shapes(ShapeFormat),
}

impl ExportWhat {
    /// The one that was said; none: the parser does not let that through.
    pub fn format(&self) -> Option<ExportFormat> {
        self.model.map(ExportFormat::Model).or(self.shapes.map(ExportFormat::Shapes))
    }
}

impl ExportFormat {
    /// Ending of a file's name.
    pub const fn extension(self) -> &'static str {
        match self {
            Self::Model(ModelFormat::Mat) => "mat",
            Self::Model(ModelFormat::Json) => "json",
            Self::Shapes(ShapeFormat::Uff) => "unv",
        }
    }
}

/// A format for models.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ModelFormat {
    /// A MATLAB file (level 5): MATLAB, Octave, scipy, MAT.jl.
    Mat,
    /// JSON, for anything else.
    Json,
}

/// A format for modes with their shapes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum ShapeFormat {
    /// A universal file: dataset 55, a mode each, and dataset 15 where positions are known.
    Uff,
}
