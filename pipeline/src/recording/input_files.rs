//! The files that a program reads: what they hash to, and which of them are open.

use std::collections::HashMap;
use std::fs::File;
use std::io::{Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};

use super::chunk_cache::ChunkCache;
use super::opened_files::OpenedFiles;
use crate::error::StageError;
use crate::files::{FileState, KnownHashes, head, is_result, open_regular, read_regular};
use crate::hdf5_files::{HeapGuard, Refusal, Vetted, finding_text, parse_finding};

/// The files that a program reads. A value that is passed to whatever reads: cloning is cheap, and clones share what
/// they know.
///
/// A file is hashed once per state (device, inode, size, times of modification and change); with a folder also once
/// over several runs. What foreign files were parsed or inflated to is kept up to a bound.
#[derive(Clone, Default)]
pub struct InputFiles(Arc<Inner>);

impl std::fmt::Debug for InputFiles {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("InputFiles")
    }
}

#[derive(Default)]
struct Inner {
    inspected: Mutex<HashMap<PathBuf, (FileState, Inspected)>>,
    earlier: Option<KnownHashes>,
    here: OnceLock<PathBuf>,
    opened: OpenedFiles,
    chunks: ChunkCache,
}

/// What one pass through a file found.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Inspected {
    /// BLAKE3 hash of its bytes, in hexadecimal.
    pub(super) blake3: String,
    /// Whether it is a stage or result file of this program's.
    is_result: bool,
    /// See [`HeapGuard`].
    finding: Result<Vetted, Refusal>,
}

/// An HDF5 file that the library can be let at.
#[derive(Debug, Clone)]
pub(super) struct HashedHdf5 {
    /// BLAKE3 hash of its bytes, in hexadecimal.
    pub(super) blake3: String,
    /// The state in which it was looked through.
    pub(super) state: FileState,
    pub(super) vetted: Vetted,
}

/// A file in the state in which it was hashed.
#[derive(Debug, Clone)]
pub(crate) struct HashedFile {
    path: PathBuf,
    state: FileState,
    /// Whether any later change must show in the state.
    settled: bool,
    /// BLAKE3 hash of its bytes, in hexadecimal.
    pub(crate) blake3: String,
}

impl InputFiles {
    /// Nothing is known, and nothing is kept beyond this value's life.
    pub fn new() -> Self {
        Self::default()
    }

    /// Hashes are kept in `folder` over several runs; those of earlier runs count unless `fresh`.
    pub fn keeping_hashes(folder: &Path, fresh: bool) -> Self {
        Self(Arc::new(Inner { earlier: Some(KnownHashes::new(folder, fresh)), ..Inner::default() }))
    }

    /// BLAKE3 hash of a file's bytes, in hexadecimal. Streams.
    ///
    /// Errors: the file cannot be read, or changes meanwhile.
    pub fn hash(&self, path: &Path) -> Result<String, StageError> {
        self.hashed(path).map(|file| file.blake3)
    }

    /// The same with the state that the file had. Errors: as [`InputFiles::hash`].
    pub(crate) fn hashed(&self, path: &Path) -> Result<HashedFile, StageError> {
        let (state, found) = self.inspect(path)?;
        Ok(HashedFile { path: path.to_owned(), settled: state.is_settled(), state, blake3: found.blake3 })
    }

    /// Whether a file is a stage or result file of this program's, whole or damaged. Errors: it cannot be read.
    pub fn is_result(&self, path: &Path) -> std::io::Result<bool> {
        let known = self.known(&self.absolute(path)?, &FileState::at(path)?);
        if let Some(found) = known {
            return Ok(found.is_result);
        }
        let mut file = open_regular(path)?;
        let head = head(&mut file)?;
        is_result(&mut file, &head)
    }

    /// A whole file, for what is small. The bytes are those that have the file's hash. Errors: as [`InputFiles::hash`].
    pub fn read(&self, path: &Path) -> Result<Vec<u8>, StageError> {
        let wanted = self.hash(path)?;
        let bytes = read_regular(path, u64::MAX).map_err(|error| unreadable(path, &error))?;
        if blake3::hash(&bytes).to_hex().as_str() == wanted { Ok(bytes) } else { Err(changed(path)) }
    }

    /// What one pass through a file that the HDF5 library is to open found, and the state that the file had.
    ///
    /// Errors: as [`InputFiles::hash`]; damage that the library does not survive.
    pub(super) fn inspect_hdf5(&self, path: &Path) -> Result<HashedHdf5, StageError> {
        let (state, inspected) = self.inspect(path)?;
        match inspected.finding {
            Ok(vetted) => Ok(HashedHdf5 { blake3: inspected.blake3, state, vetted }),
            Err(refusal) => Err(StageError::new(refusal.text()).at(path)),
        }
    }

    pub(super) fn opened(&self) -> &OpenedFiles {
        &self.0.opened
    }

    pub(super) fn chunks(&self) -> &ChunkCache {
        &self.0.chunks
    }

