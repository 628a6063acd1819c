//! Configs with plugins of `tests/plugins`, and a built-in stage that makes one artifact of each shape.

use std::path::{Path, PathBuf};

use afmid_pipeline::cache::Cache;
use afmid_pipeline::plugin::{AllStages, Plugins, Rule};
use afmid_pipeline::recording::{
    Codes, InputFiles, NativeChannel, NativeRecord, RecordStorage, Wanted, open_native, write_native,
};
use afmid_pipeline::runner::{Options, Quiet, RunError, run};
use afmid_pipeline::{
    Array, Axis, Context, Document, Entry, Example, Matrix, Plan, Port, Ports, Problem, Recording, Registry, RunResult,
    Spec, Stage, StageError, StateSpace, Table, graph,
};
use num_complex::Complex64;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// The Python of `make test-deps`, with h5py and numpy.
pub fn python() -> String {
    let python = Path::new(ROOT).join(".tools/bin/python");
    assert!(python.exists(), "{} is missing: run `make test-deps`", python.display());
    python.display().to_string()
}

/// A script of `tests/plugins`.
pub fn script(name: &str) -> String {
    Path::new(ROOT).join("tests/plugins").join(name).display().to_string()
}

/// A config with one plugin `mine` and the lines of its stages.
pub fn config(script: &str, timeout_s: f64, stages: &str) -> String {
    let python = python();
    format!(
        "[pipeline]\nname = \"plugins\"\nseed = 7\n[plugins]\n\
         mine = {{ command = [{python:?}, {script:?}], timeout_s = {timeout_s:?} }}\n{stages}"
    )
}

pub fn registry() -> Registry {
    Registry::new().with(&[Entry::of::<All>()]).expect("one name")
}

/// Plans with plugins that may all start. Their processes wait for the run: they end with the test.
pub fn plan(folder: &Path, text: &str) -> Result<Plan, Vec<Problem>> {
    plan_with(folder, text, Box::leak(Box::new(Plugins::new(Rule::All, None))))
}

pub fn plan_with(folder: &Path, text: &str, plugins: &Plugins) -> Result<Plan, Vec<Problem>> {
    let file = folder.join("config.toml").display().to_string();
    graph::load(&file, text, &[], &AllStages { registry: &registry(), plugins })
}

pub fn execute(folder: &Path, plan: &Plan) -> Result<RunResult, Vec<RunError>> {
    let cache = Cache::open(&folder.join("cache"));
    let program = "afmid test".to_owned();
    run(
        plan,
        &Options {
            base: folder.to_owned(),
            cache: &cache,
            files: cache.input_files(false),
            fresh: false,
            program,
            overrides: Vec::new(),
            observer: &Quiet,
        },
    )
}

pub const ARRAY: Port<Array> = Port::new("array", "wave", "every kind of variable");
pub const TABLE: Port<Table> = Port::new("table", "", "every kind of column");
pub const MODEL: Port<StateSpace> = Port::new("state_space", "", "a model");
pub const DOCUMENT: Port<Document> = Port::new("document", "", "a document");
pub const RECORDING: Port<Recording> = Port::new("recording", "", "a record");

/// One artifact of each shape.
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct All {
    /// Changes nothing.
    pub nothing: u32,
}

impl Stage for All {
    const SPEC: Spec = Spec {
        name: "test.all",
        version: 1,
        summary: "one artifact of each shape",
        inputs: &[],
        outputs: &[ARRAY.spec(), TABLE.spec(), MODEL.spec(), DOCUMENT.spec(), RECORDING.spec()],
        source: "",
        ..Spec::STORED
    };

    fn run(&self, _inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        let path = record(cx.base());
        let record = open_native(
            &InputFiles::new(),
            &path,
            &[Wanted { role: "deflection", location: "/deflection", required: true }],
        )?;
        Ok(Ports::new()
            .with(&ARRAY, array())
            .with(&TABLE, table())
            .with(&MODEL, model())
            .with(&DOCUMENT, Document(serde_json::json!({ "a": [1, null, "\u{e9}\n"], "b": 0.1 })))
            .with(&RECORDING, Recording { records: vec![record] }))
    }

    fn examples() -> Vec<Example> {
        Vec::new()
    }
}

/// A record of four samples.
pub fn record(folder: &Path) -> PathBuf {
    let path = folder.join("record.h5");
    let channel = NativeChannel {
        location: "deflection".to_owned(),
        codes: Codes::Int16(vec![1, 2, 3, -4]),
        unit: "V".to_owned(),
        scale_factor: 0.5,
        add_offset: 1.0,
        long_name: "deflection".to_owned(),
    };
    let record = NativeRecord { sample_rate_hz: 5e6, started_at: String::new(), channels: vec![channel] };
    write_native(&path, &record, RecordStorage::Raw).expect("a record");
    path
}

pub fn array() -> Array {
    let real = vec![0.1, -0.0, f64::NAN, 1e-300, 5e-324, 2.0];
    let complex: Vec<Complex64> = real.iter().map(|&value| Complex64::new(value, 1.0 / 3.0)).collect();
    let axes = vec![
        Axis::new("event", "1", "event", vec![0.0, 1.0]),
        Axis::new("time", "s", "time", vec![0.0, 1e-6, 2e-6]),
        Axis::new("none", "1", "nothing", vec![]),
    ];
    Array::over(axes)
        .with("signal", "V", "a signal", &["event", "time"], real)
        .with("transfer", "1", "a transfer function", &["event", "time"], complex)
        .with("count", "1", "whole numbers", &["event"], vec![(1_i64 << 53) + 1, i64::MIN])
        .with("empty", "1", "no values", &["none"], Vec::<f64>::new())
        .with("scalar", "1", "one value", &[], vec![0.3])
        .attribute("gain", 0.1)
        .attribute("kind", "free")
        .attribute("events", 2_i64)
        .attribute("aligned", true)
}

pub fn table() -> Table {
    Table::new()
        .with("frequency_hz", "Hz", "frequency", vec![46_300.1, f64::NAN])
        .with("mode", "1", "mode", vec![1_i64, 2])
        .with("kept", "", "whether it is kept", vec![true, false])
        .with("name", "", "name", vec!["one".to_owned(), "zw\u{f6}lf \"x\"".to_owned()])
        .attribute("rows", 2_i64)
}

pub fn model() -> StateSpace {
    let matrix = |rows, columns, values: &[f64]| Matrix::new(rows, columns, values.to_vec()).expect("fits");
    StateSpace {
        a: matrix(2, 2, &[0.9, 0.1, -0.1, 0.8]),
        b: matrix(2, 1, &[1.0, 0.5]),
        c: matrix(1, 2, &[1.0, 0.0]),
        d: matrix(1, 1, &[0.0]),
        k: matrix(2, 1, &[0.1, 1.0 / 3.0]),
        x0: vec![0.0, 1e-9],
        sample_time_s: 2e-7,
        innovation_variance: 1.0 / 7.0,
        parameter_names: vec!["f".to_owned(), "q".to_owned()],
        parameters: vec![46_300.1, 40.8],
        covariance: matrix(2, 2, &[1.0, 0.1, 0.1, 2.0]),
        ..StateSpace::default()
    }
}
