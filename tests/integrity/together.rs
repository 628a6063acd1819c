//! Several commands that write into one folder at the same time.

use std::process::{Child, Stdio};

use super::common::sets;
use super::faults::stderr;
use super::leftovers::Place;

/// As many at once.
const TOGETHER: usize = 10;

/// Times that they begin from nothing.
const ROUNDS: usize = 20;

/// Starts a command ten times at once; all must end with 0.
#[track_caller]
fn all_at_once(place: &Place, arguments: &[&str]) {
    let start = |_| {
        let mut command = place.command(arguments);
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("afmid starts")
    };
    let children: Vec<Child> = (0..TOGETHER).map(start).collect();
    for child in children {
        let output = child.wait_with_output().expect("it ends");
        assert_eq!(output.status.code(), Some(0), "{arguments:?}: {}", stderr(&output));
    }
}

fn place() -> Place {
    let place = Place::new();
    std::fs::write(place.path("census.toml"), sets::CENSUS).expect("a config");
    let swept = format!("{}\n[sweep]\ncensus.min_bandwidth_share = [0.01, 0.02]\n", sets::CENSUS);
    std::fs::write(place.path("swept.toml"), swept).expect("a config");
    (0..3).for_each(|set| sets::write_set(&place.path(&format!("set-{set}")), set, 1000));
    place
}

/// Results of two folders have the same numbers, their tables the same bytes.
#[track_caller]
fn assert_alike(place: &Place, [made, like]: [&str; 2], results: &[String], tables: &[&str]) {
    let [made, like] = [made, like].map(|folder| place.path(folder));
    for name in results {
        let differences = afmid_pipeline::store::compare(&like.join(name), &made.join(name));
        assert_eq!(differences.expect("two results"), [], "{name}");
    }
    for name in tables {
        let [made, like] = [&made, &like].map(|folder| std::fs::read(folder.join(name)).expect("a table"));
        assert!(made == like, "{name} differs");
    }
}

const SETS: [&str; 3] = ["set-0", "set-1", "set-2"];

fn batch(out: &str) -> Vec<&str> {
    [&["batch", "census.toml", "-o", out][..], &SETS].concat()
}

fn sweep(out: &str) -> [&str; 6] {
    ["run", "swept.toml", "--set", "records.files=['set-0']", "-o", out]
}

#[test]
fn ten_batches_of_one_folder_all_end_well() {
    let place = place();
    assert!(place.command(&batch("whole")).status().expect("afmid starts").success());
    let results = SETS.map(|set| format!("{set}.h5"));
    for round in 0..ROUNDS {
        let out = format!("out-{round}");
        all_at_once(&place, &batch(&out));
        assert_alike(&place, [&out, "whole"], &results, &["summary.csv", "summary.parquet"]);
        if round % 5 == 0 {
            all_at_once(&place, &[&batch(&out)[..], &["--collect"]].concat());
            assert_alike(&place, [&out, "whole"], &results, &["summary.csv", "summary.parquet"]);
        }
    }
}

#[test]
fn ten_sweeps_and_ten_crates_of_one_folder_all_end_well() {
    let place = place();
    assert!(place.command(&sweep("whole")).status().expect("afmid starts").success());
    let points = [1, 2].map(|point| format!("point_{point:05}.h5"));
    for round in 0..5 {
        let out = format!("points-{round}");
        all_at_once(&place, &sweep(&out));
        assert_alike(&place, [&out, "whole"], &points, &["summary.csv"]);
        let packed = format!("crate-{round}");
        all_at_once(&place, &["export-crate", "whole/point_00001.h5", "-o", &packed, "--with-data"]);
        assert!(place.path(&packed).join("ro-crate-metadata.json").is_file());
    }
}
