//! The arguments of the command line.

use std::num::NonZeroU16;
use std::path::PathBuf;

use clap::{Args, Parser, Subcommand, ValueEnum};
use clap_complete::Shell;

mod at_once;
mod batch;
mod examples;
mod export;
mod new;
mod plugins;
mod provenance;
mod submit;

pub use at_once::{AtOnceArgs, ModesArgs};
pub use batch::{BatchArgs, SetsArgs};
pub use examples::command;
pub use export::{ExportArgs, ExportFormat, ModelFormat, ShapeFormat};
pub use new::{
    Goal, New, NewCauseArgs, NewFolderArgs, NewPipelineArgs, NewStageArgs, RecordingsArgs, RecordsAre, SpringArgs,
};
pub use plugins::{AllowArgs, PluginCommand, TrustArgs};
pub use provenance::{CrateArgs, DiffArgs, GcArgs, RerunArgs, TraceArgs};
pub use submit::{SlurmArgs, SubmitTo};

/// Identifies dynamic systems from archived transients, such as snap-off events in force curves of an atomic force
/// microscope.
#[derive(Debug, Parser)]
#[command(name = "afmid", version, about, propagate_version = true)]
pub struct Cli {
    /// What to do.
    #[command(subcommand)]
    pub command: Command,
}

