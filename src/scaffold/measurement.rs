//! Input and output of one measurement in files of their own.

use std::path::{Path, PathBuf};

use afmid_pipeline::recording::{FoundChannel, InputFiles, Measurement, Reading, put_together};

use super::channels::{same_name, some_of, usable};
use super::choice::Question;
use super::pipeline::Wanted;
use super::recordings::Source;
use crate::cli::Goal;
use crate::inspect::{Channel, Outcome, inspect};

/// Files of one measurement, and which of their channels are what.
#[derive(Debug)]
pub struct JoinedFiles {
    pub source: Source,
    /// As `FILE:CHANNEL`.
    pub inputs: Vec<String>,
    pub outputs: Vec<String>,
    /// Of an axis in its loop, what the output is to follow.
    pub reference: Option<String>,
    /// What was done to put them together.
    pub notes: Vec<String>,
}

/// The files as one measurement, where `--input` names one of them; else none.
///
/// Errors: what is not known, and how to say it; clocks that do not agree.
pub fn joined_files(paths: &[PathBuf], wanted: &Wanted<'_>) -> Result<Option<JoinedFiles>, Question> {
    let named_file = wanted.inputs.iter().any(|input| paths.iter().any(|path| of_file(path, input).is_some()));
    if !named_file || paths.len() < 2 {
        return Ok(None);
    }
    if let Some(folder) = paths.iter().find(|path| path.is_dir()) {
        let problem = format!("{} is a folder, wanted the files of one measurement", folder.display());
        return Err((problem, Some("name each file: --input says which of them is the input".to_owned())));
    }
    if wanted.records_are.is_some() {
        let help = "leave --as out, or --input with a file's name".to_owned();
        return Err(("--as is for several measurements, these files are one".to_owned(), Some(help)));
    }
    if !matches!(wanted.goal, None | Some(Goal::InputOutput | Goal::Frf | Goal::Modes | Goal::Diagnosis)) {
        let help = "wanted --goal input-output, frf or diagnosis, or none".to_owned();
        return Err(("that goal takes no measured input in a file of its own".to_owned(), Some(help)));
    }
    let files = Files::open(paths, wanted.resample)?;
    let inputs = files.inputs(wanted)?;
    let reference = wanted.reference.map(|name| files.named("--reference", name)).transpose()?;
    let driving: Vec<&Channel> = inputs.iter().copied().chain(reference).collect();
    let outputs = files.outputs(wanted, &driving)?;
    let of = |channel: &&Channel| {
        let mut all = files.opened.contents().channels.iter();
        all.find(|found| found.location == channel.location)
    };
    let chosen: Vec<&FoundChannel> = driving.iter().chain(&outputs).filter_map(of).collect();
    let (_, notes) = put_together(&chosen, wanted.rate_hz.is_some()).map_err(|error| (error.problem, error.help))?;
    let locations = |all: &[&Channel]| all.iter().map(|channel| channel.location.clone()).collect();
    let (inputs, outputs) = (locations(&inputs), locations(&outputs));
    let reference = reference.map(|channel| channel.location.clone());
    Ok(Some(JoinedFiles { source: files.source(), inputs, outputs, reference, notes }))
}

/// What is behind a file's path or name in what the user names: nothing, or a channel; none if it is not that file.
fn of_file<'a>(path: &Path, named: &'a str) -> Option<&'a str> {
    let (whole, name) = (path.to_string_lossy(), path.file_name().unwrap_or_default().to_string_lossy());
    let behind = |start: &str| match named.strip_prefix(start)? {
        "" => Some(""),
        rest => rest.strip_prefix(':'),
    };
    behind(&whole).or_else(|| behind(&name))
}

struct Files<'a> {
    paths: &'a [PathBuf],
    /// What was opened: a file is parsed once.
    files: InputFiles,
    opened: Measurement,
    /// Of each file, as `FILE:CHANNEL`.
    channels: Vec<Vec<Channel>>,
    remarks: Vec<String>,
    resample: bool,
}

impl<'a> Files<'a> {
    fn open(paths: &'a [PathBuf], resample: bool) -> Result<Self, Question> {
        let files = InputFiles::new();
        let opened = Measurement::open(&files, paths, &Reading::of("auto", None).resampled(resample));
        let opened = opened.map_err(|error| (error.to_string(), error.help.clone()))?;
        let mut names = opened.contents().channels.iter().map(|channel| channel.location.clone());
        let mut channels = Vec::new();
        for path in paths {
            let holdings = match inspect(path, &files, resample).outcome {
                Outcome::Read(holdings) => holdings,
                Outcome::Own => return Err((format!("{} is a result of afmid's", path.display()), None)),
                Outcome::Refused { problem, help, .. } => return Err((format!("{}: {problem}", path.display()), help)),
            };
            let named = holdings.channels.into_iter().zip(names.by_ref());
            channels.push(named.map(|(channel, location)| Channel { location, ..channel }).collect());
        }
        let remarks = opened.contents().remarks.clone();
        Ok(Self { paths, files, opened, channels, remarks, resample })
    }

