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
    let message = stderr(&afmid(folder.path(), &["check", "wrong.toml"]));
    assert!(message.contains("wrong.toml:5:8") && message.contains("did you mean `io.records`?"), "{message}");
}

#[test]
fn check_goes_on_after_a_wrong_config() {
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("a.toml"), "[pipeline]\n").expect("a config");
    std::fs::write(folder.path().join("b.toml"), "[[stage]]\n").expect("a config");
    let output = afmid(folder.path(), &["check", "a.toml", "b.toml"]);
    assert_eq!(code(&output), 2);
    let message = stderr(&output);
    assert!(message.contains("a.toml: 2 problems") && message.contains("b.toml: 3 problems"), "{message}");
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
        params = { files = [\"record_*.h5\"] }\n[[stage]]\nid = \"census\"\nuses = \"io.census\"\n\
        inputs = { records = \"records\" }\n";
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
    std::fs::create_dir(folder.join("out")).expect("a folder");
    let (output, progress) = run(&["-o", "out/a.h5", "-j", "1"]);
    assert!(output.starts_with("out/a.h5: 2 stages in "), "{output}");
    assert!(progress.contains("census: "), "{progress}");
    let (output, progress) = run(&["-o", "out/b.h5", "-j", "3"]);
    assert!(output.contains("1 reused") && progress.contains("census: reused"), "{output}{progress}");
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
fn commands_that_write_tell_programs_what_they_wrote() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    archive(folder);
    let json = |arguments: &[&str]| -> serde_json::Value {
        let output = afmid(folder, arguments);
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        serde_json::from_str(&stdout(&output)).expect("JSON alone on stdout")
    };
    let graph = json(&["graph", "count.toml", "--json"]);
    assert_eq!(graph, json(&["graph", "count.toml", "--format", "json"]));
    assert_eq!(graph["stages"][1]["inputs"]["records"], "records.records");
    json(&["run", "count.toml", "--cache", "cache", "-o", "a.h5", "--json"]);
    let report = json(&["report", "a.h5", "--figures", "figures", "--png", "--json"]);
    let figures: Vec<&str> =
        report["figures"].as_array().expect("a list").iter().filter_map(|name| name.as_str()).collect();
    assert!(folder.join(report["page"].as_str().expect("a page")).is_file());
    for pair in figures.chunks(2) {
        assert_eq!(pair[0].replace(".svg", ".png"), pair[1]);
        let bytes = std::fs::read(folder.join(pair[1])).expect("a picture");
        assert!(bytes.starts_with(b"\x89PNG\r\n"), "{}", pair[1]);
    }
    assert_eq!(code(&afmid(folder, &["report", "a.h5", "--png"])), 2, "--png wants --figures");
    let stage = json(&["new", "stage", "mine", "--python", "--json"]);
    let files = stage["files"].as_array().expect("a list");
    assert!(files.len() >= 3 && files.iter().all(|name| folder.join(name.as_str().expect("a name")).is_file()));
    let made = json(&["export-crate", "a.h5", "--json"]);
    assert_eq!((&made["inputs"], &made["missing"]), (&3.into(), &0.into()));
    assert!(folder.join(made["folder"].as_str().expect("a folder")).is_dir());
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
    let message = stderr(&output);
    assert!(message.contains("stage `records` (io.records)") && message.contains("record_2.h5"), "{message}");
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

/// Everything in a folder, by name, with its bytes.
fn contents(folder: &Path) -> Vec<(std::path::PathBuf, Vec<u8>)> {
    let entries = std::fs::read_dir(folder).expect("the folder").map(|entry| entry.expect("an entry").path());
    let mut found: Vec<_> = entries.filter(|path| path.is_file()).collect();
    found.sort();
    found.into_iter().map(|path| (path.clone(), std::fs::read(&path).expect("a file"))).collect()
}

#[test]
fn an_output_never_replaces_an_input_or_anything_that_afmid_did_not_write() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    archive(folder);
    let link = |to: &str, name: &str| std::os::unix::fs::symlink(to, folder.join(name)).expect("a link");
    link("record_2.h5", "also.h5");
    link("/dev/null", "device.h5");
    link("nowhere", "dangling.h5");
    std::fs::hard_link(folder.join("record_3.h5"), folder.join("hard.h5")).expect("a link");
    std::fs::write(folder.join("thesis.txt"), "three years").expect("a file");
    std::fs::write(folder.join("photo.h5"), [0xff; 100]).expect("a file");
    std::fs::create_dir(folder.join("there")).expect("a folder");
    let before = contents(folder);
    for (output, said) in [
        ("record_1.h5", "the output would replace a record"),
        ("./record_1.h5", "the output would replace a record"),
        ("also.h5", "the output would replace a record"),
        ("hard.h5", "the output would replace a record"),
        ("count.toml", "the output would replace the config"),
        ("thesis.txt", "is a text file: only a result of afmid's is replaced"),
        ("photo.h5", "is a file of an unknown kind"),
        ("there", "is a folder"),
        ("..", "is a folder"),
        ("/dev/null", "is a device"),
        ("device.h5", "is a device"),
        ("dangling.h5", "is a link to nothing"),
        ("/proc/x.h5", "/proc/x.h5 cannot be written"),
        ("thesis.txt/such/x.h5", "thesis.txt/such cannot be a folder"),
        ("thesis.txt/x.h5", "thesis.txt is a file, wanted a folder"),
        (&format!("{}.h5", "x".repeat(250)), "its name is too long"),
    ] {
        let run = afmid(folder, &["run", "count.toml", "--cache", "cache", "-o", output]);
        let message = stderr(&run);
        assert_eq!(code(&run), 2, "{output}: {message}");
        assert!(message.contains(said), "{output}: {message}");
        assert!(
            !message.contains(".tmp") && !message.contains("HDF5:") && !message.contains("records: "),
            "{output}: {message}"
        );
        assert!(message.contains("help: "), "{output}: {message}");
        assert_eq!(stdout(&run), "");
    }
    assert_eq!(contents(folder), before, "nothing was written, nothing replaced");
    assert!(!folder.join("cache").exists(), "nothing ran");
    // a folder that is missing is made
    let run = afmid(folder, &["run", "count.toml", "--cache", "cache", "-o", "new/deep/x.h5"]);
    assert!(code(&run) == 0 && folder.join("new/deep/x.h5").is_file(), "{}", stderr(&run));
    // what may be replaced: a result, whole or cut short, and an empty file
    for bytes in [None, Some(300)] {
        let run = afmid(folder, &["run", "count.toml", "--cache", "cache", "-o", "there/a.h5"]);
        assert_eq!(code(&run), 0, "{}", stderr(&run));
        let whole = std::fs::read(folder.join("there/a.h5")).expect("a result");
        std::fs::write(folder.join("there/a.h5"), &whole[..whole.len() - bytes.unwrap_or(0)]).expect("a file");
    }
    std::fs::write(folder.join("there/empty.h5"), "").expect("a file");
    for output in ["there/a.h5", "there/empty.h5"] {
        let run = afmid(folder, &["run", "count.toml", "--cache", "cache", "-o", output]);
        assert_eq!(code(&run), 0, "{output}: {}", stderr(&run));
    }
}

#[test]
fn a_result_beside_the_records_is_no_record_and_may_be_replaced() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    archive(folder);
    let run = || {
        let output = afmid(
            folder,
            &["run", "count.toml", "--cache", "cache", "-o", "result.h5", "--set", "records.files=['*.h5']"],
        );
        assert_eq!(code(&output), 0, "{}", stderr(&output));
        stderr(&output)
    };
    assert!(!run().contains("warning"));
    let again = run();
    assert!(
        again.contains("1 file of those that match is a result of afmid's") && again.contains("census: reused"),
        "{again}"
    );
    let shown = stdout(&afmid(folder, &["show", "result.h5", "records"]));
    assert!(shown.contains("record_3.h5") && !shown.contains("result.h5 "), "{shown}");
}

