//! Plugins on the command line: the examples in Python, a new stage, the conformance test. Octave's and scikit-rf's are
//! in `make test-interop`.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::common::{ROOT, number, path_with, python_bin};
use serde_json::Value;

/// afmid with `bin` of the working folder and the Python of `make test-deps` first on the PATH.
fn afmid(here: &Path, arguments: &[&str]) -> Output {
    let path = path_with(&[here.join("bin"), python_bin()]);
    let mut command = Command::new(env!("CARGO_BIN_EXE_afmid"));
    command.current_dir(here).args(arguments).env("PATH", path).env("PYTHONDONTWRITEBYTECODE", "1");
    command.env("AFMID_TRUST", here.join("trust"));
    command.output().expect("afmid starts")
}

fn stdout(here: &Path, arguments: &[&str]) -> String {
    let output = afmid(here, arguments);
    let all = [output.stdout.as_slice(), &output.stderr].concat();
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&all));
    String::from_utf8(output.stdout).expect("text")
}

fn plugins() -> PathBuf {
    Path::new(ROOT).join("examples/plugins")
}

#[test]
fn a_smoother_of_scipys_runs_beside_the_built_in_one() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let script = plugins().join("savgol.py").display().to_string();
    let tried = stdout(here, &["plugin", "check", "--", "python3", &script]);
    assert!(tried.contains("passed") && !tried.contains("FAIL"), "{tried}");
    let config = plugins().join("savgol.toml").display().to_string();
    let archive = format!("archive.out='{}'", here.join("archive").display());
    stdout(here, &["run", &config, "--allow-plugins", "--set", &archive, "-o", "s.h5", "--cache", "cache"]);
    let shown: Value = serde_json::from_str(&stdout(here, &["show", "s.h5", "savgol", "--json"])).expect("JSON");
    let comparison = find(&shown, "largest_peak_over_reference").expect("the comparison");
    // mode 1 is two bins wide: a parabola over 21 bins flattens it to a few per cent, the local rational does not
    let peak = number(comparison, "/largest_peak_over_reference");
    assert!(peak > 0.05 && peak < 0.5, "{peak}");
    let frequency = number(comparison, "/largest_peak_hz");
    assert!((frequency / 46.3e3 - 1.0).abs() < 0.02, "{frequency} Hz");
    // the second run takes all from the cache
    let again = ["run", &config, "--allow-plugins", "--set", &archive, "-o", "s.h5", "--cache", "cache", "--json"];
    let again = stdout(here, &again);
    let again: Value = serde_json::from_str(&again).expect("JSON");
    // `simulate.afm` writes files and runs every time
    assert_eq!(number(&again, "/stages") - number(&again, "/reused"), 1.0, "{again}");
}

/// The object that holds this key, wherever it lies.
fn find<'a>(value: &'a Value, key: &str) -> Option<&'a Value> {
    match value {
        Value::Object(fields) if fields.contains_key(key) => Some(value),
        Value::Object(fields) => fields.values().find_map(|inner| find(inner, key)),
        Value::Array(items) => items.iter().find_map(|inner| find(inner, key)),
        _ => None,
    }
}

#[test]
fn a_new_stage_in_python_passes_and_runs() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    stdout(here, &["new", "stage", "end_noise", "--python"]);
    let tried = stdout(&here.join("end_noise"), &["plugin", "check", "--", "python3", "end_noise.py"]);
    assert!(tried.contains("passed") && !tried.contains("FAIL"), "{tried}");
    stdout(here, &["trust", "end_noise/end_noise.toml"]);
    stdout(here, &["run", "end_noise/end_noise.toml", "-o", "n.h5", "--cache", "cache"]);
    let shown: Value = serde_json::from_str(&stdout(here, &["show", "n.h5", "end_noise", "--json"])).expect("JSON");
    // 0.7 V of mode 1, five decay times later: 4 mV, noise beside it
    let rms = number(find(&shown, "rms").expect("the summary"), "/rms");
    assert!(rms > 2e-3 && rms < 8e-3, "{rms} V");
    let twice = afmid(here, &["new", "stage", "end_noise", "--python"]);
    assert!(String::from_utf8_lossy(&twice.stderr).contains("is there already"));
    let wrong = afmid(here, &["new", "stage", "End-Noise", "--python"]);
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("lowercase letters"));
}

