//! What a plugin would run: its command, its folder, and the files that these name.

use std::collections::BTreeMap;
use std::os::unix::ffi::OsStrExt;
use std::path::{Path, PathBuf};

use crate::plugin::error::PluginError;
use crate::plugin::launch::Launch;
use crate::recording::InputFiles;

/// What a plugin would run, with the hashes of the files that its command names: what consent is given for, and what
/// belongs to a cache key.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Candidate {
    pub(in crate::plugin) launch: Launch,
    files: Vec<MadeOf>,
}

/// A file that a command names: the program, or an argument.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct MadeOf {
    /// Where it lies.
    pub path: PathBuf,
    /// BLAKE3 hash in hexadecimal.
    pub blake3: String,
}

impl Candidate {
    /// Hashes the program and the files among its arguments. Errors: one cannot be read.
    pub(in crate::plugin) fn new(launch: Launch, hashes: &InputFiles) -> Result<Self, PluginError> {
        let mut paths = vec![launch.program.clone()];
        for path in launch.arguments.iter().filter_map(|argument| named(&launch.folder, argument)) {
            if path.is_dir() {
                files_below(&path, &mut paths)?;
            } else {
                paths.push(path);
            }
        }
        let files = paths.into_iter().map(|path| hashed(path, hashes)).collect::<Result<_, _>>()?;
        Ok(Self { files, launch })
    }

    /// The name that configs call it by: NAME of `exec:NAME`.
    pub fn name(&self) -> &str {
        &self.launch.name
    }

    /// The program.
    pub fn program(&self) -> &Path {
        &self.launch.program
    }

    /// Its arguments.
    pub fn arguments(&self) -> &[String] {
        &self.launch.arguments
    }

    /// The variables that the config adds to its environment.
    pub fn environment(&self) -> &BTreeMap<String, String> {
        &self.launch.environment
    }

    /// The folder that it runs in.
    pub fn folder(&self) -> &Path {
        &self.launch.folder
    }

    /// Whether it may write to its own temporary folder alone, and use no TCP, where the system enforces that.
    pub fn is_confined(&self) -> bool {
        self.launch.confined
    }

    /// The program, then the files among its arguments.
    pub fn files(&self) -> &[MadeOf] {
        &self.files
    }

    /// One hash of folder, command, environment and files: whatever of them changes, it is another one. Its name and
    /// its time limit are none of it.
    pub fn seal(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        let mut part = |bytes: &[u8]| {
            hasher.update(&(bytes.len() as u64).to_le_bytes()).update(bytes);
        };
        part(b"afmid plugin 1");
        part(self.folder().as_os_str().as_bytes());
        part(self.program().as_os_str().as_bytes());
        part(&(self.arguments().len() as u64).to_le_bytes());
        self.arguments().iter().for_each(|argument| part(argument.as_bytes()));
        part(&(self.environment().len() as u64).to_le_bytes());
        for (name, value) in self.environment() {
            part(name.as_bytes());
            part(value.as_bytes());
        }
        part(&[u8::from(self.is_confined())]);
        for file in &self.files {
            part(file.path.as_os_str().as_bytes());
            part(file.blake3.as_bytes());
        }
        hasher.finalize().to_hex().to_string()
    }

    /// Its command and folder in a line, for messages.
    pub(in crate::plugin) fn would_run(&self) -> String {
        let variables = self.environment().iter().map(|(name, value)| format!("{name}={value}"));
        let words = variables.chain([self.program().display().to_string()]).chain(self.arguments().iter().cloned());
        // a word with spaces or control characters must not look like others
        let word = |word: String| if word.chars().all(plain) && !word.is_empty() { word } else { format!("{word:?}") };
        format!("it would run `{}` in {}", words.map(word).collect::<Vec<_>>().join(" "), self.folder().display())
    }

    /// What of it belongs to a cache key: every argument, the variables, and the files by name and bytes. Folders do
    /// not: a plugin that was moved with its config is the same.
    pub(in crate::plugin) fn key_parts(&self) -> Vec<String> {
        let name = |path: &Path| path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        let files = self.files.iter().map(|file| format!("{} blake3:{}", name(&file.path), file.blake3));
        let arguments = self.arguments().iter().map(|argument| format!("argument {argument}"));
        let variables = self.environment().iter().map(|(name, value)| format!("environment {name}={value}"));
        files.chain(arguments).chain(variables).collect()
    }

    /// Sees whether the files are still those that it was made from. Errors: one has changed, or cannot be read.
    pub(in crate::plugin) fn check_unchanged(&self, hashes: &InputFiles) -> Result<(), PluginError> {
        if Self::new(self.launch.clone(), hashes)?.files == self.files {
            return Ok(());
        }
        let help = "run again: its results belong to the files that it had at the start of the run";
        Err(PluginError::new("was changed during the run", help))
    }
}

fn plain(c: char) -> bool {
    c.is_alphanumeric() || "/._-+,:@%=".contains(c)
}

/// The file that an argument names, as it is or after its `=`, or the folder that Python would run: one with a
/// `__main__.py`.
fn named(folder: &Path, argument: &str) -> Option<PathBuf> {
    let value = argument.split_once('=').map(|(_, value)| value);
    let names = std::iter::once(argument).chain(value).filter(|name| !name.is_empty());
    names.map(|name| folder.join(name)).find(|path| path.is_file() || path.join("__main__.py").is_file())
}

/// Files of a plugin's folder: more is no program.
const MOST_FILES: usize = 1000;

/// The files of a folder that is run, by name, but for what the interpreter keeps there. Errors: too many; one cannot
/// be listed.
fn files_below(folder: &Path, into: &mut Vec<PathBuf>) -> Result<(), PluginError> {
    let failed = |error: std::io::Error| {
        PluginError::new(
            format!("names the folder {}, which cannot be listed: {error}", folder.display()),
            "its files are part of the cache key, and of what is agreed to",
        )
    };
    let mut entries = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(failed)? {
        entries.push(entry.map_err(failed)?);
    }
    entries.sort_by_key(std::fs::DirEntry::file_name);
    for entry in entries {
        let (path, kind) = (entry.path(), entry.file_type().map_err(failed)?);
        if kind.is_dir() && entry.file_name() != "__pycache__" {
            files_below(&path, into)?;
        } else if path.is_file() {
            into.push(path);
        }
        if into.len() > MOST_FILES {
            let what = format!("names a folder of more than {MOST_FILES} files, {}", folder.display());
            return Err(PluginError::new(what, "keep its data elsewhere"));
        }
    }
    Ok(())
}

fn hashed(path: PathBuf, hashes: &InputFiles) -> Result<MadeOf, PluginError> {
    let blake3 = hashes.hash(&path).map_err(|error| {
        PluginError::new(
            format!("cannot be read: {error}"),
            "its bytes are part of the cache key, and of what is agreed to",
        )
    })?;
    Ok(MadeOf { path, blake3 })
}
