//! Where a result comes from: the parts of its key in words, in a small file beside it.
//!
//! A key says that something changed, never what. The origin of each result lies in `DIR/KEY.json`, so that
//! `afmid explain` can say it without opening results. It is written before the result and not synced: where it is
//! missing or cut short, less is known, and nothing else is lost.

use std::path::Path;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use crate::error::StoreError;
use crate::files::{read_regular, replace_unsynced};

/// The largest that is read: of a stage with a million files.
const MOST_BYTES: u64 = 256 << 20;

/// The parts of a result's key, and who made it first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Origin {
    /// The key.
    pub key: String,
    /// Version of the layout of stage files.
    pub format: u32,
    /// The stage's name in the registry.
    pub uses: String,
    /// The stage's version.
    pub version: u32,
    /// All parameters, defaults filled in.
    pub params: Value,
    /// Parameters that are no part of the key.
    pub location_params: Vec<String>,
    /// Plugins of the stage with their versions.
    pub depends_on: Vec<String>,
    /// What of processor and build may change last bits.
    #[serde(default)]
    pub arithmetic: String,
    /// Seed, if the stage draws random numbers.
    pub seed: Option<u64>,
    /// The files that it read, in order.
    pub files: Vec<OriginFile>,
    /// What it was wired to.
    pub inputs: Vec<OriginInput>,
    /// `[pipeline] name` of the run that made it.
    pub pipeline: String,
    /// The stage's id there.
    pub id: String,
    /// The program that made it.
    pub program: String,
}

/// A file that a stage read.
#[derive(Debug, Clone, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub struct OriginFile {
    /// Its name without folders.
    pub name: String,
    /// Bytes.
    pub size: u64,
    /// BLAKE3 hash in hexadecimal.
    pub blake3: String,
}

/// What an input port was wired to.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OriginInput {
    /// The input port.
    pub port: String,
    /// Id of the stage that it takes.
    pub stage: String,
    /// That stage's output.
    pub output: String,
    /// Key of that stage's result.
    pub key: String,
    /// That stage's own origin, if its results are not kept: nothing lies under its key to ask.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub origin: Option<Box<Origin>>,
}

impl Origin {
    /// Writes it whole or not at all. Errors: the folder cannot be written.
    pub(super) fn write(&self, path: &Path) -> Result<(), StoreError> {
        let text = serde_json::to_vec(self).map_err(|error| StoreError::new(error.to_string()).file(path))?;
        replace_unsynced(path, &text)
    }

    /// Reads one; none if it is missing, cut short or of another layout.
    pub(super) fn read(path: &Path) -> Option<Self> {
        serde_json::from_slice(&read_regular(path, MOST_BYTES).ok()?).ok()
    }
}