/// What to do.
#[derive(Debug, Subcommand)]
pub enum Command {
    /// Run a config, reusing what is still valid, and write a result file; with [sweep], one per point and one table of
    /// them all.
    Run(RunArgs),
    /// Run a config on many data sets, each with its own result file, and write one table of them all.
    Batch(BatchArgs),
    /// Hand a batch to a cluster: its data sets in shards, any number of machines.
    Submit {
        /// Which kind of cluster.
        #[command(subcommand)]
        to: SubmitTo,
    },
    /// From recordings to their modes: config, result and page are written side by side, the table is printed.
    Modes(ModesArgs),
    /// From recordings to a verdict on the linear model: config, result and page are written side by side, the verdict is
    /// printed.
    Diagnose(AtOnceArgs),
    /// Begin something of your own.
    New {
        /// What.
        #[command(subcommand)]
        what: New,
    },
    /// Check configs: everything that can be wrong without opening data, all errors at once, the first hundred printed.
    Check {
        /// The configs.
        #[arg(required = true, value_name = "CONFIG")]
        configs: Vec<PathBuf>,
        /// As JSON, alone on stdout: every problem with its line and column.
        #[arg(long)]
        json: bool,
    },
    /// Draw the graph of a config.
    Graph {
        /// The config and what changes it.
        #[command(flatten)]
        config: ConfigArgs,
        /// How to draw it.
        #[arg(long, value_enum, default_value = "text")]
        format: GraphFormat,
        /// As JSON, alone on stdout: --format json.
        #[arg(long, conflicts_with = "format")]
        json: bool,
    },
    /// Say which stages would run, and why.
    Explain(ExplainArgs),
    /// Say what recorded files hold, and whether they can carry a ringdown.
    Inspect {
        /// The files; a folder means all files in it, one line each.
        #[arg(required = true, value_name = "FILE")]
        files: Vec<PathBuf>,
        /// Put samples of a clock that wanders on an even grid by interpolation; gaps stay gaps.
        #[arg(long)]
        resample: bool,
        /// As JSON, alone on stdout.
        #[arg(long)]
        json: bool,
    },
    /// Show what a run found.
    Show {
        /// The result file, or the folder of a batch.
        result: PathBuf,
        /// The stage, or STAGE.PORT, one of its artifacts; without it, the run as a whole.
        id: Option<String>,
        /// Of a stage with modes all it has, not their table alone.
        #[arg(long)]
        all: bool,
        /// The table of that stage, or STAGE.PORT, as comma-separated values, alone on stdout.
        #[arg(long, requires = "id", conflicts_with_all = ["all", "json"])]
        csv: bool,
        /// As JSON, alone on stdout.
        #[arg(long)]
        json: bool,
    },
    /// Show the modes of several results beside one another, and how far they differ in standard errors.
    Compare {
        /// The result files, two at least; changes are from the first that has a mode.
        #[arg(required = true, num_args = 2.., value_name = "RESULT")]
        results: Vec<PathBuf>,
        /// As JSON, alone on stdout.
        #[arg(long)]
        json: bool,
    },
    /// Say what differs between two result files: inputs, parameters, versions, results.
    Diff(DiffArgs),
    /// Go back from a number to the stages, parameters and files that it comes from.
    Trace(TraceArgs),
    /// Repeat a run from its own result file and compare.
    Rerun(RerunArgs),
    /// Write a model (A, B, C, D, K, covariance, sample time) or modes with their shapes for MATLAB, Octave, Julia,
    /// programs of modal analysis or any other.
    Export(ExportArgs),
    /// Write a run as a Process Run RO-Crate, which other archives and tools read.
    ExportCrate(CrateArgs),
    /// Free the cache: what has not been used for longest goes first.
    Gc(GcArgs),
    /// Write a run's page with its figures: one HTML file that needs no network.
    Report(ReportArgs),
    /// List the stages, or document one.
    Stages {
        /// The stage to document.
        name: Option<String>,
        /// As JSON, alone on stdout: ports, and the JSON Schema of the parameters.
        #[arg(long)]
        json: bool,
    },
    /// List what a simulation can get wrong, or document one cause.
    Causes {
        /// The cause to document.
        name: Option<String>,
        /// As JSON, alone on stdout.
        #[arg(long)]
        json: bool,
    },
    /// Hide causes in simulated recordings, diagnose them with a config, and say how well it did.
    Exam(ExamArgs),
    /// List what the plugins of a config would run, ask them to describe themselves, and remember that you agree.
    Trust(TrustArgs),
    /// Try a stage that runs as a process of its own.
    Plugin {
        /// What to do with it.
        #[command(subcommand)]
        what: PluginCommand,
    },
    /// Print the JSON Schema of a config.
    Schema,
    /// Look at everything that a run needs of this machine: library, cache, disk, arithmetic; say what to do where
    /// something is missing.
    Doctor(DoctorArgs),
    /// Print the completions of a shell.
    Completions {
        /// The shell.
        #[arg(value_enum)]
        shell: Shell,
    },
    /// Print the manual page, or write those of all commands into a folder.
    Man {
        /// The folder, such as ~/.local/share/man/man1.
        folder: Option<PathBuf>,
    },
    /// Write the generated documentation: the stages' pages and the schema of configs.
    #[command(hide = true)]
    Docs {
        /// Where to.
        #[arg(default_value = "docs")]
        folder: PathBuf,
        /// Write nothing; fail if something would change.
        #[arg(long)]
        check: bool,
    },
}

/// A config and what changes it.
#[derive(Debug, Args)]
pub struct ConfigArgs {
    /// The config, TOML of at most 8 MiB.
    pub config: PathBuf,
    /// Set a parameter (or `pipeline.seed`); VALUE is TOML or bare text.
    #[arg(long = "set", value_name = "ID.PARAM=VALUE")]
    pub set: Vec<String>,
}

/// How to examine a config.
#[derive(Debug, Args)]
pub struct ExamArgs {
    /// The config, with a stage `records` and a stage `diagnosis`, and what changes it.
    #[command(flatten)]
    pub config: ConfigArgs,
    /// Archives to draw.
    #[arg(long, value_name = "N", default_value_t = 400)]
    pub seeds: u64,
    /// Seed of the first archive; the others follow.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub first_seed: u64,
    /// Hide only this [default: all of them, in fixed shares].
    #[arg(long, value_enum, value_name = "KIND")]
    pub only: Option<ExamKind>,
    /// Keep the recordings and the verdict of every archive that was judged wrong, in a folder per seed.
    #[arg(long, value_name = "FOLDER")]
    pub keep: Option<PathBuf>,
    /// Whether plugins may start.
    #[command(flatten)]
    pub plugins: AllowArgs,
    /// As JSON, alone on stdout, every archive with its draw.
    #[arg(long)]
    pub json: bool,
}

