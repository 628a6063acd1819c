//! `afmid modes` on recordings of known truth: the table, its marks, the three files.

use std::f64::consts::TAU;
use std::fmt::Write;
use std::path::Path;

use super::begin::white;
use crate::common::{self, afmid, said};
use serde_json::Value;

/// Samples per second of all recordings here.
const RATE_HZ: f64 = 1000.0;

/// Times in seconds and one more column.
pub fn table(here: &Path, name: &str, title: &str, values: &[f64]) {
    let mut text = format!("Time (s),{title}\n");
    for (k, value) in values.iter().enumerate() {
        let _ = writeln!(text, "{:.3},{value:.9}", k as f64 / RATE_HZ);
    }
    std::fs::write(here.join(name), text).expect("a table");
}

/// Quiet, then two modes that die away, of 40 and 110 Hz by the distance of their poles from zero, in white noise of a
/// thousandth.
pub fn two_modes(seed: u64) -> Vec<f64> {
    let mode = |f: f64, q: f64, t: f64| {
        let rate = 0.5 * TAU * f / q;
        (-rate * t).exp() * ((TAU * f * TAU * f - rate * rate).sqrt() * t).sin()
    };
    let ring = |t: f64| if t < 0.0 { 0.0 } else { mode(40.0, 50.0, t) + 0.5 * mode(110.0, 80.0, t) };
    let signal = (0..4000).map(|k| ring((k as f64 - 300.0) / RATE_HZ));
    signal.zip(white(seed, 4000)).map(|(y, e)| y + 1e-3 * e).collect()
}

/// Quiet, then an oscillator whose frequency rises by 4 % while it dies away.
fn moving(seed: u64) -> Vec<f64> {
    let mut phase = 0.0;
    let signal = (0..6000).map(|k| {
        let t = (f64::from(k) - 300.0) / RATE_HZ;
        if t < 0.0 {
            return 0.0;
        }
        let a = (-0.5 * TAU * 40.0 / 100.0 * t).exp();
        phase += TAU * 40.0 * (1.0 - 0.04 * a * a) / RATE_HZ;
        a * phase.sin()
    });
    signal.zip(white(seed, 6000)).map(|(y, e)| y + 1e-3 * e).collect()
}

#[test]
fn modes_of_a_recording_are_one_command() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    table(here, "hit 3.csv", "acceleration (m/s^2)", &two_modes(3));
    let command = ["modes", "hit 3.csv", "--cache", "cache"];
    let [stdout, _] = said(here, &command);
    let lines: Vec<&str> = stdout.lines().collect();
    assert!(lines.len() <= 10, "{stdout}");
    assert!(lines[0].contains("a free decay"), "{stdout}");
    let words = |line: &str| line.split_whitespace().map(str::to_owned).collect::<Vec<String>>();
    assert_eq!(words(lines[1]), ["mode", "frequency", "(Hz)", "Q", "damping", "(%)"]);
    for (line, (number, truth)) in lines[2..4].iter().zip([("1", 40.0), ("2", 110.0)]) {
        let [mode, frequency, quality, damping] = &words(line)[..] else { panic!("{stdout}") };
        let frequency: f64 = frequency.split('(').next().expect("a number").parse().expect("a number");
        // noise of a thousandth: errors of some millionths
        assert!(mode == number && (frequency - truth).abs() < 1e-3 * truth, "{stdout}");
        assert!(quality.contains('(') && damping.contains('('), "{stdout}");
    }
    assert!(
        lines[4].starts_with("all numbers") && lines[4].ends_with("afmid show hit-3.modes.h5 modes --all"),
        "{stdout}"
    );
    let names = ["toml", "h5", "html"].map(|ending| format!("hit-3.modes.{ending}"));
    assert_eq!(lines[lines.len() - 3..], names);
    names.iter().for_each(|name| assert!(here.join(name).is_file(), "{name}"));
    // the config is the one that `afmid new pipeline` writes; again all is reused
    assert_eq!(said(here, &command)[0], stdout);
    let config = std::fs::read_to_string(here.join(&names[0])).expect("a config");
    afmid(here, &["new", "pipeline", "hit 3.csv", "-o", "other.toml"]);
    assert_eq!(config, std::fs::read_to_string(here.join("other.toml")).expect("a config"));
    // for scripts: what is stored, the paths and what was warned of
    let answer: Value = serde_json::from_str(&afmid(here, &[&command[..], &["--json"]].concat())).expect("JSON");
    assert_eq!([&answer["config"], &answer["result"], &answer["page"]], names.each_ref().map(String::as_str));
    assert_eq!((&answer["goal"], answer["warnings"].is_array()), (&"decay".into(), true), "{answer:#}");
    let stored = common::shown(here, &names[1], "modes");
    stored.as_object().expect("a document").iter().for_each(|(key, value)| assert_eq!(&answer[key], value, "{key}"));
    for (mode, truth) in stored["modes"].as_array().expect("modes").iter().zip([40.0, 110.0]) {
        let [f, std] = ["frequency_hz", "frequency_std_hz"].map(|name| mode[name].as_f64().expect("a number"));
        assert!((f - truth).abs() < 4.0 * std, "{f} +- {std} for {truth}"); // by chance once in 16,000
    }
}

