//! The example program: a stage of one's own beside the built-in ones.

mod common;

use std::path::Path;
use std::process::Command;

use common::ROOT;

#[test]
fn a_stage_of_another_crate_runs_in_a_config() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    // cargo builds the examples before the tests run, beside the program's folder
    let program = Path::new(env!("CARGO_BIN_EXE_afmid")).with_file_name("examples").join("custom_stage");
    let config = Path::new(ROOT).join("examples/custom_stage.toml");
    let archive = format!("archive.out='{}'", here.join("archive").display());
    let run = |arguments: &[&str]| {
        let output = Command::new(&program).current_dir(here).args(arguments).output().expect("the example starts");
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
        String::from_utf8_lossy(&output.stdout).into_owned()
    };
    run(&["run", &config.display().to_string(), "--set", &archive, "-o", "x.h5", "--cache", "cache"]);
    let shown: serde_json::Value = serde_json::from_str(&run(&["show", "x.h5", "envelope", "--json"])).expect("JSON");
    // the simulated lever's mode 1: tau = Q / (pi f) = 0.2805 ms; higher modes and blocks of 2.4 periods cost some per cent
    let tau = common::number(&shown, "/decay_time_s");
    assert!((tau / 2.805e-4 - 1.0).abs() < 0.05, "{tau} s");
    assert!(run(&["stages", "example.envelope"]).contains("Decay time"));
}
