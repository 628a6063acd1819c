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
