//! Kills at random moments leave whole files or none, and nothing beside them after the next run or `gc`.

use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use super::common::{config, files, sets, simulated};
use super::leftovers::Place;
use super::random::Random;

/// How long a command takes that nobody kills.
fn whole(place: &Place, arguments: &[&str]) -> Duration {
    let clock = Instant::now();
    let output = place.command(arguments).output().expect("afmid starts");
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    clock.elapsed()
}

/// Kills a command at a moment between its start and its usual end. Whether it had not ended before.
fn kill(place: &Place, arguments: &[&str], usual: Duration, random: &mut Random) -> bool {
    let mut command = place.command(arguments);
    let mut child = command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("afmid starts");
    std::thread::sleep(usual.mul_f64(random.share()));
    // SIGKILL; it may have ended by itself
    let _ = child.kill();
    child.wait().expect("it is gone").code().is_none()
}

/// Tries with their numbers, from 0, until `wanted` kills have come before the end of what they were to end. Panics:
/// that took three times as many.
fn until_killed(wanted: usize, what: &str, mut each: impl FnMut(usize) -> bool) {
    let (mut hit, mut tries) = (0, 0);
    while hit < wanted {
        assert!(tries < 3 * wanted, "{what}: {hit} of {tries} kills came before the end");
        hit += usize::from(each(tries));
        tries += 1;
    }
    println!("{what}: {hit} killed before their end, {} had ended", tries - hit);
}

/// A file is not there, or has the datasets of another.
fn assert_whole_or_none(file: &Path, like: &Path) {
    if file.exists() {
        assert_eq!(afmid_pipeline::store::compare(like, file).expect("a whole result"), [], "{}", file.display());
    }
}

/// The next run has swept what it writes, `gc` the cache.
fn assert_nothing_left(place: &Place) {
    whole(place, &["gc"]);
    assert_eq!(place.leftovers(), Vec::<std::path::PathBuf>::new());
}

#[test]
fn a_killed_run_loses_nothing_that_was_finished() {
    let place = Place::new();
    let archive = simulated(place.folder(), "archive", 4, 9);
    let (config, set) = (config("free-lever.toml"), files(&archive.folder));
    let run = |result: &str, more: &[&str]| {
        let arguments = [&["run", &config, "--set", &set, "-o", result][..], more].concat();
        arguments.into_iter().map(str::to_owned).collect::<Vec<String>>()
    };
    let reference = run("whole.h5", &["--cache", "other"]);
    let reference: Vec<&str> = reference.iter().map(String::as_str).collect();
    let usual = whole(&place, &reference);
    let (mut random, mut most_reused, mut begun) = (Random(0x2545_f491_4f6c_dd1d), 0, Vec::new());
    until_killed(30, "runs of the lean pipeline", |round| {
        // every third round starts from an empty cache, so that kills hit all stages
        if round % 3 == 0 {
            std::fs::remove_dir_all(place.path("cache")).expect("removed");
        }
        let result = format!("r{round}.h5");
        let arguments = run(&result, &[]);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        let killed = kill(&place, &arguments, usual, &mut random);
        assert_whole_or_none(&place.path(&result), &place.path("whole.h5"));
        let explained = place.command(&["explain", &config, "--set", &set]).output().expect("afmid starts");
        let explained = String::from_utf8_lossy(&explained.stdout).into_owned();
        most_reused = most_reused.max(explained.lines().filter(|line| line.contains("reuse")).count());
        begun.push(result);
        killed
    });
    assert!(most_reused > 0, "no finished stage was ever kept");
    // the next runs complete from what is there
    for (number, result) in begun.iter().enumerate() {
        let arguments = run(result, &[]);
        let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
        if !place.path(result).exists() || number + 1 == begun.len() {
            whole(&place, &arguments);
        }
        assert_whole_or_none(&place.path(result), &place.path("whole.h5"));
    }
    assert_nothing_left(&place);
}

