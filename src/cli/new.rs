//! The arguments of `afmid new`.

use std::path::PathBuf;

use afmid_stages::calibration::ContactSpring;
use clap::{Args, Subcommand, ValueEnum};

/// What to begin.
#[derive(Debug, Subcommand)]
pub enum New {
    /// Write a config for recordings, from what they hold; what they don't say is asked for by name.
    Pipeline(NewPipelineArgs),
    /// Write a folder with a stage of your own, its test and a config that runs it.
    Stage(NewStageArgs),
    /// Write a folder with a cause of your own for the diagnosis, and recordings that it is hidden and found in.
    Cause(NewCauseArgs),
}

/// Which stage, in which language.
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("language").required(true))]
pub struct NewStageArgs {
    /// Its name: lowercase letters, digits and `_`, a letter first.
    #[arg(value_name = "NAME", value_parser = stage_name)]
    pub name: String,
    /// A plugin in Python: a process beside afmid.
    #[arg(long, group = "language")]
    pub python: bool,
    /// A crate that adds the stage to a binary of its own; wants --sources.
    #[arg(long, group = "language", requires = "sources")]
    pub rust: bool,
    /// Where it goes.
    #[command(flatten)]
    pub place: NewFolderArgs,
}

/// Which cause, in which language.
#[derive(Debug, Args)]
#[command(group = clap::ArgGroup::new("language").required(true))]
pub struct NewCauseArgs {
    /// Its name: lowercase letters and `_`, a letter first; verdicts have `-` for `_`.
    #[arg(value_name = "NAME", value_parser = cause_name)]
    pub name: String,
    /// A function in Python for `afmid.diagnose`.
    #[arg(long, group = "language")]
    pub python: bool,
    /// A crate that adds the cause to a binary of its own; wants --sources.
    #[arg(long, group = "language", requires = "sources")]
    pub rust: bool,
    /// Where it goes.
    #[command(flatten)]
    pub place: NewFolderArgs,
}

/// Where a stage or a cause goes.
#[derive(Debug, Args)]
pub struct NewFolderArgs {
    /// A clone of afmid's repository, which the crate depends on.
    #[arg(long, value_name = "FOLDER")]
    pub sources: Option<PathBuf>,
    /// The folder, which must not be there yet [default: NAME in the working directory].
    #[arg(short, long, value_name = "FOLDER")]
    pub output: Option<PathBuf>,
    /// What was written, as JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}

fn cause_name(text: &str) -> Result<String, String> {
    match stage_name(text) {
        Ok(name) if !name.contains(|c: char| c.is_ascii_digit()) => Ok(name),
        _ => Err("wanted a name of lowercase letters and `_`, a letter first, 40 at most".to_owned()),
    }
}

fn stage_name(text: &str) -> Result<String, String> {
    let letters = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '_';
    let right = text.starts_with(|c: char| c.is_ascii_lowercase()) && text.chars().all(letters) && text.len() <= 40;
    match right {
        true => Ok(text.to_owned()),
        false => Err("wanted a name of lowercase letters, digits and `_`, a letter first, 40 at most".to_owned()),
    }
}

/// For which recordings, and to find what.
#[derive(Debug, Args)]
pub struct NewPipelineArgs {
    /// The recordings, and what is known of them.
    #[command(flatten)]
    pub recordings: RecordingsArgs,
    /// What to find [default: what the recordings look like].
    #[arg(long, value_enum)]
    pub goal: Option<Goal>,
    /// What a spring constant needs beside recordings.
    #[command(flatten)]
    pub spring: SpringArgs,
    /// The config [default: the goal's name with `.toml`, in the working directory]; a file that is there is left
    /// alone.
    #[arg(short, long, value_name = "CONFIG.toml")]
    pub output: Option<PathBuf>,
    /// What was written, as JSON, alone on stdout.
    #[arg(long)]
    pub json: bool,
}

/// What no file says and `--goal spring-constant` needs.
#[derive(Debug, Clone, Copy, Default, Args)]
pub struct SpringArgs {
    /// Of a spring constant: travel of the piezo in metres a volt of its monitor, where its channel is in volts.
    #[arg(long, value_name = "M_PER_V", value_parser = above_zero, allow_hyphen_values = true)]
    pub piezo: Option<f64>,
    /// Of a spring constant: stiffness of the contact between tip and sample in N/m, or `rigid` where it is much stiffer
    /// than the lever.
    #[arg(long, value_name = "N_PER_M", value_parser = contact, allow_hyphen_values = true)]
    pub contact: Option<ContactSpring>,
}

fn above_zero(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|value: &f64| value.is_finite() && *value > 0.0);
    value.ok_or_else(|| "wanted a number above 0".to_owned())
}

