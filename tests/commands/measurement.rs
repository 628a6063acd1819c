//! Input and output of one measurement in files of their own.

use std::fmt::Write;
use std::path::Path;

use super::begin_files::{MODES, frequencies, moved, noise};
use crate::common::{self, said};

/// A table of one column with times in steps of `step_s` from `first` steps on.
fn table(here: &Path, name: &str, (first, step_s): (usize, f64), title: &str, values: &[f64]) {
    let mut text = format!("Time (s),{title}\n");
    for (k, value) in (first..).zip(values) {
        let _ = writeln!(text, "{:.6},{value:.9}", k as f64 * step_s);
    }
    std::fs::write(here.join(name), text).expect("a table");
}

/// 12,000 samples of a force of noise at 1000 Hz, and what two sensors see of it.
fn write_files(here: &Path) -> [Vec<f64>; 3] {
    let force: Vec<f64> = (0..6).flat_map(|piece| noise(900 + piece)).collect();
    let [near, far] = [(0.4, 1), (0.8, 2)].map(|(x, seed)| moved(&force, x, seed));
    table(here, "u.csv", (0, 1e-3), "force (N)", &force);
    table(here, "y.csv", (0, 1e-3), "acc (m/s^2)", &near);
    [force, near, far]
}

fn refused(here: &Path, arguments: &[&str]) -> String {
    let output = common::command(here, arguments).output().expect("afmid starts");
    assert!(!output.status.success(), "{arguments:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// That a config finds the modes of the beam.
fn finds_modes(here: &Path, config: &str) {
    let found = frequencies(here, config);
    assert_eq!(found.len(), MODES.len(), "{config}: {found:?}");
    for (found, [frequency, _]) in found.iter().zip(MODES) {
        // noise of a thousandth; responses through windows whose bins are a third of the width of the slow mode
        assert!((found / frequency - 1.0).abs() < 2e-3, "{config}: {found}");
    }
}

#[test]
fn a_file_of_the_input_and_one_of_the_output_give_the_modes_at_any_start_and_length() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let [force, near, far] = write_files(here);
    table(here, "late.csv", (300, 1e-3), "acc (m/s^2)", &near[300..]);
    table(here, "short.csv", (0, 1e-3), "acc (m/s^2)", &near[..9000]);
    table(here, "far.csv", (0, 1e-3), "acc (m/s^2)", &far);
    let new = |output: &str| {
        let config = format!("{output}.toml");
        let [stdout, stderr] = said(here, &["new", "pipeline", "u.csv", output, "--input", "u.csv", "-o", &config]);
        assert!(stdout.contains(&format!("2 files; measured input u.csv:force and output {output}:acc")), "{stdout}");
        finds_modes(here, &config);
        stderr
    };
    assert_eq!(new("y.csv"), "");
    let notes = new("late.csv");
    assert!(notes.contains("late.csv:acc begins 0.3 s (300.000 samples) after u.csv:force"), "{notes}");
    let notes = new("short.csv");
    assert!(notes.contains("9000 samples are taken, which all have: u.csv:force has 12000"), "{notes}");
    // the run says it, too
    let [_, stderr] = said(here, &["run", "late.csv.toml", "-o", "again.h5", "--cache", "cache", "--fresh"]);
    assert!(stderr.contains("late.csv:acc begins 0.3 s"), "{stderr}");
    // two sensors in files of their own, the input by its name
    let arguments = ["new", "pipeline", "y.csv", "far.csv", "u.csv", "--input", "u.csv:force", "-o", "two.toml"];
    let [stdout, _] = said(here, &arguments);
    assert!(stdout.contains("3 files; measured input u.csv:force and output y.csv:acc, far.csv:acc"), "{stdout}");
    finds_modes(here, "two.toml");
    // one signal of several in a file is named
    let rows = (0..force.len()).map(|k| format!("{:.3},{:.9},{:.9}\n", k as f64 * 1e-3, near[k], force[k]));
    std::fs::write(here.join("both.csv"), format!("Time (s),acc (m/s^2),force (N)\n{}", rows.collect::<String>()))
        .expect("a table");
    let problem = refused(here, &["new", "pipeline", "both.csv", "y.csv", "--input", "both.csv", "-o", "n.toml"]);
    assert!(problem.contains("may be both.csv:acc, both.csv:force") && problem.contains("FILE:CHANNEL"), "{problem}");
    said(here, &["new", "pipeline", "both.csv", "y.csv", "--input", "both.csv:force", "-o", "both.toml"]);
    finds_modes(here, "both.toml");
}

#[test]
fn clocks_that_differ_are_refused_with_both_files_and_clocks() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let [_, near, _] = write_files(here);
    table(here, "fast.csv", (0, 5e-4), "acc (m/s^2)", &near);
    table(here, "after.csv", (20_000, 1e-3), "acc (m/s^2)", &near);
    let rows: String = near.iter().map(|value| format!("{value:.9}\n")).collect();
    std::fs::write(here.join("bare.csv"), format!("acc (m/s^2)\n{rows}")).expect("a table");
    for (output, words) in [
        ("fast.csv", "fast.csv:acc has 2000 samples per second, u.csv:force has 1000"),
        ("after.csv", "after.csv:acc begins 20 s after u.csv:force: they do not overlap"),
        ("bare.csv", "bare.csv:acc has no sample rate, u.csv:force has 1000"),
        ("u.csv", "two files of one measurement are called u.csv"),
    ] {
        let config = format!("{output}.toml");
        let problem = refused(here, &["new", "pipeline", "u.csv", output, "--input", "u.csv", "-o", &config]);
        assert!(problem.contains(words) && !here.join(&config).exists(), "{problem}");
        if output == "u.csv" {
            continue;
        }
        // and by a config that is written by hand
        let text = format!(
            "[pipeline]\nname = \"a\"\n\n[[stage]]\nid = \"data\"\nuses = \"io.columns\"\n\
             params = {{ file = \"u.csv\", joined_files = [\"{output}\"], inputs = [1], output = 2 }}\n"
        );
        std::fs::write(here.join(&config), text).expect("a config");
        let problem = refused(here, &["run", &config, "-o", "none.h5", "--cache", "cache"]);
        assert!(problem.contains(words), "{problem}");
    }
    let given = ["new", "pipeline", "u.csv", "bare.csv", "--input", "u.csv", "--rate", "1000", "-o", "bare.toml"];
    let [_, notes] = said(here, &given);
    assert!(notes.contains("bare.csv:acc does not say when the first sample was taken: all begin at once"), "{notes}");
    finds_modes(here, "bare.toml");
}

