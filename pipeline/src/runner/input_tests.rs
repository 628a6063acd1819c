//! Files that change while stages read them: the run fails, names the file and keeps nothing.

use std::fs::{self, File};
use std::path::{Path, PathBuf};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Options, Quiet, RunError, run};
use crate::artifact::{Array, Axis};
use crate::cache::Cache;
use crate::error::StageError;
use crate::files::fixture::Folder;
use crate::graph::load;
use crate::outcome::{Port, Ports, RunResult};
use crate::recording::{
    Codes, InputFiles, NativeChannel, NativeRecord, RecordStorage, Recording, Wanted, open_native, write_native,
};
use crate::stage::{Caching, Context, Entry, Example, Registry, Spec, Stage};

const RECORDS: Port<Recording> = Port::new("records", "records", "records");
const OUT: Port<Array> = Port::new("out", "series", "a series");

/// What happens to the file while a stage reads it.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
enum Meanwhile {
    #[default]
    Nothing,
    /// Other bytes in place, then the old ones and their time of modification.
    InPlace,
    /// Another file under its name, then the old one again.
    Renamed,
    /// Another folder under its folder's name, then the old one again: nothing of the file itself changes.
    Swapped,
}

fn one_value(values: Vec<f64>) -> Array {
    let axis = Axis::new("n", "1", "index", (0..values.len()).map(|index| index as f64).collect());
    Array::over(vec![axis]).with("value", "1", "value", &["n"], values)
}

fn other(path: &Path) -> Vec<u8> {
    let mut bytes = fs::read(path).expect("bytes");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    bytes
}

impl Meanwhile {
    /// Reads with `read` while the file is another one.
    fn during<T>(self, path: &Path, read: impl FnOnce() -> Result<T, StageError>) -> Result<T, StageError> {
        let aside = path.with_extension("aside");
        let whole = fs::read(path).expect("bytes");
        let folder = path.parent().expect("a folder");
        let (elsewhere, away) = (folder.with_extension("other"), folder.with_extension("away"));
        match self {
            Self::Nothing => read(),
            Self::InPlace => {
                let modified = fs::metadata(path).and_then(|about| about.modified()).expect("a time");
                fs::write(path, other(path)).expect("written");
                let found = read();
                fs::write(path, whole).expect("written");
                File::options().write(true).open(path).and_then(|file| file.set_modified(modified)).expect("a time");
                found
            }
            Self::Renamed => {
                fs::rename(path, &aside).expect("renamed");
                fs::write(path, other(&aside)).expect("written");
                let found = read();
                fs::rename(&aside, path).expect("renamed");
                found
            }
            Self::Swapped => {
                fs::create_dir(&elsewhere).expect("a folder");
                fs::write(elsewhere.join(path.file_name().expect("a name")), other(path)).expect("written");
                let swap = |to: &Path, from: &Path| {
                    fs::rename(folder, to).expect("renamed");
                    fs::rename(from, folder).expect("renamed");
                };
                swap(&away, &elsewhere);
                let found = read();
                swap(&elsewhere, &away);
                fs::remove_dir_all(&elsewhere).expect("removed");
                found
            }
        }
    }
}

/// Reads a file of its own.
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Read {
    /// Which.
    file: PathBuf,
    /// What happens meanwhile.
    meanwhile: Meanwhile,
}

impl Stage for Read {
    const SPEC: Spec = Spec {
        name: "test.read",
        version: 1,
        summary: "reads",
        inputs: &[],
        outputs: &[OUT.spec()],
        source: "",
        ..Spec::STORED
    };

    fn sources(&self, base: &Path, _files: &InputFiles) -> Result<Vec<PathBuf>, StageError> {
        Ok(vec![base.join(&self.file)])
    }

    fn run(&self, _inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let path = cx.base().join(&self.file);
        let bytes = self.meanwhile.during(&path, || Ok(fs::read(&path).expect("bytes")))?;
        Ok(Ports::new().with(&OUT, one_value(bytes.into_iter().map(f64::from).collect())))
    }

    fn examples() -> Vec<Example> {
        Vec::new()
    }
}

/// Opens a record.
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Open {
    /// Which.
    file: PathBuf,
}

impl Stage for Open {
    const SPEC: Spec = Spec { name: "test.open", outputs: &[RECORDS.spec()], caching: Caching::Stored, ..Read::SPEC };

    fn sources(&self, base: &Path, _files: &InputFiles) -> Result<Vec<PathBuf>, StageError> {
        Ok(vec![base.join(&self.file)])
    }

    fn run(&self, _inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let wanted = [Wanted { role: "deflection", location: "/deflection", required: true }];
        let record = open_native(cx.files(), &cx.base().join(&self.file), &wanted)?;
        Ok(Ports::new().with(&RECORDS, Recording { records: vec![record] }))
    }

    fn examples() -> Vec<Example> {
        Vec::new()
    }
}

/// Reads the samples of records.
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Samples {
    /// What happens meanwhile.
    meanwhile: Meanwhile,
}

