//! Results of earlier formats stay readable.
//!
//! `earlier/result-2.h5` was written by version 0.1.0 of commit 3e9ec2c from `earlier/simulate.toml` and
//! `earlier/small.toml`: format 2, before stage files stated what they hold.

use std::fs;
use std::path::{Path, PathBuf};

use super::common::{ROOT, afmid, command, number, shown};

fn earlier(name: &str) -> PathBuf {
    Path::new(ROOT).join("tests/integrity/earlier").join(name)
}

/// A folder with the earlier result.
fn folder() -> tempfile::TempDir {
    let scratch = tempfile::tempdir().expect("a folder");
    for name in ["result-2.h5", "simulate.toml", "small.toml"] {
        fs::copy(earlier(name), scratch.path().join(name)).expect("a copy");
    }
    scratch
}

#[test]
fn an_earlier_result_is_shown_reported_and_traced() {
    let scratch = folder();
    let here = scratch.path();
    let stdout = afmid(here, &["show", "result-2.h5"]);
    for stage in ["records", "census", "events", "ringdown"] {
        assert!(stdout.contains(stage), "{stdout}");
    }
    let modes = shown(here, "result-2.h5", "ringdown");
    // what `afmid show` of that version printed
    assert_eq!(number(&modes, "/modes/0/frequency_hz"), 46_299.370_036_477_21);
    afmid(here, &["report", "result-2.h5", "-o", "page.html"]);
    let page = fs::read_to_string(here.join("page.html")).expect("a page");
    assert!(page.contains("model.ringdown") && page.contains("46299"), "the page shows the modes");
    let stdout = afmid(here, &["trace", "result-2.h5", "ringdown.modes[0].frequency_hz"]);
    assert!(stdout.contains("record_0001.h5") && stdout.contains("BLAKE3 0e3cce4a08e8c2fc"), "{stdout}");
}

#[test]
fn an_earlier_result_is_compared_with_itself_and_with_one_of_today() {
    let scratch = folder();
    let here = scratch.path();
    fs::copy(here.join("result-2.h5"), here.join("same.h5")).expect("a copy");
    afmid(here, &["diff", "result-2.h5", "same.h5", "--exit-code"]);
    afmid(here, &["run", "simulate.toml", "-o", "simulate.h5", "--cache", "cache"]);
    afmid(here, &["run", "small.toml", "-o", "now.h5", "--cache", "cache", "--set", "ringdown.modes=1"]);
    let output = command(here, &["diff", "result-2.h5", "now.h5"]).output().expect("afmid starts");
    let stdout = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success() && stdout.contains("modes") && stdout.contains("ringdown"), "{output:?}");
    // it may be replaced, as any result of afmid's
    afmid(here, &["run", "small.toml", "-o", "result-2.h5", "--cache", "cache"]);
}
