//! The command line as scripts see it: exit codes, and what goes to stdout and to stderr.

use std::path::Path;
use std::process::{Command, Output};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

fn afmid(folder: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_afmid")).current_dir(folder).args(arguments).output().expect("afmid starts")
}

fn root(arguments: &[&str]) -> Output {
    afmid(Path::new(ROOT), arguments)
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn code(output: &Output) -> i32 {
    output.status.code().expect("it ended by itself")
}

#[test]
fn the_generated_documentation_is_current() {
    let output = root(&["docs", "--check"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
}

#[test]
fn every_shipped_config_is_right() {
    let folder = Path::new(ROOT).join("configs");
    let entries = std::fs::read_dir(folder).expect("the folder of configs");
    let mut configs: Vec<String> = entries.map(|entry| entry.expect("an entry").path().display().to_string()).collect();
    configs.retain(|config| config.ends_with(".toml"));
    configs.sort();
    assert!(!configs.is_empty());
    let mut arguments = vec!["check"];
    arguments.extend(configs.iter().map(String::as_str));
    let output = root(&arguments);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
    assert_eq!(stdout(&output).lines().count(), configs.len());
}

#[test]
fn a_wrong_command_line_or_config_is_exit_code_2_with_nothing_on_stdout() {
    let folder = tempfile::tempdir().expect("a folder");
    let wrong = "[pipeline]\nname = \"x\"\n[[stage]]\nid = \"a\"\nuses = \"io.record\"\n";
    std::fs::write(folder.path().join("wrong.toml"), wrong).expect("a config");
    std::fs::write(folder.path().join("bytes.toml"), [0xff, 0xfe]).expect("a config");
    for arguments in [
        &["no-such-command"][..],
        &["run"],
        &["run", "no-such.toml"],
        &["run", "wrong.toml"],
        &["check", "wrong.toml"],
        &["check", "bytes.toml"],
        &["graph", "wrong.toml"],
        &["explain", "wrong.toml"],
        &["run", "wrong.toml", "-j", "0"],
        &["show", "no-such.h5"],
        &["stages", "io.record"],
    ] {
        let output = afmid(folder.path(), arguments);
        assert_eq!(code(&output), 2, "{arguments:?}: {}", stderr(&output));
        assert_eq!(stdout(&output), "", "{arguments:?}");
        assert!(!stderr(&output).is_empty(), "{arguments:?}");
    }
    let told = stderr(&afmid(folder.path(), &["check", "wrong.toml"]));
    assert!(told.contains("wrong.toml:5:8") && told.contains("did you mean `io.records`?"), "{told}");
}

#[test]
fn check_goes_on_after_a_wrong_config() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.toml"), "[pipeline]\n").expect("a config");
    std::fs::write(folder.path().join("b.toml"), "[[stage]]\n").expect("a config");
    let output = afmid(folder.path(), &["check", "a.toml", "b.toml"]);
    assert_eq!(code(&output), 2);
    let told = stderr(&output);
    assert!(told.contains("a.toml: 2 problems") && told.contains("b.toml: 3 problems"), "{told}");
}

#[test]
fn stages_and_schema_print_the_registry() {
    let list = stdout(&root(&["stages"]));
    assert!(list.lines().any(|line| line.starts_with("io.records ")), "{list}");
    assert!(stdout(&root(&["stages", "io.records"])).starts_with("# io.records\n"));
    let schema: serde_json::Value = serde_json::from_str(&stdout(&root(&["schema"]))).expect("JSON alone");
    assert_eq!(schema["type"], "object");
}

/// Three records with an annoying amount of nothing in them, and a config that counts their samples.
fn archive(folder: &Path) {
    use afmid_pipeline::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};
    for number in 1..=3i16 {
        let channel = NativeChannel {
            location: "deflection".to_owned(),
            codes: Codes::Int16((0..2000).map(|k: i16| k.wrapping_mul(7919 + number) % 1000).collect()),
            unit: "V".to_owned(),
            scale_factor: 1e-3,
            add_offset: 0.0,
            long_name: "deflection".to_owned(),
        };
        let started_at = "2005-03-01T10:00:00Z".to_owned();
        let record = NativeRecord { sample_rate_hz: 5e6, started_at, channels: vec![channel] };
        let path = folder.join(format!("record_{number}.h5"));
        write_native(&path, &record, RecordStorage::Raw).expect("a record");
    }
    let config = "[pipeline]\nname = \"count\"\n[[stage]]\nid = \"records\"\nuses = \"io.records\"\n\
        params = { files = [\"record_*.h5\"] }\n[[stage]]\nid = \"census\"\nuses = \"io.census\"\ninputs = { records = \"records\" }\n";
    std::fs::write(folder.join("count.toml"), config).expect("a config");
}

#[test]
fn a_run_leaves_a_result_that_can_be_shown_and_the_next_one_reuses_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    archive(folder);
    let run = |arguments: &[&str]| {
        let output = afmid(folder, &[&["run", "count.toml", "--cache", "cache"], arguments].concat());
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        (stdout(&output), stderr(&output))
    };
    let (told, progress) = run(&["-o", "out/a.h5", "-j", "1"]);
    assert!(told.starts_with("out/a.h5: 2 stages in "), "{told}");
    assert!(progress.contains("census: "), "{progress}");
    let (told, progress) = run(&["-o", "out/b.h5", "-j", "3"]);
    assert!(told.contains("1 reused") && progress.contains("census: reused"), "{told}{progress}");
    run(&["-o", "out/c.h5", "-j", "3", "--fresh"]);
    for other in ["out/b.h5", "out/c.h5"] {
        let differences =
            afmid_pipeline::store::compare(&folder.join("out/a.h5"), &folder.join(other)).expect("both whole");
        assert!(differences.is_empty(), "{differences:?}");
    }
    run(&[]);
    assert!(folder.join("count.h5").is_file(), "without -o the result is named after the pipeline");

    let overview = stdout(&afmid(folder, &["show", "out/a.h5"]));
    assert!(overview.starts_with("count (seed 0), afmid ") && overview.contains("table (table)"), "{overview}");
    let json = |arguments: &[&str]| -> serde_json::Value {
        let output = afmid(folder, arguments);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        serde_json::from_str(&stdout(&output)).expect("JSON alone on stdout")
    };
    assert_eq!(json(&["show", "out/a.h5", "--json"])["stages"][1]["id"], "census");
    assert!(json(&["show", "out/a.h5", "census", "--json"]).is_object());
    let stage = stdout(&afmid(folder, &["show", "out/a.h5", "census"]));
    assert!(stage.starts_with("census: io.census version ") && stage.contains("record_2.h5"), "{stage}");

    let unknown = afmid(folder, &["show", "out/a.h5", "sensus"]);
    assert_eq!(code(&unknown), 2);
    assert!(stderr(&unknown).contains("did you mean `census`?"), "{}", stderr(&unknown));
    assert_eq!(stdout(&unknown), "");
}

