//! Diagnoses made by hand.

use afmid_pipeline::{Array, Axis, Document, RunInfo, RunResult, Shaped, StageRecord, Table};
use serde_json::{Value, json};

use crate::report::fixture::{Noise, RATE, stage};

/// The JSON of a bent detector.
pub(crate) fn named() -> Value {
    json!({"verdict": "named", "p_value": 1e-120,
        "causes": [{"id": "quadratic-detector", "class": ["quadratic-detector"], "p_value": 1e-120,
            "parameters": {"a2": {"value": 0.01201, "std": 0.00009, "unit": "1/V"}},
            "gain": {"rms_before": 0.00412, "rms_after": 0.00123, "unit": "V", "log_likelihood": 812.4, "held_out": "10 events in two halves"},
            "runner_up": {"id": "extra-mode", "share_of_gain": 0.862}, "next_measurement": "halve the <laser> power"}],
        "evidence": ["a residual common to all events at 92.6 kHz, near 2 f1"], "nearest": [],
        "modes_before": [{"frequency_hz": 46310.0, "frequency_std_hz": 2.0, "quality_factor": 41.0, "quality_factor_std": 0.1},
            {"frequency_hz": 247400.0, "frequency_std_hz": null, "quality_factor": 193.0, "quality_factor_std": 1.0}],
        "modes_after": [{"frequency_hz": 46300.0, "frequency_std_hz": 1.5, "quality_factor": 40.8, "quality_factor_std": 0.1},
            {"frequency_hz": 247401.0, "frequency_std_hz": 3.0, "quality_factor": 193.2, "quality_factor_std": 1.0}],
        "validation": [],
        "ladder": [{"added": "linear lever and detector", "parameters": 14, "rms": 0.00391, "held_out_rms": null, "unit": "V", "log_likelihood_gain": null, "bic": 5.0},
            {"added": "quadratic-detector", "parameters": 15, "rms": 0.000381, "held_out_rms": 0.00123, "unit": "V", "log_likelihood_gain": 25134.2, "bic": 4.0}],
        "false_alarm_rate": 0.01})
}

/// Nothing is wrong.
pub(crate) fn clean() -> Value {
    let mut answer = named();
    answer["verdict"] = json!("clean");
    answer["p_value"] = json!(0.046);
    answer["causes"] = json!([]);
    answer["evidence"] = json!([]);
    answer["ladder"] = json!([answer["ladder"][0]]);
    answer["modes_after"] = answer["modes_before"].clone();
    answer
}

/// Something is wrong, and nothing accounts for it.
pub(crate) fn unexplained() -> Value {
    let mut answer = clean();
    answer["verdict"] = json!("unexplained");
    answer["p_value"] = json!(1e-9);
    answer["evidence"] = json!(["extra-mode would ring at 2 f1"]);
    answer["nearest"] =
        json!([{"id": "extra-mode", "share_of_gain": 0.97}, {"id": "mode-coupling", "share_of_gain": null}]);
    answer
}

/// The parts that judge a system.
pub(crate) fn of_system() -> Value {
    let mut answer = named();
    answer["causes"][0]["id"] = json!("duffing");
    answer["causes"][0]["class"] = json!(["duffing", "output-cubic"]);
    answer["ladder"][1]["added"] = json!("duffing");
    answer["validation"] = json!([{"name": "multisine", "rms_before": 0.01475, "rms_after": 0.000239, "unit": "V"},
        {"name": "arrow", "rms_before": null, "rms_after": 0.000312, "unit": "V"}]);
    answer
}

fn run(stages: Vec<StageRecord>) -> RunResult {
    RunResult {
        name: "diagnosed".to_owned(),
        seed: 1,
        config: String::new(),
        overrides: Vec::new(),
        program: "afmid".to_owned(),
        stages,
        info: RunInfo::default(),
    }
}

