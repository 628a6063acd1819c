//! What is freed, what stays, and that a run never misses it.

use std::fs::{self, File};
use std::path::Path;
use std::time::{Duration, SystemTime};

use serde_json::json;

use super::*;
use crate::files::fixture::Folder;
use crate::recording::InputFiles;
use crate::store::fixture::{identity, stage_result};

const DAY: Duration = Duration::from_secs(24 * 3600);

fn key(digit: char) -> String {
    digit.to_string().repeat(64)
}

fn write(path: &Path, bytes: usize, days: u32) {
    fs::write(path, vec![b'x'; bytes]).unwrap();
    File::options().write(true).open(path).unwrap().set_modified(SystemTime::now() - DAY * days).unwrap();
}

/// Three results of 100 bytes used 1, 10 and 40 days ago, the last with its origin; a leftover of each kind; files of
/// others.
fn folder() -> Folder {
    let folder = Folder::new("free");
    for (digit, days) in [('a', 1), ('b', 10), ('c', 40)] {
        write(&folder.file(&format!("{}.h5", key(digit))), 100, days);
    }
    write(&folder.file(&format!("{}.json", key('c'))), 7, 40);
    write(&folder.file(&format!("{}.json", key('d'))), 7, 2);
    write(&folder.file(&format!(".{}.h5.0123456789ab.1.0.tmp", key('e'))), 50, 3);
    fs::create_dir(folder.file("stamps")).unwrap();
    write(&folder.file(&format!("stamps/{}", key('f'))), 9, 40);
    write(&folder.file("stamps/notes.txt"), 9, 400);
    write(&folder.file("thesis.h5"), 1000, 400);
    write(&folder.file(&format!(".{}.h5.0123456789ab.1.1.tmp", key('e'))), 50, 0);
    folder
}

fn names(freed: &Freed) -> Vec<String> {
    let name = |gone: &Gone| gone.file.path.file_name().unwrap().to_string_lossy().chars().take(2).collect();
    freed.gone.iter().map(name).collect()
}

fn count(folder: &Folder) -> usize {
    fs::read_dir(&folder.0).unwrap().count() + fs::read_dir(folder.file("stamps")).unwrap().count()
}

#[test]
fn without_a_limit_only_leftovers_go() {
    let folder = folder();
    let before = count(&folder);
    let dry = free(&folder.0, &Limits::default(), true).unwrap();
    assert_eq!(count(&folder), before, "a dry run removes nothing");
    let freed = free(&folder.0, &Limits::default(), false).unwrap();
    assert_eq!((names(&freed), names(&dry)), (vec![".e".to_owned(), "dd".to_owned()], names(&freed)));
    assert_eq!(freed.left.total(Sort::Result), (3, 307), "with the origin's 7 bytes");
    assert_eq!(freed.left.idle(DAY * 30, SystemTime::now()), (1, 107));
    assert_eq!(count(&folder), before - 2);
    assert!(free(&folder.0, &Limits::default(), false).unwrap().gone.is_empty(), "nothing is left to free");
}

#[test]
fn what_was_not_used_for_longer_goes_with_its_origin_and_old_stamps() {
    let folder = folder();
    let limits = Limits { older_than: Some(DAY * 30), max_bytes: None };
    let freed = free(&folder.0, &limits, false).unwrap();
    assert_eq!(freed.gone.iter().filter(|gone| gone.why == Why::Old).count(), 2, "{freed:?}");
    assert!(!folder.file(&format!("{}.h5", key('c'))).exists());
    assert!(!folder.file(&format!("{}.json", key('c'))).exists());
    assert!(!folder.file(&format!("stamps/{}", key('f'))).exists());
    assert!(folder.file("stamps/notes.txt").exists() && folder.file("thesis.h5").exists(), "files of others stay");
}

