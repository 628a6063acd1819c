//! Keys, whole files, damage.

use serde_json::json;

use super::*;
use crate::files::fixture::Folder;
use crate::outcome::SourceFile;
use crate::recording::InputFiles;
use crate::store::fixture::{identity, run_result, stage_result};
use crate::store::write_result;

fn file(path: &str, hash: &str) -> SourceFile {
    SourceFile { path: path.to_owned(), size: 1, blake3: hash.to_owned() }
}

#[test]
fn a_key_depends_on_everything_but_places_and_the_order_of_keys() {
    let params = json!({"a": 1, "b": [1.5, null], "files": ["x/*.h5"]});
    let sources = [file("x/a.h5", "00"), file("x/b.h5", "11")];
    let upstream = [("in".to_owned(), "k".to_owned(), "out".to_owned())];
    let base = KeyParts {
        stage: "events.correlation",
        version: 1,
        params: &params,
        location_params: &["files"],
        depends_on: &[],
        arithmetic: "x86_64 [avx2 fma]",
        seed: None,
        sources: &sources,
        upstream: &upstream,
    };
    let moved = [file("y/a.h5", "00"), file("y/b.h5", "11")];
    let elsewhere = json!({"files": ["y/*.h5"], "b": [1.5, null], "a": 1});
    assert_eq!(key(&base), key(&KeyParts { params: &elsewhere, sources: &moved, ..base }));
    let swapped = [file("x/b.h5", "11"), file("x/a.h5", "00")];
    let (other, text) = (json!({"a": 2, "b": [1.5, null]}), json!({"a": "1", "b": [1.5, null]}));
    let plugins = ["one 1".to_owned(), "two 1".to_owned()];
    let others = [
        KeyParts { stage: "events.other", ..base },
        KeyParts { version: 2, ..base },
        KeyParts { params: &other, ..base },
        KeyParts { params: &text, ..base },
        KeyParts { location_params: &[], ..base },
        KeyParts { depends_on: &plugins, ..base },
        KeyParts { depends_on: &plugins[..1], ..base },
        KeyParts { arithmetic: "x86_64 [sse4.1]", ..base },
        KeyParts { seed: Some(0), ..base },
        KeyParts { sources: &swapped, ..base },
        KeyParts { sources: &sources[..1], ..base },
        KeyParts { upstream: &[], ..base },
    ];
    let mut keys: Vec<String> = others.iter().map(key).collect();
    keys.push(key(&base));
    keys.sort_unstable();
    keys.dedup();
    assert_eq!(keys.len(), others.len() + 1);
}

fn get(cache: &Cache, key: &str) -> Option<crate::StageResult> {
    cache.get(&identity(key), &InputFiles::new())
}

#[test]
fn a_file_that_holds_another_result_is_not_served() {
    use crate::store::StageIdentity;
    let folder = Folder::new("swapped");
    let cache = Cache::open(&folder.0);
    cache.put(&identity("aa"), &stage_result()).unwrap();
    let one = identity("aa");
    let others = [
        identity("bb"),
        StageIdentity { stage: "events.other", ..one },
        StageIdentity { version: one.version + 1, ..one },
        StageIdentity { outputs: &one.outputs[1..], ..one },
    ];
    for other in others {
        std::fs::copy(cache.path("aa"), folder.file("kept")).unwrap();
        if other.key != "aa" {
            std::fs::copy(cache.path("aa"), cache.path(other.key)).unwrap();
        }
        assert!(cache.get(&other, &InputFiles::new()).is_none(), "{other:?}");
        let notes = cache.take_notes();
        assert!(notes.len() == 1 && notes[0].contains("holds another result"), "{notes:?}");
        std::fs::copy(folder.file("kept"), cache.path("aa")).unwrap();
    }
    assert!(get(&cache, "aa").is_some());
}

