//! One artifact of every shape, with everything that is hard to store.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use num_complex::Complex64;
use serde_json::json;

use super::StageIdentity;
use crate::artifact::{Array, Artifact, Attribute, Axis, Document, Matrix, Shape, StateSpace, Table};
use crate::outcome::{PortSpec, Ports, RunInfo, RunResult, SourceFile, StageRecord, StageResult};
use crate::recording::{Channel, InputFiles, LazySource, RawBinary, Reading, Record, Recording};

pub(crate) fn array() -> Array {
    let samples = 5;
    let ensemble: Vec<f64> = (0..3 * samples).map(|index| index as f64 * 0.1).collect();
    Array::over(vec![
        Axis::new("event", "1", "event", vec![0.0, 1.0, 2.0]),
        Axis::new("time", "s", "time since the onset", (0..samples).map(|index| index as f64 * 2e-7).collect()),
    ])
    .with("response", "V", "photodiode signal", &["event", "time"], ensemble)
    .with("mean", "V", "averaged signal", &["time"], vec![f64::NAN, f64::INFINITY, -0.0, f64::NEG_INFINITY, 1e-310])
    .with("count", "1", "samples averaged", &["time"], vec![i64::MIN, 0, 1, 2, i64::MAX])
    .with("gain", "1", "one number", &[], vec![2.5])
    .attribute("bandwidth_hz", 2.5e5)
    .attribute("signal", "a name that NeXus uses itself")
    .attribute("unknown", f64::NAN)
    .attribute("events", 3_usize)
    .attribute("tapered", true)
    .attribute("unit_text", "µ-Volt ü 漢 🙂")
    .attribute("empty", "")
}

pub(crate) fn spectrum() -> Array {
    let transfer: Vec<Complex64> = (0..4).map(|index| Complex64::new(f64::from(index), -0.0)).collect();
    Array::over(vec![Axis::new("frequency", "Hz", "frequency", vec![0.0, 1e3, 2e3, 3e3])])
        .with("transfer", "V/N", "transfer function", &["frequency"], transfer)
        .with("variance", "V^2/N^2", "variance", &["frequency"], vec![1.0, 2.0, 3.0, f64::NAN])
}

pub(crate) fn table() -> Table {
    let long = "x".repeat(70_000);
    Table::new()
        .with("record", "", "file", vec!["a.h5".to_owned(), String::new(), "ü漢🙂".to_owned(), long])
        .with("frequency", "Hz", "frequency", vec![46.3e3, f64::NAN, f64::INFINITY, -0.0])
        .with("row", "1", "a name that the scale would like", vec![1_i64, -2, i64::MAX, i64::MIN])
        .with("accepted", "", "", vec![true, false, true, false])
        .attribute("kind", "snap-off")
}

pub(crate) fn model() -> StateSpace {
    StateSpace {
        a: Matrix { rows: 2, columns: 2, values: vec![0.9, 0.1, -0.1, 0.9] },
        b: Matrix::column(vec![1.0, 0.5]),
        c: Matrix::row(vec![1.0, 0.0]),
        d: Matrix { rows: 1, columns: 1, values: vec![0.0] },
        k: Matrix::column(vec![0.1, 0.2]),
        x0: vec![0.0, 1e-300],
        sample_time_s: 2e-7,
        innovation_variance: 1e-6,
        parameter_names: vec!["a1".to_owned(), "a2".to_owned()],
        parameters: vec![1.5, -0.7],
        covariance: Matrix { rows: 2, columns: 2, values: vec![1.0, 0.1, 0.1, 2.0] },
        attributes: BTreeMap::from([("converged".to_owned(), Attribute::Flag(true))]),
    }
}

pub(crate) fn recording() -> Recording {
    let raw = Reading::of("auto", Some(RawBinary { channels: 2, scale_factor: 0.1 + 0.2, ..RawBinary::default() }));
    // the last record is a stretch of a file without a header
    let part = |index: usize| if index == 2 { (70_000, raw.clone()) } else { (0, Reading::default()) };
    let channel = |index: usize, path: &Path, role: &str, fill_code| Channel {
        role: role.to_owned(),
        location: format!("/{role}"),
        samples: 900_000,
        unit: "V".to_owned(),
        long_name: "photodiode signal".to_owned(),
        scale_factor: 0.000977,
        add_offset: 0.0,
        fill_code,
        source: Arc::new(
            LazySource::new(&InputFiles::new(), path, (600_000, &"ab".repeat(32)), &format!("/{role}"), 900_000)
                .of_stretch(part(index).0, &part(index).1),
        ),
    };
    let path = |index: usize| PathBuf::from(format!("archive/record_{index:04}.h5"));
    let record = |index: usize| Record {
        name: format!("record_{index:04}.h5"),
        path: path(index),
        size: 600_000,
        blake3: "ab".repeat(32),
        sample_rate_hz: 5e6,
        started_at: "2005-03-01T10:00:00Z".to_owned(),
        rate_relative_std: 0.0,
        first_sample: part(index).0,
        reading: part(index).1,
        channels: vec![
            channel(index, &path(index), "deflection", Some(-32768.0)),
            channel(index, &path(index), "piezo", None),
        ],
    };
    Recording { records: (0..3).map(record).collect() }
}

