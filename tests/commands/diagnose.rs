//! `afmid diagnose` on recordings of known truth: the kind that is seen, the causes, the three files.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

use super::begin::white;
use crate::common::{self, afmid, said};
use serde_json::Value;

/// Samples per second of all recordings here.
const RATE_HZ: f64 = 1000.0;

/// Columns with times in seconds.
fn table(here: &Path, name: &str, titles: &str, columns: &[&[f64]]) {
    let mut text = format!("Time (s),{titles}\n");
    for k in 0..columns[0].len() {
        let _ = write!(text, "{:.3}", k as f64 / RATE_HZ);
        columns.iter().for_each(|column| {
            let _ = write!(text, ",{:.9}", column[k]);
        });
        text.push('\n');
    }
    std::fs::write(here.join(name), text).expect("a table");
}

/// A spring that stiffens with the square of the deflection.
const K3: f64 = 0.6;

/// The motion of `q'' + w/Q q' + w^2 (q + k3 q^3) = w^2 u` at 40 Hz, Q = 20, from a deflection, the input held between
/// samples.
fn duffing(k3: f64, input: &[f64], from: f64) -> Vec<f64> {
    const STEPS: usize = 8;
    let w = TAU * 40.0;
    let dt = 1.0 / RATE_HZ / STEPS as f64;
    let (mut q, mut v) = (from, 0.0);
    let step = |u: &f64| {
        let now = q;
        let force = |q: f64, v: f64| w * w * (u - q - k3 * q.powi(3)) - w / 20.0 * v;
        for _ in 0..STEPS {
            let (q1, v1) = (v, force(q, v));
            let (q2, v2) = (v + dt / 2.0 * v1, force(q + dt / 2.0 * q1, v + dt / 2.0 * v1));
            let (q3, v3) = (v + dt / 2.0 * v2, force(q + dt / 2.0 * q2, v + dt / 2.0 * v2));
            let (q4, v4) = (v + dt * v3, force(q + dt * q3, v + dt * v3));
            q += dt / 6.0 * (q1 + 2.0 * q2 + 2.0 * q3 + q4);
            v += dt / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4);
        }
        now
    };
    input.iter().map(step).collect()
}

fn with_noise(values: &[f64], size: f64, seed: u64) -> Vec<f64> {
    values.iter().zip(white(seed, values.len())).map(|(y, e)| y + size * e).collect()
}

/// Force and motion of the oscillator in a table.
fn write_pair(here: &Path, name: &str, titles: &str, k3: f64) {
    let force: Vec<f64> = white(11, 6000).into_iter().map(|u| 0.15 * u).collect();
    let motion = with_noise(&duffing(k3, &force, 0.0), 1e-3, 40);
    table(here, name, titles, &[&force, &motion]);
}

/// Quiet, then a free decay of the oscillator, twice.
fn write_decays(here: &Path, name: &str) {
    let decay = |from: f64| duffing(K3, &[0.0; 1500], from);
    let motion = [vec![0.0; 500], decay(1.0), decay(0.7)].concat();
    table(here, name, "motion (m)", &[&with_noise(&motion, 1e-3, 50)]);
}

/// Mass, viscous and dry friction of an axis, over the force of a volt of its drive.
const AXIS: [f64; 3] = [2.5, 6.0, 0.6];

/// Strokes back and forth of smooth course, with pauses.
fn strokes(samples: usize) -> Vec<f64> {
    let mut draws = white(60, 200).into_iter().map(|draw| draw.abs().fract());
    let (mut all, mut from) = (Vec::new(), 0.0);
    while all.len() < samples {
        let [far, long] = [(); 2].map(|()| draws.next().expect("a draw"));
        let to = if from > 0.05 { -0.1 * far } else { 0.05 + 0.1 * far };
        let steps = 600 + (900.0 * long) as usize;
        let course = |t: f64| from + (to - from) * t.powi(3) * (10.0 - 15.0 * t + 6.0 * t * t);
        all.extend((0..steps).map(|k| course(k as f64 / steps as f64)));
        all.extend([to; 100]);
        from = to;
    }
    all.truncate(samples);
    all
}

/// Set point, drive and position of the axis under a controller of position and speed.
fn write_axis(here: &Path, name: &str) {
    const STEPS: usize = 20;
    let [mass, viscous, dry] = AXIS;
    let samples = 12_000;
    let (wanted, sensor) = (strokes(samples), white(70, samples));
    let h = 1.0 / RATE_HZ / STEPS as f64;
    let (mut position, mut speed) = (0.0_f64, 0.0_f64);
    let (mut drive, mut seen): (Vec<f64>, Vec<f64>) = (Vec::new(), Vec::new());
    for k in 0..samples {
        seen.push(position + 1e-7 * sensor[k]);
        let rate = (seen[k] - seen[k.saturating_sub(2)]) * RATE_HZ / 2.0;
        drive.push((200.0 * (100.0 * (wanted[k] - seen[k]) - rate)).clamp(-10.0, 10.0));
        for _ in 0..STEPS {
            // the damping sees the mean of both ends; dry friction takes what it can and never reverses the motion
            let half = 0.5 * h * viscous / mass;
            let free = (speed * (1.0 - half) + h * drive[k] / mass) / (1.0 + half);
            let most = h * dry / mass;
            let next = if free.abs() <= most { 0.0 } else { free - most * free.signum() };
            position += 0.5 * h * (speed + next);
            speed = next;
        }
    }
    table(here, name, "wanted (m),motor (V),position (m)", &[&wanted, &drive, &seen]);
}

