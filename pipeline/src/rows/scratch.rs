//! Files without a name.

use std::fs::{self, File, OpenOptions};
use std::path::{Path, PathBuf};

use crate::error::StageError;
use crate::files::temporary_path;

/// Most bytes of rows that stay in memory; the paper's 84 windows of 8192 samples are 5.5 MB.
const LIMIT_BYTES: usize = 8 << 20;

/// Begins the names of files in the system's folder for temporary ones.
const TITLE: &str = "afmid-rows";

/// Where rows go that are too many for memory.
#[derive(Debug, Clone)]
pub struct Scratch {
    /// The files lie beside this one, under temporary names.
    beside: PathBuf,
    limit_bytes: usize,
}

impl Scratch {
    /// Files in the folder of `beside`, under names like that one's temporary ones: who sweeps these sweeps them too.
    pub fn beside(beside: &Path) -> Self {
        Self { beside: beside.to_owned(), limit_bytes: LIMIT_BYTES }
    }

    /// The same with another limit.
    #[must_use]
    pub fn with_limit_bytes(self, limit_bytes: usize) -> Self {
        Self { limit_bytes, ..self }
    }

    /// Most bytes of a set of rows that stay in memory.
    pub fn limit_bytes(&self) -> usize {
        self.limit_bytes
    }

    pub(crate) fn path(&self) -> &Path {
        &self.beside
    }

    /// A new file without a name: it goes with its last handle, also in a kill. Errors: no folder can be made or
    /// written.
    pub(crate) fn file(&self) -> Result<File, StageError> {
        // a cache that cannot be written stops no run
        let made = unnamed(&self.beside).or_else(|error| self.elsewhere().map_err(|_| error));
        made.map_err(|error| {
            StageError::new(format!("a temporary file for rows of events cannot be made: {error}"))
                .at(self.beside.parent().unwrap_or(&self.beside))
                .help("choose another folder with --cache, or set TMPDIR")
        })
    }

    /// The same in the system's folder for temporary files. Errors: that cannot be written either.
    pub(crate) fn elsewhere(&self) -> std::io::Result<File> {
        unnamed(&std::env::temp_dir().join(TITLE))
    }
}

/// A new file without a name in the folder of `beside`.
fn unnamed(beside: &Path) -> std::io::Result<File> {
    let path = temporary_path(beside);
    let folder = path.parent().unwrap_or(Path::new("."));
    fs::create_dir_all(folder)?;
    let mut options = OpenOptions::new();
    options.read(true).write(true);
    #[cfg(target_os = "linux")]
    {
        use std::os::unix::fs::OpenOptionsExt;
        let nameless = i32::try_from(rustix::fs::OFlags::TMPFILE.bits());
        let made = nameless.map(|flag| options.clone().custom_flags(flag).mode(0o600).open(folder));
        if let Ok(Ok(file)) = made {
            return Ok(file);
        }
    }
    // not every file system has files that never had a name
    let file = options.create_new(true).open(&path)?;
    // a kill between these two leaves an empty file, which the next sweep takes
    fs::remove_file(path)?;
    Ok(file)
}

/// In the system's folder for temporary files.
impl Default for Scratch {
    fn default() -> Self {
        Self::beside(&std::env::temp_dir().join(TITLE))
    }
}
