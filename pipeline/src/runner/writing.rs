//! The thread that writes what a run makes into the cache and the result file, while its stages go on.

use std::collections::BTreeMap;
use std::fs::File;
use std::sync::mpsc::{self, Receiver};
use std::thread;

use crate::cache::{Cache, Origin, PendingStage};
use crate::error::StoreError;
use crate::outcome::{PortSpec, StageRecord};
use crate::store::{PendingResult, StageIdentity};

/// A stage that has ended.
pub(super) struct Made {
    /// Its place in the plan.
    pub(super) index: usize,
    /// What it is known by in the cache, if it is to be kept there.
    pub(super) origin: Option<Origin>,
    /// The outputs that the stage declares.
    pub(super) outputs: &'static [PortSpec],
    pub(super) record: StageRecord,
}

/// The result file with the stages that have ended, if one was wanted.
pub(super) type Pending = Option<Result<PendingResult, StoreError>>;

/// What waits for the disk.
enum Unsynced {
    /// A stage's file, to be put in its place.
    Stage(PendingStage),
    /// The result file as far as it is written.
    Share(File),
}

/// Puts results into the cache as they come and into the result file in an order of its own, until the run has ended.
/// What cannot be put into the cache is a note of the cache's: the next run computes it again.
///
/// A second thread waits for the disk: meanwhile the next file is written.
pub(super) fn keep(
    made: Receiver<Made>,
    cache: &Cache,
    begin: Option<impl FnOnce() -> Result<PendingResult, StoreError>>,
) -> Pending {
    let mut result = begin.map(|begin| begin());
    let mut early = BTreeMap::new();
    let (written, rest) = mpsc::channel();
    thread::scope(|scope| {
        let (mut rest, mut syncer) = (Some(rest), None);
        for Made { index, origin, outputs, record } in made {
            if let Some(origin) = origin {
                let Origin { key, uses, version, .. } = &origin;
                let identity = StageIdentity { key, stage: uses, version: *version, outputs };
                match cache.write_with_origin(&origin, &identity, &record.result) {
                    Ok(file) => {
                        if let Some(rest) = rest.take() {
                            syncer = Some(scope.spawn(move || finish(rest, cache)));
                        }
                        // the other end lives until this one goes
                        let _ = written.send(Unsynced::Stage(file));
                    }
                    Err(error) => cache.unkept(&error),
                }
            }
            if let Some(Ok(_)) = result {
                early.insert(index, record);
                result = result.take().map(|file| file.and_then(|file| grown(file, &mut early)));
                // nobody waits for the last share but the end itself
                if let Some(Ok(file)) = &mut result
                    && syncer.is_some()
                    && file.next_stage().is_some()
                    && let Some(share) = file.next_share()
                {
                    let _ = written.send(Unsynced::Share(share));
                }
            }
        }
        drop(written);
        // a panic there is a bug like any other: it goes on here
        if let Some(Err(panic)) = syncer.map(thread::ScopedJoinHandle::join) {
            std::panic::resume_unwind(panic);
        }
    });
    result
}

/// Sends files to the disk and puts those of stages in their places.
fn finish(written: Receiver<Unsynced>, cache: &Cache) {
    for unsynced in written {
        match unsynced {
            Unsynced::Stage(file) => file.finish().unwrap_or_else(|error| cache.unkept(&error)),
            // the end of the file is waited for in any case, and says what is wrong
            Unsynced::Share(file) => drop(file.sync_data()),
        }
    }
}

/// The file with all stages that are there and wanted. Errors: one cannot be written.
fn grown(mut file: PendingResult, early: &mut BTreeMap<usize, StageRecord>) -> Result<PendingResult, StoreError> {
    while let Some(record) = file.next_stage().and_then(|index| early.remove(&index)) {
        file.stage(&record)?;
    }
    Ok(file)
}
