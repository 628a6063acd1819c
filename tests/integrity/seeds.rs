//! Seeds of the fuzz targets in formats of afmid's own: small files with one of everything, made by the program itself.

use std::fs;
use std::path::Path;

use afmid_pipeline::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, Wanted, open_native, write_native};
use afmid_pipeline::store::{write_result, write_stage};
use afmid_pipeline::{
    Array, Artifact, Attribute, Axis, Document, InputFiles, Matrix, Ports, Recording, RunInfo, RunResult, Shaped,
    SourceFile, StageRecord, StageResult, StateSpace, Table,
};
use num_complex::Complex64;
use serde_json::{Value, json};

use super::entrances::IDENTITY;

/// A seed: target, name, bytes.
pub type Seed = (&'static str, &'static str, Vec<u8>);

/// All of them. The same bytes on every machine.
pub fn seeds(scratch: &Path) -> Vec<Seed> {
    let mut seeds = records(scratch);
    let path = scratch.join("stage.h5");
    write_stage(&path, &IDENTITY, &everything(scratch)).expect("a stage file");
    seeds.push(("stage_file", "whole.h5", fs::read(&path).expect("a stage file")));
    for (name, run) in runs(scratch) {
        let path = scratch.join(name);
        write_result(&path, &run).expect("a result file");
        seeds.push(("result_file", name, fs::read(&path).expect("a result file")));
    }
    seeds
}

fn record(codes: Codes) -> NativeRecord {
    let channel = |location: &str, codes| NativeChannel {
        location: location.to_owned(),
        codes,
        unit: "V".to_owned(),
        scale_factor: 0.5,
        add_offset: 1.0,
        long_name: "a channel".to_owned(),
    };
    let piezo = channel("piezo", Codes::Float32(vec![0.25; 64]));
    let channels = vec![channel("deflection", codes), piezo];
    NativeRecord { sample_rate_hz: 5e6, started_at: "2005-03-01T10:00:00Z".to_owned(), channels }
}

fn records(scratch: &Path) -> Vec<Seed> {
    let ramp: Vec<i16> = (0..64).map(|sample| sample * sample - 500).collect();
    let raw = ("raw.h5", Codes::Int16(ramp.clone()), RecordStorage::Raw);
    let packed =
        ("packed.h5", Codes::Float64(ramp.iter().copied().map(f64::from).collect()), RecordStorage::Deflate(4));
    let written = |(name, codes, storage): (&'static str, Codes, RecordStorage)| {
        let path = scratch.join(name);
        write_native(&path, &record(codes), storage).expect("a record");
        ("native_record", name, fs::read(&path).expect("a record"))
    };
    vec![written(raw), written(packed)]
}

/// A recording whose file is said to lie in a folder that is not there.
fn recording(scratch: &Path) -> Recording {
    let wanted = [Wanted { role: "deflection", location: "/deflection", required: true }];
    let mut record = open_native(&InputFiles::new(), &scratch.join("raw.h5"), &wanted).expect("a record");
    record.path = "archive/raw.h5".into();
    Recording { records: vec![record] }
}

fn axis(name: &str, unit: &str, length: usize) -> Axis {
    Axis::new(name, unit, name, (0..length).map(|index| index as f64).collect())
}

fn array() -> Array {
    Array::over(vec![axis("event", "1", 2), axis("time", "s", 4)])
        .with("signal", "V", "signal", &["event", "time"], vec![0.5, f64::NAN, f64::INFINITY, -0.0, 1.0, 2.0, 3.0, 4.0])
        .with("count", "1", "count", &["time"], vec![i64::MIN, 0, 1, i64::MAX])
        .attribute("kind", "snap-off")
        .attribute("sample_rate_hz", 5e6)
        .attribute("onset_sample", 1_usize)
        .attribute("tapered", true)
}

fn table() -> Table {
    Table::new()
        .with("record", "", "file", vec!["a.h5".to_owned(), "ü漢".to_owned()])
        .with("frequency_hz", "Hz", "frequency", vec![46.3e3, f64::NAN])
        .with("event", "1", "event", vec![0_i64, -1])
        .with("accepted", "", "accepted", vec![true, false])
}

fn model() -> StateSpace {
    StateSpace {
        a: Matrix { rows: 2, columns: 2, values: vec![0.9, 0.1, -0.1, 0.9] },
        b: Matrix::column(vec![1.0, 0.5]),
        c: Matrix::row(vec![1.0, 0.0]),
        d: Matrix::row(vec![0.0]),
        k: Matrix::column(vec![0.1, 0.2]),
        x0: vec![0.0, 1e-300],
        sample_time_s: 2e-7,
        innovation_variance: 1e-6,
        parameter_names: vec!["a1".to_owned(), "a2".to_owned()],
        parameters: vec![1.5, -0.7],
        covariance: Matrix { rows: 2, columns: 2, values: vec![1.0, 0.1, 0.1, 2.0] },
        attributes: [("converged".to_owned(), Attribute::Flag(true))].into(),
    }
}

fn result(outputs: Vec<(&str, Artifact)>) -> StageResult {
    let mut ports = Ports::new();
    for (port, artifact) in outputs {
        ports.insert(port, artifact);
    }
    StageResult { outputs: ports, warnings: vec!["a warning".to_owned()] }
}

fn everything(scratch: &Path) -> StageResult {
    result(vec![
        ("array", array().wrap()),
        ("table", table().wrap()),
        ("model", model().wrap()),
        ("document", Document(json!({"found": 24, "q": 0.1 + 0.2, "none": null, "list": [{"a": "b"}]})).wrap()),
        ("recording", recording(scratch).wrap()),
    ])
}

