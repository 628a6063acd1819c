//! No file stays open: archives have more files than a process may hold.

use std::path::Path;
use std::process::{Command, Output};

use super::common::sets;
use super::leftovers::Place;

/// Fewer than files of the tests.
const MOST_OPEN: usize = 48;
const FILES: usize = 100;

/// Runs a command that may hold few files open at a time.
fn with_few_handles(place: &Place, arguments: &[&str]) -> Output {
    let afmid = place.command(arguments);
    let mut command = Command::new("sh");
    command.current_dir(place.folder()).args(["-c", &format!("ulimit -n {MOST_OPEN}; exec \"$0\" \"$@\"")]);
    command.arg(afmid.get_program()).args(arguments);
    command.envs(afmid.get_envs().filter_map(|(name, value)| Some((name, value?))));
    command.output().expect("sh starts")
}

#[track_caller]
fn assert_right(output: &Output) {
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success() && !stderr.contains("warning"), "{}: {stderr}", output.status);
}

/// Another program's file of rows, stored in chunks: read through the library.
fn rows(path: &Path, seed: usize) {
    let values: Vec<f32> = (0..600).map(|k| ((k * 7919 + seed * 104_729) % 4096) as f32).collect();
    let values = ndarray::Array2::from_shape_vec((3, 200), values).expect("three rows");
    let file = hdf5::File::create(path).expect("a file");
    file.new_dataset_builder().chunk((1, 50)).deflate(1).with_data(&values).create("map").expect("a dataset");
}

#[test]
fn files_of_other_programs_are_closed_after_each_look() {
    let place = Place::new();
    std::fs::create_dir(place.path("maps")).expect("a folder");
    (0..FILES).for_each(|n| rows(&place.path(&format!("maps/m{n:03}.h5")), n));
    assert_right(&with_few_handles(&place, &["inspect", "maps"]));
    let config = "[pipeline]\nname = \"maps\"\n[[stage]]\nid = \"records\"\nuses = \"io.records\"\n\
                  params = { files = [\"maps/*.h5\"], channel = \"/map[1]\", sample_rate_hz = 1e6, unit = \"V\" }\n\
                  [[stage]]\nid = \"census\"\nuses = \"io.census\"\ninputs = { records = \"records\" }\n";
    std::fs::write(place.path("maps.toml"), config).expect("a config");
    assert_right(&with_few_handles(&place, &["run", "maps.toml", "-o", "maps.h5"]));
}

#[test]
fn results_of_the_cache_are_closed_once_they_are_read() {
    let place = Place::new();
    std::fs::write(place.path("census.toml"), sets::CENSUS).expect("a config");
    let sets: Vec<String> = (0..FILES).map(|n| format!("set-{n:03}")).collect();
    sets.iter().enumerate().for_each(|(n, set)| sets::write_set(&place.path(set), n, 300));
    let names: Vec<&str> = sets.iter().map(String::as_str).collect();
    let batch = |out| [&["batch", "census.toml", "-o", out][..], &names].concat();
    assert_right(&with_few_handles(&place, &batch("first")));
    // all of it is reused
    assert_right(&with_few_handles(&place, &batch("second")));
    let count = |out: &str| super::leftovers::count(&place.path(out), ".h5");
    assert_eq!((count("first"), count("second")), (FILES + 1, FILES + 1));
}
