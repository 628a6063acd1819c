//! Rows that a run leaves in a file of the cache: a file that is changed in place and changed back while a stage reads
//! it gives no other numbers under a right key.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use afmid_pipeline::cache::Cache;
use afmid_pipeline::graph::load;
use afmid_pipeline::rows::{RowSource, in_blocks};
use afmid_pipeline::runner::{Failed, Options, Quiet, run_to_file};
use afmid_pipeline::{
    Array, Axis, Context, Document, Entry, Example, Port, Ports, Registry, RunResult, Spec, Stage, StageError,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::small::{altered, cached, overwrite_unseen};

/// More than stays in memory when it comes from the cache: 9.8 MB.
const ROWS: [usize; 2] = [300, 4096];

const SIGNAL: Port<Array> = Port::new("signal", "", "rows that are too many for memory");
const SUM: Port<Document> = Port::new("sum", "", "the sum of the bits of all values");

/// The file that the second stage changes while it reads, if it is to change one.
static DISTURBED: Mutex<Option<PathBuf>> = Mutex::new(None);

/// Makes rows.
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Rows {}

impl Stage for Rows {
    const SPEC: Spec =
        Spec { name: "test.rows", version: 1, summary: "rows", outputs: &[SIGNAL.spec()], ..Spec::STORED };

    fn run(&self, _inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        let axis = |name: &str, length: usize| Axis::new(name, "1", name, (0..length).map(|k| k as f64).collect());
        let values: Vec<f64> = (0..ROWS[0] * ROWS[1]).map(|k| (k as f64).sin()).collect();
        let axes = vec![axis("event", ROWS[0]), axis("time", ROWS[1])];
        Ok(Ports::new().with(&SIGNAL, Array::over(axes).with("signal", "V", "", &["event", "time"], values)))
    }

    fn examples() -> Vec<Example> {
        Vec::new()
    }
}

/// Sums them.
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Sum {}

impl Stage for Sum {
    const SPEC: Spec = Spec {
        name: "test.sum",
        version: 1,
        summary: "their sum",
        inputs: &[SIGNAL.spec()],
        outputs: &[SUM.spec()],
        ..Spec::STORED
    };

    fn run(&self, inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        let disturbed = DISTURBED.lock().expect("no panic").clone();
        let whole = disturbed.as_ref().map(|path| fs::read(path).expect("a stage file"));
        if let (Some(path), Some(whole)) = (&disturbed, &whole) {
            overwrite_unseen(path, &altered(whole));
        }
        let rows = inputs.get(&SIGNAL)?.rows("signal")?;
        let (all, mut sum) = ((0..rows.rows()).collect::<Vec<usize>>(), 0_u64);
        let read = in_blocks(&rows, &all, |_, block| -> Result<(), StageError> {
            let bits = block.iter().flat_map(|row| row.iter()).map(|value| value.to_bits());
            sum = bits.fold(sum, u64::wrapping_add);
            Ok(())
        });
        if let (Some(path), Some(whole)) = (&disturbed, &whole) {
            overwrite_unseen(path, whole);
        }
        read?;
        Ok(Ports::new().with(&SUM, Document(serde_json::json!({ "sum": sum.to_string() }))))
    }

    fn examples() -> Vec<Example> {
        Vec::new()
    }
}

const FIRST: &str = "[pipeline]\nname = \"rows\"\nseed = 1\n[[stage]]\nid = \"rows\"\nuses = \"test.rows\"\n";
const SECOND: &str = "[[stage]]\nid = \"sum\"\nuses = \"test.sum\"\ninputs = { signal = \"rows\" }\n";

fn run(here: &Path, config: &str, cache: &str) -> Result<RunResult, Failed> {
    let registry = Registry::new().with(&[Entry::of::<Rows>(), Entry::of::<Sum>()]).expect("two names");
    let plan = load(&here.join("c.toml").display().to_string(), config, &[], &registry).expect("a config");
    let cache = Cache::open(&here.join(cache));
    let options = Options {
        base: here.to_owned(),
        cache: &cache,
        files: cache.input_files(false),
        fresh: false,
        program: "afmid test".to_owned(),
        overrides: Vec::new(),
        observer: &Quiet,
    };
    run_to_file(&plan, &options, &here.join("out.h5"))
}

fn sum(run: &RunResult) -> String {
    let outputs = &run.stage("sum").expect("a stage").result.outputs;
    outputs.get(&SUM).expect("a document").0["sum"].to_string()
}

#[test]
fn a_cache_file_that_is_changed_and_changed_back_fails_the_stage_that_reads_it() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let both = format!("{FIRST}{SECOND}");
    let truth = sum(&run(here, &both, "other").expect("a run"));
    run(here, FIRST, "cache").expect("a run");
    let files = cached(&here.join("cache"), "h5");
    let [file] = &files[..] else { panic!("{files:?}") };
    let before = fs::read(file).expect("a stage file");

    *DISTURBED.lock().expect("no panic") = Some(file.clone());
    let failed = run(here, &both, "cache");
    *DISTURBED.lock().expect("no panic") = None;
    let Err(Failed::Stages { errors, .. }) = failed else { panic!("the sum of other numbers: {failed:?}") };
    let said = errors[0].to_string();
    assert!(errors.len() == 1 && errors[0].id == "sum", "{errors:?}");
    assert!(said.contains("changed while it was read") && said.contains(&file.display().to_string()), "{said}");
    assert!(fs::read(file).expect("a stage file") == before, "it was changed back");
    assert_eq!(cached(&here.join("cache"), "h5"), files, "nothing made from it is kept");

    let after = run(here, &both, "cache").expect("a run");
    assert_eq!(sum(&after), truth);
    let reused: Vec<bool> = after.info.stages.iter().map(|stage| stage.2).collect();
    assert_eq!(reused, [true, false], "the rows are as they were");
}

#[test]
fn a_cache_file_that_others_use_or_remove_meanwhile_is_read_all_the_same() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let cache = here.join("cache");
    run(here, FIRST, "cache").expect("a run");
    let truth = run(here, FIRST, "cache").expect("a run");
    let signal = truth.stage("rows").expect("a stage").result.outputs.get(&SIGNAL).expect("rows");
    let file = cached(&cache, "h5").remove(0);
    // as another run does that uses it, and `gc`
    fs::File::options()
        .write(true)
        .open(&file)
        .expect("a file")
        .set_modified(std::time::SystemTime::now())
        .expect("set");
    fs::remove_file(&file).expect("removed");
    let values = signal.real("signal").expect("all rows");
    assert!(values.iter().enumerate().all(|(k, value)| *value == (k as f64).sin()));
}