/// 170 more, over everything that writes, on records that take milliseconds.
#[test]
fn nothing_that_writes_leaves_a_broken_file_when_it_is_killed() {
    let place = Place::new();
    std::fs::write(place.path("census.toml"), sets::CENSUS).expect("a config");
    let swept = format!("{}\n[sweep]\ncensus.min_bandwidth_share = [0.01, 0.02, 0.03, 0.04]\n", sets::CENSUS);
    std::fs::write(place.path("swept.toml"), swept).expect("a config");
    (0..6).for_each(|set| sets::write_set(&place.path(&format!("set-{set}")), set, 3000));
    let here = "records.files=['set-0']";
    let mut random = Random(0x9e37_79b9_7f4a_7c15);

    // run: fresh, so that each has everything to write
    let run = ["run", "census.toml", "--set", here, "-o", "run.h5", "--fresh"];
    let usual = whole(&place, &run);
    std::fs::rename(place.path("run.h5"), place.path("whole.h5")).expect("renamed");
    until_killed(60, "runs", |_| {
        let _ = std::fs::remove_file(place.path("run.h5"));
        let killed = kill(&place, &run, usual, &mut random);
        assert_whole_or_none(&place.path("run.h5"), &place.path("whole.h5"));
        killed
    });
    whole(&place, &run);

    // batch: each goes on where the last was killed, until all are done; then one begins from nothing
    let sets: Vec<String> = (0..6).map(|set| format!("set-{set}")).collect();
    let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
    let batch = |out: &'static str| [&["batch", "census.toml", "-o", out][..], &sets].concat();
    std::fs::remove_dir_all(place.path("cache")).expect("removed");
    let usual = whole(&place, &batch("whole"));
    until_killed(40, "batches", |_| {
        if place.path("out/summary.h5").exists() {
            ["out", "cache"].iter().for_each(|name| std::fs::remove_dir_all(place.path(name)).expect("removed"));
        }
        let killed = kill(&place, &batch("out"), usual, &mut random);
        for set in &sets {
            let (result, entry) = (format!("out/{set}.h5"), place.path(&format!("out/ledger/{set}.json")));
            assert_whole_or_none(&place.path(&result), &place.path(&format!("whole/{set}.h5")));
            if let Ok(text) = std::fs::read_to_string(&entry) {
                let entry: serde_json::Value = serde_json::from_str(&text).expect("a whole entry");
                assert!(entry["error"].is_null(), "{text}");
            }
        }
        for table in ["summary.h5", "summary.csv", "summary.parquet", "trends.csv"] {
            let [made, like] = ["out", "whole"].map(|folder| std::fs::read(place.path(folder).join(table)).ok());
            assert!(made.is_none() || made == like, "{table} is broken");
        }
        killed
    });
    whole(&place, &batch("out"));

    // sweep
    let sweep = |out: &'static str| ["run", "swept.toml", "--set", here, "-o", out, "--fresh"];
    let usual = whole(&place, &sweep("points"));
    std::fs::rename(place.path("points"), place.path("whole-points")).expect("renamed");
    until_killed(30, "sweeps", |_| {
        let killed = kill(&place, &sweep("points"), usual, &mut random);
        for name in (1..=4).map(|point| format!("point_{point:05}.h5")).chain(["summary.h5".to_owned()]) {
            assert_whole_or_none(&place.path("points").join(&name), &place.path("whole-points").join(&name));
        }
        killed
    });
    whole(&place, &sweep("points"));

    // report: the same page every time
    let report = ["report", "whole/summary.h5", "-o", "page.html", "--figures", "figures"];
    let usual = whole(&place, &report);
    let page = std::fs::read(place.path("page.html")).expect("a page");
    until_killed(25, "reports", |_| {
        let _ = std::fs::remove_file(place.path("page.html"));
        let killed = kill(&place, &report, usual, &mut random);
        assert!(std::fs::read(place.path("page.html")).map_or(true, |made| made == page), "half a page");
        killed
    });
    whole(&place, &report);

    // gc: whatever it has freed, what is left is whole
    let gc = ["gc", "--older-than", "0s"];
    // what all before have left is freed once; from then on it is what one run leaves
    whole(&place, &gc);
    whole(&place, &run);
    let usual = whole(&place, &gc);
    until_killed(15, "gc", |_| {
        whole(&place, &run);
        let killed = kill(&place, &gc, usual, &mut random);
        let next =
            place.command(&["run", "census.toml", "--set", here, "-o", "run.h5"]).output().expect("afmid starts");
        let stderr = String::from_utf8_lossy(&next.stderr).into_owned();
        assert!(next.status.success() && !stderr.contains("warning"), "{stderr}");
        assert_whole_or_none(&place.path("run.h5"), &place.path("whole.h5"));
        killed
    });
    assert_nothing_left(&place);
}
