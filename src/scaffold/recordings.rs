//! What a new config must state of recordings.

use std::path::{Path, PathBuf};

use afmid_pipeline::recording::InputFiles;

use super::choice::Question;
use super::groups::{Group, Groups, Listed};
use super::pipeline::Wanted;
use crate::inspect::{Channel, Outcome, files_of, inspect};

/// Recordings of one kind, by one of them.
#[derive(Debug)]
pub struct Source {
    /// The patterns that find them, as they were given.
    pub patterns: Vec<PathBuf>,
    /// The file that was looked at.
    pub file: PathBuf,
    /// Its format, for people.
    pub format: String,
    /// All its channels.
    pub channels: Vec<Channel>,
    /// Which of them can best carry a ringdown, and why (not).
    pub best: Option<usize>,
    pub reason: String,
    /// What its reader remarked.
    pub remarks: Vec<String>,
    /// All files of that kind, in the order in which they were given.
    pub files: Vec<PathBuf>,
    /// Further files of the measurement in the first one, where input and output are in files of their own.
    pub joined: Vec<PathBuf>,
    /// Whether channels whose clock wanders are put on an even grid.
    pub resample: bool,
    /// The rate that they share, where they state one and others were given with them.
    pub rate_hz: Option<f64>,
    /// Recordings of other kinds, which are left out.
    pub others: Vec<Group>,
    /// What is no recording, and why.
    pub skipped: Vec<(PathBuf, String)>,
    /// What was opened: a file is parsed once.
    pub opened: InputFiles,
}

impl Source {
    /// The first file's name, and those that are joined to it.
    pub fn name(&self) -> String {
        let name = |path: &PathBuf| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        [&self.file].into_iter().chain(&self.joined).map(name).collect::<Vec<_>>().join(", ")
    }

    /// How many files there are.
    pub fn count(&self) -> usize {
        self.files.len() + self.joined.len()
    }
}

/// Looks at the recordings: of files of several kinds at the first file of the kind that most are of.
///
/// Errors: what cannot be used, and what to do.
pub fn look(paths: &[PathBuf], wanted: &Wanted<'_>) -> Result<Source, Question> {
    let listed = listed(paths)?;
    if let [(only, true)] = &listed[..] {
        let one = vec![only.clone()];
        return source(InputFiles::new(), Groups::default(), one.clone(), one, None, wanted.resample);
    }
    let opened = InputFiles::new();
    let mut groups = Groups::of(&listed, wanted, &opened)?;
    let Some(number) = groups.best(wanted.rate_hz) else { return Err(none(paths, &groups)) };
    let chosen = groups.all.remove(number);
    groups.all.sort_by_key(|group| std::cmp::Reverse(group.files.len()));
    let (rate_hz, files) = (chosen.rate_hz(), chosen.files);
    let patterns = paths.iter().flat_map(|path| patterns(path, &files, &groups.own)).collect();
    source(opened, groups, files, patterns, rate_hz, wanted.resample)
}

/// All files. Errors: a path that is not there, a folder without files.
fn listed(paths: &[PathBuf]) -> Result<Vec<Listed>, Question> {
    let mut files = Vec::new();
    for path in paths {
        if path.is_dir() {
            let cannot = |error: std::io::Error| (format!("{} cannot be listed: {error}", path.display()), None);
            let found = files_of(path).map_err(cannot)?;
            if found.is_empty() {
                let help = "give the folder that holds the files themselves".to_owned();
                return Err((format!("{} holds no files", path.display()), Some(help)));
            }
            files.extend(found.into_iter().map(|file| (file, false)));
        } else if path.exists() {
            files.push((path.clone(), true));
        } else {
            let help = "give the folder of the recordings, or the files".to_owned();
            return Err((format!("there is no file or folder {}", path.display()), Some(help)));
        }
    }
    Ok(files)
}

/// That there is no recording among the files, with the first reasons.
fn none(paths: &[PathBuf], groups: &Groups) -> Question {
    const MOST: usize = 5;
    let reason =
        |(path, why): &(PathBuf, String)| format!("{}: {why}", path.file_name().unwrap_or_default().to_string_lossy());
    let own = (!groups.own.is_empty()).then(|| format!("{} are results of afmid's", groups.own.len()));
    let reasons: Vec<String> = groups.skipped.iter().take(MOST).map(reason).chain(own).collect();
    let names: Vec<String> = paths.iter().take(MOST).map(|path| path.display().to_string()).collect();
    let known = groups.skipped.first().and_then(|(path, _)| match inspect(path, &InputFiles::new(), false).outcome {
        Outcome::Refused { help, .. } => help,
        _ => None,
    });
    let help = known.unwrap_or_else(|| "give the folder that holds the recordings, or the files".to_owned());
    (format!("there are no recordings in {} ({})", names.join(", "), reasons.join("; ")), Some(help))
}

/// What finds those of the files that lie at a path: of a folder a pattern, or their names where others share the
/// ending.
fn patterns(path: &Path, files: &[PathBuf], own: &[PathBuf]) -> Vec<PathBuf> {
    if !path.is_dir() {
        return files.iter().filter(|file| *file == path).take(1).cloned().collect();
    }
    let here: Vec<PathBuf> = files.iter().filter(|file| file.parent() == Some(path)).cloned().collect();
    let Some(ending) = here.first().and_then(|file| file.extension()) else { return here };
    let alike = files_of(path).unwrap_or_default().into_iter().filter(|file| file.extension() == Some(ending));
    match alike.into_iter().all(|file| here.contains(&file) || own.contains(&file)) {
        true => vec![path.join(format!("*.{}", ending.to_string_lossy()))],
        false => here,
    }
}

fn source(
    opened: InputFiles,
    groups: Groups,
    files: Vec<PathBuf>,
    patterns: Vec<PathBuf>,
    rate_hz: Option<f64>,
    resample: bool,
) -> Result<Source, Question> {
    let first = files.first().cloned().ok_or_else(|| ("there are no recordings".to_owned(), None))?;
    let inspected = inspect(&first, &opened, resample);
    match inspected.outcome {
        Outcome::Read(holdings) => Ok(Source {
            patterns,
            format: holdings.format,
            best: holdings.ringdown.channel,
            reason: holdings.ringdown.reason,
            remarks: holdings.remarks,
            channels: holdings.channels,
            files,
            joined: Vec::new(),
            resample,
            rate_hz,
            others: groups.all,
            skipped: groups.skipped,
            opened,
            file: first,
        }),
        Outcome::Own => Err((
            format!("{} is a result of afmid's, no recording", first.display()),
            Some("give the folder of the recordings".to_owned()),
        )),
        Outcome::Refused { problem, help, .. } => Err((format!("{}: {problem}", first.display()), help)),
    }
}
