//! The fuzz targets' corpus, replayed: seeds, and a file for each finding (docs/reliability.md lists them).

use std::collections::BTreeSet;
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::mpsc;
use std::time::Duration;

use super::common::ROOT;
use super::entrances::{enter, entrances, tidy};
use super::seeds::seeds;

/// The project promises 5 s a file; a busy machine is given more.
const LONGEST: Duration = Duration::from_secs(60);

/// Bounds of the corpus in the project.
const MOST_BYTES: u64 = 1_000_000;
const LARGEST_FILE: u64 = 50_000;

fn names_in(folder: &str) -> BTreeSet<String> {
    let entries = fs::read_dir(Path::new(ROOT).join(folder)).expect("a folder of the project");
    entries
        .map(|entry| entry.expect("an entry").path().file_stem().expect("a name").to_string_lossy().into_owned())
        .collect()
}

fn corpus(name: &str) -> Vec<PathBuf> {
    let entries = fs::read_dir(Path::new(ROOT).join("fuzz/corpus").join(name)).expect("a corpus");
    let mut files: Vec<PathBuf> = entries.map(|entry| entry.expect("an entry").path()).collect();
    files.sort_unstable();
    files
}

#[test]
fn every_entrance_has_a_corpus_and_the_corpus_is_small() {
    let entrances: BTreeSet<String> = entrances().into_iter().map(str::to_owned).collect();
    assert_eq!(names_in("fuzz/corpus"), entrances);
    let mut bytes = 0;
    for name in &entrances {
        let files = corpus(name);
        assert!(files.len() >= 2, "{name}: {} files are no corpus", files.len());
        for file in files {
            let size = file.metadata().expect("a file").len();
            assert!(size <= LARGEST_FILE, "{}: {size} bytes", file.display());
            bytes += size;
        }
    }
    assert!(bytes <= MOST_BYTES, "the corpus has {bytes} bytes");
}

#[test]
fn no_file_of_the_corpus_breaks_a_promise() {
    let (sender, files) = mpsc::channel();
    let worker = std::thread::spawn(move || {
        for entrance in entrances() {
            for file in corpus(entrance) {
                let bytes = fs::read(&file).expect("a file of the corpus");
                if sender.send((file, None)).is_err() {
                    return;
                }
                let entered = catch_unwind(AssertUnwindSafe(|| enter(entrance, &bytes)));
                let _ = sender.send((PathBuf::from(entrance), Some(entered.is_ok())));
            }
        }
    });
    let (mut broken, mut now, mut replayed) = (Vec::new(), PathBuf::new(), 0);
    loop {
        match files.recv_timeout(LONGEST) {
            Ok((file, None)) => now = file,
            Ok((_, Some(whole))) => {
                replayed += 1;
                if !whole {
                    broken.push(now.display().to_string());
                }
            }
            Err(mpsc::RecvTimeoutError::Disconnected) => break,
            Err(mpsc::RecvTimeoutError::Timeout) => panic!("{} takes more than {LONGEST:?}", now.display()),
        }
    }
    worker.join().expect("the corpus was read");
    tidy();
    assert!(broken.is_empty(), "these panic:\n{}", broken.join("\n"));
    assert!(replayed > entrances().len());
}

/// `AFMID_WRITE_SEEDS=1` writes them; otherwise seeds of an old format, which are refused at their first line, would go
/// unnoticed.
#[test]
fn seeds_of_own_formats_are_what_the_program_writes() {
    let scratch = tempfile::tempdir().expect("a temporary folder");
    let mut stale = Vec::new();
    for (target, name, bytes) in seeds(scratch.path()) {
        let path = Path::new(ROOT).join("fuzz/corpus").join(target).join(name);
        if std::env::var_os("AFMID_WRITE_SEEDS").is_some() {
            fs::create_dir_all(path.parent().expect("a folder")).expect("the corpus");
            fs::write(&path, &bytes).expect("a seed");
        } else if fs::read(&path).ok() != Some(bytes) {
            stale.push(path.display().to_string());
        }
    }
    let help = "write them with AFMID_WRITE_SEEDS=1 cargo test --test integrity corpus";
    assert!(stale.is_empty(), "other bytes than the program writes; {help}:\n{}", stale.join("\n"));
}
