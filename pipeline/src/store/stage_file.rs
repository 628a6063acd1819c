//! Stage files: what one stage made, and which stage with which key that was. The unit of the cache.

use std::path::Path;

use hdf5::File;

use super::format::{check_format, write_format};
use super::ports::{list_ports, read_ports, write_ports};
use super::rows::Backing;
use super::seal::{check_seal, seal};
use crate::error::{Result, StoreError};
use crate::hdf5_files::read::Node;
use crate::hdf5_files::{Vetted, read, write};
use crate::outcome::{PortSpec, StageResult};
use crate::recording::InputFiles;

const KIND: &str = "stage";
const GROUP: &str = "result";
const WARNINGS: &str = "warnings";
const KEY: &str = "key";
const STAGE: &str = "stage";
const VERSION: &str = "stage_version";

/// What a stage file is the result of. It is written inside the sealed file: a file under another name is found out.
#[derive(Debug, Clone, Copy)]
pub struct StageIdentity<'a> {
    /// Content address of the result.
    pub key: &'a str,
    /// The stage's name in the registry.
    pub stage: &'a str,
    /// The stage's version.
    pub version: u32,
    /// The outputs that the stage declares.
    pub outputs: &'a [PortSpec],
}

/// Writes a stage's result to a new file, seals and syncs it. Errors: the file exists or cannot be written; an artifact
/// is not valid.
pub fn write_stage(path: &Path, identity: &StageIdentity, result: &StageResult) -> std::result::Result<(), StoreError> {
    write_unsealed_stage(path, identity, result)?;
    seal(path)
}

/// The same file before it is sealed and synced: what is left needs nothing of the HDF5 library.
pub(crate) fn write_unsealed_stage(
    path: &Path,
    identity: &StageIdentity,
    result: &StageResult,
) -> std::result::Result<(), StoreError> {
    let write = || -> Result<()> {
        let file = write::create_file(path)?;
        write_contents(&file, identity, result)?;
        Ok(file.close()?)
    };
    write().map_err(|error| error.file(path))
}

fn write_contents(file: &File, identity: &StageIdentity, result: &StageResult) -> Result<()> {
    write_format(file, KIND)?;
    write::text_attribute(file, KEY, identity.key)?;
    write::text_attribute(file, STAGE, identity.stage)?;
    write::attribute(file, VERSION, &identity.version)?;
    write::texts(file, WARNINGS, &result.warnings)?;
    write_ports(&write::group(file, GROUP)?, &result.outputs)
}

/// Reads a stage's result. Large arrays over two axes stay in the file, which is held open for them: later reads see
/// that their bytes are still those that were sealed.
///
/// Errors: there is no file, it is damaged, of another version, or the result of something else than `identity`;
/// another process touches it all the time.
pub fn read_stage(
    path: &Path,
    identity: &StageIdentity,
    files: &InputFiles,
) -> std::result::Result<StageResult, StoreError> {
    let touched = || StoreError::new("another process changes the file again and again").file(path);
    read_untouched_stage(path, identity, files)?.ok_or_else(touched)
}

/// How often a file is read that another process touches meanwhile: it says that it uses it, too, or puts an equal one
/// in its place. Why: both are rare (`cache::Cache::get`), and what is not had from the file is computed.
const MOST_READS: usize = 5;

/// The same; none if another process touched the file each time that it was read: what was read may be of two states.
pub(crate) fn read_untouched_stage(
    path: &Path,
    identity: &StageIdentity,
    files: &InputFiles,
) -> std::result::Result<Option<StageResult>, StoreError> {
    for _ in 0..MOST_READS {
        let backing = Backing::open(path)?;
        let read = || -> std::result::Result<StageResult, StoreError> {
            let vetted = check_seal(path)?;
            read_hdf5(path, &vetted, &backing, identity, files).map_err(|error| error.file(path))
        };
        let result = read();
        // an error, too, may be that of a file that is written at this moment
        if backing.is_untouched() {
            return result.map(Some);
        }
    }
    Ok(None)
}

fn read_hdf5(
    path: &Path,
    vetted: &Vetted,
    backing: &Backing,
    identity: &StageIdentity,
    files: &InputFiles,
) -> Result<StageResult> {
    let root = read::open_file(path, vetted)?.root();
    check_format(&root, KIND)?;
    check_identity(&root, identity)?;
    let warnings = read::texts(&root, WARNINGS)?;
    Ok(StageResult { outputs: read_ports(&read::group(&root, GROUP)?, files, Some(backing))?, warnings })
}

/// Errors: the file is the result of another stage, another version or other inputs; its ports are not the declared
/// ones.
fn check_identity(file: &Node, identity: &StageIdentity) -> Result<()> {
    let differs = |what: &str, found: &dyn std::fmt::Display, wanted: &dyn std::fmt::Display| {
        StoreError::new(format!("holds another result: its {what} is {found}, wanted {wanted}"))
    };
    let (key, stage) = (read::text_attribute(file, KEY)?, read::text_attribute(file, STAGE)?);
    let version: u32 = read::attribute(file, VERSION)?;
    if stage != identity.stage {
        return Err(differs("stage", &stage, &identity.stage));
    }
    if version != identity.version {
        return Err(differs("stage version", &version, &identity.version));
    }
    if key != identity.key {
        return Err(differs("key", &key, &identity.key));
    }
    let ports = list_ports(&read::group(file, GROUP)?)?;
    for declared in identity.outputs {
        match ports.iter().find(|port| port.name == declared.name) {
            Some(port) if port.shape != declared.shape => {
                let what = format!("output `{}`", declared.name);
                return Err(differs(&what, &port.shape.name(), &declared.shape.name()));
            }
            None if !declared.optional => {
                return Err(StoreError::new(format!("holds another result: it lacks the output `{}`", declared.name)));
            }
            _ => {}
        }
    }
    match ports.iter().find(|port| identity.outputs.iter().all(|declared| declared.name != port.name)) {
        Some(port) => {
            let name = &port.name;
            Err(StoreError::new(format!("holds another result: `{}` declares no output `{name}`", identity.stage)))
        }
        None => Ok(()),
    }
}
