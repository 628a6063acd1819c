//! Stage files in the making.

use std::path::Path;

use crate::error::StoreError;
use crate::files::Replacement;
use crate::outcome::StageResult;
use crate::store::{self, StageIdentity};

/// A stage's file that is written, and not yet sealed, synced and in its place.
pub(crate) struct PendingStage(Replacement);

impl PendingStage {
    /// Writes the file beside `path`. Errors: the folder is missing or cannot be written; an artifact is not valid.
    pub(super) fn write(path: &Path, identity: &StageIdentity, result: &StageResult) -> Result<Self, StoreError> {
        let replacement = Replacement::new(path)?;
        match store::write_unsealed_stage(replacement.temporary(), identity, result) {
            Ok(()) => Ok(Self(replacement)),
            Err(error) => Err(replacement.named(error)),
        }
    }

    /// Seals and syncs the file and puts it in its place: nothing here waits for the HDF5 library. Errors: the file
    /// cannot be written.
    pub(crate) fn finish(self) -> Result<(), StoreError> {
        let sealed = store::seal(self.0.temporary());
        self.0.take(sealed)
    }
}
