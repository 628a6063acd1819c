//! A file that was looked at.

use std::io::Read;
use std::path::{Path, PathBuf};

use afmid_pipeline::StageError;
use afmid_pipeline::files::open_regular;
use afmid_pipeline::recording::{InputFiles, Reading, open_unpacked, recognised};

use super::channel::Channel;
use super::config::stage;
use super::no_sensor::tell;
use super::ringing::NO_RATE;
use super::verdict::{Verdict, of_file};

/// Channels that are read through; more are listed.
const MOST_READ: usize = 256;

/// A file and what became of it.
#[derive(Debug)]
pub struct Inspected {
    pub file: PathBuf,
    pub size_bytes: Option<u64>,
    pub outcome: Outcome,
}

/// What a file holds.
#[derive(Debug)]
pub struct Holdings {
    /// For people, with its version.
    pub format: String,
    pub started_at: String,
    pub channels: Vec<Channel>,
    pub remarks: Vec<String>,
    pub ringdown: Verdict,
    /// The `io.records` stage that would read it, in TOML; none without a signal.
    pub stage: Option<String>,
}

/// What became of a file.
#[derive(Debug)]
pub enum Outcome {
    /// It was read.
    Read(Box<Holdings>),
    /// It is a result or stage file of afmid's, no recording.
    Own,
    /// It could not be read.
    Refused {
        /// Why.
        problem: String,
        /// What to do.
        help: Option<String>,
        /// Whether it is of no format that is known, such as notes beside the recordings.
        no_recording: bool,
    },
}

/// Looks at a file: what it holds, and every sample of it once. `files` keeps what was parsed; `resample`: with channels
/// whose clock wanders on an even grid.
pub fn inspect(path: &Path, files: &InputFiles, resample: bool) -> Inspected {
    let size_bytes = std::fs::metadata(path).ok().map(|metadata| metadata.len());
    let outcome = match files.is_result(path) {
        Ok(true) => Outcome::Own,
        _ => {
            let found = read(path, files, resample);
            found.map_or_else(|error| refused(path, error), |holdings| Outcome::Read(Box::new(holdings)))
        }
    };
    Inspected { file: path.to_owned(), size_bytes, outcome }
}

fn refused(path: &Path, error: StageError) -> Outcome {
    Outcome::Refused { problem: error.problem, help: error.help, no_recording: is_no_recording(path) }
}

/// Whether a file can be read and is of no format that is known. What is empty or packed may be a recording that was
/// damaged.
fn is_no_recording(path: &Path) -> bool {
    const GZIP: &[u8] = &[0x1f, 0x8b];
    let mut head = Vec::new();
    let read = open_regular(path).and_then(|file| file.take(GZIP.len() as u64).read_to_end(&mut head));
    read.is_ok() && !head.is_empty() && head != GZIP && !recognised(path)
}

fn read(path: &Path, files: &InputFiles, resample: bool) -> Result<Holdings, StageError> {
    let opened = open_unpacked(files, path, &Reading::of("auto", None).resampled(resample))?;
    let contents = &opened.contents;
    let channels = contents.channels.iter().enumerate();
    let mut channels: Vec<Channel> =
        channels.map(|(index, found)| Channel::of(found, index < MOST_READ)).collect::<Result<_, _>>()?;
    tell(&mut channels, &contents.channels);
    let mut ringdown = of_file(&channels, &contents.channels);
    let best = ringdown.channel.and_then(|index| channels.get(index));
    // a rate that is stated and is none
    if let Some(why) = best.and_then(|channel| contents.why_no_rate(&channel.location)) {
        ringdown.reason = ringdown.reason.replace(NO_RATE, why);
    }
    Ok(Holdings {
        format: match opened.format {
            "native" => format!("native record ({})", contents.format),
            _ => contents.format.clone(),
        },
        started_at: contents.started_at.clone(),
        stage: best.filter(|channel| !channel.is_axis).map(|channel| stage(path, channel, resample)),
        channels,
        remarks: contents.remarks.clone(),
        ringdown,
    })
}
