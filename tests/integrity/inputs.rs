//! Input files that change while a run reads them, and what is remembered of them between runs.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Stdio};
use std::time::Duration;

use super::common::{afmid, command};
use super::small::{CONFIG, altered, cached, differences, folder, hash, overwrite_unseen, run, stated, truth};

/// Samples of a record that takes a while to read.
const LONG: usize = 6_000_000;

/// Longer than the state of a file may hide a change: what is older is looked at, not hashed again.
const SETTLED: Duration = Duration::from_millis(2_200);

/// A run in the background, once it has hashed its files.
fn begun(here: &Path, result: &str, cache: &str) -> Child {
    let child = command(here, &["run", CONFIG, "-o", result, "--cache", cache])
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .expect("afmid starts");
    let stamps = here.join(cache).join("stamps");
    for _ in 0..20_000 {
        if fs::read_dir(&stamps).is_ok_and(|mut entries| entries.any(|entry| entry.is_ok())) {
            break;
        }
        std::thread::sleep(Duration::from_micros(200));
    }
    child
}

/// Does something again and again until a run has ended; its exit code and what it wrote to stderr.
fn while_running(child: Child, mut meanwhile: impl FnMut()) -> (Option<i32>, String) {
    let ended = std::thread::spawn(move || child.wait_with_output().expect("it ends"));
    while !ended.is_finished() {
        meanwhile();
    }
    let output = ended.join().expect("no panic");
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Runs with a file that `change` and `restore` alternate in until one run has failed, which most do. Whatever each of
/// them kept, the next undisturbed run finds the truth.
fn disturbed(prepare: impl Fn(&Path), change: impl Fn(&Path), restore: impl Fn(&Path)) {
    let scratch = folder(1, LONG);
    let here = scratch.path();
    prepare(here);
    let truth = truth(here);
    let mut failed = 0;
    for round in 0..12 {
        // only then is a stamp kept, which says that the run has hashed its files
        std::thread::sleep(SETTLED);
        let (result, cache) = (format!("r{round}.h5"), format!("cache-{round}"));
        let child = begun(here, &result, &cache);
        let (code, stderr) = while_running(child, || {
            change(here);
            std::thread::sleep(Duration::from_millis(3));
            restore(here);
            std::thread::sleep(Duration::from_millis(3));
        });
        match code {
            Some(0) => assert_eq!(differences(&truth, &here.join(&result)), [""; 0], "round {round}: {stderr}"),
            Some(1) => {
                failed += 1;
                assert!(stderr.contains("r0.h5"), "it says which file: {stderr}");
                assert!(!here.join(&result).exists(), "no result is left: {stderr}");
            }
            other => panic!("{other:?}: {stderr}"),
        }
        let after = run(here, "after.h5", &cache, &[]);
        assert_eq!(after.code, Some(0), "{after:?}");
        assert_eq!(differences(&truth, &here.join("after.h5")), [""; 0], "what round {round} kept: {stderr}");
        if failed > 1 {
            return;
        }
    }
    panic!("no run met a change: {failed} of 12 failed");
}

#[test]
fn a_file_that_changes_while_it_is_read_fails_the_run_though_it_is_restored() {
    let scratch = folder(1, LONG);
    let whole = fs::read(scratch.path().join("archive/r0.h5")).expect("a record");
    let other = altered(&whole);
    disturbed(
        |_| {},
        |here| overwrite_unseen(&here.join("archive/r0.h5"), &other),
        |here| overwrite_unseen(&here.join("archive/r0.h5"), &whole),
    );
}

#[test]
fn a_folder_that_takes_anothers_place_for_a_moment_is_noticed_when_its_files_are_opened() {
    let lead = |here: &Path, to: &str| {
        std::os::unix::fs::symlink(to, here.join("link")).expect("a link");
        fs::rename(here.join("link"), here.join("archive")).expect("renamed");
    };
    let prepare = |here: &Path| {
        fs::create_dir(here.join("other")).expect("a folder");
        let whole = fs::read(here.join("archive/r0.h5")).expect("a record");
        fs::write(here.join("other/r0.h5"), altered(&whole)).expect("a record");
        fs::rename(here.join("archive"), here.join("own")).expect("renamed");
        lead(here, "own");
    };
    disturbed(prepare, |here| lead(here, "other"), |here| lead(here, "own"));
}

#[test]
fn other_bytes_of_the_same_size_and_time_are_stated_as_they_are() {
    let scratch = folder(2, 20_000);
    let here = scratch.path();
    std::thread::sleep(SETTLED);
    assert_eq!(run(here, "a.h5", "cache", &[]).code, Some(0));
    assert_eq!(fs::read_to_string(stamps(here)).expect("stamps").lines().count(), 2, "both hashes are remembered");
    let record = here.join("archive/r1.h5");
    let (before, bytes) = (hash(&record), fs::read(&record).expect("a record"));
    overwrite_unseen(&record, &altered(&bytes));
    assert_ne!(hash(&record), before);
    for more in [&[][..], &["--fresh"]] {
        assert_eq!(run(here, "b.h5", "cache", more).code, Some(0));
        assert_eq!(stated(&here.join("b.h5"))[1].blake3, hash(&record), "{more:?}");
        assert_eq!(differences(&truth(here), &here.join("b.h5")), [""; 0], "{more:?}");
    }
    let trace = afmid(here, &["trace", "a.h5", "census"]);
    assert!(trace.contains("r1.h5") && trace.contains("other bytes"), "{trace}");
}

/// What remembers the hashes of a folder's records, a line for each.
fn stamps(here: &Path) -> PathBuf {
    fs::read_dir(here.join("cache/stamps")).expect("stamps").next().expect("one").expect("one").path()
}

/// A folder after a run on one record: its hash, and the stamp that remembers it.
fn remembered() -> (tempfile::TempDir, String, PathBuf) {
    let scratch = folder(1, 20_000);
    let here = scratch.path();
    std::thread::sleep(SETTLED);
    assert_eq!(run(here, "a.h5", "cache", &[]).code, Some(0));
    let right = hash(&here.join("archive/r0.h5"));
    let stamp = stamps(here);
    (scratch, right, stamp)
}

/// A stamp with the hash of its own text before it.
fn sealed(body: &str) -> String {
    let hash = blake3::hash(format!("afmid stamp 3{body}").as_bytes()).to_hex();
    format!("{}\t{body}\n", &hash[..32])
}

#[test]
fn fresh_hashes_again_whatever_a_stamp_says() {
    let (scratch, right, stamp) = remembered();
    let here = scratch.path();
    let text = fs::read_to_string(&stamp).expect("text");
    let body = text.trim_end().split_once('\t').expect("a hash first").1;
    assert_eq!(sealed(body), text);
    // of the same state, with a hash that fits: only who can write the cache can make it
    let forged = sealed(&body.replace(&right, &"0".repeat(64)));
    fs::write(&stamp, &forged).expect("written");
    assert_eq!(run(here, "b.h5", "cache", &["--fresh"]).code, Some(0));
    assert_eq!(stated(&here.join("b.h5"))[0].blake3, right);
    let again = fs::read_to_string(&stamp).expect("text");
    assert_eq!(again, forged + &text, "the right hash is remembered again, and counts");
    assert_eq!(run(here, "c.h5", "cache", &[]).code, Some(0));
    assert_eq!(stated(&here.join("c.h5"))[0].blake3, right);
}

#[test]
fn a_damaged_stamp_is_never_believed() {
    let (scratch, right, stamp) = remembered();
    let here = scratch.path();
    let whole = fs::read(&stamp).expect("bytes");
    let keys = cached(&here.join("cache"), "h5");
    // every byte is tried by the unit test of the stamps; each of these is a whole run
    for at in (0..whole.len()).step_by(9) {
        for bit in [0x01, 0x02] {
            let mut broken = whole.clone();
            broken[at] ^= bit;
            fs::write(&stamp, &broken).expect("written");
            let ran = run(here, "b.h5", "cache", &[]);
            assert_eq!(ran.code, Some(0), "byte {at}: {ran:?}");
            assert_eq!(stated(&here.join("b.h5"))[0].blake3, right, "byte {at}");
            assert!(ran.stdout.contains("3 reused"), "byte {at}: {ran:?}");
        }
    }
    assert_eq!(cached(&here.join("cache"), "h5"), keys, "no other key was ever made");
}
