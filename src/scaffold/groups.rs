//! Recordings that one analysis can take together: of one ending, one sample rate and the same channels.

use std::path::{Path, PathBuf};

use afmid_pipeline::recording::{
    Contents, FoundChannel, InputFiles, Reading, mean_rate, open_unpacked, rates_agree, recognised,
};
use rayon::prelude::*;

use super::channels::{is_input, same_name};
use super::choice::Question;
use super::first_file::holds_responses;
use super::pipeline::Wanted;
use crate::cli::Goal;
use crate::inspect::LEAST_SAMPLES;
use crate::show::number;

/// A signal that the files of a group have in common.
#[derive(Debug, Clone)]
struct Signal {
    /// Its location; a number that is a whole part of it stands for any.
    name: String,
    unit: String,
    rate_hz: Option<f64>,
}

/// What the files of a group hold.
#[derive(Debug, Clone)]
enum Layout {
    /// Frequency responses, whatever they are named.
    Responses,
    Signals(Vec<Signal>),
}

/// Files that go together.
#[derive(Debug)]
pub struct Group {
    pub files: Vec<PathBuf>,
    ending: String,
    layout: Layout,
    /// Channels that the user named and these files do not have.
    pub lacks: Vec<String>,
    pub axes: Axes,
}

/// What the first file of a group has besides signals.
#[derive(Debug, Clone, Copy)]
pub struct Axes {
    /// Whether there are times or frequencies that give no rate.
    pub any: bool,
    /// The mean rate of such times.
    pub mean_rate_hz: Option<f64>,
}

/// Files by what they hold.
#[derive(Debug, Default)]
pub struct Groups {
    /// In the order of their first files.
    pub all: Vec<Group>,
    /// Names of what is no recording, and why.
    pub skipped: Vec<(PathBuf, String)>,
    /// Results of afmid's, which patterns leave out.
    pub own: Vec<PathBuf>,
}

/// What a file is.
enum Kind {
    Recording(Layout, Vec<String>, Axes),
    Own,
    None(String),
}

/// A file, and whether it was given by its own name instead of its folder's.
pub type Listed = (PathBuf, bool);

impl Groups {
    /// Opens all files. Errors: one that was given by its own name cannot be read.
    pub fn of(files: &[Listed], wanted: &Wanted<'_>, opened: &InputFiles) -> Result<Self, Question> {
        let kinds: Vec<Result<Kind, Question>> = files.par_iter().map(|file| kind(file, wanted, opened)).collect();
        let mut groups = Self::default();
        for ((path, _), kind) in files.iter().zip(kinds) {
            match kind? {
                Kind::Recording(layout, lacks, axes) => groups.add(path, layout, lacks, axes),
                Kind::Own => groups.own.push(path.clone()),
                Kind::None(why) => groups.skipped.push((path.clone(), why)),
            }
        }
        Ok(groups)
    }

    fn add(&mut self, path: &Path, layout: Layout, lacks: Vec<String>, axes: Axes) {
        let ending = path.extension().unwrap_or_default().to_string_lossy().into_owned();
        let same = |group: &&mut Group| group.ending == ending && group.layout.is(&layout);
        match self.all.iter_mut().find(same) {
            Some(group) => group.files.push(path.to_owned()),
            None => {
                let files = vec![path.to_owned()];
                self.all.push(Group { files, ending, layout, lacks, axes });
            }
        }
    }

    /// The number of the group to take: the largest that has the channels and the rate that the user names; of equals
    /// the first.
    pub fn best(&self, rate_hz: Option<f64>) -> Option<usize> {
        let has_rate = |group: &Group| rate_hz.is_some_and(|rate| group.is_at(rate));
        let rank = |&number: &usize| {
            self.all.get(number).map(|group| (group.lacks.is_empty(), has_rate(group), group.files.len()))
        };
        (0..self.all.len()).rev().max_by_key(rank)
    }
}

impl Group {
    /// The rate that its files state.
    pub fn rate_hz(&self) -> Option<f64> {
        match &self.layout {
            Layout::Responses => None,
            Layout::Signals(signals) => signals.iter().find_map(|signal| signal.rate_hz),
        }
    }

    fn is_at(&self, rate_hz: f64) -> bool {
        self.rate_hz().is_some_and(|rate| rates_agree(rate, rate_hz, 0.0))
    }