impl Stage for Samples {
    const SPEC: Spec = Spec { name: "test.samples", inputs: &[RECORDS.spec()], ..Read::SPEC };

    fn run(&self, inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        let records = inputs.get(&RECORDS)?;
        let [record] = &records.records[..] else { return Err(StageError::new("wanted one record")) };
        let channel = record.channel("deflection")?;
        let values = self.meanwhile.during(&record.path, || channel.read(0, channel.samples))?;
        Ok(Ports::new().with(&OUT, one_value(values)))
    }

    fn examples() -> Vec<Example> {
        Vec::new()
    }
}

/// A folder with the folder `data` and a record in it.
fn folder() -> Folder {
    let folder = Folder::new("meanwhile");
    fs::create_dir(folder.file("data")).expect("a folder");
    let channel = NativeChannel {
        location: "deflection".to_owned(),
        codes: Codes::Int16((0..20_000).map(|n| (n % 512) as i16).collect()),
        unit: "V".to_owned(),
        scale_factor: 1.0,
        add_offset: 0.0,
        long_name: String::new(),
    };
    let record = NativeRecord { sample_rate_hz: 1e6, started_at: String::new(), channels: vec![channel] };
    write_native(&folder.file("data/r.h5"), &record, RecordStorage::Raw).expect("a record");
    folder
}

/// Runs stages, in TOML, in a folder with its cache. How many results the cache has then.
fn ran(folder: &Folder, stages: &str) -> (Result<RunResult, Vec<RunError>>, usize) {
    let registry = Registry::new().with(&[Entry::of::<Read>(), Entry::of::<Open>(), Entry::of::<Samples>()]);
    let text = format!("[pipeline]\nname = \"meanwhile\"\nseed = 1\n{stages}");
    let plan = load("m.toml", &text, &[], &registry.expect("three names")).expect("a valid config");
    let cache = Cache::open(&folder.file("cache"));
    let (base, program) = (folder.0.clone(), "afmid test".to_owned());
    let files = cache.input_files(false);
    let options =
        Options { base, cache: &cache, files, fresh: false, program, overrides: Vec::new(), observer: &Quiet };
    let result = run(&plan, &options);
    let kept = fs::read_dir(folder.file("cache")).expect("the cache").flatten();
    let kept = kept.filter(|entry| entry.path().extension().is_some_and(|ending| ending == "h5")).count();
    (result, kept)
}

const CHANGES: [&str; 2] = ["in-place", "renamed"];

#[test]
fn a_stage_whose_own_file_changes_meanwhile_fails_and_is_not_kept() {
    for meanwhile in CHANGES {
        let folder = folder();
        let stage = |what: &str| {
            format!(
                "[[stage]]\nid = \"a\"\nuses = \"test.read\"\n\
                 params = {{ file = \"data/r.h5\", meanwhile = \"{what}\" }}\n"
            )
        };
        let (result, kept) = ran(&folder, &stage(meanwhile));
        let errors = result.expect_err(meanwhile);
        assert!(errors.len() == 1 && errors[0].to_string().contains("r.h5"), "{meanwhile}: {errors:?}");
        assert!(errors[0].to_string().contains("changed while it was read"), "{meanwhile}: {errors:?}");
        assert_eq!(kept, 0, "{meanwhile}");
        let (result, kept) = ran(&folder, &stage("nothing"));
        assert!(result.is_ok() && kept == 1, "the file is as it was");
    }
}

#[test]
fn a_stage_whose_recording_changes_meanwhile_fails_also_where_the_recording_comes_from_the_cache() {
    let stages = |what: &str| {
        format!(
            "[[stage]]\nid = \"r\"\nuses = \"test.open\"\nparams = {{ file = \"data/r.h5\" }}\n\
             [[stage]]\nid = \"s\"\nuses = \"test.samples\"\ninputs = {{ records = \"r\" }}\n\
             params = {{ meanwhile = \"{what}\" }}\n"
        )
    };
    for stored in [false, true] {
        for meanwhile in CHANGES.into_iter().chain(["swapped"]) {
            let folder = folder();
            if stored {
                assert_eq!(
                    ran(&folder, stages("nothing").split("[[stage]]\nid = \"s\"").next().unwrap_or_default()).1,
                    1
                );
            }
            let (result, kept) = ran(&folder, &stages(meanwhile));
            let errors = result.expect_err(meanwhile);
            let message = errors[0].to_string();
            assert!(errors.len() == 1 && message.contains("`s`") && message.contains("r.h5"), "{meanwhile}: {message}");
            assert!(message.contains("changed"), "{meanwhile}, {stored}: {message}");
            assert_eq!(kept, 1, "only the list of records is kept");
            let (result, kept) = ran(&folder, &stages("nothing"));
            let result = result.expect("the file is as it was");
            let values = result.stage("s").and_then(|stage| stage.result.outputs.find(&OUT).ok().flatten());
            let values = values.expect("values").real("value").expect("real").to_vec();
            assert!(values.iter().enumerate().all(|(n, value)| *value == (n % 512) as f64) && kept == 2);
        }
    }
}
