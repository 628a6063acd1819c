//! A run such as the paper's, made by hand: four modes in closed form, no stage involved.

use afmid_pipeline::{
    Array, Artifact, Axis, Document, Matrix, Record, Recording, RunInfo, RunResult, Shaped, SourceFile, StageRecord,
    StageResult, StateSpace, Table,
};
use num_complex::Complex64;
use serde_json::{Value, json};

pub(crate) const RATE: f64 = 5e6;
const MODES: [(f64, f64, f64); 4] =
    [(46.3e3, 40.8, 0.898), (247.4e3, 193.2, 0.0794), (580.8e3, 358.0, 0.0166), (1051.2e3, 503.8, 0.006)];

/// A small stream of numbers between -1 and 1.
pub(crate) struct Noise(u64);

impl Noise {
    pub fn new(seed: u64) -> Self {
        Self(seed.wrapping_mul(0x9e37_79b9_7f4a_7c15) | 1)
    }

    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }
}

/// Free ringing after a released load of -1, one before it.
fn ringing(t: f64, stretch: f64) -> f64 {
    if t < 0.0 {
        return -1.0;
    }
    MODES
        .iter()
        .map(|(f, q, g)| {
            let w = std::f64::consts::TAU * f * stretch;
            -g * (-w * t / (2.0 * q)).exp() * (w * t).cos()
        })
        .sum()
}

fn transfer(f: f64, stretch: f64) -> Complex64 {
    MODES
        .iter()
        .map(|(f0, q, g)| {
            let r = f / (f0 * stretch);
            *g / Complex64::new(1.0 - r * r, r / q)
        })
        .sum::<Complex64>()
        / Complex64::new(1.0, f / 1.6e6)
}

/// A block-diagonal discrete model with the modes' poles.
fn model() -> StateSpace {
    let n = 2 * MODES.len();
    let mut a = vec![0.0; n * n];
    let (mut b, mut c) = (vec![0.0; n], vec![0.0; n]);
    for (k, (f, q, g)) in MODES.iter().enumerate() {
        let w = std::f64::consts::TAU * f / RATE;
        let radius = (-w / (2.0 * q)).exp();
        let (re, im) = (radius * w.cos(), radius * w.sin());
        let i = 2 * k;
        for (row, column, value) in [(i, i, re), (i, i + 1, -im), (i + 1, i, im), (i + 1, i + 1, re)] {
            a[row * n + column] = value;
        }
        b[i] = 1.0;
        c[i + 1] = g * w;
    }
    StateSpace {
        a: Matrix { rows: n, columns: n, values: a },
        b: Matrix::column(b),
        c: Matrix::row(c),
        d: Matrix::row(vec![0.0]),
        k: Matrix::column(vec![0.0; n]),
        x0: vec![0.0; n],
        sample_time_s: 1.0 / RATE,
        innovation_variance: 1.2e-8,
        ..StateSpace::default()
    }
}

pub(crate) fn stage(
    id: &str,
    uses: &str,
    wires: &[(&str, &str)],
    params: Value,
    outputs: Vec<(&str, Artifact)>,
) -> StageRecord {
    let mut result = StageResult::default();
    for (port, artifact) in outputs {
        artifact.validate().expect("a whole artifact");
        result.outputs.insert(port, artifact);
    }
    StageRecord {
        id: id.to_owned(),
        uses: uses.to_owned(),
        version: 1,
        params,
        wires: wires.iter().map(|(port, source)| ((*port).to_owned(), (*source).to_owned(), "x".to_owned())).collect(),
        seed: None,
        key: format!(
            "{:064x}",
            id.bytes().fold(7u128, |key, byte| key.wrapping_mul(0x1_0000_01b3).wrapping_add(u128::from(byte)))
        ),
        sources: Vec::new(),
        result,
    }
}

fn records() -> StageRecord {
    let record = |k: usize| Record {
        name: format!("record_{k:04}.h5"),
        path: format!("archive/record_{k:04}.h5").into(),
        size: 6_291_456,
        blake3: format!("{k:064x}"),
        sample_rate_hz: RATE,
        started_at: "2005-06-01T12:00:00Z".to_owned(),
        rate_relative_std: 0.0,
        first_sample: 0,
        reading: afmid_pipeline::recording::Reading::default(),
        channels: Vec::new(),
    };
    let recording = Recording { records: (0..26).map(record).collect() };
    let mut stage =
        stage("records", "io.records", &[], json!({"files": ["archive/*.h5"]}), vec![("records", recording.wrap())]);
    stage.sources = (0..26)
        .map(|k| SourceFile { path: format!("archive/record_{k:04}.h5"), size: 6_291_456, blake3: format!("{k:064x}") })
        .collect();
    stage
}

