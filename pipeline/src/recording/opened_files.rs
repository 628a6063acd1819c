//! Files of foreign formats that were opened last. Text is parsed and compressed data are inflated once; what that
//! keeps in memory is bounded here, whatever the number of records.

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use super::contents::open_contents;
use super::how::Reading;
use super::input_files::require_state;
use super::{Contents, FormatError, InputFiles};
use crate::files::FileState;

/// Memory for parsed text and inflated data, beyond what each thread needs for the file that it reads.
const MOST_BYTES: u64 = 128 << 20;

/// More files are forgotten even if they keep nothing: finding one takes time.
const MOST_FILES: usize = 64;

type Slot = Arc<OnceLock<Result<Arc<Contents>, FormatError>>>;

#[derive(Debug, Clone, PartialEq)]
struct Key {
    path: PathBuf,
    state: FileState,
    reading: Reading,
}

/// The files that were opened last, the newest first.
#[derive(Debug, Default)]
pub(super) struct OpenedFiles(Mutex<Vec<(Key, Slot)>>);

/// What a file holds that is in this state, as it was opened last or is opened now. Errors: it is in another; as
/// [`open_contents`].
pub(super) fn contents(
    files: &InputFiles,
    path: &Path,
    state: FileState,
    reading: &Reading,
) -> Result<Arc<Contents>, FormatError> {
    require_state(path, &state)?;
    let key = Key { path: path.to_owned(), state, reading: reading.clone() };
    let slot = files.opened().slot_of(&key);
    if let Some(opened) = slot.get() {
        return opened.clone();
    }
    // opened outside the lock: another thread may want another file meanwhile, the same file is opened once
    let open = || {
        let contents = open_contents(files, path, reading)?.1;
        // what was read may be of a file that changed meanwhile
        require_state(path, &state)?;
        Ok(Arc::new(contents))
    };
    let opened = slot.get_or_init(open).clone();
    files.opened().trim(&key, opened.is_err());
    opened
}

impl OpenedFiles {
    /// The file's slot, which becomes the newest.
    fn slot_of(&self, key: &Key) -> Slot {
        let mut opened = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let found = opened.iter().position(|(have, _)| have == key);
        let entry = found.map_or_else(|| (key.clone(), Slot::default()), |place| opened.remove(place));
        let slot = Arc::clone(&entry.1);
        opened.insert(0, entry);
        slot
    }

    /// Forgets a file that could not be opened, and the oldest ones beyond the bound. Every thread's newest file stays:
    /// reading stretches of records in turn must not parse them again and again.
    fn trim(&self, key: &Key, failed: bool) {
        let mut opened = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        opened.retain(|(have, _)| !(failed && have == key));
        let (stay, mut bytes, mut files) = (rayon::current_num_threads() + 1, 0_u64, 0_usize);
        opened.retain(|(_, slot)| {
            bytes = bytes.saturating_add(slot.get().map_or(0, weight));
            files += 1;
            files <= stay || (bytes <= MOST_BYTES && files <= MOST_FILES)
        });
    }
}

fn weight(opened: &Result<Arc<Contents>, FormatError>) -> u64 {
    let channels = opened.as_ref().map_or(&[][..], |contents| &contents.channels);
    channels.iter().map(|channel| channel.source.kept_bytes()).fold(0, u64::saturating_add)
}