#[test]
fn what_was_put_comes_back() {
    let folder = Folder::new("cache");
    let cache = Cache::open(&folder.file("made"));
    assert!(get(&cache, "00ff").is_none());
    cache.put(&identity("00ff"), &stage_result()).unwrap();
    assert_eq!(format!("{:?}", get(&cache, "00ff").unwrap()), format!("{:?}", stage_result()));
    assert!(cache.take_notes().is_empty());
    assert_eq!(std::fs::read_dir(cache.folder()).unwrap().count(), 1, "no temporary file is left");
}

#[test]
fn every_damaged_byte_of_a_cached_file_is_noticed() {
    let folder = Folder::new("damage");
    let cache = Cache::open(&folder.0);
    cache.put(&identity("aa"), &stage_result()).unwrap();
    let whole = std::fs::read(cache.path("aa")).unwrap();
    let places = (0..whole.len()).step_by(1997).chain(whole.len() - 120..whole.len());
    for place in places {
        let mut bytes = whole.clone();
        bytes[place] ^= 0x10;
        std::fs::write(cache.path("aa"), &bytes).unwrap();
        assert!(get(&cache, "aa").is_none(), "byte {place}");
        assert!(!cache.contains("aa"), "a damaged file is removed");
        assert_eq!(cache.take_notes().len(), 1);
    }
    for length in [0, 1, 50, 2000, whole.len() - 116, whole.len() - 1] {
        std::fs::write(cache.path("aa"), &whole[..length]).unwrap();
        assert!(get(&cache, "aa").is_none(), "cut at {length}");
    }
}

#[test]
fn the_same_result_gives_the_same_bytes() {
    let folder = Folder::new("bytes");
    let cache = Cache::open(&folder.0);
    let other = Cache::open(&folder.file("other"));
    cache.put(&identity("a"), &stage_result()).unwrap();
    other.put(&identity("a"), &stage_result()).unwrap();
    assert!(std::fs::read(cache.path("a")).unwrap() == std::fs::read(other.path("a")).unwrap());
    let (first, second) = (folder.file("r1.h5"), folder.file("r2.h5"));
    write_result(&first, &run_result()).unwrap();
    write_result(&second, &run_result()).unwrap();
    assert!(std::fs::read(&first).unwrap() == std::fs::read(&second).unwrap());
    write_result(&first, &run_result()).unwrap();
    assert!(std::fs::read(&first).unwrap() == std::fs::read(&second).unwrap(), "written over itself");
}

#[test]
fn a_failed_write_leaves_the_old_file_and_no_temporary_one() {
    let folder = Folder::new("failed");
    let path = folder.file("result.h5");
    write_result(&path, &run_result()).unwrap();
    let old = std::fs::read(&path).unwrap();
    let mut run = run_result();
    run.config.push('\0');
    let error = write_result(&path, &run).unwrap_err();
    assert!(error.problem.contains("NUL"), "{error}");
    assert_eq!(error.file, path);
    assert!(std::fs::read(&path).unwrap() == old);
    assert_eq!(std::fs::read_dir(&folder.0).unwrap().count(), 1);
}

#[test]
fn temporary_files_of_the_dead_are_swept_those_of_the_living_stay() {
    let folder = Folder::new("sweep");
    let host = crate::files::host();
    // pid_max is at most 2^22
    let dead = folder.file(&format!(".k.h5.{host}.4194999.0.tmp"));
    let living = folder.file(&format!(".k.h5.{host}.{}.0.tmp", std::process::id()));
    let elsewhere = folder.file(".k.h5.0123456789ab.4194999.0.tmp");
    let result = folder.file("k.h5");
    for path in [&dead, &living, &elsewhere, &result] {
        std::fs::write(path, b"x").unwrap();
    }
    Cache::open(&folder.0);
    assert!(!dead.exists() && living.exists() && elsewhere.exists() && result.exists());
    let yesterday = std::time::SystemTime::now() - std::time::Duration::from_secs(25 * 3600);
    std::fs::File::options().write(true).open(&elsewhere).unwrap().set_modified(yesterday).unwrap();
    Cache::open(&folder.0);
    assert!(!elsewhere.exists());
}