fn overview() -> StageRecord {
    let n = 4000;
    let time: Vec<f64> = (0..n).map(|k| k as f64 * 0.6 / n as f64).collect();
    let mut noise = Noise::new(5);
    let level = |t: f64| {
        let phase = (t * 5.58).fract();
        if (0.42..0.62).contains(&phase) { 8.0 * (0.5 - (phase - 0.5).abs()) - 3.3 } else { 0.02 * phase }
    };
    let mut extreme =
        |sign: f64| -> Vec<f64> { time.iter().map(|t| level(*t) + sign * 0.01 * (2.0 + noise.next())).collect() };
    let (low, high) = (extreme(-1.0), extreme(1.0));
    let array = Array::over(vec![Axis::new("time", "s", "time", time)])
        .with("minimum", "V", "least value", &["time"], low)
        .with("maximum", "V", "largest value", &["time"], high);
    stage("overview", "io.overview", &[("records", "records")], json!({}), vec![("overview", array.wrap())])
}

fn events(id: &str, kind: &str, count: usize, stretch: f64, amplitude: f64) -> StageRecord {
    let samples = 8192;
    let onset = 1024;
    let time: Vec<f64> = (0..samples).map(|k| (k as f64 - onset as f64) / RATE).collect();
    let mut noise = Noise::new(count as u64);
    let mut signal = Vec::new();
    for _ in 0..count {
        let scale = amplitude * (1.0 + 0.06 * noise.next());
        signal.extend(time.iter().map(|t| scale * ringing(*t, stretch) + 0.002 * noise.next()));
    }
    let ensemble = Array::over(vec![
        Axis::new("event", "1", "event", (0..count).map(|k| k as f64).collect()),
        Axis::new("time", "s", "time after the onset", time),
    ])
    .with("signal", "V", "deflection signal", &["event", "time"], signal)
    .attribute("sample_rate_hz", RATE)
    .attribute("onset_sample", onset as usize)
    .attribute("kind", kind);
    let events = Table::new()
        .with(
            "record",
            "",
            "file name of the record",
            (0..count).map(|k| format!("record_{:04}.h5", k / 4)).collect::<Vec<_>>(),
        )
        .with("event", "1", "place in the ensemble", (0..count as i64).collect::<Vec<_>>())
        .with("time_s", "s", "time of the onset in the record", (0..count).map(|k| 0.1 * k as f64).collect::<Vec<_>>())
        .with("correlation", "1", "correlation with the average", vec![0.9991; count])
        .with("rejected", "", "why it is not in the ensemble", vec![String::new(); count]);
    let summary = Document(json!({"events": {"kind": kind, "records": 26, "found": count,
        "rejected": [{"record": "record_0003.h5", "index": null, "reason": "no rupture"}], "iterations": 4}}));
    stage(
        id,
        "events.correlation",
        &[("records", "records")],
        json!({"kind": kind, "window_samples": samples}),
        vec![("ensemble", ensemble.wrap()), ("events", events.wrap()), ("summary", summary.wrap())],
    )
}

fn force() -> StageRecord {
    let time: Vec<f64> = (0..8192).map(|k| (f64::from(k) - 1024.0) / RATE).collect();
    let mut noise = Noise::new(11);
    let response: Vec<f64> =
        time.iter().map(|t| 0.9 * ringing(*t, 1.0) + 40.0 * t.min(0.0) + 2e-4 * noise.next()).collect();
    let force: Vec<f64> = time.iter().map(|t| if *t < 0.0 { -0.9 + 40.0 * t } else { 0.0 }).collect();
    let n = time.len();
    let pair = Array::over(vec![Axis::new("time", "s", "time since t0", time)])
        .with("response", "V", "deflection above the zero-force line", &["time"], response)
        .with("force", "V", "force, as the static deflection that it causes", &["time"], force)
        .with("standard_error", "V", "standard error of the response", &["time"], vec![2e-4; n])
        .attribute("kind", "snap-off");
    let summary = Document(json!({"load": {"value": -0.9, "std": 0.001, "unit": "V"},
        "force": {"value": -330.2e-9, "std": 1.3e-9, "unit": "N"}, "t0_ambiguity_s": 4e-7}));
    stage(
        "force",
        "force.extrapolation",
        &[("average", "average")],
        json!({}),
        vec![("pair", pair.wrap()), ("summary", summary.wrap())],
    )
}

