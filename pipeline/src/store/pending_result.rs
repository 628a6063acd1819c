//! Result files in the making, and the one way to write one: whole or not at all.

use std::fs::File;
use std::path::{Path, PathBuf};

use super::file_kind::FileKind;
use super::result_file::{ResultWriter, RunHead};
use super::seal::seal;
use super::written::{Written, written};
use crate::error::StoreError;
use crate::files::{Replacement, sweep_beside};
use crate::outcome::{RunInfo, RunResult, StageRecord};

/// Writes a run's result file, whole or not at all, and removes what killed runs left beside it.
///
/// Errors: the folder is missing or cannot be written; an artifact is not valid.
pub fn write_result(path: &Path, run: &RunResult) -> Result<(), StoreError> {
    let ids: Vec<&str> = run.stages.iter().map(|stage| stage.id.as_str()).collect();
    let place = |id: &String| ids.iter().position(|own| own == id);
    let needs = |stage: &StageRecord| stage.wires.iter().filter_map(|(_, source, _)| place(source)).collect();
    let needs: Vec<Vec<usize>> = run.stages.iter().map(needs).collect();
    let RunResult { name, seed, config, overrides, program, .. } = run;
    let head = RunHead { name, seed: *seed, config, overrides, program, ids: &ids, needs: &needs };
    sweep_beside(path);
    let mut pending = PendingResult::new(path, &head)?;
    while let Some(stage) = pending.next_stage().and_then(|index| run.stages.get(index)) {
        pending.stage(stage)?;
    }
    pending.finish(&run.info)
}

/// A result file that grows while its stages run: what is at its path stays until it is whole. The same bytes as
/// [`write_result`].
/// It sweeps nothing: thousands of results may lie in one folder.
pub(crate) struct PendingResult {
    // before the replacement, which removes the file
    writer: ResultWriter,
    replacement: Replacement,
    /// Where it goes.
    place: PathBuf,
    /// The file's length when it was last on its way to the disk.
    sent: u64,
}

/// Growth after which a file is sent to the disk before it ends: less takes no time at the end.
const SHARE: u64 = 1 << 20;

impl PendingResult {
    /// Begins the file beside `path`. Errors: as [`write_result`].
    pub(crate) fn new(path: &Path, run: &RunHead) -> Result<Self, StoreError> {
        let replacement = Replacement::new(path)?;
        match ResultWriter::new(replacement.temporary(), run) {
            Ok(writer) => Ok(Self { writer, replacement, place: path.to_owned(), sent: 0 }),
            Err(error) => Err(replacement.named(error)),
        }
    }

    /// The place in the plan of the stage that is to be written next. None: all are written.
    pub(crate) fn next_stage(&self) -> Option<usize> {
        self.writer.next_stage()
    }

    /// Writes the next stage. Errors: the file cannot be written; an artifact is not valid.
    pub(crate) fn stage(&mut self, stage: &StageRecord) -> Result<(), StoreError> {
        self.writer.stage(stage).map_err(|error| self.replacement.named(error))
    }

    /// The file as it is, if it has grown so much that another thread should send it to the disk: little is left to
    /// wait for when it ends.
    pub(crate) fn next_share(&mut self) -> Option<File> {
        // a file that cannot be opened is an error at its end
        let file = File::open(self.replacement.temporary()).ok()?;
        let length = file.metadata().ok()?.len();
        (length >= self.sent + SHARE).then(|| {
            self.sent = length;
            file
        })
    }

    /// Seals and syncs the file and puts it in its place. Errors: a stage is missing; something else has come to lie
    /// there; as [`write_result`].
    pub(crate) fn finish(self, info: &RunInfo) -> Result<(), StoreError> {
        let Self { writer, replacement, place, .. } = self;
        let written = writer.finish(info).and_then(|()| seal(replacement.temporary()));
        let written = written.and_then(|()| check_place(&place));
        replacement.take(written)
    }
}

/// Errors: something lies there that is no result as this program writes it, whenever it came: a state taken when the
/// writing began would miss what came between the look at the output and then. (Two workers may make the same result.)
fn check_place(place: &Path) -> Result<(), StoreError> {
    match written(place) {
        Ok(Written::AsWritten | Written::CutShort | Written::Other(FileKind::Empty)) => return Ok(()),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(()),
        Ok(_) | Err(_) => {}
    }
    let problem = "was made or changed by another program meanwhile: it is not replaced";
    let help = "run again with another output: what was computed is in the cache";
    Err(StoreError::new(problem).file(place).help(help))
}
