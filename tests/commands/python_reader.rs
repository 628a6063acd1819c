//! The Python reader (python/afmid) on a result of this program: its examples and tests, and the notebooks of docs/.

use std::path::Path;
use std::process::Command;

use crate::common::{ROOT, afmid, config, files, python_bin, simulated};

#[test]
fn the_python_reader_reads_what_afmid_shows_and_the_notebooks_run() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let archive = simulated(here, "archive", 8, 3);
    let chosen = files(&archive.folder);
    afmid(here, &["run", &config("free-lever.toml"), "--set", &chosen, "-o", "a.h5", "--cache", "cache"]);
    let python = python_bin().join("python");
    let package = Path::new(ROOT).join("python/afmid");
    let output = Command::new(python)
        .args(["-m", "pytest", "-q"])
        .arg(&package)
        .current_dir(here)
        .env("PYTHONPATH", package.join("src"))
        // a test leaves nothing behind in the tree
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("AFMID", env!("CARGO_BIN_EXE_afmid"))
        .env("AFMID_RESULT", here.join("a.h5"))
        .output()
        .expect("python starts");
    let text = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{text}\n{}", String::from_utf8_lossy(&output.stderr));
    assert!(text.contains(" passed") && !text.contains("skipped"), "{text}");
    println!("{text}");
}