#[test]
fn a_file_that_is_no_result_is_called_what_it_is() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    archive(folder);
    std::fs::write(folder.join("cut.h5"), b"\x89HDF\r\n\x1a\nand no more").expect("a file");
    assert_eq!(code(&afmid(folder, &["run", "count.toml", "--cache", "cache", "-o", "a.h5"])), 0);
    for command in ["show", "report"] {
        for (file, said, help) in [
            ("record_1.h5", "is a native record", "io.records"),
            ("count.toml", "is a TOML file", "afmid run count.toml"),
            ("cut.h5", "is an HDF5 file of another program", "afmid run CONFIG"),
            (".", "is a folder", ""),
        ] {
            let output = afmid(folder, &[command, file]);
            let message = stderr(&output);
            assert_eq!(code(&output), 2, "{command} {file}: {message}");
            assert!(
                message.contains(said) && message.contains("wanted a result file") && message.contains(help),
                "{file}: {message}"
            );
            assert!(!message.contains("seal"), "{message}");
        }
        let whole = std::fs::read(folder.join("a.h5")).expect("the result");
        std::fs::write(folder.join("b.h5"), &whole[..whole.len() - 1]).expect("a file");
        let broken = afmid(folder, &[command, "b.h5"]);
        assert_eq!(code(&broken), 1);
        assert!(stderr(&broken).contains("its last line is no seal"), "{}", stderr(&broken));
    }
}

