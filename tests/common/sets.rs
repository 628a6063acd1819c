//! Small data sets in a folder of their own, and `afmid batch` on them.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use afmid_pipeline::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};
use serde_json::Value;

/// Two stages that take milliseconds.
pub const CENSUS: &str = r#"
[pipeline]
name = "census"

[[stage]]
id = "records"
uses = "io.records"
params = { files = ["nowhere/*.h5"] }

[[stage]]
id = "census"
uses = "io.census"
inputs = { records = "records" }
"#;

/// A data set of two records; its numbers depend on `seed`.
pub fn write_set(folder: &Path, seed: usize, samples: usize) {
    std::fs::create_dir_all(folder).expect("a folder");
    for record in 0..2 {
        write_record(&folder.join(format!("record_{record}.h5")), 2 * seed + record, samples);
    }
}

/// A record without an event; its numbers depend on `seed`.
pub fn write_record(path: &Path, seed: usize, samples: usize) {
    let code = |k: usize| ((k * 7919 + seed * 104_729) % 4096) as i16 - 2048;
    let channel = NativeChannel {
        location: "/deflection".to_owned(),
        codes: Codes::Int16((0..samples).map(code).collect()),
        unit: "V".to_owned(),
        scale_factor: 0.001,
        add_offset: 0.0,
        long_name: "deflection".to_owned(),
    };
    let started_at = format!("{}-03-01T10:00:00Z", 2001 + seed / 2);
    let record = NativeRecord { sample_rate_hz: 5e6, started_at, channels: vec![channel] };
    write_native(path, &record, RecordStorage::Raw).expect("a record");
}

/// A folder with a config and data sets.
pub struct Here(tempfile::TempDir);

impl Here {
    /// One with the config.
    pub fn new() -> Self {
        let here = Self(tempfile::tempdir().expect("a folder"));
        std::fs::write(here.path("census.toml"), CENSUS).expect("a config");
        here
    }

    /// The folder itself.
    pub fn folder(&self) -> &Path {
        self.0.path()
    }

    /// A file in it.
    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    /// [`write_set`] in it.
    pub fn set(&self, name: &str, seed: usize, samples: usize) {
        write_set(&self.path(name), seed, samples);
    }

    /// `afmid batch` in it.
    pub fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_afmid"));
        command.current_dir(self.0.path()).arg("batch").args(arguments);
        command
    }

    /// What that gives.
    pub fn batch(&self, arguments: &[&str]) -> Output {
        self.command(arguments).output().expect("afmid starts")
    }

    /// Exit code and JSON of `afmid batch --json`.
    pub fn batch_json(&self, arguments: &[&str]) -> (i32, Value) {
        let output = self.batch(&[arguments, &["--json"]].concat());
        let value = serde_json::from_slice(&output.stdout);
        let value = value.unwrap_or_else(|_| panic!("{}", String::from_utf8_lossy(&output.stderr)));
        (output.status.code().expect("it ended by itself"), value)
    }

    /// All files below a folder with their bytes.
    pub fn bytes(&self, folder: &str) -> BTreeMap<PathBuf, Vec<u8>> {
        let mut all = BTreeMap::new();
        for part in [self.path(folder), self.path(folder).join("ledger")] {
            for entry in std::fs::read_dir(part).expect("a folder") {
                let path = entry.expect("an entry").path();
                if path.is_file() {
                    all.insert(path.clone(), std::fs::read(&path).expect("a file"));
                }
            }
        }
        all
    }
}
