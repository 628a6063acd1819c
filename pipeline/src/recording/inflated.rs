//! Files that were packed with gzip.

use std::fs::File;
use std::io::{Read, copy};
use std::path::{Path, PathBuf};

use afmid_formats::{head_of, most_inflated, open_regular};
use flate2::read::MultiGzDecoder;
use tempfile::TempDir;

use crate::error::StageError;

const MAGIC: &[u8] = b"\x1f\x8b";

/// What a packed file holds, in a folder of its own that goes with it.
#[derive(Debug)]
pub(super) struct Inflated {
    path: PathBuf,
    _folder: TempDir,
}

impl Inflated {
    /// Unpacks a file; none if it is not packed. Errors: it cannot be read or unpacked; it comes to more than
    /// [`most_inflated`] bytes.
    pub(super) fn of(path: &Path) -> Result<Option<Self>, StageError> {
        if !head_of(path)?.starts_with(MAGIC) {
            return Ok(None);
        }
        let failed = |error: std::io::Error| {
            StageError::new(format!("the packed file cannot be unpacked: {error}"))
                .at(path)
                .help("the file is damaged or cut off: copy it again from where it was recorded")
        };
        let packed = open_regular(path).map_err(failed)?;
        let most = most_inflated(packed.metadata().map_err(failed)?.len());
        let folder = tempfile::tempdir().map_err(failed)?;
        let target = folder.path().join(name(path));
        let mut unpacked = MultiGzDecoder::new(packed).take(most.saturating_add(1));
        let bytes = copy(&mut unpacked, &mut File::create(&target).map_err(failed)?).map_err(failed)?;
        if bytes > most {
            let problem = format!("it unpacks to more than {most} bytes, which no measurement of its size does");
            return Err(StageError::new(problem).at(path).help("unpack it yourself, if it is a recording"));
        }
        Ok(Some(Self { path: target, _folder: folder }))
    }

    /// Where it lies.
    pub(super) fn path(&self) -> &Path {
        &self.path
    }
}

/// The name without `.gz`: endings tell formats apart.
fn name(path: &Path) -> String {
    let whole = path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let bare = whole.strip_suffix(".gz").or_else(|| whole.strip_suffix(".GZ")).unwrap_or(&whole);
    if bare.is_empty() { "file".to_owned() } else { bare.to_owned() }
}
