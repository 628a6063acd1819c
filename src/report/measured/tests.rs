//! Pages of measurements that are no lever's: their words, their names, their curves.

use afmid_pipeline::{Array, Axis, Document, RunResult, Shaped, StageRecord, Table};
use num_complex::Complex64;
use serde_json::{Value, json};

use crate::report::fixture::stage;
use crate::report::tests::{alone, assert_page, bare};

/// Words of the paper's lever, in small letters.
const OF_THE_LEVER: [&str; 10] = [
    "lever",
    "rupture",
    "deflection",
    "static share",
    "one at rest",
    "fig. ",
    "not in this run",
    "piezo",
    "snap",
    "t₀",
];

/// The page without its style, its script and the config.
fn page(run: &RunResult) -> String {
    let page = alone(run).expect("a page");
    assert_page(&page);
    let (_, rest) = page.split_once("</style>").expect("the end of the style");
    let (shown, _) = rest.split_once("<section id=\"config\">").expect("the config");
    let shown = shown.to_owned();
    let small = shown.to_lowercase();
    for word in OF_THE_LEVER {
        assert!(!small.contains(word), "{word}: {:?}", small.find(word).map(|at| small.get(at.saturating_sub(80)..at)));
    }
    shown
}

fn pair() -> StageRecord {
    let time: Vec<f64> = (0..400).map(|k| f64::from(k) * 1e-3).collect();
    let force: Vec<f64> = time.iter().map(|t| if *t < 3e-3 { 20.0 } else { 0.0 }).collect();
    let response: Vec<f64> = time.iter().map(|t| (-10.0 * t).exp() * (300.0 * t).sin()).collect();
    let array = Array::over(vec![Axis::new("time", "s", "time since the first sample", time)])
        .with("response", "m/s^2", "output", &["time"], response)
        .with("force", "N", "input", &["time"], force)
        .attribute("kind", "columns")
        .attribute("inputs", "hammer head")
        .attribute("outputs", "/bench/accelerometer 3 of the outer rib");
    stage("data", "io.columns", &[], json!({}), vec![("pair", array.wrap())])
}

fn lines() -> Vec<f64> {
    (20..200).map(f64::from).collect()
}

/// Two accelerances with a mode at 80 Hz, the second against the first.
fn accelerances() -> Vec<Complex64> {
    let at = |f: f64| -f * f / Complex64::new(80.0 * 80.0 - f * f, 0.04 * 80.0 * f);
    lines().into_iter().map(at).chain(lines().into_iter().map(|f| -0.5 * at(f))).collect()
}

fn over_lines() -> Array {
    Array::over(vec![
        Axis::new("response", "1", "number of the response", vec![1.0, 2.0]),
        Axis::new("frequency_hz", "Hz", "frequency", lines()),
    ])
}

fn frf(coherence: bool) -> StageRecord {
    let point = |name: &str, position: Option<f64>| json!({ "name": name, "direction": "z", "position_m": position });
    let row = |name: &str, position: f64| json!({ "output": point(name, Some(position)), "input": point("P", None) });
    let over = &["response", "frequency_hz"];
    let mut array = over_lines()
        .with("frf", "(m/s^2)/N", "measured frequency response", over, accelerances())
        .with("variance", "((m/s^2)/N)^2", "expected squared error", over, vec![1e-6; 360])
        .attribute("responses", json!([row("P", 0.1), row("Q", 0.7)]).to_string())
        .attribute("quantity", "accelerance")
        .attribute("driving_point", 0_usize);
    if coherence {
        array = array.with("coherence", "1", "ordinary coherence", over, vec![0.98; 360]);
    }
    stage("frf", "spectrum.measured_frf", &[("pair", "data")], json!({}), vec![("frf", array.wrap())])
}

fn modes() -> StageRecord {
    let over = &["response", "frequency_hz"];
    let fit = over_lines()
        .with("measured", "(m/s^2)/N", "measured", over, accelerances())
        .with("fitted", "(m/s^2)/N", "the same as fitted", over, accelerances())
        .with(
            "indicator",
            "1",
            "all",
            &["frequency_hz"],
            accelerances()[..180].iter().map(|h| h.norm()).collect::<Vec<_>>(),
        );
    let diagram = Table::new()
        .with("order", "1", "order", vec![2_i64, 4])
        .with("frequency_hz", "Hz", "frequency", vec![80.0, 80.1])
        .with("damping_stable", "1", "stable", vec![false, true])
        .with("mode", "1", "mode", vec![0_i64, 1]);
    let point = |name: &str, re: f64| json!({ "channel": name, "re": re, "im": 0.0, "re_std": 0.01, "im_std": 0.01 });
    let mode = json!({
        "frequency_hz": 80.0, "frequency_std_hz": 0.02, "quality_factor": 25.0, "quality_factor_std": 0.5,
        "damping_ratio": 0.02, "damping_ratio_std": 0.0004, "static_share": 0.9,
        "shape": [point("Pz", 1.0), point("Qz", -0.5)],
    });
    let summary = Document(json!({ "modes": [mode] }));
    let outputs = vec![("diagram", diagram.wrap()), ("fit", fit.wrap()), ("summary", summary.wrap())];
    stage("modes", "model.frf_modes", &[("frf", "frf")], json!({}), outputs)
}

/// How many panels have this label on an axis.
fn labels(page: &str, label: &str) -> usize {
    page.matches(&format!(">{label}</text>")).count()
}