fn stage(id: &str, uses: &str, from: Option<&str>, params: Value, outputs: Vec<(&str, Artifact)>) -> StageRecord {
    StageRecord {
        id: id.to_owned(),
        uses: uses.to_owned(),
        version: 1,
        params,
        wires: from.map(|from| ("input".to_owned(), from.to_owned(), "output".to_owned())).into_iter().collect(),
        seed: Some(7),
        key: "cd".repeat(32),
        sources: vec![SourceFile { path: "archive/a.h5".to_owned(), size: 12, blake3: "ef".repeat(32) }],
        result: result(outputs),
    }
}

fn run(name: &str, stages: Vec<StageRecord>) -> RunResult {
    let times = stages.iter().map(|stage| (stage.id.clone(), 0.5, false)).collect();
    RunResult {
        name: name.to_owned(),
        seed: 1,
        config: "[pipeline]\nname = \"seed\"\n".to_owned(),
        overrides: vec!["events.kind=\"snap-in\"".to_owned()],
        program: "afmid 0.1.0".to_owned(),
        stages,
        info: RunInfo {
            started_at: "2026-01-01T00:00:00Z".to_owned(),
            seconds: 1.5,
            host: "host".to_owned(),
            threads: 2,
            folder: "/nowhere".to_owned(),
            config_file: "seed.toml".to_owned(),
            stages: times,
            logs: vec![("records".to_owned(), "said on stderr\n".to_owned())],
            unfinished: Vec::new(),
        },
    }
}

/// Small runs: each with a part of what pages and figures are made of.
fn runs(scratch: &Path) -> [(&'static str, RunResult); 4] {
    let records = vec![("records", recording(scratch).wrap())];
    let records = stage("records", "io.records", None, json!({"files": ["archive/*.h5"]}), records);
    let fitted = vec![("model", model().wrap())];
    let fitted = stage("model", "model.pem", Some("records"), json!({"order": 2}), fitted);
    let found = vec![("ensemble", array().wrap()), ("events", table().wrap())];
    let events = || stage("events", "events.correlation", None, json!({"kind": "snap-off"}), found.clone());
    let force = stage("force", "force.extrapolation", Some("events"), json!({}), vec![("pair", pair().wrap())]);
    let etfe = stage("etfe", "spectrum.etfe", None, json!({}), vec![("estimate", estimate().wrap())]);
    let diagnosed = vec![("summary", Document(diagnosis()).wrap())];
    let diagnosed = stage("diagnosis", "diagnosis.release", Some("etfe"), json!({}), diagnosed);
    [
        ("whole.h5", run("fitted", vec![records, fitted])),
        ("modes.h5", run("modes", vec![modes()])),
        ("events.h5", run("events", vec![events(), force])),
        ("diagnosis.h5", run("diagnosis", vec![etfe, diagnosed])),
    ]
}

fn modes() -> StageRecord {
    let summary = json!({
        "modes": [{
            "frequency_hz": 46.3e3, "frequency_std_hz": 0.4, "quality_factor": 40.8, "quality_factor_std": 0.05, "static_share": 0.9
        }],
        "fit_percent": {"identification": 99.8, "held_out": 99.7, "noise_ceiling": 99.9},
    });
    let roots = Table::new()
        .with("kind", "", "kind", vec!["pole".to_owned(), "zero".to_owned()])
        .with("class", "", "class", vec!["mechanical".to_owned(), String::new()])
        .with("frequency_hz", "Hz", "frequency", vec![46.3e3, 110e3])
        .with("quality_factor", "1", "quality factor", vec![40.8, 60.0])
        .with("z_re", "1", "real", vec![0.9, -2.7])
        .with("z_im", "1", "imaginary", vec![0.1, 0.0]);
    let outputs = vec![("roots", roots.wrap()), ("summary", Document(summary).wrap())];
    stage("modes", "model.modes", None, json!({}), outputs)
}

fn pair() -> Array {
    Array::over(vec![axis("time", "s", 6)])
        .with("response", "V", "response", &["time"], vec![-1.0, -1.0, 0.5, -0.2, 0.1, 0.0])
        .with("force", "V", "force", &["time"], vec![-1.0, -1.0, 0.0, 0.0, 0.0, 0.0])
        .with("standard_error", "V", "standard error", &["time"], vec![0.1; 6])
        .attribute("kind", "snap-off")
}

fn estimate() -> Array {
    let transfer: Vec<Complex64> = (0..5).map(|k| Complex64::new(1.0, -f64::from(k))).collect();
    Array::over(vec![axis("frequency_hz", "Hz", 5)])
        .with("transfer", "1", "transfer function", &["frequency_hz"], transfer)
        .with("variance", "1", "variance", &["frequency_hz"], vec![1e-3; 5])
}

fn diagnosis() -> Value {
    json!({
        "verdict": "named",
        "baseline": {"adequate": true, "order": 2, "parameters": {}, "noise_rms": 0.0012, "distortion_rms": 0.00002},
        "causes": [{"id": "quadratic-detector", "class": ["quadratic-detector"], "p_value": 1e-9,
            "parameters": {"a2": {"value": 0.061, "std": 0.001, "unit": "1/V"}},
            "gain": {"rms_before": 0.0041, "rms_after": 0.0012, "unit": "V", "log_likelihood": 812.4, "held_out": "8 events"},
            "runner_up": {"id": "extra-mode", "share_of_gain": 0.78}, "next_measurement": "shift the spot"}],
        "evidence": ["a line"], "modes_before": [], "modes_after": [], "validation": [],
    })
}