/// A steady oscillation behind a detector whose answer bends.
fn write_steady(here: &Path, name: &str) {
    let x = |k: usize| (TAU * 0.0837 * k as f64).cos();
    let y: Vec<f64> = (0..30_000).map(|k| x(k) + 0.05 * x(k) * x(k)).collect();
    table(here, name, "signal (V)", &[&with_noise(&y, 1e-3, 90)]);
}

/// The answer as JSON; the config is the one that `afmid new pipeline` writes.
fn diagnosed(here: &Path, file: &str, named: &[&str]) -> Value {
    let files = [&["diagnose", file][..], named, &["-o", "d.h5", "--cache", "cache", "--json"]].concat();
    let answer: Value = serde_json::from_str(&afmid(here, &files)).expect("JSON");
    assert_eq!([&answer["config"], &answer["result"], &answer["page"]], ["d.toml", "d.h5", "d.html"], "{answer}");
    let config = std::fs::read_to_string(here.join("d.toml")).expect("a config");
    std::fs::remove_file(here.join("d.toml")).expect("a config");
    afmid(here, &[&["new", "pipeline", file, "--goal", "diagnosis"][..], named, &["-o", "d.toml"]].concat());
    assert_eq!(config, std::fs::read_to_string(here.join("d.toml")).expect("a config"));
    std::fs::remove_file(here.join("d.toml")).expect("a config");
    // the stored document, key by key
    let stored = common::shown(here, "d.h5", "diagnosis");
    stored.as_object().expect("a document").iter().for_each(|(key, value)| assert_eq!(&answer[key], value, "{key}"));
    let page = std::fs::read_to_string(here.join("d.html")).expect("a page");
    assert!(page.contains("Diagnosis"));
    answer
}

fn ids(answer: &Value) -> Vec<&str> {
    answer["causes"].as_array().into_iter().flatten().filter_map(|cause| cause["id"].as_str()).collect()
}

/// A parameter of a cause within four of its errors: by chance once in 16,000.
fn near(answer: &Value, id: &str, parameter: &str, truth: f64) {
    let cause = answer["causes"].as_array().into_iter().flatten().find(|cause| cause["id"] == id);
    let found = &cause.unwrap_or_else(|| panic!("no {id}: {answer:#}"))["parameters"][parameter];
    let number = |name: &str| found[name].as_f64().unwrap_or_else(|| panic!("{answer:#}"));
    assert!((number("value") - truth).abs() < 4.0 * number("std"), "{id} {parameter}: {found}, truth {truth}");
}

#[test]
fn every_kind_of_recording_has_its_diagnosis_in_one_command() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    write_pair(here, "pair.csv", "force (N),motion (m)", K3);
    let answer = diagnosed(here, "pair.csv", &[]);
    assert_eq!((&answer["verdict"], ids(&answer)), (&"named".into(), vec!["duffing"]), "{answer:#}");
    near(&answer, "duffing", "k3", K3);
    write_pair(here, "linear.csv", "force (N),motion (m)", 0.0);
    assert_eq!(diagnosed(here, "linear.csv", &[])["verdict"], "clean");
    write_decays(here, "decays.csv");
    let answer = diagnosed(here, "decays.csv", &[]);
    assert_eq!((&answer["verdict"], ids(&answer)), (&"named".into(), vec!["duffing"]), "{answer:#}");
    near(&answer, "duffing", "k3", K3);
    write_axis(here, "axis.csv");
    let loops = ["--reference", "wanted", "--input", "motor", "--channel", "position"];
    let answer = diagnosed(here, "axis.csv", &loops);
    assert_eq!((&answer["verdict"], ids(&answer)), (&"named".into(), vec!["coulomb-friction"]), "{answer:#}");
    near(&answer, "coulomb-friction", "friction_force", AXIS[2]);
    assert_eq!(answer["causes"][0]["parameters"]["friction_force"]["unit"], "V");
    write_steady(here, "steady.csv");
    let answer = diagnosed(here, "steady.csv", &[]);
    assert_eq!((&answer["verdict"], ids(&answer)), (&"named".into(), vec!["quadratic-detector"]), "{answer:#}");
}