/// A run of `diagnosis.release` with this answer.
pub(crate) fn release(answer: Value) -> RunResult {
    let mut noise = Noise::new(9);
    let n = 4000;
    let time: Vec<f64> = (0..n).map(|k| (f64::from(k) - 16.0) / RATE).collect();
    let wave =
        |t: f64, f: f64| if t < 0.0 { -1.0 } else { -(-3500.0 * t).exp() * (std::f64::consts::TAU * f * t).cos() };
    let measured: Vec<f64> = time.iter().map(|t| wave(*t, 46.3e3) + 1e-4 * noise.next()).collect();
    let before: Vec<f64> = time.iter().map(|t| 4e-3 * wave(*t, 92.6e3) + 1e-4 * noise.next()).collect();
    let after: Vec<f64> = time.iter().map(|_| 1e-4 * noise.next()).collect();
    let less = |rest: &[f64]| -> Vec<f64> { measured.iter().zip(rest).map(|(y, r)| y - r).collect() };
    let f: Vec<f64> = (0..2001).map(|k| f64::from(k) * RATE / 4000.0).collect();
    let density =
        |peak: f64| -> Vec<f64> { f.iter().map(|f| 1e-15 + peak / (1.0 + ((f - 92.6e3) / 1e3).powi(2))).collect() };
    let (t, q, e) = (&["time"], &["frequency"], &["event"]);
    let (linear, extended) = (less(&before), less(&after));
    let residuals = Array::over(vec![
        Axis::new("time", "s", "time after the release", time),
        Axis::new("frequency", "Hz", "frequency", f.clone()),
        Axis::new("event", "1", "event", (0..10).map(f64::from).collect()),
        Axis::new("level", "V", "level at the converter", (0..20).map(|k| 0.1 * f64::from(k) - 1.0).collect()),
        Axis::new("position", "m", "position of the piezo", (0..12).map(|k| 2e-8 * f64::from(k)).collect()),
    ])
    .with(
        "level_before",
        "V",
        "",
        &["level"],
        (0..20).map(|k| 1e-5 * f64::from((k - 10) * (k - 10))).collect::<Vec<_>>(),
    )
    .with("level_before_std", "V", "", &["level"], vec![5e-5; 20])
    .with("level_after", "V", "", &["level"], vec![1e-5; 20])
    .with("level_after_std", "V", "", &["level"], vec![5e-5; 20])
    .with("free_before", "V", "", &["position"], (0..12).map(|k| 1e-4 * f64::from(k - 6)).collect::<Vec<_>>())
    .with("free_before_std", "V", "", &["position"], vec![5e-5; 12])
    .with("free_after", "V", "", &["position"], vec![0.0; 12])
    .with("free_after_std", "V", "", &["position"], vec![5e-5; 12])
    .with("before", "V", "", t, before)
    .with("after", "V", "", t, after)
    .with("measured", "V", "", t, measured)
    .with("linear", "V", "", t, linear)
    .with("extended", "V", "", t, extended)
    .with("spectrum_before", "V^2/Hz", "", q, density(1e-10))
    .with("spectrum_after", "V^2/Hz", "", q, density(0.0))
    .with("spectrum_noise", "V^2/Hz", "", q, vec![1e-15; 2001])
    .with("record", "1", "", e, (0..10_i64).collect::<Vec<_>>())
    .with("amplitude", "V", "", e, (0..10).map(|k| 0.9 + 0.02 * f64::from(k)).collect::<Vec<_>>())
    .with("event_rms_before", "V", "", e, vec![4e-3; 10])
    .with("event_rms_after", "V", "", e, vec![1.2e-3; 10])
    .with("frequency_shift", "1", "", e, (0..10).map(|k| 1e-5 * f64::from(k)).collect::<Vec<_>>())
    .with("frequency_shift_std", "1", "", e, vec![8e-6; 10]);
    let tiles = Table::new()
        .with("from_s", "s", "", vec![0.0, 5e-5, 0.0])
        .with("to_s", "s", "", vec![5e-5, 15e-5, 5e-5])
        .with("low_hz", "Hz", "", vec![2e4, 2e4, 2e5])
        .with("high_hz", "Hz", "", vec![2e5, 2e5, 4e5])
        .with("excess_before", "1", "", vec![400.0, 8.0, 1.0])
        .with("excess_after", "1", "", vec![1.1, 0.9, 1.0])
        .with("p_before", "1", "", vec![0.0, 1e-9, 0.4])
        .with("p_after", "1", "", vec![0.3, 0.6, 0.4]);
    let summary = Document(answer);
    let outputs = vec![("summary", summary.wrap()), ("residuals", residuals.wrap()), ("tiles", tiles.wrap())];
    run(vec![stage("diagnosis", "diagnosis.release", &[], json!({}), outputs)])
}

/// A run of `diagnosis.causes` with this answer.
pub(crate) fn system(answer: Value) -> RunResult {
    let time: Vec<f64> = (0..3000).map(|k| 1e-3 * f64::from(k)).collect();
    let wave = |scale: f64| -> Vec<f64> { time.iter().map(|t| scale * t * (500.0 * t).sin()).collect() };
    let simulation = Array::over(vec![Axis::new("time", "s", "", time.clone())])
        .with("measured", "V", "", &["time"], wave(1.0))
        .with("before", "V", "", &["time"], wave(0.9))
        .with("after", "V", "", &["time"], wave(0.999));
    let f: Vec<f64> = (0..129).map(|k| 500.0 * f64::from(k) / 128.0).collect();
    let flat = |level: f64| vec![level; 129];
    let errors = Array::over(vec![
        Axis::new("frequency", "Hz", "", f),
        Axis::new("output", "V", "", (0..24).map(|k| f64::from(k) - 12.0).collect()),
    ])
    .with("spectrum_output", "V^2/Hz", "", &["frequency"], flat(1.0))
    .with("spectrum_before", "V^2/Hz", "", &["frequency"], flat(1e-2))
    .with("spectrum_after", "V^2/Hz", "", &["frequency"], flat(1e-6))
    .with("rms_before", "V", "", &["output"], vec![0.1; 24])
    .with("rms_after", "V", "", &["output"], vec![1e-3; 24]);
    let parts = |part: &str| vec![part.to_owned(); 5];
    let judged = Table::new()
        .with("part", "", "", [parts("multisine"), parts("arrow")].concat())
        .with("time_s", "s", "", (0..10).map(f64::from).collect::<Vec<_>>())
        .with("output", "V", "", vec![1.0; 10])
        .with("before", "V", "", vec![0.1; 10])
        .with("after", "V", "", vec![1e-3; 10]);
    let outputs = vec![
        ("summary", Document(answer).wrap()),
        ("simulation", simulation.wrap()),
        ("errors", errors.wrap()),
        ("judged", judged.wrap()),
    ];
    run(vec![stage("diagnosis", "diagnosis.causes", &[], json!({}), outputs)])
}