#[test]
fn both_files_count_for_the_cache_and_are_found_where_they_were_moved() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let [force, ..] = write_files(here);
    said(here, &["new", "pipeline", "u.csv", "y.csv", "--input", "u.csv", "-o", "c.toml"]);
    said(here, &["run", "c.toml", "-o", "c.h5", "--cache", "cache"]);
    std::fs::create_dir(here.join("moved")).expect("a folder");
    for file in ["u.csv", "y.csv"] {
        std::fs::rename(here.join(file), here.join("moved").join(file)).expect("moved");
    }
    let [stdout, _] = said(here, &["rerun", "c.h5", "--data", "moved", "--cache", "cache"]);
    assert!(stdout.contains("identical"), "{stdout}");
    // other bytes of the input alone
    std::fs::rename(here.join("moved/y.csv"), here.join("y.csv")).expect("moved back");
    let problem = refused(here, &["run", "c.toml", "-o", "c2.h5", "--cache", "cache"]);
    assert!(problem.contains("u.csv, which is not there"), "{problem}");
    table(here, "u.csv", (0, 1e-3), "force (N)", &force.iter().map(|f| 2.0 * f).collect::<Vec<f64>>());
    let [stdout, _] = said(here, &["explain", "c.toml", "--cache", "cache"]);
    assert!(stdout.contains("u.csv") && stdout.contains("run"), "{stdout}");
}
