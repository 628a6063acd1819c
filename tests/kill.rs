//! `kill -9` at any moment leaves no result or a whole one, and the next run reuses what was finished.

mod common;

use std::time::Instant;

use common::{afmid, command, config, files, simulated};

const KILLS: u32 = 50;

#[test]
fn a_killed_run_loses_nothing_that_was_finished() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let archive = simulated(here, "archive", 8, 9);
    let (config, set) = (config("free-lever.toml"), files(&archive.folder));
    let clock = Instant::now();
    afmid(here, &["run", &config, "--set", &set, "-o", "whole.h5", "--cache", "whole"]);
    let whole = clock.elapsed();

    let (mut early, mut late, mut most_reused) = (0, 0, 0);
    let mut random = 0x2545_f491_4f6c_dd1d_u64;
    for round in 0..KILLS {
        // every tenth round starts from an empty cache, so that kills hit all stages
        let (result, cache) = (format!("r{round}.h5"), format!("cache-{}", round / 10));
        let arguments = ["run", &config, "--set", &set, "-o", &result, "--cache", &cache];
        let mut child = command(here, &arguments).stderr(std::process::Stdio::null()).spawn().expect("afmid starts");
        // xorshift: moments from the start to a little after the end of an uninterrupted run
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        std::thread::sleep(whole.mul_f64(1.1 * (random >> 11) as f64 / (1u64 << 53) as f64));
        // SIGKILL; it may have ended by itself
        let _ = child.kill();
        child.wait().expect("it is gone");
        match here.join(&result).exists() {
            false => early += 1,
            true => {
                late += 1;
                let differences = afmid_pipeline::store::compare(&here.join("whole.h5"), &here.join(&result));
                assert_eq!(differences.expect("a whole result"), [], "round {round}");
            }
        }
        let told = afmid(here, &["explain", &config, "--set", &set, "--cache", &cache]);
        most_reused = most_reused.max(told.lines().filter(|line| line.contains("reuse")).count());
    }
    assert!(early > 0, "no kill came before the end of a run ({late} late): the test showed nothing");
    assert!(most_reused > 0, "no finished stage was ever kept");

    // the next run after the kills completes from what is there
    let cache = format!("cache-{}", (KILLS - 1) / 10);
    afmid(here, &["run", &config, "--set", &set, "-o", "after.h5", "--cache", &cache]);
    let differences =
        afmid_pipeline::store::compare(&here.join("whole.h5"), &here.join("after.h5")).expect("two results");
    assert!(differences.is_empty(), "{differences:?}");
    let left =
        std::fs::read_dir(here).expect("the folder").filter_map(|entry| entry.ok()?.file_name().into_string().ok());
    let results: Vec<String> = left.filter(|name| name.starts_with('r') && !name.ends_with(".h5")).collect();
    assert!(results.is_empty(), "half-written files under final names: {results:?}");
}