#[test]
fn explain_says_what_would_run() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    archive(folder);
    let explain = || stdout(&afmid(folder, &["explain", "count.toml", "--cache", "cache"]));
    let line = |text: &str| text.lines().find(|line| line.starts_with("census ")).unwrap_or_default().to_owned();
    assert!(line(&explain()).contains("run "), "{}", explain());
    assert_eq!(code(&afmid(folder, &["run", "count.toml", "--cache", "cache"])), 0);
    assert!(line(&explain()).contains("be reused"), "{}", explain());
}

#[test]
fn a_failed_run_is_exit_code_1_names_the_stage_and_leaves_no_result() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    archive(folder);
    std::fs::write(folder.join("record_2.h5"), b"not HDF5").expect("a broken record");
    let output = afmid(folder, &["run", "count.toml", "--cache", "cache", "-o", "a.h5"]);
    assert_eq!(code(&output), 1);
    let told = stderr(&output);
    assert!(told.contains("stage `records` (io.records)") && told.contains("record_2.h5"), "{told}");
    assert_eq!(stdout(&output), "");
    assert!(!folder.join("a.h5").exists());
}

#[test]
fn a_set_argument_changes_the_run_and_its_mistakes_are_shown_in_it() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    archive(folder);
    let set =
        |argument: &str| afmid(folder, &["run", "count.toml", "--cache", "cache", "-o", "a.h5", "--set", argument]);
    let right = set("records.files=[\"record_1.h5\"]");
    assert_eq!(code(&right), 0, "{}", stderr(&right));
    let shown = stdout(&afmid(folder, &["show", "a.h5", "records"]));
    assert!(shown.contains("record_1.h5") && !shown.contains("record_2.h5"), "{shown}");
    let wrong = set("records.file=[\"record_1.h5\"]");
    assert_eq!(code(&wrong), 2);
    assert!(stderr(&wrong).contains("did you mean `files`?") && stderr(&wrong).contains("--set"), "{}", stderr(&wrong));
}
