//! What a new config must state of recordings.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

use afmid_pipeline::recording::recognised;
use afmid_stages::io::natural_order;

use super::choice::Question;
use crate::inspect::{Channel, Outcome, inspect};

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
    /// How many files there are of that kind.
    pub files: usize,
}

impl Source {
    /// The first file's name.
    pub fn name(&self) -> String {
        self.file.file_name().unwrap_or_default().to_string_lossy().into_owned()
    }
}

/// Looks at the recordings: of a folder at the first file of the kind that most of its files are of.
///
/// Errors: what cannot be used, and what to do.
pub fn look(paths: &[PathBuf]) -> Result<Source, Question> {
    let mut patterns = Vec::new();
    let mut files: Vec<PathBuf> = Vec::new();
    for path in paths {
        if path.is_dir() {
            let (pattern, found) = kind(path)?;
            patterns.extend(pattern);
            files.extend(found);
        } else if path.exists() {
            patterns.push(path.clone());
            files.push(path.clone());
        } else {
            let help = "give the folder of the recordings, or the files".to_owned();
            return Err((format!("there is no file or folder {}", path.display()), Some(help)));
        }
    }
    let first = files.first().cloned().ok_or_else(|| ("there are no recordings".to_owned(), None))?;
    let inspected = inspect(&first);
    match inspected.outcome {
        Outcome::Read(holdings) => Ok(Source {
            patterns,
            format: holdings.format,
            best: holdings.ringdown.channel,
            reason: holdings.ringdown.reason,
            remarks: holdings.remarks,
            channels: holdings.channels,
            files: files.len(),
            file: first,
        }),
        Outcome::Own => Err((
            format!("{} is a result of afmid's, no recording", first.display()),
            Some("give the folder of the recordings".to_owned()),
        )),
        Outcome::Refused { problem, help } => Err((format!("{}: {problem}", first.display()), help)),
    }
}

/// The files of a folder that share the commonest ending, in natural order, and what finds them: a pattern, or their
/// names where others share the ending.
fn kind(folder: &Path) -> Result<(Vec<PathBuf>, Vec<PathBuf>), Question> {
    let cannot = |error: std::io::Error| (format!("{} cannot be listed: {error}", folder.display()), None);
    let mut by_ending: BTreeMap<String, Vec<(String, PathBuf)>> = BTreeMap::new();
    for entry in std::fs::read_dir(folder).map_err(cannot)? {
        let entry = entry.map_err(cannot)?;
        let (name, path) = (entry.file_name().to_string_lossy().into_owned(), entry.path());
        if !name.starts_with('.') && path.is_file() {
            let ending = path.extension().map(|ending| ending.to_string_lossy().into_owned()).unwrap_or_default();
            by_ending.entry(ending).or_default().push((name, path));
        }
    }
    // of equally many the first ending of the alphabet
    let commonest = by_ending.into_iter().rev().max_by_key(|(_, files)| files.len());
    let Some((ending, mut files)) = commonest else {
        let help = "give the folder that holds the files themselves".to_owned();
        return Err((format!("{} holds no files", folder.display()), Some(help)));
    };
    files.sort_by(|a, b| natural_order(&a.0, &b.0));
    let all: Vec<PathBuf> = files.into_iter().map(|(_, path)| path).collect();
    // what was written about recordings lies beside them
    let readable: Vec<PathBuf> = all.iter().filter(|path| recognised(path)).cloned().collect();
    if !readable.is_empty() && readable.len() < all.len() {
        return Ok((readable.clone(), readable));
    }
    let pattern = if ending.is_empty() { "*".to_owned() } else { format!("*.{ending}") };
    Ok((vec![folder.join(pattern)], all))
}