impl Command {
    /// Whether it makes products of matrices.
    pub const fn computes(&self) -> bool {
        matches!(
            self,
            Self::Run(_)
                | Self::Batch(_)
                | Self::Rerun(_)
                | Self::Modes(_)
                | Self::Diagnose(_)
                | Self::New { .. }
                | Self::Inspect { .. }
                | Self::Exam(_)
        )
    }
}

/// What an exam hides.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum ExamKind {
    /// Nothing.
    Clean,
    /// One cause.
    One,
    /// Two or three causes.
    Mixture,
    /// One cause that the diagnosis may not use.
    LeftOut,
}

/// How to run a config.
#[derive(Debug, Args)]
pub struct RunArgs {
    /// The config and what changes it.
    #[command(flatten)]
    pub config: ConfigArgs,
    /// What it runs on instead of the files of `records` or `data`: files, folders or patterns, from the working directory.
    pub files: Vec<String>,
    /// The result file; of a config with [sweep], the folder of the results [default: the
    /// config's file name, in the working directory].
    #[arg(short, long, value_name = "OUT.h5")]
    pub output: Option<PathBuf>,
    /// Threads [default: one per processor]; results don't depend on it.
    #[arg(short, long, value_name = "N", value_parser = threads)]
    pub jobs: Option<NonZeroU16>,
    /// Reuse nothing.
    #[arg(long)]
    pub fresh: bool,
    /// Where stage results are kept [default: $AFMID_CACHE, or `afmid` in the user's cache folder].
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// Whether plugins may start.
    #[command(flatten)]
    pub plugins: AllowArgs,
    /// As JSON, alone on stdout; of a config with [sweep], all points.
    #[arg(long)]
    pub json: bool,
}

/// A number of threads.
fn threads(text: &str) -> Result<NonZeroU16, String> {
    text.parse().map_err(|_| format!("wanted a whole number from 1 to {}", u16::MAX))
}

/// What to report, and where to.
#[derive(Debug, Args)]
pub struct ReportArgs {
    /// The result file, or the folder of a batch.
    pub result: PathBuf,
    /// The page [default: the result file's name with `.html`, in the working directory].
    #[arg(short, long, value_name = "REPORT.html")]
    pub output: Option<PathBuf>,
    /// What the page is headed by [default: the pipeline's name and the first files].
    #[arg(long, value_name = "TEXT")]
    pub title: Option<String>,
    /// Also write every figure as an SVG file into this folder.
    #[arg(long, value_name = "DIR")]
    pub figures: Option<PathBuf>,
    /// With --figures: each as a PNG file as well, 2000 pixels across (300 to the inch at 17 cm).
    #[arg(long, requires = "figures")]
    pub png: bool,
    /// What was written, as JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}

/// What to explain.
#[derive(Debug, Args)]
pub struct ExplainArgs {
    /// The config and what changes it.
    #[command(flatten)]
    pub config: ConfigArgs,
    /// Where stage results are kept, as for `run`.
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// As JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}

/// Where to look.
#[derive(Debug, Args)]
pub struct DoctorArgs {
    /// Where stage results are kept, as for `run`.
    #[arg(long, value_name = "DIR")]
    pub cache: Option<PathBuf>,
    /// As JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}

/// How to draw a graph.
#[derive(Debug, Clone, Copy, ValueEnum)]
pub enum GraphFormat {
    /// Aligned text.
    Text,
    /// Mermaid, which many Markdown viewers draw.
    Mermaid,
    /// Graphviz.
    Dot,
    /// Stages and wires, for programs.
    Json,
}
