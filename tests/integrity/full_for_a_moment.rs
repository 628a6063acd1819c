//! Disks that are full for a moment: what ends with 0 is whole and right, what is kept for later too.

use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::Duration;

use rustix::process::{Pid, Resource, Rlimit, prlimit};

use super::common::sets;
use super::faults::{Mounts, stderr};
use super::leftovers::Place;
use super::random::Random;

/// Runs of each test; `AFMID_ROUNDS` asks for more.
const ROUNDS: usize = 200;

/// Most bytes of a file under the limit: census results have 25 kB.
const LIMIT_BYTES: f64 = 30e3;

/// Longest time that a limit, or its absence, lasts: a census takes some 20 ms, writing its files 2 ms.
const LONGEST_S: f64 = 3e-3;

fn rounds() -> usize {
    std::env::var("AFMID_ROUNDS").ok().and_then(|rounds| rounds.parse().ok()).unwrap_or(ROUNDS)
}

/// A place with a data set, a config that counts its samples, and what that gives: `whole.h5` and `whole/set.h5`.
fn census() -> Place {
    let place = Place::new();
    std::fs::write(place.path("census.toml"), sets::CENSUS).expect("a config");
    sets::write_set(&place.path("set"), 3, 3000);
    for arguments in [
        &["run", "census.toml", "--set", SET, "-o", "whole.h5", "--cache", "other"][..],
        &["batch", "census.toml", "set", "-o", "whole", "--cache", "other"],
    ] {
        let output = place.command(arguments).output().expect("afmid starts");
        assert!(output.status.success(), "{}", stderr(&output));
    }
    place
}

const SET: &str = "records.files=['set']";

/// Counts what a try left.
#[derive(Debug, Default)]
struct Tally {
    whole: usize,
    failed: usize,
}

impl Tally {
    /// A result is the right one, or the command failed and there is none.
    #[track_caller]
    fn result(&mut self, done: bool, made: &Path, like: &Path) {
        assert_eq!(done, made.exists(), "{}: done {done}", made.display());
        if done {
            assert_eq!(afmid_pipeline::store::compare(like, made).expect("a whole result"), [], "{}", made.display());
        }
        self.whole += usize::from(done);
        self.failed += usize::from(!done);
    }

    /// What the cache has kept serves the next run with the right numbers.
    #[track_caller]
    fn cache(&self, place: &Place, cache: &str) {
        let output = place
            .command(&["run", "census.toml", "--set", SET, "-o", "again.h5", "--cache", cache])
            .output()
            .expect("afmid starts");
        assert!(output.status.success(), "{}", stderr(&output));
        let differences = afmid_pipeline::store::compare(&place.path("whole.h5"), &place.path("again.h5"));
        assert_eq!(differences.expect("two results"), [], "from the cache {cache}");
    }
}

/// Sets and lifts the limit of a process's files until it ends.
fn disturb(child: &mut Child, random: &mut Random) {
    let pid = Pid::from_raw(child.id() as i32);
    let unlimited = Rlimit { current: None, maximum: None };
    while child.try_wait().expect("a child").is_none() {
        let limit = Rlimit { current: Some((random.share() * LIMIT_BYTES) as u64), maximum: None };
        for limit in [limit, unlimited] {
            // it may have ended meanwhile
            let _ = prlimit(pid, Resource::Fsize, limit);
            std::thread::sleep(Duration::from_secs_f64(LONGEST_S * random.share()));
        }
    }
}

/// Needs no root: a limit of file sizes that comes and goes.
#[test]
fn a_limit_of_file_sizes_that_is_lifted_midway_leaves_whole_results_or_none() {
    let place = census();
    let (mut random, mut runs, mut sets) = (Random(0x51ed_270b_7f4a_7c15), Tally::default(), Tally::default());
    for round in 0..rounds() {
        let (cache, out) = (format!("cache-{round}"), format!("out-{round}"));
        let result = format!("{out}.h5");
        let batch = round % 4 == 3;
        let arguments = if batch {
            vec!["batch", "census.toml", "set", "-o", &out, "--cache", &cache]
        } else {
            vec!["run", "census.toml", "--set", SET, "-o", &result, "--cache", &cache]
        };
        let mut child = place.command(&arguments).stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("afmid");
        disturb(&mut child, &mut random);
        let done = child.wait().expect("it ended").success();
        if batch {
            let ledger = std::fs::read_to_string(place.path(&out).join("ledger/set.json")).unwrap_or_default();
            let entry: serde_json::Value = serde_json::from_str(&ledger).unwrap_or_default();
            let made = place.path(&out).join("set.h5");
            assert!(!done || entry["error"].is_null(), "{ledger}");
            sets.result(made.exists(), &made, &place.path("whole/set.h5"));
        } else {
            runs.result(done, &place.path(&result), &place.path("whole.h5"));
        }
        runs.cache(&place, &cache);
    }
    println!("runs {runs:?}, data sets {sets:?}");
    assert!(runs.whole > 0 && runs.failed > 0, "no limit came, or none was lifted: {runs:?}");
    assert_eq!(place.leftovers(), Vec::<PathBuf>::new());
}

/// Where something can be mounted: a disk of 96 kB that another process fills and frees all the time.
#[test]
fn a_disk_that_another_process_fills_and_frees_leaves_whole_results_or_none() {
    let place = census();
    std::fs::create_dir(place.path("disk")).expect("a folder");
    std::fs::create_dir(place.path("out")).expect("a folder");
    // what was made is carried away before the next run: the copy is on another disk
    let script = format!(
        "mount -t tmpfs -o size=96k none disk || exit 99\n\
         ( while [ -d out ]; do dd if=/dev/zero of=disk/fill bs=4k 2>/dev/null; rm disk/fill; done ) & filler=$!\n\
         for round in $(seq {}); do\n\
             \"$0\" run census.toml --set \"{SET}\" -o disk/out.h5 --cache disk/cache >/dev/null 2>&1\n\
             echo $round $? >> out/codes\n\
             [ ! -e disk/out.h5 ] || mv disk/out.h5 out/$round.h5\n\
             [ ! -e disk/cache ] || {{ cp -r disk/cache out/cache-$round && rm -r disk/cache; }}\n\
         done\n\
         kill $filler; wait; true",
        rounds()
    );
    let Some(output) = Mounts::new().script(&place, &script) else {
        return println!("NOT DONE: a disk that is filled and freed, nothing can be mounted here");
    };
    assert!(output.status.success(), "{}", stderr(&output));
    let codes = std::fs::read_to_string(place.path("out/codes")).expect("exit codes");
    let mut runs = Tally::default();
    for line in codes.lines() {
        let (round, code) = line.split_once(' ').expect("two numbers");
        runs.result(code == "0", &place.path(&format!("out/{round}.h5")), &place.path("whole.h5"));
        runs.cache(&place, &format!("out/cache-{round}"));
    }
    println!("done: a disk that is filled and freed: {runs:?}");
    assert!(runs.whole > 0 && runs.failed > 0, "the disk was never full, or always: {runs:?}");
}