#[test]
fn a_mode_that_moves_leads_on_to_the_diagnosis() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    table(here, "moving.csv", "angle", &moving(4));
    let [stdout, _] = said(here, &["modes", "moving.csv", "-o", "m.h5", "--cache", "cache"]);
    assert!(stdout.contains("\na mode that moves is not linear; what by: afmid diagnose moving.csv\n"), "{stdout}");
    assert!(stdout.ends_with("m.toml\nm.h5\nm.html\n"), "{stdout}");
    // what was said of the recording is said again
    let given = ["--unit", "rad", "--as", "hits"];
    let [stdout, _] = said(here, &[&["modes", "moving.csv"], &given[..], &["-o", "n.h5", "--cache", "cache"]].concat());
    assert!(stdout.contains("what by: afmid diagnose moving.csv --as hits --unit rad\n"), "{stdout}");
    // a config that another run was made with stays
    let changed = std::fs::read_to_string(here.join("m.toml")).expect("a config") + "# mine\n";
    std::fs::write(here.join("m.toml"), &changed).expect("a config");
    afmid(here, &["run", "m.toml", "-o", "m.h5", "--cache", "cache"]);
    let output = common::command(here, &["modes", "moving.csv", "-o", "m.h5", "--cache", "cache"]).output();
    assert_eq!(output.expect("afmid starts").status.code(), Some(2));
    assert_eq!(std::fs::read_to_string(here.join("m.toml")).expect("a config"), changed);
    // a name that begins with a dash is an option where it is typed
    std::fs::rename(here.join("moving.csv"), here.join("-moving.csv")).expect("a recording");
    let [stdout, _] = said(here, &["modes", "--cache", "cache", "--", "-moving.csv"]);
    assert!(stdout.contains("afmid show moving.modes.h5 modes --all\n"), "{stdout}");
    assert!(stdout.contains("what by: afmid diagnose ./-moving.csv\n"), "{stdout}");
}

#[test]
fn results_stand_beside_one_another() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    for (name, seed) in [("monday", 6), ("tuesday", 7)] {
        table(here, &format!("{name}.csv"), "acceleration (m/s^2)", &two_modes(seed));
        let result = format!("{name}.h5");
        afmid(here, &["modes", &format!("{name}.csv"), "-o", &result, "--cache", "cache"]);
    }
    let text = afmid(here, &["compare", "monday.h5", "tuesday.h5"]);
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines.len() == 6 && lines[0].contains("in errors") && lines[5].starts_with("change: "), "{text}");
    assert!(lines[1].contains("monday.h5") && lines[2].contains("tuesday.h5"), "{text}");
    let found: Value =
        serde_json::from_str(&afmid(here, &["compare", "monday.h5", "tuesday.h5", "--json"])).expect("JSON");
    assert_eq!((&found["results"][1], found["modes"].as_array().map(Vec::len)), (&"tuesday.h5".into(), Some(2)));
    for mode in found["modes"].as_array().expect("modes") {
        assert_eq!(mode[0]["frequency_z"], 0.0);
        // the same structure with other noise: by chance once in 16,000
        assert!(mode[1]["frequency_z"].as_f64().expect("a number").abs() < 4.0, "{found:#}");
        assert_eq!(mode[1]["doubtful"], false);
    }
    let output = common::command(here, &["compare", "monday.h5"]).output().expect("afmid starts");
    assert_eq!(output.status.code(), Some(2));
    let output = common::command(here, &["compare", "monday.h5", "monday.csv"]).output().expect("afmid starts");
    let error = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(2) && error.contains("wanted a result file"), "{error}");
}

#[test]
fn what_is_no_modes_is_said() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    table(here, "hit.csv", "acceleration (m/s^2)", &two_modes(5));
    let refused = |arguments: &[&str]| {
        let output = common::command(here, arguments).output().expect("afmid starts");
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        assert!(output.stdout.is_empty());
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let error = refused(&["modes", "hit.csv", "--goal", "diagnosis", "--cache", "cache"]);
    assert!(error.contains("a diagnosis lists no modes") && error.contains("afmid diagnose"), "{error}");
    // a recording or a folder without a command
    for path in ["hit.csv", "."] {
        let error = refused(&[path]);
        assert!(error.contains(&format!("`afmid modes {path}` finds their modes")), "{error}");
        assert!(error.contains("stands where a command should"), "{error}");
    }
    let error = refused(&["hit.toml"]);
    assert!(error.contains("unrecognized subcommand"), "{error}");
    assert_eq!(std::fs::read_dir(here).expect("a folder").count(), 1);
}
