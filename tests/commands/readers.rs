//! Results open in the readers that people use: h5py, xarray, nxcheck.

use std::path::Path;
use std::process::Command;

use crate::common::{ROOT, afmid, config, files, python_bin, simulated};

#[test]
fn h5py_xarray_and_nxcheck_read_a_result() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let archive = simulated(here, "archive", 8, 3);
    afmid(here, &["run", &config("paper.toml"), "--set", &files(&archive.folder), "-o", "p.h5", "--cache", "cache"]);
    let python = python_bin().join("python");
    let script = Path::new(ROOT).join("tests/store_readers.py");
    let output = Command::new(python).arg(script).arg(here.join("p.h5")).output().expect("python starts");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}\n{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains("coordinates"), "{text}");
    println!("{text}");
}
