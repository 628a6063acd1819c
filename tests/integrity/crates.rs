//! Exports of a run with its data that are ended before they are done: nothing is left behind, and the next one goes
//! on.

use std::fs::{self, File};
use std::os::unix::fs::MetadataExt;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::{Duration, SystemTime};

use super::common::sets;
use super::leftovers::{Place, count, signal, wait_until};
use super::small;

const RECORDS: usize = 6;
/// Samples of a record that takes a moment to copy, hash and sync.
const SAMPLES: usize = 3_000_000;

const EXPORT: [&str; 5] = ["export-crate", "out.h5", "-o", "crate", "--with-data"];

/// A run on records, and its result `out.h5`.
fn place(samples: usize) -> Place {
    let place = Place::new();
    fs::write(place.path("census.toml"), sets::CENSUS).expect("a config");
    fs::create_dir(place.path("archive")).expect("a folder");
    (0..RECORDS).for_each(|k| small::record(&place.path(&format!("archive/r{k}.h5")), samples, k as u64));
    let run = ["run", "census.toml", "--set", "records.files=['archive']", "-o", "out.h5"];
    let ran = place.command(&run).output().expect("afmid starts");
    assert!(ran.status.success(), "{}", String::from_utf8_lossy(&ran.stderr));
    place
}

/// An export that copies inputs at this moment.
fn copying(place: &Place) -> Option<Child> {
    let mut command = place.command(&EXPORT);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("afmid starts");
    wait_until(&mut child, || has_temporary(&place.path("crate/inputs"))).then_some(child)
}

fn has_temporary(folder: &Path) -> bool {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.into_iter().any(|entry| entry.file_name().to_string_lossy().ends_with(".tmp"))
}

#[track_caller]
fn exports(place: &Place) {
    let output = place.command(&EXPORT).output().expect("afmid starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(place.leftovers(), Vec::<PathBuf>::new());
    assert_eq!(count(&place.path("crate/inputs"), ".h5"), RECORDS);
    assert!(place.path("crate/ro-crate-metadata.json").exists());
}

#[test]
fn an_interrupted_export_leaves_no_temporary_file_in_any_level() {
    let place = place(SAMPLES);
    let mut interrupted = 0;
    for _ in 0..5 {
        let _ = fs::remove_dir_all(place.path("crate"));
        let Some(child) = copying(&place) else { continue };
        signal(&child, "INT");
        let code = child.wait_with_output().expect("it ends").status.code();
        assert_eq!(place.leftovers(), Vec::<PathBuf>::new(), "{code:?}");
        interrupted += usize::from(code == Some(130));
    }
    assert!(interrupted > 0, "every export was faster than the signal");
    exports(&place);
}

#[test]
fn an_export_after_a_kill_sweeps_and_goes_on() {
    let place = place(SAMPLES);
    let whole = |k: usize| fs::metadata(place.path(&format!("crate/inputs/r{k}.h5"))).map(|found| found.ino()).ok();
    let mut resumed = 0;
    for _ in 0..5 {
        let _ = fs::remove_dir_all(place.path("crate"));
        let Some(mut child) = copying(&place) else { continue };
        // SIGKILL; it may have ended by itself
        let _ = child.kill();
        child.wait().expect("it is gone");
        let before: Vec<Option<u64>> = (0..RECORDS).map(whole).collect();
        exports(&place);
        let after: Vec<Option<u64>> = (0..RECORDS).map(whole).collect();
        let stayed = before.iter().zip(&after).filter(|(before, _)| before.is_some());
        assert!(stayed.clone().all(|(before, after)| before == after), "what was whole was copied again");
        resumed += usize::from(stayed.count() < RECORDS);
    }
    assert!(resumed > 0, "every export had ended before it was killed");
}

#[test]
fn a_folder_with_nothing_but_what_a_kill_left_is_taken() {
    let place = place(2000);
    let left = place.path("crate/.out.h5.0123456789ab.1-1.0.tmp");
    fs::create_dir(place.path("crate")).expect("a folder");
    fs::write(&left, "half a result").expect("written");
    // of another machine, a day ago: it is nobody's any more
    let then = SystemTime::now() - Duration::from_secs(25 * 3600);
    File::options().write(true).open(&left).and_then(|file| file.set_modified(then)).expect("aged");
    exports(&place);
    // another's file is one all the same
    fs::create_dir(place.path("theirs")).expect("a folder");
    fs::write(place.path("theirs/.notes.tmp"), "mine").expect("written");
    let output = place.command(&["export-crate", "out.h5", "-o", "theirs"]).output().expect("afmid starts");
    assert_eq!(output.status.code(), Some(2), "{}", String::from_utf8_lossy(&output.stderr));
}