    /// How many files, at which rate, of what.
    pub fn said(&self) -> String {
        const MOST: usize = 6;
        let files = if self.files.len() == 1 { "1 file".to_owned() } else { format!("{} files", self.files.len()) };
        let Layout::Signals(signals) = &self.layout else { return format!("{files} with frequency responses") };
        let rate = match (self.rate_hz(), self.axes.mean_rate_hz) {
            (Some(rate), _) => format!("at {} Hz", number(rate)),
            (None, Some(rate)) => format!("with uneven times, {} Hz on average", number(rate)),
            (None, None) => "without a rate".to_owned(),
        };
        let mut names: Vec<&str> = signals.iter().take(MOST).map(|signal| signal.name.as_str()).collect();
        names.extend((signals.len() > MOST).then_some("..."));
        match names.is_empty() {
            true => format!("{files} {rate}"),
            false => format!("{files} {rate} ({})", names.join(", ")),
        }
    }
}

impl Layout {
    fn is(&self, other: &Self) -> bool {
        let rates = |a: Option<f64>, b: Option<f64>| match (a, b) {
            (Some(a), Some(b)) => rates_agree(a, b, 0.0),
            (a, b) => a.is_none() && b.is_none(),
        };
        let alike = |a: &Signal, b: &Signal| a.name == b.name && a.unit == b.unit && rates(a.rate_hz, b.rate_hz);
        match (self, other) {
            (Self::Responses, Self::Responses) => true,
            (Self::Signals(own), Self::Signals(others)) => {
                own.len() == others.len() && own.iter().zip(others).all(|(a, b)| alike(a, b))
            }
            _ => false,
        }
    }

    /// What matters of a file's channels: those that the user named, or all but the piezo monitor, which a record may
    /// lack; and the named ones that it lacks.
    fn of(contents: &Contents, wanted: &Wanted<'_>) -> (Self, Vec<String>) {
        let guessed = wanted.goal == Some(Goal::Frf) && wanted.inputs.is_empty();
        if holds_responses(contents, guessed) {
            return (Self::Responses, Vec::new());
        }
        let signals: Vec<&FoundChannel> = contents.channels.iter().filter(|channel| !channel.is_axis).collect();
        let has = |name: &&String| !signals.iter().any(|channel| same_name(&channel.location, name));
        let lacks = wanted.channels.iter().chain(wanted.inputs).filter(has).cloned().collect();
        let matters = |channel: &&&FoundChannel| {
            let named = |names: &[String]| names.iter().any(|name| same_name(&channel.location, name));
            let other_input = wanted.inputs.is_empty() && wanted.goal != Some(Goal::Decay);
            match wanted.channels {
                [] => !channel.location.to_lowercase().contains("piezo"),
                names => {
                    named(names) || named(wanted.inputs) || (other_input && is_input(&channel.location, &channel.unit))
                }
            }
        };
        let mut found: Vec<Signal> = Vec::new();
        for channel in signals.iter().filter(matters) {
            let name = numbers_aside(&channel.location);
            if !found.iter().any(|known| known.name == name) {
                found.push(Signal { name, unit: channel.unit.clone(), rate_hz: channel.sample_rate_hz });
            }
        }
        (Self::Signals(found), lacks)
    }
}

/// A location with `#` for each part of it that is a number: curves of a map are alike.
fn numbers_aside(location: &str) -> String {
    let number = |part: &str| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit());
    location.split('/').map(|part| if number(part) { "#" } else { part }).collect::<Vec<_>>().join("/")
}

/// What a file is. Errors: it was given by its own name and cannot be read.
fn kind((path, given): &Listed, wanted: &Wanted<'_>, files: &InputFiles) -> Result<Kind, Question> {
    if matches!(files.is_result(path), Ok(true)) {
        return Ok(Kind::Own);
    }
    let opened = match open_unpacked(files, path, &Reading::of("auto", None).resampled(wanted.resample)) {
        Ok(opened) => opened,
        Err(error) if *given => return Err((format!("{}: {}", path.display(), error.problem), error.help)),
        Err(error) if recognised(path) => return Ok(Kind::None(error.problem)),
        Err(_) => {
            let closed = std::fs::File::open(path).err().map(|error| format!("cannot be read: {error}"));
            return Ok(Kind::None(closed.unwrap_or_else(|| "of no format that is known".to_owned())));
        }
    };
    let contents = &opened.contents;
    let longest = contents.channels.iter().map(|channel| channel.samples).max().unwrap_or_default();
    if !given && longest < LEAST_SAMPLES && contents.responses.is_empty() {
        return Ok(Kind::None(format!("no channel of {LEAST_SAMPLES} samples")));
    }
    let (layout, lacks) = Layout::of(contents, wanted);
    let mut channels = contents.channels.iter().filter(|channel| !channel.is_axis);
    let mean_rate_hz = channels.find_map(|channel| mean_rate(&contents.channels, channel)).map(|(rate, _)| rate);
    let axes = Axes { any: contents.channels.iter().any(|channel| channel.is_axis), mean_rate_hz };
    Ok(Kind::Recording(layout, lacks, axes))
}
