//! The thread that writes down what a run makes, while its stages go on.

use std::collections::BTreeMap;
use std::fs::File;
use std::sync::mpsc::{self, Receiver};
use std::thread;

use super::result::StageRecord;
use crate::cache::{Cache, Origin, PendingResult, PendingStage};
use crate::store::StoreError;

/// A stage that has ended.
pub(super) struct Made {
    /// Its place in the plan.
    pub(super) index: usize,
    /// What it is known by in the cache, if it is to be kept there.
    pub(super) origin: Option<Origin>,
    pub(super) record: StageRecord,
}

/// The result file with the stages that have ended, if one was wanted.
pub(super) type Pending = Option<Result<PendingResult, StoreError>>;

/// What was written down.
#[derive(Default)]
pub(super) struct Kept {
    /// What could not be put into the cache.
    pub(super) unkept: BTreeMap<usize, StoreError>,
    pub(super) file: Pending,
}

/// What waits for the disk.
enum Unsynced {
    /// A stage's file, to be put in its place.
    Stage(usize, PendingStage),
    /// The result file as far as it is written.
    Share(File),
}

/// Puts results into the cache as they come and into the result file in an order of its own, until the run has ended.
///
/// A second thread waits for the disk: meanwhile the next file is written.
pub(super) fn keep(
    made: Receiver<Made>,
    cache: &Cache,
    begin: Option<impl FnOnce() -> Result<PendingResult, StoreError>>,
) -> Kept {
    let mut kept = Kept { file: begin.map(|begin| begin()), ..Kept::default() };
    let mut early = BTreeMap::new();
    let (written, rest) = mpsc::channel();
    let unsynced = thread::scope(|scope| {
        let (mut rest, mut syncer) = (Some(rest), None);
        for Made { index, origin, record } in made {
            if let Some(origin) = origin {
                match cache.write_with_origin(&origin, &record.result) {
                    Ok(file) => {
                        if let Some(rest) = rest.take() {
                            syncer = Some(scope.spawn(move || finish(rest)));
                        }
                        // the other end lives until this one goes
                        let _ = written.send(Unsynced::Stage(index, file));
                    }
                    Err(error) => drop(kept.unkept.insert(index, error)),
                }
            }
            if let Some(Ok(_)) = kept.file {
                early.insert(index, record);
                kept.file = kept.file.take().map(|file| file.and_then(|file| grown(file, &mut early)));
                // nobody waits for the last share but the end itself
                if let Some(Ok(file)) = &mut kept.file
                    && syncer.is_some()
                    && file.wanted().is_some()
                    && let Some(share) = file.next_share()
                {
                    let _ = written.send(Unsynced::Share(share));
                }
            }
        }
        drop(written);
        // a panic there is a bug like any other: it goes on here
        syncer.map(|thread| thread.join().unwrap_or_else(|panic| std::panic::resume_unwind(panic)))
    });
    kept.unkept.extend(unsynced.unwrap_or_default());
    kept
}

/// Sends files to the disk and puts those of stages in their places. Returns those that could not be.
fn finish(written: Receiver<Unsynced>) -> Vec<(usize, StoreError)> {
    let end = |unsynced| match unsynced {
        Unsynced::Stage(index, file) => file.finish().err().map(|error| (index, error)),
        Unsynced::Share(file) => {
            // the end of the file is waited for in any case, and tells what is wrong
            let _ = file.sync_data();
            None
        }
    };
    written.into_iter().filter_map(end).collect()
}

/// The file with all stages that are there and wanted. Errors: one cannot be written.
fn grown(mut file: PendingResult, early: &mut BTreeMap<usize, StageRecord>) -> Result<PendingResult, StoreError> {
    while let Some(record) = file.wanted().and_then(|index| early.remove(&index)) {
        file.stage(&record)?;
    }
    Ok(file)
}
