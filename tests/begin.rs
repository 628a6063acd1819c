//! Beginnings: configs for recordings, completions, manual pages, the doctor.

mod common;

use std::path::Path;
use std::process::{Command, Output};

use common::sets::write_set;
use serde_json::Value;

fn afmid(here: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_afmid")).current_dir(here).args(arguments).output().expect("afmid starts")
}

fn stdout(here: &Path, arguments: &[&str]) -> String {
    let output = afmid(here, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn a_new_pipeline_finds_its_recordings_from_wherever_it_lies() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    write_set(&here.join("archive/2004"), 0, 3000);
    std::fs::write(here.join("archive/2004/notes.txt"), "of somebody").expect("a file");
    std::fs::create_dir(here.join("configs")).expect("a folder");
    for goal in ["modes", "ringdown", "diagnosis", "coupled"] {
        let config = format!("configs/{goal}.toml");
        let said = stdout(here, &["new", "pipeline", "archive/2004", "--goal", goal, "-o", &config]);
        assert!(said.contains("2 files"), "{said}");
        stdout(here, &["check", &config]);
        let text = std::fs::read_to_string(here.join(&config)).expect("a config");
        assert!(text.contains("\"../archive/2004/*.h5\""), "{text}");
        // the recordings are found and read; that they hold no event is another matter
        let explained = stdout(here, &["explain", &config, "--cache", "cache"]);
        assert!(explained.contains("records"), "{explained}");
    }
}

#[test]
fn completions_know_every_command() {
    let here = tempfile::tempdir().expect("a folder");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = stdout(here.path(), &["completions", shell]);
        for command in ["run", "batch", "inspect", "doctor", "export-crate"] {
            assert!(script.contains(command), "{shell}: {command}");
        }
    }
    // what bash says of it, where there is one
    std::fs::write(here.path().join("afmid.bash"), stdout(here.path(), &["completions", "bash"])).expect("a script");
    let asked =
        "source ./afmid.bash; COMP_WORDS=(afmid ins); COMP_CWORD=1; _afmid afmid ins afmid; echo \"${COMPREPLY[@]}\"";
    let reply = Command::new("bash").current_dir(here.path()).args(["-c", asked]).output().expect("bash starts");
    assert_eq!(String::from_utf8_lossy(&reply.stdout).trim(), "inspect", "{}", String::from_utf8_lossy(&reply.stderr));
}

#[test]
fn every_command_has_a_manual_page_with_its_examples() {
    let scratch = tempfile::tempdir().expect("a folder");
    stdout(scratch.path(), &["man", "man1"]);
    let page = |name: &str| std::fs::read_to_string(scratch.path().join("man1").join(name)).expect(name);
    assert!(page("afmid.1").contains("afmid\\-run(1)"));
    assert!(page("afmid-run.1").contains("records.files"));
    assert!(page("afmid-submit-slurm.1").contains("\\-\\-shards"));
    assert!(page("afmid-new-pipeline.1").contains("\\-\\-goal"));
    assert_eq!(stdout(scratch.path(), &["man"]), page("afmid.1"));
}

#[test]
fn the_doctor_finds_this_machine_fit_and_a_blocked_cache_not() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let findings: Value = serde_json::from_str(&stdout(here, &["doctor", "--cache", "cache", "--json"])).expect("JSON");
    let findings = findings["findings"].as_array().expect("findings");
    let state = |what: &str| findings.iter().find(|finding| finding["what"] == what).map(|finding| &finding["state"]);
    assert_eq!(state("model.pem"), Some(&"good".into()), "{findings:?}");
    assert!(findings.iter().all(|finding| finding["state"] != "bad"), "{findings:?}");
    std::fs::write(here.join("file"), "in the way").expect("a file");
    let output = afmid(here, &["doctor", "--cache", "file"]);
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.lines().any(|line| line.starts_with("x cache")) && text.contains("--cache"), "{text}");
}

/// Modes of a file by three commands: frequency, its error, damping ratio, its error.
fn modes_by_three_commands(here: &Path, file: &str, said: &[String]) -> Vec<[f64; 4]> {
    let (config, result) = (format!("{file}.toml"), format!("{file}.result.h5"));
    let mut new = vec!["new", "pipeline", file, "-o", &config];
    new.extend(said.iter().map(String::as_str));
    stdout(here, &new);
    stdout(here, &["run", &config, "-o", &result, "--cache", "cache"]);
    let shown: Value = serde_json::from_str(&stdout(here, &["show", &result, "modes", "--json"])).expect("JSON");
    let names = ["frequency_hz", "frequency_std_hz", "damping_ratio", "damping_ratio_std"];
    let number = |mode: &Value, name: &str| mode[name].as_f64().unwrap_or_else(|| panic!("{file}: {shown}"));
    shown["modes"].as_array().expect("modes").iter().map(|mode| names.map(|name| number(mode, name))).collect()
}

#[test]
fn one_decay_gives_the_same_modes_from_any_file_by_three_commands() {
    let python = common::python_bin().join("python");
    let script = Path::new(common::ROOT).join("tests/decay_files.py");
    let (mut covered, mut all) = (0, 0);
    for seed in 0..5 {
        let scratch = tempfile::tempdir().expect("a folder");
        let here = scratch.path();
        let written =
            Command::new(&python).arg(&script).arg(here).arg(seed.to_string()).output().expect("python starts");
        assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
        let written: Value = serde_json::from_slice(&written.stdout).expect("JSON");
        let truth: Vec<[f64; 2]> = serde_json::from_value(written["modes"].clone()).expect("modes");
        let mut first: Option<Vec<[f64; 4]>> = None;
        for (file, said) in written["files"].as_object().expect("files") {
            let said: Vec<String> = serde_json::from_value(said.clone()).expect("arguments");
            let modes = modes_by_three_commands(here, file, &said);
            assert_eq!(modes.len(), truth.len(), "{file}, seed {seed}: {modes:?}");
            let first = first.get_or_insert_with(|| modes.clone());
            for (own, other) in modes.iter().zip(first) {
                // twelve digits of a universal file, and where the search ends
                let far = (own[0] - other[0]).abs() / other[1] + (own[2] - other[2]).abs() / other[3];
                assert!(far < 1e-3, "{file}, seed {seed}: {own:?} {other:?}");
            }
        }
        for (mode, [frequency, damping]) in first.expect("files").iter().zip(truth) {
            let inside = |value: f64, std: f64, truth: f64| usize::from((value - truth).abs() < 1.96 * std);
            covered += inside(mode[0], mode[1], frequency) + inside(mode[2], mode[3], damping);
            all += 2;
        }
    }
    // of 30 intervals of 95 % fewer than 25 hold the truth once in a thousand times
    assert!(covered >= 25, "{covered} of {all} intervals hold the truth");
}