#[test]
fn the_verdict_is_a_few_lines_and_the_files_have_the_recording_s_name() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    std::fs::create_dir(here.join("data")).expect("a folder");
    write_pair(&here.join("data"), "run 7.csv", "force (N),motion (m)", K3);
    let command = ["diagnose", "data/run 7.csv", "--cache", "cache"];
    let [stdout, _] = said(here, &command);
    let lines: Vec<&str> = stdout.lines().collect();
    assert!(lines.len() <= 11, "{stdout}");
    assert_eq!(lines[0], "measured input force and output motion in run 7.csv");
    assert!(lines[1].starts_with("named: duffing (") && lines[1].contains("false-alarm rate 0.01"), "{stdout}");
    // the strength with its error, the gain on folds
    assert!(lines[2].starts_with("  duffing: k3 0.") && lines[2].contains(") 1/m^2; error "), "{stdout}");
    assert!(lines[2].contains(" -> ") && lines[2].contains("held out"), "{stdout}");
    assert!(stdout.contains("\nnext measurement: drive the"), "{stdout}");
    let names = ["toml", "h5", "html"].map(|ending| format!("run-7.diagnosis.{ending}"));
    assert_eq!(lines[lines.len() - 3..], names);
    names.iter().for_each(|name| assert!(here.join(name).is_file(), "{name}"));
    // again: the config is the same, everything is reused; the same as by `run` and `report`
    assert_eq!(said(here, &command)[0], stdout);
    afmid(here, &["run", &names[0], "-o", "again.h5", "--cache", "cache"]);
    afmid(here, &["diff", &names[1], "again.h5", "--exit-code"]);
    // a config that somebody changed stays, and so does everything else
    let changed = std::fs::read_to_string(here.join(&names[0])).expect("a config") + "# mine\n";
    std::fs::write(here.join(&names[0]), &changed).expect("a config");
    let output = common::command(here, &command).output().expect("afmid starts");
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(error.contains("run-7.diagnosis.toml is there already, and is not what would be written"), "{error}");
    assert!(error.contains("afmid run run-7.diagnosis.toml") && output.stdout.is_empty(), "{error}");
    assert_eq!(std::fs::read_to_string(here.join(&names[0])).expect("a config"), changed);
}

/// What is asked of a command line that ends with code 2 and writes nothing.
fn asked(here: &Path, arguments: &[&str]) -> String {
    let before = std::fs::read_dir(here).expect("a folder").count();
    let command = [&["diagnose"][..], arguments, &["--cache", "cache"]].concat();
    let output = common::command(here, &command).output().expect("afmid starts");
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{arguments:?}: {error}");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    assert_eq!(std::fs::read_dir(here).expect("a folder").count(), before, "{arguments:?}");
    error
}

#[test]
fn channels_that_do_not_say_what_they_are_are_asked_for() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    write_pair(here, "unclear.csv", "V1 (V),V2 (V)", K3);
    let error = asked(here, &["unclear.csv"]);
    assert!(error.contains("unclear.csv does not say what its channels V1, V2 are"), "{error}");
    ["--channel NAME", "--input NAME", "--reference NAME"]
        .iter()
        .for_each(|flag| assert!(error.contains(flag), "{error}"));
    write_axis(here, "axis.csv");
    // an oscillation of the set point that nothing damps is no reason to take it for the signal
    assert!(asked(here, &["axis.csv"]).contains("wanted, motor, position"), "{}", asked(here, &["axis.csv"]));
    let error = asked(here, &["axis.csv", "--reference", "wanted"]);
    assert!(
        error.contains("which channel is the drive") && error.contains("--input which of motor, position"),
        "{error}"
    );
    let error = asked(here, &["axis.csv", "--input", "motor"]);
    assert!(error.contains("say with --channel which one of wanted, position"), "{error}");
    let error = asked(here, &["axis.csv", "--input", "motor", "--channel", "motor"]);
    assert!(error.contains("motor is input and output at once"), "{error}");
    table(here, "noise.csv", "signal (V)", &[&white(5, 4000)]);
    assert!(asked(here, &["noise.csv"]).contains("noise.csv"), "{}", asked(here, &["noise.csv"]));
    write_pair(here, "pair.csv", "force (N),motion (m)", K3);
    write_pair(here, "more.csv", "force (N),motion (m)", 0.0);
    let error = asked(here, &["pair.csv", "more.csv"]);
    assert!(error.contains("2 files, wanted one record of input and output"), "{error}");
    assert!(asked(here, &["pair.csv", "-o", "d.toml"]).contains("d.toml is no name of a result"));
    let error = common::command(here, &["new", "pipeline", "axis.csv", "--reference", "wanted"]).output();
    let error = String::from_utf8_lossy(&error.expect("afmid starts").stderr).into_owned();
    assert!(error.contains("only a diagnosis is of an axis in its loop"), "{error}");
}

#[test]
fn a_run_that_fails_is_exit_code_1_and_leaves_its_config() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let force = white(3, 40);
    table(here, "short.csv", "force (N),motion (m)", &[&force, &duffing(0.0, &force, 0.0)]);
    let output = common::command(here, &["diagnose", "short.csv", "--cache", "cache"]).output().expect("afmid starts");
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(1), "{error}");
    assert!(error.contains("the config is short.diagnosis.toml") && output.stdout.is_empty(), "{error}");
    assert!(here.join("short.diagnosis.toml").is_file() && !here.join("short.diagnosis.html").exists());
}