fn etfe(id: &str, source: &str, stretch: f64, noise_level: f64, smooth: bool) -> StageRecord {
    let f: Vec<f64> = (0..4097).map(|k| f64::from(k) * RATE / 8192.0).collect();
    let mut noise = Noise::new(77);
    let mut h: Vec<Complex64> = f
        .iter()
        .map(|f| transfer(*f, stretch) + noise_level * (1.0 + f / 5e5) * Complex64::new(noise.next(), noise.next()))
        .collect();
    // the band limit, and a removed line
    for (f, h) in f.iter().zip(h.iter_mut()) {
        if *f > 1.8e6 || (smooth && (f - 92.6e3).abs() < 2e3) {
            *h = Complex64::new(f64::NAN, f64::NAN);
        }
    }
    let variance = vec![noise_level * noise_level; f.len()];
    let array = Array::over(vec![Axis::new("frequency_hz", "Hz", "frequency", f)])
        .with("transfer", "1", "transfer function", &["frequency_hz"], h)
        .with("variance", "1", "variance of the transfer function", &["frequency_hz"], variance);
    let uses = if smooth { "spectrum.smoothing" } else { "spectrum.etfe" };
    stage(id, uses, &[("input", source)], json!({}), vec![("estimate", array.wrap())])
}

fn modes() -> StageRecord {
    let w = |f: f64| std::f64::consts::TAU * f / RATE;
    let rows: Vec<(f64, f64, f64, f64)> = MODES
        .iter()
        .map(|(f, q, _)| {
            let radius = (-w(*f) / (2.0 * q)).exp();
            (radius * w(*f).cos(), radius * w(*f).sin(), *f, *q)
        })
        .chain([(0.13, 0.0, 1.62e6, 0.5), (0.04, 0.0, 2.5e6, 0.5), (-0.2, 0.3, 1.9e6, 0.8)])
        .collect();
    let zeros: Vec<(f64, f64, f64, f64)> = [(110e3, 60.0), (470e3, 210.0), (905e3, 320.0)]
        .iter()
        .map(|(f, q)| {
            let radius = (-w(*f) / (2.0 * q)).exp();
            (radius * w(*f).cos(), radius * w(*f).sin(), *f, *q)
        })
        .chain([(-2.7, 0.0, 0.0, 0.5), (-0.3, 0.0, 0.0, 0.5)])
        .collect();
    let both: Vec<(f64, f64, f64, f64)> = rows.iter().chain(&zeros).copied().collect();
    let column = |pick: fn(&(f64, f64, f64, f64)) -> f64| both.iter().map(pick).collect::<Vec<f64>>();
    let kinds =
        rows.iter().map(|_| "pole").chain(zeros.iter().map(|_| "zero")).map(str::to_owned).collect::<Vec<String>>();
    let classes =
        both.iter().map(|row| if row.3 > 5.0 { "mechanical" } else { "detector" }.to_owned()).collect::<Vec<String>>();
    let roots = Table::new()
        .with("kind", "", "pole or zero", kinds)
        .with("class", "", "what a pole belongs to", classes)
        .with("frequency_hz", "Hz", "abs(s) / 2 pi", column(|row| row.2))
        .with("frequency_std_hz", "Hz", "its standard error", column(|row| row.2 * 4e-6))
        .with("quality_factor", "1", "abs(s) / (-2 Re s)", column(|row| row.3))
        .with("quality_factor_std", "1", "its standard error", column(|row| row.3 * 0.02))
        .with("z_re", "1", "in the z plane", column(|row| row.0))
        .with("z_im", "1", "in the z plane", column(|row| row.1));
    let reference = [46.2e3, 247e3, 581e3, 1051e3];
    let list: Vec<Value> = MODES
        .iter()
        .map(|(f, q, g)| {
            json!({"frequency_hz": f * 1.000_002, "frequency_std_hz": f * 4e-6, "quality_factor": q * 1.003, "quality_factor_std": q * 0.004,
                "static_share": g, "static_share_std": 1e-4})
        })
        .collect();
    let compared: Vec<Value> = MODES
        .iter()
        .zip(reference)
        .map(|((f, q, _), reference)| {
            json!({"reference_frequency_hz": reference, "reference_quality_factor": q, "frequency_hz": f * 1.000_002, "quality_factor": q * 1.003})
        })
        .collect();
    let summary = Document(json!({"modes": list, "reference": compared,
        "fit_percent": {"identification": 99.8312, "held_out": 99.8034, "noise_ceiling": 99.8411}}));
    stage(
        "modes",
        "model.modes",
        &[("model", "model")],
        json!({}),
        vec![("roots", roots.wrap()), ("summary", summary.wrap())],
    )
}