fn contact(text: &str) -> Result<ContactSpring, String> {
    let stiffness =
        || above_zero(text).map(ContactSpring::NPerM).map_err(|wanted| format!("{wanted} in N/m, or rigid"));
    if text == "rigid" { Ok(ContactSpring::Rigid) } else { stiffness() }
}

/// Recordings, and what the user says of them beside what they hold.
#[derive(Debug, Args)]
pub struct RecordingsArgs {
    /// Recordings: a folder, or files; of several rates or channels those that most are of.
    #[arg(required = true, value_name = "RECORDINGS")]
    pub paths: Vec<PathBuf>,
    /// The signal, as `afmid inspect` names it; of decays and of a hammer's responses several, one for each sensor
    /// [default: the channel that can carry a ringdown and is named most like a deflection; of decays all channels of
    /// that length and unit].
    #[arg(long, value_name = "NAME")]
    pub channel: Vec<String>,
    /// The measured input, as `afmid inspect` names it; several of several inputs [default: channels named as a force,
    /// an input, a drive]. A file among RECORDINGS, or FILE:NAME, if input and output are in files of their own, recorded
    /// at the same time.
    #[arg(long, value_name = "NAME")]
    pub input: Vec<String>,
    /// Of a diagnosis: the channel that the output is to follow, where a controller makes the input (the drive) from
    /// both.
    #[arg(long, value_name = "NAME")]
    pub reference: Option<String>,
    /// What files and channels are, of decays: hits, or sensors that saw the same hits; of a force and what moves: hits, or
    /// points; of frequency responses: points [default: files are hits, channels are sensors, cells are hits; files with a
    /// force are hits if their names number hits].
    #[arg(long = "as", value_enum, value_name = "WHAT")]
    pub records_are: Option<RecordsAre>,
    /// Samples per second in Hz, of files that state none; of files of several rates, which to take [default: of which
    /// there are most].
    #[arg(long, value_name = "HZ")]
    pub rate: Option<f64>,
    /// Unit of the signal, of files that state none.
    #[arg(long, value_name = "UNIT")]
    pub unit: Option<String>,
    /// Put samples of a clock that wanders on an even grid by interpolation (docs/archives.md); gaps stay gaps.
    #[arg(long)]
    pub resample: bool,
}

/// What files and channels are.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum RecordsAre {
    /// Each channel of each file is a hit; of files with a force each file, averaged.
    Hits,
    /// All files and channels saw the same hits.
    Sensors,
    /// Each file is another point of the structure: of frequency responses, or of a force and what moves.
    Points,
}

/// What a pipeline is to find.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Goal {
    /// Modes, damping and mode shapes from free decays: after a hit, a release, a pulse, the end of a drive.
    Decay,
    /// Modes by what the recordings look like: snap-offs of a lever, decays, responses, input and output.
    Modes,
    /// Transfer function and modes of the free lever, from averaged snap-offs, as in the paper.
    SnapOff,
    /// Frequencies and quality factors from all snap-offs jointly, no average: the best errors.
    Ringdown,
    /// What a linear simulation gets wrong, by name: of snap-offs of a lever, decays, input and output, an axis in its
    /// loop (--reference), a steady oscillation.
    Diagnosis,
    /// The lever in contact beside the free one: snap-ins as well.
    Coupled,
    /// Transfer function and modes from a measured input and output.
    InputOutput,
    /// Modes and mode shapes from frequency responses: measured ones, or those of hits with a measured force.
    Frf,
    /// Resonance, quality factor and noise floor of a resonator that nothing but noise drives.
    Thermal,
    /// Spring constant of a lever from its thermal motion and the contact's slope in force curves: --piezo, --contact.
    SpringConstant,
    /// Frequency and harmonics of an oscillation that does not decay.
    Steady,
}