#[test]
fn the_least_recently_used_go_until_the_size_is_kept() {
    let folder = folder();
    // 316 bytes count: 307 of results, 9 of a stamp; without the oldest result 209, without the next 109
    let limits = Limits { older_than: None, max_bytes: Some(208) };
    let freed = free(&folder.0, &limits, false).unwrap();
    assert_eq!(names(&freed), ["cc", "bb", ".e", "dd"], "{freed:?}");
    assert!(folder.file(&format!("{}.h5", key('a'))).exists());
    let none = free(&folder.0, &Limits { older_than: None, max_bytes: Some(0) }, false).unwrap();
    assert_eq!(names(&none), ["aa"]);
    assert!(folder.file("thesis.h5").exists());
}

#[test]
fn a_result_that_is_used_is_the_last_to_go() {
    let folder = Folder::new("used");
    let cache = Cache::open(&folder.0);
    for digit in ['a', 'b'] {
        cache.put(&identity(&key(digit)), &stage_result()).unwrap();
        let file = File::options().write(true).open(cache.path(&key(digit))).unwrap();
        file.set_modified(SystemTime::now() - DAY * if digit == 'a' { 9 } else { 2 }).unwrap();
    }
    assert!(cache.get(&identity(&key('a')), &InputFiles::new()).is_some());
    let freed = free(&folder.0, &Limits { older_than: Some(DAY), max_bytes: None }, false).unwrap();
    assert_eq!(names(&freed), ["bb"]);
    assert!(cache.get(&identity(&key('a')), &InputFiles::new()).is_some());
}

#[test]
fn a_folder_that_is_not_there_is_empty_and_stays_away() {
    let folder = Folder::new("absent");
    let freed = free(&folder.file("none"), &Limits::default(), false).unwrap();
    assert!(freed.gone.is_empty() && freed.left.files.is_empty());
    assert!(!folder.file("none").exists());
}

#[test]
fn origins_come_back_and_broken_ones_are_left_out() {
    let folder = Folder::new("origins");
    let cache = Cache::open(&folder.0);
    let origin = |digit: char| Origin {
        key: key(digit),
        format: 1,
        uses: "events.correlation".to_owned(),
        version: 2,
        params: json!({ "a": 0.1, "files": ["x"] }),
        location_params: vec!["files".to_owned()],
        depends_on: Vec::new(),
        arithmetic: "x86_64 [avx2]".to_owned(),
        seed: Some(u64::MAX),
        files: vec![OriginFile { name: "a.h5".to_owned(), size: 3, blake3: "00".to_owned() }],
        inputs: Vec::new(),
        pipeline: "p".to_owned(),
        id: "events".to_owned(),
        program: "afmid 1".to_owned(),
    };
    let put = |digit: char| {
        let key = key(digit);
        cache.write_with_origin(&origin(digit), &identity(&key), &stage_result()).unwrap().finish().unwrap();
    };
    put('a');
    put('b');
    assert_eq!(cache.origin(&key('a')), Some(origin('a')));
    fs::write(cache.origin_path(&key('b')), b"{\"key\":").unwrap();
    fs::remove_file(cache.path(&key('b'))).unwrap();
    let found: Vec<Origin> = cache.origins().into_iter().map(|(origin, _)| origin).collect();
    assert_eq!(found, [origin('a')]);
    assert!(cache.get(&identity(&key('a')), &InputFiles::new()).is_some() && cache.take_notes().is_empty());
}

#[test]
fn whatever_is_removed_at_any_moment_gets_and_puts_go_on() {
    let folder = Folder::new("race");
    let cache = Cache::open(&folder.0);
    let stop = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !stop.load(std::sync::atomic::Ordering::Relaxed) {
                free(&folder.0, &Limits { older_than: None, max_bytes: Some(0) }, false).unwrap();
            }
        });
        for _ in 0..60 {
            cache.put(&identity(&key('a')), &stage_result()).unwrap();
            // there or gone, never half of it
            if let Some(found) = cache.get(&identity(&key('a')), &InputFiles::new()) {
                assert_eq!(found.warnings, stage_result().warnings);
            }
        }
        stop.store(true, std::sync::atomic::Ordering::Relaxed);
    });
    assert!(cache.take_notes().is_empty(), "nothing was taken for damaged");
}