fn drift() -> StageRecord {
    let groups = Table::new()
        .with(
            "order",
            "",
            "how its events were chosen",
            ["ordered", "random"].iter().flat_map(|o| vec![(*o).to_owned(); 4]).collect::<Vec<String>>(),
        )
        .with("group", "1", "number of the group", vec![0_i64, 1, 2, 3, 0, 1, 2, 3])
        .with("events", "1", "events in it", vec![21_i64; 8])
        .with(
            "correlation",
            "1",
            "correlation",
            (0..8).map(|k| 1.0 - 1e-6 * (1.0 + 0.3 * f64::from(k))).collect::<Vec<_>>(),
        );
    let summary = Document(json!({"events": 84, "p_value": 0.41, "z_score": -0.2}));
    stage(
        "drift",
        "ensemble.drift",
        &[("ensemble", "events")],
        json!({}),
        vec![("groups", groups.wrap()), ("summary", summary.wrap())],
    )
}

fn residual() -> StageRecord {
    let time: Vec<f64> = (0..8192).map(|k| (f64::from(k) - 1024.0) / RATE).collect();
    let mut noise = Noise::new(3);
    let values: Vec<f64> = time.iter().map(|_| 2e-4 * noise.next()).collect();
    let array = Array::over(vec![Axis::new("time", "s", "time since t0", time)]).with(
        "residual",
        "V",
        "what is left",
        &["time"],
        values,
    );
    stage(
        "model",
        "model.pem",
        &[("pair", "force")],
        json!({"order": 11}),
        vec![("model", model().wrap()), ("residual", array.wrap())],
    )
}

fn periodogram() -> StageRecord {
    let f: Vec<f64> = (0..4097).map(|k| f64::from(k) * RATE / 8192.0).collect();
    let input: Vec<f64> = f.iter().map(|f| 1e-4 / (1.0 + (f / 610.0).powi(2))).collect();
    let output: Vec<f64> = f.iter().zip(&input).map(|(f, u)| u * transfer(*f, 1.0).norm_sqr() + 1e-13).collect();
    let array = Array::over(vec![Axis::new("frequency_hz", "Hz", "frequency", f)])
        .with("input", "V^2/Hz", "input", &["frequency_hz"], input)
        .with("output", "V^2/Hz", "output", &["frequency_hz"], output);
    stage("periodogram", "spectrum.periodogram", &[("pair", "force")], json!({}), vec![("periodogram", array.wrap())])
}

fn calibration() -> StageRecord {
    let summary =
        Document(json!({"stiffness_n_per_m": {"value": 3.81, "std": 0.12, "unit": "N/m"}, "temperature_k": 298.15}));
    stage("calibration", "calibration.thermal", &[("records", "records")], json!({}), vec![("summary", summary.wrap())])
}

/// The paper's run.
pub(crate) fn paper() -> RunResult {
    let mut force = force();
    force.result.warnings =
        vec!["t0 is uncertain by 2 samples (0.4 µs): the delay of the response is known no better <&>".to_owned()];
    let stages = vec![
        records(),
        overview(),
        events("events", "snap-off", 84, 1.0, 0.9),
        events("snap-in", "snap-in", 89, 1.35, 0.2),
        stage("average", "ensemble.average", &[("ensemble", "events")], json!({}), vec![]),
        drift(),
        force,
        periodogram(),
        etfe("etfe", "force", 1.0, 3e-4, false),
        etfe("smooth", "etfe", 1.0, 1e-5, true),
        etfe("coupled-etfe", "snap-in", 1.35, 4e-3, false),
        etfe("coupled-smooth", "coupled-etfe", 1.35, 4e-4, true),
        residual(),
        modes(),
        calibration(),
    ];
    let timings = stages.iter().enumerate().map(|(k, stage)| (stage.id.clone(), 0.04 * k as f64, k % 3 == 0)).collect();
    RunResult {
        name: "paper".to_owned(),
        seed: 1,
        config: "[pipeline]\nname = \"paper\" # <config> & more\nseed = 1\n\n[[stage]]\nid = \"records\"\n\
            uses = \"io.records\"\n"
            .to_owned(),
        overrides: vec!["records.files=[\"a.h5\"]".to_owned()],
        program: "afmid 0.1.0".to_owned(),
        stages,
        info: RunInfo {
            started_at: "2026-11-21T02:00:00Z".to_owned(),
            seconds: 12.3,
            host: "bench".to_owned(),
            threads: 2,
            folder: "/home/somebody".to_owned(),
            config_file: "configs/free-lever.toml".to_owned(),
            logs: Vec::new(),
            unfinished: Vec::new(),
            stages: timings,
        },
    }
}