#[test]
fn a_hammer_s_page_shows_magnitude_phase_and_coherence_of_each_response_with_its_fit() {
    let with = page(&bare(vec![pair(), frf(true), modes()]));
    assert_eq!(labels(&with, "Accelerance ((m/s²)/N)"), 2);
    assert_eq!((labels(&with, "Phase (°)"), labels(&with, "Coherence")), (2, 2));
    assert!(with.contains("Pz / Pz · driving point") && with.contains("Qz / Pz"));
    assert!(with.contains(">measured</text>") && with.contains(">fitted</text>"));
    assert!(with.contains("magnitude of the responses"), "the stabilisation diagram lies over the magnitude");
    assert!(with.contains("Mode 1 · 80.000(20) Hz") && with.contains("Position (m"), "shapes are drawn");
    let without = page(&bare(vec![pair(), frf(false), modes()]));
    assert_eq!((labels(&without, "Phase (°)"), labels(&without, "Coherence")), (2, 0));
}

#[test]
fn measured_responses_are_drawn_without_a_fit_too() {
    let alone = page(&bare(vec![pair(), frf(true)]));
    assert_eq!((labels(&alone, "Phase (°)"), labels(&alone, "Coherence")), (2, 2));
    assert!(!alone.contains(">fitted</text>"));
}

#[test]
fn modes_have_their_damping_ratio_beside_the_quality_factor() {
    let page = page(&bare(vec![pair(), frf(true), modes()]));
    let columns = ["mode", "frequency", "damping ratio", "quality factor"];
    let heads: String = columns.map(|name| format!("<th scope=\"col\" class=\"number\">{name}</th>")).concat();
    assert!(page.contains(&heads), "{heads}");
    assert!(page.contains("2.00(4) %"));
}

#[test]
fn measured_input_and_output_stand_under_their_channels_names() {
    let page = page(&bare(vec![pair()]));
    assert_eq!(labels(&page, "hammer head (N)"), 1);
    assert_eq!(labels(&page, "…rometer 3 of the outer rib (m/s²)"), 1, "a long name keeps its end");
}

/// A model of a measured input and output with its modes, poles and zeros, as `model.modes` gives them.
fn model() -> Vec<StageRecord> {
    let frequency: Vec<f64> = (1..500).map(f64::from).collect();
    let one = |f: &f64| 1.0 / Complex64::new(1.0 - (f / 50.0).powi(2), f / 500.0);
    let transfer: Vec<Complex64> = frequency.iter().map(one).collect();
    let response = Array::over(vec![Axis::new("frequency_hz", "Hz", "frequency", frequency)]).with(
        "transfer",
        "1",
        "transfer function of the model",
        &["frequency_hz"],
        transfer,
    );
    let roots = Table::new()
        .with("kind", "", "", vec!["pole".to_owned(), "zero".to_owned()])
        .with("z_re", "1", "", vec![0.9, 0.2])
        .with("z_im", "1", "", vec![0.3, 0.0]);
    let residual = Array::over(vec![Axis::new("time", "s", "time since t0", vec![0.0, 1.0])]);
    let residual = residual.with("residual", "m/s^2", "what is left", &["time"], vec![0.1, 0.2]);
    let fits: Value = json!({ "identification": 99.0, "held_out": 98.0, "noise_ceiling": null });
    let summary = Document(json!({ "modes": [], "fit_percent": fits }));
    let outputs = vec![("response", response.wrap()), ("roots", roots.wrap()), ("summary", summary.wrap())];
    vec![
        pair(),
        stage("model", "model.pem", &[("pair", "data")], json!({}), vec![("left", residual.wrap())]),
        stage("modes", "model.modes", &[("model", "model")], json!({}), outputs),
    ]
}

#[test]
fn a_transfer_function_has_the_unit_of_output_over_input_and_plain_titles() {
    let page = page(&bare(model()));
    assert_eq!(labels(&page, "Magnitude ((m/s²)/N)"), 1);
    for title in ["Transfer function", "Poles and zeros", "Measured input and output", "Residuals"] {
        assert!(page.contains(&format!("<h2>{title}</h2>")), "{title}");
    }
    assert!(page.contains("fit on the held-out part") && !page.contains("noise allows"));
}

#[test]
fn a_thermal_spectrum_and_a_steady_oscillation_have_their_numbers_first() {
    let of = |value: f64, unit: &str| json!({ "value": value, "std": 0.1, "robust_std": 0.2, "unit": unit });
    let thermal = json!({ "frequency": of(50.0, "Hz"), "quality_factor": of(5.0, "1"), "white": of(1.0, "V^2/Hz") });
    let steady = json!({ "oscillations": [{ "record": "hum.csv", "channel": "line", "unit": "V", "frequency_hz": 32.1,
        "frequency_std_hz": 0.01, "amplitude": 1.0, "amplitude_std": 0.01, "distortion": 0.1,
        "amplitude_steady": { "p_value": 0.5 }, "phase_steady": { "p_value": 0.25 } }] });
    let summary = |document: Value| vec![("summary", Document(document).wrap())];
    let page = page(&bare(vec![
        stage("thermal", "spectrum.thermal", &[], json!({}), summary(thermal)),
        stage("oscillation", "model.harmonics", &[], json!({}), summary(steady)),
    ]));
    // half of 1 / 5, and its relative error of 0.2 / 5
    assert!(page.contains("<h2>Resonance</h2>") && page.contains("10.0(4) %") && page.contains("50.00(20) Hz"));
    assert!(page.contains("<h2>Oscillation</h2>") && page.contains("32.100(10) Hz") && page.contains("10.000 %"));
}
