//! `afmid report` as people and scripts see it.

use std::path::Path;
use std::process::{Command, Output};

use afmid_pipeline::store::write_result;
use afmid_pipeline::{Array, Axis, Ports, RunInfo, RunResult, Shaped, StageRecord, StageResult};

fn report(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_afmid"));
    command.current_dir(folder).arg("report").args(arguments).output().expect("afmid starts")
}

/// A run of one stage with a signal.
fn result(path: &Path) {
    let time: Vec<f64> = (0..500).map(|k| f64::from(k) * 1e-6).collect();
    let signal: Vec<f64> = time.iter().map(|t| (t * 1e5).sin()).collect();
    let array =
        Array::over(vec![Axis::new("time", "s", "time", time)]).with("signal", "V", "a sine", &["time"], signal);
    let mut outputs = Ports::new();
    outputs.insert("wave", array.wrap());
    let stage = StageRecord {
        id: "sine".to_owned(),
        uses: "any.sine".to_owned(),
        version: 1,
        params: serde_json::json!({}),
        wires: Vec::new(),
        seed: None,
        key: "0".repeat(64),
        sources: Vec::new(),
        result: StageResult { outputs, warnings: vec!["a <warning>".to_owned()] },
    };
    let run = RunResult {
        name: "waves".to_owned(),
        seed: 0,
        config: "[pipeline]\nname = \"waves\"\n".to_owned(),
        overrides: Vec::new(),
        program: "afmid".to_owned(),
        stages: vec![stage],
        info: RunInfo::default(),
    };
    write_result(path, &run).expect("a result");
}

#[test]
fn a_result_becomes_one_page_and_its_figures_files() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    result(&folder.join("waves.h5"));
    let output = report(folder, &["waves.h5"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(String::from_utf8_lossy(&output.stdout), "waves.html\n");
    let page = std::fs::read_to_string(folder.join("waves.html")).expect("a page");
    assert!(page.starts_with("<!DOCTYPE html>") && page.contains("a &lt;warning&gt;") && page.contains("a sine"));

    let output = report(folder, &["waves.h5", "-o", "again.html", "--figures", "pictures"]);
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(std::fs::read_to_string(folder.join("again.html")).expect("a page"), page, "same result, same page");
    let figure = std::fs::read_to_string(folder.join("pictures/stage-sine--wave.svg")).expect("a figure");
    assert!(figure.starts_with("<?xml") && figure.contains("<svg "));
    let left: Vec<_> =
        std::fs::read_dir(folder).expect("the folder").map(|entry| entry.expect("an entry").file_name()).collect();
    assert_eq!(left.len(), 4, "no temporary file is left: {left:?}");
}

#[test]
fn what_cannot_be_reported_is_said_with_the_exit_code() {
    let folder = tempfile::tempdir().expect("a folder");
    let folder = folder.path();
    result(&folder.join("waves.h5"));
    std::fs::write(folder.join("text.h5"), "no HDF5").expect("a file");
    std::os::unix::fs::symlink("waves.h5", folder.join("other-name.h5")).expect("a link");
    std::os::unix::fs::symlink("/dev/null", folder.join("device.html")).expect("a link");
    let bytes = std::fs::read(folder.join("waves.h5")).expect("the result");
    std::fs::write(folder.join("cut.h5"), &bytes[..bytes.len() - 10]).expect("a file");
    for (arguments, code, message) in [
        (&["nowhere.h5"][..], 2, "there is no file nowhere.h5"),
        (&["waves.h5", "-o", "waves.h5"], 2, "would replace the result file"),
        (&["text.h5"], 2, "text.h5 is a text file, wanted a result file"),
        (&["waves.h5", "-o", "text.h5/such/folder.html"], 2, "text.h5/such cannot be a folder"),
        (&["waves.h5", "-o", "text.h5/page.html"], 2, "text.h5 is a file, wanted a folder"),
        (&["waves.h5", "-o", "x.html", "--figures", "text.h5/such"], 2, "text.h5/such cannot be a folder"),
        (&["waves.h5", "-o", "other-name.h5"], 2, "would replace the result file"),
        (&["waves.h5", "-o", "text.h5"], 2, "only a page that `afmid report` wrote is replaced"),
        (&["waves.h5", "-o", "/dev/null"], 2, "is a device"),
        (&["waves.h5", "-o", "device.html"], 2, "is a device"),
        (&["waves.h5", "-o", "."], 2, "is a folder"),
        (&["cut.h5"], 1, "no seal"),
    ] {
        let output = report(folder, arguments);
        let stderr = String::from_utf8_lossy(&output.stderr);
        assert_eq!(output.status.code(), Some(code), "{arguments:?}: {stderr}");
        assert!(stderr.contains(message), "{arguments:?}: {stderr}");
    }
    assert_eq!(std::fs::read(folder.join("waves.h5")).expect("the result"), bytes, "nothing was replaced");
    assert_eq!(std::fs::read(folder.join("text.h5")).expect("a file"), b"no HDF5");
}