pub(crate) fn document() -> Document {
    // 0.1 + 0.2 and the last number are read back wrongly by parsers that do not round correctly
    Document(json!({"found": 24, "rejected": [{"record": "r.h5", "reason": "no rupture"}], "q": 0.1 + 0.2,
        "f": 46300.10000000001, "none": null, "big": u64::MAX, "tiny": 5e-324, "text": "nul \u{0} and ü"}))
}

/// Shapes without anything in them.
fn empty() -> [(&'static str, Artifact); 5] {
    let columns = Table::new()
        .with("record", "", "file", Vec::<String>::new())
        .with("time", "s", "time", Vec::<f64>::new())
        .with("accepted", "", "", Vec::<bool>::new());
    let none = Array::over(vec![Axis::new("time", "s", "time", Vec::new())])
        .with("signal", "V", "signal", &["time"], Vec::<f64>::new())
        .with("other", "V", "signal", &["time"], Vec::<Complex64>::new());
    [
        ("no-rows", Artifact::Table(Arc::new(columns))),
        ("no-columns", Artifact::Table(Arc::new(Table::new()))),
        ("no-samples", Artifact::Array(Arc::new(none))),
        ("no-model", Artifact::StateSpace(Arc::new(StateSpace::default()))),
        ("version", Artifact::Recording(Arc::new(Recording::default()))),
    ]
}

const fn output(name: &'static str, shape: Shape) -> PortSpec {
    PortSpec { name, shape, tag: "", optional: false, doc: "" }
}

const OUTPUTS: &[PortSpec] = &[
    output("ensemble", Shape::Array),
    output("spectrum", Shape::Array),
    output("events", Shape::Table),
    output("model", Shape::StateSpace),
    output("records", Shape::Recording),
    output("summary", Shape::Document),
    output("no-rows", Shape::Table),
    output("no-columns", Shape::Table),
    output("no-samples", Shape::Array),
    output("no-model", Shape::StateSpace),
    output("version", Shape::Recording),
];

/// What [`stage_result`] is the result of.
pub(crate) fn identity(key: &str) -> StageIdentity<'_> {
    StageIdentity { key, stage: "test.everything", version: 3, outputs: OUTPUTS }
}

pub(crate) fn stage_result() -> StageResult {
    let mut outputs = Ports::new();
    outputs.insert("ensemble", Artifact::Array(Arc::new(array())));
    outputs.insert("spectrum", Artifact::Array(Arc::new(spectrum())));
    outputs.insert("events", Artifact::Table(Arc::new(table())));
    outputs.insert("model", Artifact::StateSpace(Arc::new(model())));
    outputs.insert("records", Artifact::Recording(Arc::new(recording())));
    outputs.insert("summary", Artifact::Document(Arc::new(document())));
    for (name, artifact) in empty() {
        outputs.insert(name, artifact);
    }
    StageResult { outputs, warnings: vec!["the event lies under the taper".to_owned(), String::new()] }
}

pub(crate) fn run_result() -> RunResult {
    let stage = |id: &str, wires: Vec<(String, String, String)>| StageRecord {
        id: id.to_owned(),
        uses: "events.correlation".to_owned(),
        version: 3,
        params: json!({"kind": "snap-off", "window_samples": 8192, "alpha": 0.1, "files": ["*.h5"], "strict": true, "none": null}),
        wires,
        seed: (id == "events").then_some(u64::MAX),
        key: "cd".repeat(32),
        sources: vec![SourceFile { path: "archive/a.h5".to_owned(), size: 12, blake3: "ef".repeat(32) }],
        result: stage_result(),
    };
    RunResult {
        name: "free-lever".to_owned(),
        seed: 1,
        config: "[pipeline]\nname = \"free-lever\" # ü\n".to_owned(),
        overrides: vec!["events.kind=\"snap-in\"".to_owned()],
        program: "0.1.0".to_owned(),
        stages: vec![
            stage("records", Vec::new()),
            stage("free-lever_2", Vec::new()),
            stage("run", Vec::new()),
            stage("events", vec![("records".to_owned(), "records".to_owned(), "records".to_owned())]),
        ],
        info: RunInfo {
            started_at: "2026-01-01T00:00:00Z".to_owned(),
            seconds: 1.5,
            host: "host".to_owned(),
            threads: 2,
            folder: "/home/somebody".to_owned(),
            config_file: "configs/free-lever.toml".to_owned(),
            logs: vec![("plug".to_owned(), "said on stderr\n".to_owned())],
            unfinished: Vec::new(),
            stages: vec![("records".to_owned(), 0.5, false), ("events".to_owned(), 1.0, true)],
        },
    }
}