    /// The state that the file had, and what one pass through it found. Errors: as [`InputFiles::hash`].
    pub(super) fn inspect(&self, path: &Path) -> Result<(FileState, Inspected), StageError> {
        let fail = |error: std::io::Error| unreadable(path, &error);
        let key = self.absolute(path).map_err(fail)?;
        // not opened while it is known; the code that opens it compares the states again
        let state = FileState::at(path).map_err(fail)?;
        if let Some(found) = self.known(&key, &state) {
            return Ok((state, found));
        }
        let mut file = open_regular(path).map_err(fail)?;
        let state = FileState::of(&file).map_err(fail)?;
        let found = pass(&mut file).map_err(fail)?;
        if FileState::of(&file).map_err(fail)? != state {
            return Err(changed(path));
        }
        // a state that may hide a change is not remembered
        if state.is_settled() {
            if let Some(known) = &self.0.earlier {
                known.keep(&key, &state, &found.line());
            }
            self.inspected().insert(key, (state, found.clone()));
        }
        Ok((state, found))
    }

    /// What is known of a file in this state, from this run or an earlier one.
    fn known(&self, key: &Path, state: &FileState) -> Option<Inspected> {
        if let Some((have, found)) = self.inspected().get(key)
            && have == state
        {
            return Some(found.clone());
        }
        Inspected::parse(&self.0.earlier.as_ref()?.find(key, state)?)
    }

    fn inspected(&self) -> MutexGuard<'_, HashMap<PathBuf, (FileState, Inspected)>> {
        self.0.inspected.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The folder where relative paths begin is asked for once.
    fn absolute(&self, path: &Path) -> std::io::Result<PathBuf> {
        if path.is_absolute() {
            return Ok(path.to_owned());
        }
        if self.0.here.get().is_none() {
            let _ = self.0.here.set(std::env::current_dir()?);
        }
        std::path::absolute(self.0.here.get().map_or_else(|| path.to_owned(), |here| here.join(path)))
    }
}

impl HashedFile {
    /// Where it lies.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// The state in which it was hashed.
    pub(super) fn state(&self) -> FileState {
        self.state
    }

    /// Hash of its bytes.
    pub(super) fn blake3(&self) -> &str {
        &self.blake3
    }

    /// Bytes.
    pub(crate) fn size(&self) -> u64 {
        self.state.size()
    }

    /// Sees whether the file is still the one that was hashed, so that what was read since has this hash. Errors: it
    /// has changed, or is gone.
    ///
    /// The state tells, since programs cannot set back the time of a file's last change; a file that was written
    /// shortly before it was hashed is hashed again.
    pub(crate) fn check_unchanged(&self) -> Result<(), StageError> {
        let now = FileState::at(&self.path)
            .map_err(|error| StageError::new(format!("the file was there, and now: {error}")).at(&self.path))?;
        if now != self.state {
            return Err(changed(&self.path));
        }
        if self.settled {
            return Ok(());
        }
        let again = InputFiles::new().hash(&self.path)?;
        if again == self.blake3 { Ok(()) } else { Err(changed(&self.path)) }
    }
}

/// Errors: the file that lies at a path now is not in the state in which it was opened. Whatever was read by name since
/// was read from the same file.
pub(super) fn require_state(path: &Path, then: &FileState) -> Result<(), StageError> {
    let now = FileState::at(path).map_err(|error| unreadable(path, &error))?;
    require_same(path, &now, then)
}

/// The same of the file that `now` is the state of.
pub(super) fn require_same(path: &Path, now: &FileState, then: &FileState) -> Result<(), StageError> {
    if now == then {
        return Ok(());
    }
    let problem = match (now.size(), then.size()) {
        (now, then) if now != then => format!("the file has {now} bytes, it had {then} when it was opened"),
        _ => "the file was changed since it was opened".to_owned(),
    };
    Err(StageError::new(problem).at(path).help("wait until nothing writes to it, then run again"))
}

fn unreadable(path: &Path, error: &std::io::Error) -> StageError {
    StageError::new(format!("the file cannot be read: {error}")).at(path)
}

fn changed(path: &Path) -> StageError {
    StageError::new("the file was changed while it was read: nothing made from it is kept")
        .at(path)
        .help("run again when nothing writes to it")
}

impl Inspected {
    fn line(&self) -> String {
        let kind = if self.is_result { RESULT } else { OTHER };
        format!("{} {kind} {}", self.blake3, finding_text(&self.finding))
    }

    fn parse(line: &str) -> Option<Self> {
        let (blake3, rest) = line.split_once(' ')?;
        let (kind, finding) = rest.split_once(' ')?;
        let is_hash = blake3.len() == 64 && blake3.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'));
        let (is_result, finding) = (kind == RESULT, parse_finding(finding)?);
        is_hash.then(|| Self { blake3: blake3.to_owned(), is_result, finding })
    }
}

/// What stands for the kind of a file where it is kept.
const RESULT: &str = "result";
const OTHER: &str = "other";

/// Hashes a file, sees whether it is a result, and looks for damage that the HDF5 library does not survive.
fn pass(file: &mut File) -> std::io::Result<Inspected> {
    let head = head(file)?;
    let is_result = is_result(file, &head)?;
    file.seek(SeekFrom::Start(0))?;
    let (mut hasher, mut guard) = (blake3::Hasher::new(), HeapGuard::new(file.metadata()?.len()));
    let mut buffer = vec![0; 1 << 16];
    loop {
        let count = file.read(&mut buffer)?;
        if count == 0 {
            let blake3 = hasher.finalize().to_hex().to_string();
            return Ok(Inspected { blake3, is_result, finding: guard.finish() });
        }
        hasher.update(&buffer[..count]);
        guard.update(&buffer[..count]);
    }
}
