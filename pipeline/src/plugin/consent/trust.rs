//! What was agreed to, and what the plugins said of themselves then: a folder of the user's, with a file per plugin.

use std::collections::BTreeMap;
use std::fs;
use std::io::Read;
use std::os::unix::fs::DirBuilderExt;
use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use super::Candidate;
use crate::error::StoreError;
use crate::files::{open_regular, replace_with};
use crate::plugin::message::Introduction;

/// Begins every file; another layout gets another number.
const TITLE: &str = "afmid consent 1";

/// The largest file that is read: a description has at most 16 MiB.
const MOST_BYTES: u64 = 64 << 20;

/// The folder of what a user agreed to. It must be none that comes with what others send: neither a project's nor the
/// cache.
///
/// A file lies under its plugin's seal ([`Candidate::seal`]) and ends with the hash of its own text: one that is
/// damaged, renamed or cut short is no consent.
#[derive(Debug, Clone)]
pub struct Trust {
    folder: PathBuf,
}

/// A plugin that was agreed to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trusted {
    /// See [`Candidate::seal`].
    pub seal: String,
    /// The name that its config called it by.
    pub name: String,
    /// The program.
    pub program: String,
    /// Its arguments.
    pub arguments: Vec<String>,
    /// The variables that the config adds to its environment.
    pub environment: BTreeMap<String, String>,
    /// The folder that it runs in.
    pub folder: String,
    /// See [`Candidate::is_confined`].
    pub confined: bool,
    /// BLAKE3 hashes of the files, by path.
    pub files: BTreeMap<String, String>,
    /// When (UTC, ISO 8601).
    pub agreed_at: String,
    /// What it said of itself.
    pub(in crate::plugin) introduction: Introduction,
}

impl Trusted {
    /// The plugin's own name and version.
    pub fn identity(&self) -> (&str, &str) {
        (&self.introduction.handshake.name, &self.introduction.handshake.version)
    }
}

impl Trust {
    /// What was agreed to in `folder`, which is made when something is.
    pub fn at(folder: &Path) -> Self {
        Self { folder: folder.to_owned() }
    }

    /// Where it lies.
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// What was agreed to under a seal; none if the file is missing or damaged.
    pub fn find(&self, seal: &str) -> Option<Trusted> {
        let file = open_regular(&self.place(seal)?).ok()?;
        let mut text = String::new();
        file.take(MOST_BYTES).read_to_string(&mut text).ok()?;
        let (body, hash) = text.strip_suffix('\n')?.rsplit_once('\n')?;
        if blake3::hash(body.as_bytes()).to_hex().as_str() != hash {
            return None;
        }
        let entry = body.strip_prefix(TITLE)?.strip_prefix('\n')?;
        serde_json::from_str(entry).ok().filter(|trusted: &Trusted| trusted.seal == seal)
    }

    /// All that was agreed to, by name and folder. What is damaged is left out.
    pub fn list(&self) -> Vec<Trusted> {
        let names = fs::read_dir(&self.folder).into_iter().flatten().flatten().map(|entry| entry.file_name());
        let mut all: Vec<Trusted> = names.filter_map(|name| self.find(name.to_str()?)).collect();
        all.sort_by(|a, b| (&a.name, &a.folder, &a.seal).cmp(&(&b.name, &b.folder, &b.seal)));
        all
    }

    /// Takes consent back: whether there was any. Errors: the file cannot be removed.
    pub fn revoke(&self, seal: &str) -> Result<bool, StoreError> {
        let Some(place) = self.place(seal) else { return Ok(false) };
        match fs::remove_file(&place) {
            Ok(()) => Ok(true),
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Ok(false),
            Err(error) => Err(StoreError::io("cannot be removed", &place, &error)),
        }
    }

    /// Remembers consent and description. Errors: the folder cannot be made or written.
    pub(in crate::plugin) fn remember(
        &self,
        candidate: &Candidate,
        introduction: &Introduction,
    ) -> Result<(), StoreError> {
        let path = |path: &Path| path.display().to_string();
        let seal = candidate.seal();
        let trusted = Trusted {
            seal: seal.clone(),
            name: candidate.name().to_owned(),
            program: path(candidate.program()),
            arguments: candidate.arguments().to_vec(),
            environment: candidate.environment().clone(),
            folder: path(candidate.folder()),
            confined: candidate.is_confined(),
            files: candidate.files().iter().map(|file| (path(&file.path), file.blake3.clone())).collect(),
            agreed_at: jiff::Timestamp::now().strftime("%Y-%m-%dT%H:%M:%SZ").to_string(),
            introduction: introduction.clone(),
        };
        let entry = serde_json::to_string(&trusted).map_err(|error| StoreError::new(error.to_string()))?;
        let body = format!("{TITLE}\n{entry}");
        let text = format!("{body}\n{}\n", blake3::hash(body.as_bytes()).to_hex());
        fs::DirBuilder::new()
            .recursive(true)
            .mode(0o700)
            .create(&self.folder)
            .map_err(|error| StoreError::io("the folder of consent cannot be made", &self.folder, &error))?;
        replace_with(&self.folder.join(&seal), |temporary| fs::write(temporary, &text))
    }

    fn place(&self, seal: &str) -> Option<PathBuf> {
        is_seal(seal).then(|| self.folder.join(seal))
    }
}

/// Whether a text can be a seal: 64 hexadecimal digits.
pub fn is_seal(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}