    /// The channel that is meant: `FILE:CHANNEL`, a file with one signal, or a channel that one file has.
    fn named(&self, flag: &str, name: &str) -> Result<&Channel, Question> {
        let each = || self.paths.iter().zip(&self.channels);
        let behind = |channel: &Channel| channel.location.split_once(':').map_or("", |(_, own)| own).to_owned();
        let (what, found): (String, Vec<&Channel>) =
            match each().find_map(|(path, all)| Some((all, of_file(path, name)?))) {
                Some((all, "")) => (name.to_owned(), all.iter().filter(|channel| is_signal(channel)).collect()),
                Some((all, own)) => (name.to_owned(), all.iter().filter(|one| same_name(&behind(one), own)).collect()),
                None => {
                    let all = self.channels.iter().flatten();
                    (format!("the channel {name}"), all.filter(|one| same_name(&behind(one), name)).collect())
                }
            };
        let locations = |all: &[&Channel]| some_of(&all.iter().map(|one| one.location.as_str()).collect::<Vec<_>>());
        match found[..] {
            [only] => Ok(only),
            [] => {
                let all: Vec<&Channel> = self.channels.iter().flatten().filter(|one| !one.is_axis).collect();
                Err((
                    format!("{flag} {name}: none of the files has it"),
                    Some(format!("they have {}", locations(&all))),
                ))
            }
            _ => Err((
                format!("{flag} {name}: {what} may be {}", locations(&found)),
                Some(format!("say which one with {flag} FILE:CHANNEL")),
            )),
        }
    }

    fn inputs(&self, wanted: &Wanted<'_>) -> Result<Vec<&Channel>, Question> {
        wanted.inputs.iter().map(|name| self.named("--input", name)).collect()
    }

    /// As they were named, else all signals of the files that no input is of. Errors: there is none; they have several
    /// units.
    fn outputs(&self, wanted: &Wanted<'_>, inputs: &[&Channel]) -> Result<Vec<&Channel>, Question> {
        if !wanted.channels.is_empty() {
            return wanted.channels.iter().map(|name| self.named("--channel", name)).collect();
        }
        let mut outputs: Vec<&Channel> = Vec::new();
        for (path, all) in self.paths.iter().zip(&self.channels) {
            let is_input = |channel: &Channel| inputs.iter().any(|input| input.location == channel.location);
            if all.iter().any(is_input) {
                continue;
            }
            let before = outputs.len();
            outputs.extend(all.iter().filter(usable));
            if outputs.len() == before {
                let help = "leave it out, or name its signal with --channel".to_owned();
                return Err((format!("{}: no channel of it is a signal", path.display()), Some(help)));
            }
        }
        let first = outputs.first().ok_or_else(|| {
            let help = "give the file of the output as well, or name the output with --channel FILE:CHANNEL".to_owned();
            ("each file holds an input, no file is left for the output".to_owned(), Some(help))
        })?;
        match outputs.iter().find(|other| other.unit != first.unit) {
            None => Ok(outputs),
            Some(other) => {
                let problem = format!(
                    "{} is in «{}», {} in «{}»: wanted outputs of one unit",
                    first.location, first.unit, other.location, other.unit
                );
                Err((problem, Some("name the outputs with --channel FILE:CHANNEL".to_owned())))
            }
        }
    }

    fn source(self) -> Source {
        let file = self.paths.first().cloned().unwrap_or_default();
        Source {
            patterns: vec![file.clone()],
            format: self.opened.contents().format.clone(),
            channels: self.channels.into_iter().flatten().collect(),
            best: None,
            reason: String::new(),
            remarks: self.remarks,
            files: vec![file.clone()],
            joined: self.paths.get(1..).unwrap_or_default().to_vec(),
            resample: self.resample,
            rate_hz: None,
            others: Vec::new(),
            skipped: Vec::new(),
            opened: self.files,
            file,
        }
    }
}

/// Whether a channel varies: inputs may have two levels.
fn is_signal(channel: &Channel) -> bool {
    !channel.is_axis && channel.values.as_ref().is_none_or(|values| values.least < values.largest)
}

#[cfg(test)]
#[test]
fn a_file_is_meant_by_its_path_or_name_and_a_channel_behind_a_colon() {
    let of = |named| of_file(Path::new("in/u.csv"), named);
    assert_eq!((of("in/u.csv"), of("u.csv"), of("u.csv:a:b")), (Some(""), Some(""), Some("a:b")));
    assert_eq!((of("u.csv2"), of("u"), of("out/u.csv")), (None, None, None));
}