#[test]
fn a_new_stage_in_rust_is_a_crate_that_cargo_understands() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    stdout(here, &["new", "stage", "end_noise", "--rust", "--sources", ROOT]);
    // the program itself is examples/new_stage.rs, which cargo has built and tests/commands/example.rs runs
    let metadata = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--format-version", "1", "--offline"])
        .current_dir(here.join("end_noise"))
        .output()
        .expect("cargo starts");
    assert!(metadata.status.success(), "{}", String::from_utf8_lossy(&metadata.stderr));
    let metadata: Value = serde_json::from_slice(&metadata.stdout).expect("JSON");
    assert_eq!(metadata["packages"][0]["name"], "end_noise");
    let names: Vec<&str> = metadata["packages"][0]["dependencies"]
        .as_array()
        .expect("a list")
        .iter()
        .filter_map(|one| one["name"].as_str())
        .collect();
    assert_eq!(names, ["afmid", "afmid-pipeline", "schemars", "serde", "serde_json"]);
    let nowhere = afmid(here, &["new", "stage", "other", "--rust", "--sources", "."]);
    assert!(String::from_utf8_lossy(&nowhere.stderr).contains("pipeline/Cargo.toml"));
}

#[test]
fn a_new_cause_is_a_script_or_a_crate() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    // the script itself is run in tests/wheel, with the package that it imports
    stdout(here, &["new", "cause", "end_stop", "--python", "-o", "script"]);
    let script = std::fs::read_to_string(here.join("script/end_stop.py")).expect("the script");
    assert!(script.contains("def end_stop(x, v,"), "{script}");
    // the program itself is examples/custom_cause.rs, which tests/commands/example.rs runs
    stdout(here, &["new", "cause", "end_stop", "--rust", "--sources", ROOT]);
    let metadata = Command::new(env!("CARGO"))
        .args(["metadata", "--no-deps", "--format-version", "1", "--offline"])
        .current_dir(here.join("end_stop"))
        .output()
        .expect("cargo starts");
    assert!(metadata.status.success(), "{}", String::from_utf8_lossy(&metadata.stderr));
    // this program has no such cause: the rest of the config is right
    let config = std::fs::read_to_string(here.join("end_stop/end_stop.toml")).expect("the config");
    let known = config.replace(", hidden = [{ cause = \"end-stop\", asymmetry = 0.01 }]", "");
    assert_ne!(known, config);
    std::fs::write(here.join("known.toml"), known).expect("a config");
    stdout(here, &["check", "known.toml"]);
    let wrong = afmid(here, &["new", "cause", "stop2", "--python"]);
    assert!(String::from_utf8_lossy(&wrong.stderr).contains("lowercase letters"));
}

#[test]
fn a_broken_plugin_fails_with_what_is_wrong_and_the_exit_code_says_so() {
    let scratch = tempfile::tempdir().expect("a folder");
    let script = Path::new(ROOT).join("tests/plugins/broken/wrong_length.py").display().to_string();
    let output = afmid(scratch.path(), &["plugin", "check", "--json", "--", "python3", &script]);
    assert_eq!(output.status.code(), Some(1));
    let all: Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(all["passed"], false);
    let failed =
        all["checks"].as_array().expect("a list").iter().find(|check| check["passed"] == false).expect("a failure");
    assert!(failed["said"].as_str().is_some_and(|said| said.contains("wrong_length.py")), "{failed}");
}

#[test]
fn a_program_on_the_path_is_a_plugin_by_its_name() {
    use std::os::unix::fs::PermissionsExt;
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let program = here.join("bin/afmid-stage-echo");
    std::fs::create_dir(here.join("bin")).expect("a folder");
    let script = Path::new(ROOT).join("tests/plugins/echo.py");
    std::fs::write(&program, format!("#!/bin/sh\nexec python3 '{}'\n", script.display())).expect("a program");
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).expect("an executable");
    let config =
        "[pipeline]\nname = \"echo\"\n[[stage]]\nid = \"echo\"\nuses = \"exec:echo\"\nparams = { steps = 2 }\n";
    std::fs::write(here.join("echo.toml"), config).expect("a config");
    stdout(here, &["run", "echo.toml", "--allow-plugins", "-o", "e.h5", "--cache", "cache"]);
    let shown: Value = serde_json::from_str(&stdout(here, &["show", "e.h5", "echo", "--json"])).expect("JSON");
    assert_eq!(number(find(&shown, "steps").expect("its parameters"), "/steps"), 2.0);
}
