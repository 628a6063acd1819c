//! A pipeline that takes milliseconds, on records that are written here.

use std::fs::{self, File};
use std::io::Write;
use std::path::{Path, PathBuf};

use afmid_pipeline::SourceFile;
use afmid_pipeline::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};
use afmid_pipeline::store::{ResultFile, compare};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::common::{afmid, command};

/// The config's name.
pub const CONFIG: &str = "small.toml";

/// Three stages that are kept and read the records that the first lists.
const TEXT: &str = r#"[pipeline]
name = "small"
seed = 1

[[stage]]
id = "records"
uses = "io.records"
params = { files = ["archive/*.h5"] }

[[stage]]
id = "census"
uses = "io.census"
inputs = { records = "records" }

[[stage]]
id = "overview"
uses = "io.overview"
inputs = { records = "records" }
params = { stretches = 50 }

[[stage]]
id = "welch"
uses = "spectrum.welch"
inputs = { records = "records" }
params = { segment_samples = 1024, free = { settle_s = 0.0, guard_s = 0.0 } }
"#;

/// A folder with the config and `records` records of noise below it.
pub fn folder(records: u64, samples: usize) -> tempfile::TempDir {
    let scratch = tempfile::tempdir().expect("a folder");
    fs::write(scratch.path().join(CONFIG), TEXT).expect("the config");
    fs::create_dir(scratch.path().join("archive")).expect("a folder");
    for number in 0..records {
        record(&scratch.path().join(format!("archive/r{number}.h5")), samples, number);
    }
    scratch
}

/// A record of noise that `seed` alone determines.
pub fn record(path: &Path, samples: usize, seed: u64) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let channel = NativeChannel {
        location: "deflection".to_owned(),
        codes: Codes::Int16((0..samples).map(|_| random.random_range(-400..400)).collect()),
        unit: "V".to_owned(),
        scale_factor: 1e-3,
        add_offset: 0.0,
        long_name: "noise".to_owned(),
    };
    let record = NativeRecord { sample_rate_hz: 1e6, started_at: String::new(), channels: vec![channel] };
    write_native(path, &record, RecordStorage::Raw).expect("a record");
}

/// `afmid run small.toml -o RESULT --cache CACHE` and more arguments; what it wrote to stdout and stderr.
pub fn run(here: &Path, result: &str, cache: &str, more: &[&str]) -> Ran {
    let arguments: Vec<&str> = ["run", CONFIG, "-o", result, "--cache", cache].iter().chain(more).copied().collect();
    let output = command(here, &arguments).output().expect("afmid starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    Ran { code: output.status.code(), stdout: text(&output.stdout), stderr: text(&output.stderr) }
}

/// A run that has ended.
#[derive(Debug)]
pub struct Ran {
    pub code: Option<i32>,
    pub stdout: String,
    pub stderr: String,
}

/// A result that was computed from the files as they are, with an empty cache of its own.
pub fn truth(here: &Path) -> PathBuf {
    let cache = tempfile::tempdir().expect("a folder");
    let result = here.join("truth.h5");
    let cache = cache.path().display().to_string();
    afmid(here, &["run", CONFIG, "-o", &result.display().to_string(), "--cache", &cache]);
    result
}

/// What differs between two results, bit for bit.
pub fn differences(a: &Path, b: &Path) -> Vec<String> {
    let found = compare(a, b).unwrap_or_else(|error| panic!("{} and {}: {error}", a.display(), b.display()));
    found.iter().map(|difference| format!("{difference:?}")).collect()
}

/// The files that a result states for its first stage.
pub fn stated(result: &Path) -> Vec<SourceFile> {
    let file = ResultFile::open(result).expect("a result");
    file.stages().first().map(|stage| stage.record.sources.clone()).unwrap_or_default()
}

/// BLAKE3 of a file.
pub fn hash(path: &Path) -> String {
    blake3::hash(&fs::read(path).expect("a file")).to_hex().to_string()
}

/// Writes other bytes into a file in place and sets its time of modification back: `cp` and `touch -r`.
pub fn overwrite_unseen(path: &Path, bytes: &[u8]) {
    let modified = fs::metadata(path).and_then(|metadata| metadata.modified()).expect("a time");
    // in place: a file that is cut short for a moment fails any reader, one of other bytes only who looks
    let mut file = File::options().write(true).open(path).expect("a file");
    file.write_all(bytes).and_then(|()| file.set_modified(modified)).expect("written, and the time set back");
}

/// The bytes with one sample in the middle that is another.
pub fn altered(bytes: &[u8]) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let middle = bytes.len() / 2;
    bytes[middle] ^= 0x55;
    bytes
}

/// Files of a cache with an ending, by name.
pub fn cached(cache: &Path, ending: &str) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = fs::read_dir(cache)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.path())
        .filter(|path| path.extension().is_some_and(|found| found == ending))
        .collect();
    files.sort();
    files
}
