//! Names of data sets whose results would take one another's place.

use std::fs;

use super::common::sets::{CENSUS, Here};

/// A stage that finds nothing in noise.
const NO_EVENT: &str = "\n[[stage]]\nid = \"events\"\nuses = \"events.correlation\"\n\
    inputs = { records = \"records\" }\nparams = { kind = \"snap-off\", window_samples = 1024 }\n";

fn here(names: &[&str]) -> Here {
    let here = Here::new();
    fs::write(here.path("events.toml"), format!("{CENSUS}{NO_EVENT}")).expect("a config");
    names.iter().enumerate().for_each(|(seed, name)| here.set(name, seed, 3000));
    here
}

#[test]
fn names_whose_results_collide_are_refused_before_anything_runs() {
    for names in [["a", "a.failed"], ["deep/Lever", "lever"], ["x.failed", "deep/X"]] {
        let here = here(&names);
        let output = here.batch(&["events.toml", names[0], names[1], "-o", "out", "--cache", "cache"]);
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{names:?}: {said}");
        for name in names.map(|name| name.trim_start_matches("deep/")) {
            assert!(said.contains(&format!("`{name}`")), "{name}: {said}");
        }
        assert!(!here.path("out").exists() && !here.path("cache").exists(), "{names:?}: something ran");
    }
    let here = here(&["a", "b.failed"]);
    assert_eq!(here.batch_json(&["census.toml", "a", "b.failed", "-o", "out", "--cache", "cache"]).0, 0);
}

#[test]
fn a_failed_run_replaces_and_removes_no_result_that_went_through() {
    let here = here(&["a", "a.failed"]);
    let batch = |config: &str, set: &str| here.batch_json(&[config, set, "-o", "out", "--cache", "cache"]);
    assert_eq!(batch("census.toml", "a.failed").0, 0);
    let whole = fs::read(here.path("out/a.failed.h5")).expect("a result");
    let (code, output) = batch("events.toml", "a");
    let error = output["failures"][0]["error"].as_str().unwrap_or_default();
    assert!(code == 3 && error.contains("are not kept") && error.contains("a.failed.h5"), "{output}");
    assert!(fs::read(here.path("out/a.failed.h5")).expect("a result") == whole, "it was replaced");
    // a run that goes through removes what a failed one left, and nothing else
    assert_eq!(batch("census.toml", "a").0, 0);
    assert!(fs::read(here.path("out/a.failed.h5")).expect("a result") == whole, "it was replaced");
}
