//! SIGINT and SIGTERM tidy up.

use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

use super::common::{config, files, sets};
use super::leftovers::{Place, count, signal, wait_until};

fn start(mut command: Command) -> Child {
    command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("afmid starts")
}

/// Exit code and stderr.
fn end(child: Child) -> (Option<i32>, String) {
    let output = child.wait_with_output().expect("it ends");
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

#[track_caller]
fn assert_tidy(place: &Place) {
    assert_eq!(place.leftovers(), Vec::<PathBuf>::new());
}

/// A simulation of more records than anybody waits for.
fn simulation(place: &Place) -> Child {
    let (config, out) = (config("simulate-demo.toml"), format!("archive.out='{}'", place.path("archive").display()));
    let counts = ["records", "snap_offs", "snap_ins"].map(|name| format!("archive.{name}=2000"));
    let mut arguments = vec!["run", &config, "-o", "simulated.h5", "--set", &out];
    counts.iter().for_each(|count| arguments.extend(["--set", count]));
    let mut child = start(place.command(&arguments));
    assert!(wait_until(&mut child, || count(&place.path("archive"), ".h5") > 0), "it ended");
    child
}

#[test]
fn a_stage_that_goes_on_is_ended_and_leaves_whole_files_only() {
    let place = Place::new();
    for (name, wanted) in [("HUP", 129), ("QUIT", 131), ("TERM", 143)] {
        let _ = std::fs::remove_dir_all(place.path("archive"));
        let child = simulation(&place);
        signal(&child, name);
        let (code, stderr) = end(child);
        assert_eq!(code, Some(wanted), "{stderr}");
        assert!(stderr.contains(&format!("interrupted by SIG{name}")), "{stderr}");
        assert!(!place.path("simulated.h5").exists());
        assert_tidy(&place);
    }
    let inspected = place.command(&["inspect", "archive"]).output().expect("afmid starts");
    assert!(inspected.status.success(), "{}", String::from_utf8_lossy(&inspected.stderr));
}

#[test]
fn a_second_signal_ends_it_at_once() {
    // the code is that of the signal that ended it: 143 if it has ended by the first before the second comes
    let ended = (0..3).any(|_| {
        let place = Place::new();
        let child = simulation(&place);
        signal(&child, "TERM");
        std::thread::sleep(std::time::Duration::from_millis(200));
        let _ = Command::new("sh").args(["-c", &format!("kill -INT {}", child.id())]).status();
        end(child).0 == Some(130)
    });
    assert!(ended, "it went on until the first had done its work");
}

#[test]
fn a_run_keeps_what_has_succeeded_and_the_next_completes() {
    let place = Place::new();
    let archive = super::common::simulated(place.folder(), "archive", 4, 5);
    let (config, set) = (config("free-lever.toml"), files(&archive.folder));
    let whole = place.command(&["run", &config, "--set", &set, "-o", "whole.h5", "--cache", "other"]).output();
    assert!(whole.expect("afmid starts").status.success());
    let run = ["run", &config, "--set", &set, "-o", "out.h5"];
    let mut interrupted = false;
    for _ in 0..5 {
        let mut child = start(place.command(&run));
        if !wait_until(&mut child, || count(&place.path("cache"), ".h5") > 0) {
            continue;
        }
        signal(&child, "INT");
        let (code, stderr) = end(child);
        assert_eq!(code, Some(130), "{stderr}");
        assert!(stderr.contains("interrupted by SIGINT") && !stderr.contains("error:"), "{stderr}");
        assert_tidy(&place);
        interrupted = !place.path("out.h5").exists();
        if interrupted {
            break;
        }
        std::fs::remove_file(place.path("out.h5")).expect("removed");
        std::fs::remove_dir_all(place.path("cache")).expect("removed");
    }
    assert!(interrupted, "every run was faster than the signal");
    let output = place.command(&run).output().expect("afmid starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    assert!(String::from_utf8_lossy(&output.stdout).contains("reused"), "nothing was kept");
    let differences = afmid_pipeline::store::compare(&place.path("whole.h5"), &place.path("out.h5"));
    assert_eq!(differences.expect("two results"), []);
}

/// The data sets of a batch, and its command.
fn batch(place: &Place, number: usize) -> Vec<String> {
    std::fs::write(place.path("census.toml"), sets::CENSUS).expect("a config");
    let set = |k: usize| format!("sets/set-{k:03}");
    (0..number).for_each(|k| sets::write_set(&place.path(&set(k)), k, 3000));
    let head = ["batch", "census.toml", "-o", "out", "-j", "1"].map(str::to_owned);
    head.into_iter().chain((0..number).map(set)).collect()
}

#[test]
fn the_ledger_of_a_batch_stays_consistent_and_the_next_one_goes_on() {
    let place = Place::new();
    let arguments = batch(&place, 60);
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let mut child = start(place.command(&arguments));
    assert!(wait_until(&mut child, || count(&place.path("out/ledger"), ".json") > 2), "it ended");
    signal(&child, "TERM");
    let (code, stderr) = end(child);
    assert_eq!(code, Some(143), "{stderr}");
    assert_tidy(&place);
    let done = count(&place.path("out/ledger"), ".json");
    assert!(done < 60 && !place.path("out/summary.h5").exists(), "{done} were done");
    for entry in std::fs::read_dir(place.path("out/ledger")).expect("the ledger").flatten() {
        let text = std::fs::read_to_string(entry.path()).expect("an entry");
        let entry: serde_json::Value = serde_json::from_str(&text).expect("a whole one");
        assert!(entry["error"].is_null(), "{text}");
        let result = place.path("out").join(format!("{}.h5", entry["name"].as_str().expect("a name")));
        assert_eq!(std::fs::metadata(&result).expect("its result").len(), entry["result_bytes"].as_u64().unwrap_or(0));
    }
    let next = place.command(&[&arguments[..], &["--json"]].concat()).output().expect("afmid starts");
    assert!(next.status.success(), "{}", String::from_utf8_lossy(&next.stderr));
    let next: serde_json::Value = serde_json::from_slice(&next.stdout).expect("JSON");
    assert_eq!((&next["failed"], &next["ran"]), (&0.into(), &(60 - done).into()));
}

#[test]
fn a_signal_that_was_ignored_stays_so() {
    let place = Place::new();
    let arguments = batch(&place, 30);
    let mut shell = Command::new("sh");
    shell.current_dir(place.folder()).env("AFMID_CACHE", place.path("cache")).env("TMPDIR", place.path("tmp"));
    shell.args(["-c", "trap '' INT; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_afmid")]).args(&arguments);
    let mut child = start(shell);
    assert!(wait_until(&mut child, || count(&place.path("out/ledger"), ".json") > 0), "it ended");
    signal(&child, "INT");
    let (code, stderr) = end(child);
    assert_eq!(code, Some(0), "{stderr}");
    assert_eq!(count(&place.path("out/ledger"), ".json"), 30);
}

#[test]
fn the_process_of_a_plugin_goes_with_it() {
    let place = Place::new();
    // says who it is and nothing else
    let script = "cd $TMPDIR; echo $$ >pid.part; mv pid.part pid; exec sleep 1000";
    let mut child = start(place.command(&["plugin", "check", "--", "sh", "-c", script]));
    let said = || super::leftovers::below(&place.path("tmp")).into_iter().find(|path| path.ends_with("pid"));
    assert!(wait_until(&mut child, || said().is_some()), "it ended");
    let pid = std::fs::read_to_string(said().expect("it is there")).expect("its number");
    signal(&child, "INT");
    let (code, stderr) = end(child);
    assert_eq!(code, Some(130), "{stderr}");
    let state = std::fs::read_to_string(format!("/proc/{}/stat", pid.trim())).unwrap_or_default();
    // a zombie waits for the system to take it
    assert!(state.is_empty() || state.contains(") Z "), "the plugin goes on: {state}");
    assert_tidy(&place);
}

#[test]
fn the_archives_of_an_exam_are_removed() {
    let place = Place::new();
    let mut child = start(place.command(&["exam", &config("diagnose.toml"), "--seeds", "400"]));
    let drawn = |tmp: &Path| super::leftovers::below(tmp).iter().any(|path| path.ends_with("archive"));
    assert!(wait_until(&mut child, || drawn(&place.path("tmp"))), "it ended");
    signal(&child, "TERM");
    let (code, stderr) = end(child);
    assert_eq!(code, Some(143), "{stderr}");
    assert_tidy(&place);
}