#[test]
fn a_closed_pipe_ends_quietly_and_a_full_device_with_an_error() {
    use std::process::Stdio;
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    archive(folder);
    assert_eq!(code(&afmid(folder, &["run", "count.toml", "--cache", "cache", "-o", "a.h5"])), 0);
    let start = |arguments: &[&str], stdout: Stdio| {
        let mut command = Command::new(env!("CARGO_BIN_EXE_afmid"));
        command.current_dir(folder).args(arguments).stdout(stdout).stderr(Stdio::piped()).spawn().expect("afmid starts")
    };
    for arguments in [
        &["schema"][..],
        &["show", "a.h5"],
        &["show", "a.h5", "--json"],
        &["stages"],
        &["stages", "io.records"],
        &["graph", "count.toml"],
        &["explain", "count.toml", "--cache", "cache"],
        &["diff", "a.h5", "a.h5"],
        &["trace", "a.h5", "census"],
        &["rerun", "a.h5", "--cache", "cache"],
        &["gc", "--cache", "cache"],
        &["check", "count.toml", "count.toml"],
        &["run", "count.toml", "--cache", "cache", "-o", "b.h5"],
        &["report", "a.h5"],
        &["--help"],
        &["run", "--help"],
        &["--version"],
    ] {
        let mut child = start(arguments, Stdio::piped());
        drop(child.stdout.take());
        let output = child.wait_with_output().expect("it ends");
        assert_eq!(code(&output), 0, "{arguments:?}: {}", stderr(&output));
        assert!(!stderr(&output).contains("panicked") && !stderr(&output).contains("error"), "{}", stderr(&output));

        let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("/dev/full");
        let output = start(arguments, full.into()).wait_with_output().expect("it ends");
        assert_eq!(code(&output), 1, "{arguments:?}: {}", stderr(&output));
        assert!(stderr(&output).contains("error: stdout cannot be written: No space left"), "{}", stderr(&output));
    }
    // stderr may be full too: the exit code is left
    let full = std::fs::OpenOptions::new().write(true).open("/dev/full").expect("/dev/full");
    let status = Command::new(env!("CARGO_BIN_EXE_afmid"))
        .args(["show", "nowhere.h5"])
        .stderr(full)
        .status()
        .expect("afmid starts");
    assert_eq!(status.code(), Some(2));
}

#[test]
fn mistakes_are_reported_with_the_range_that_holds() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    archive(folder);
    let refused = |arguments: &[&str]| {
        let output = afmid(folder, arguments);
        assert_eq!(code(&output), 2);
        stderr(&output)
    };
    let jobs = refused(&["run", "count.toml", "-j", "0"]);
    assert!(jobs.contains("wanted a whole number from 1 to 65535") && !jobs.contains("non-zero"), "{jobs}");
    let config = std::fs::read_to_string(folder.join("count.toml")).expect("the config");
    let events = "[[stage]]\nid = \"events\"\nuses = \"events.correlation\"\ninputs = { records = \"records\" }\n\
        params = { kind = \"snap-off\", window_samples = -3 }\n";
    std::fs::write(folder.join("range.toml"), format!("{config}{events}")).expect("a config");
    let range = refused(&["check", "range.toml"]);
    assert!(range.contains("found the integer `-3`, wanted 256 to 4194304"), "{range}");
    let modes = "[pipeline]\nname = \"x\"\n[[stage]]\nid = \"m\"\nuses = \"model.modes\"\ninputs = { model = \"m\" }\n\
        params = { reference_quality_factor = [1.0] }\n";
    std::fs::write(folder.join("modes.toml"), modes).expect("a config");
    let modes = refused(&["check", "modes.toml"]).replace(['\n', '│'], " ");
    assert!(modes.contains("has 1 value, wanted none"), "{modes}");
    std::fs::write(folder.join("open.toml"), config.replace("[pipeline]", "[pipeline")).expect("a config");
    let open = refused(&["check", "open.toml"]);
    assert!(open.contains("unclosed table") && !open.contains("given twice"), "{open}");
}

/// No text of the program sends people to a command that does not exist.
#[test]
fn every_command_that_help_texts_name_exists() {
    let help = stdout(&root(&["--help"]));
    let commands: Vec<&str> =
        help.lines().filter_map(|line| line.strip_prefix("  ")?.split_whitespace().next()).collect();
    let mut sources =
        ["src", "stages/src", "stages/kernels/src", "pipeline/src"].map(|folder| Path::new(ROOT).join(folder)).to_vec();
    let mut seen = 0;
    while let Some(path) = sources.pop() {
        if path.is_dir() {
            sources.extend(std::fs::read_dir(path).expect("a folder").map(|entry| entry.expect("an entry").path()));
            continue;
        }
        let text = std::fs::read_to_string(&path).unwrap_or_default();
        for (at, _) in text.match_indices("`afmid ") {
            let name: String = text[at + 7..].chars().take_while(|&c| c.is_ascii_lowercase() || c == '-').collect();
            seen += 1;
            let known = name.is_empty() || name.starts_with('-') || name == "docs" || commands.contains(&name.as_str());
            assert!(known, "{}: `afmid {name}`", path.display());
        }
    }
    assert!(seen > 10, "{seen}");
}

/// The config in the README is one.
#[test]
fn the_config_in_the_readme_is_right() {
    let readme = std::fs::read_to_string(Path::new(ROOT).join("README.md")).expect("the README");
    let config = readme.split("```toml\n").nth(1).and_then(|rest| rest.split("```").next()).expect("a config");
    let folder = tempfile::tempdir().expect("a folder");
    std::fs::write(folder.path().join("mine.toml"), config).expect("a config");
    let output = afmid(folder.path(), &["check", "mine.toml"]);
    assert_eq!(code(&output), 0, "{}", stderr(&output));
}
