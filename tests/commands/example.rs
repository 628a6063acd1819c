//! The example programs: a stage of one's own beside the built-in ones, a cause of one's own in the catalogue.

use std::path::Path;
use std::process::Command;

use crate::common::{self, ROOT};

/// What `afmid new stage --rust` begins with: its own test runs with these.
#[path = "../../examples/new_stage.rs"]
#[allow(dead_code, reason = "its main is the example's")]
mod new_stage;

/// A program of the examples, which cargo builds before the tests run, beside the program's folder.
fn example(name: &str, here: &Path, arguments: &[&str]) -> String {
    let program = Path::new(env!("CARGO_BIN_EXE_afmid")).with_file_name("examples").join(name);
    let output = Command::new(&program).current_dir(here).args(arguments).output().expect("the example starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8_lossy(&output.stdout).into_owned()
}

#[test]
fn a_stage_of_another_crate_runs_in_a_config() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let config = Path::new(ROOT).join("examples/custom_stage.toml");
    let archive = format!("archive.out='{}'", here.join("archive").display());
    let run = |arguments: &[&str]| example("custom_stage", here, arguments);
    run(&["run", &config.display().to_string(), "--set", &archive, "-o", "x.h5", "--cache", "cache"]);
    let shown: serde_json::Value = serde_json::from_str(&run(&["show", "x.h5", "envelope", "--json"])).expect("JSON");
    // the simulated lever's mode 1: tau = Q / (pi f) = 0.2805 ms; higher modes and blocks of 2.4 periods cost some per
    // cent
    let tau = common::number(&shown, "/decay_time_s");
    assert!((tau / 2.805e-4 - 1.0).abs() < 0.05, "{tau} s");
    assert!(run(&["stages", "example.envelope"]).contains("Decay time"));
}

#[test]
fn a_cause_of_another_crate_is_hidden_and_named() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let config = Path::new(ROOT).join("examples/custom_cause.toml").display().to_string();
    let archive = format!("archive.out='{}'", here.join("archive").display());
    let run = |arguments: &[&str]| example("custom_cause", here, arguments);
    run(&["run", &config, "--set", &archive, "-o", "c.h5", "--cache", "cache"]);
    let found: serde_json::Value = serde_json::from_str(&run(&["show", "c.h5", "diagnosis", "--json"])).expect("JSON");
    assert_eq!(found["verdict"], "named", "{found:#}");
    assert_eq!(found["causes"][0]["id"], "unequal-segments", "{found:#}");
    let of = |what: &str| common::number(&found, &format!("/causes/0/parameters/asymmetry/{what}"));
    // four of its own standard errors: by chance once in 16,000
    assert!((of("value") - 0.01).abs() < 4.0 * of("std"), "{} +- {}", of("value"), of("std"));
    assert!(run(&["causes", "unequal-segments"]).contains("segments"));
}

#[test]
fn what_a_new_stage_begins_with_runs_in_its_config() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let config = Path::new(ROOT).join("examples/new_stage.toml").display().to_string();
    let archive = format!("archive.out='{}'", here.join("archive").display());
    let run = |arguments: &[&str]| example("new_stage", here, arguments);
    run(&["run", &config, "--set", &archive, "-o", "n.h5", "--cache", "cache"]);
    let shown: serde_json::Value = serde_json::from_str(&run(&["show", "n.h5", "new_stage", "--json"])).expect("JSON");
    // 0.7 V of mode 1, five decay times later: 4 mV, noise beside it
    let rms = common::number(&shown, "/rms");
    assert!(rms > 2e-3 && rms < 8e-3, "{rms} V");
}
