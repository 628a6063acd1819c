//! Files of the cache that hold something else than their names say: damaged, exchanged, mutated.

use std::fs;
use std::path::{Path, PathBuf};

use afmid_pipeline::Plan;
use afmid_pipeline::cache::Cache;
use afmid_pipeline::graph::load;
use afmid_pipeline::runner::{Options, Quiet, run_to_file};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::common::few_or_all;
use super::small::{CONFIG, cached, differences, folder, run, truth};

/// Behind the bytes of a sealed file, before their hash.
const SEAL: &[u8] = b"\nafmid seal, BLAKE3 of all bytes before this line: ";

#[test]
fn files_that_changed_places_are_computed_again_with_a_warning() {
    let scratch = folder(2, 20_000);
    let here = scratch.path();
    let truth = truth(here);
    assert_eq!(run(here, "a.h5", "cache", &[]).code, Some(0));
    // the same stage with another parameter, and other stages
    assert_eq!(run(here, "other.h5", "cache", &["--set", "census.min_bandwidth_share=0.03"]).code, Some(0));
    let files = cached(&here.join("cache"), "h5");
    assert_eq!(files.len(), 4, "three stages, one of them twice");
    let whole: Vec<Vec<u8>> = files.iter().map(|file| fs::read(file).expect("bytes")).collect();
    for one in 0..files.len() {
        for other in 0..one {
            files.iter().zip(&whole).for_each(|(file, bytes)| fs::write(file, bytes).expect("written"));
            fs::write(&files[one], &whole[other]).expect("written");
            fs::write(&files[other], &whole[one]).expect("written");
            let ran = run(here, "b.h5", "cache", &[]);
            assert_eq!(ran.code, Some(0), "{ran:?}");
            assert_eq!(differences(&truth, &here.join("b.h5")), [""; 0], "{one} and {other}: {ran:?}");
            let warned = ran.stderr.matches("holds another result").count();
            assert!(warned > 0 && ran.stderr.contains("its stage runs again"), "{one} and {other}: {ran:?}");
        }
    }
}

/// A run in this process.
struct Small {
    plan: Plan,
    here: PathBuf,
}

impl Small {
    fn new(here: &Path) -> Self {
        let config = here.join(CONFIG);
        let text = fs::read_to_string(&config).expect("the config");
        let registry = afmid::registry().expect("stages");
        let plan = load(&config.display().to_string(), &text, &[], &registry).expect("a config");
        Self { plan, here: here.to_owned() }
    }

    /// Runs with this cache; how many stages came from it, and the notes about it.
    fn run(&self, cache: &Path, result: &Path) -> (usize, Vec<String>) {
        let cache = Cache::open(cache);
        let options = Options {
            base: self.here.clone(),
            cache: &cache,
            files: cache.input_files(false),
            fresh: false,
            program: "afmid test".to_owned(),
            overrides: Vec::new(),
            observer: &Quiet,
        };
        let run = run_to_file(&self.plan, &options, result).unwrap_or_else(|failed| panic!("{failed:?}"));
        (run.info.stages.iter().filter(|stage| stage.2).count(), cache.take_notes())
    }
}

/// A file with a seal that fits.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    [bytes, SEAL, blake3::hash(bytes).to_hex().as_bytes(), b"\n"].concat()
}

/// A file without its seal.
fn body(file: &[u8]) -> &[u8] {
    &file[..file.len() - SEAL.len() - 65]
}

/// Where some bytes begin.
fn find(bytes: &[u8], wanted: &[u8]) -> Option<usize> {
    bytes.windows(wanted.len()).position(|window| window == wanted)
}

/// Every file of a cache, below its folder.
fn read_all(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut all = Vec::new();
    for entry in fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()) {
        match entry.is_dir() {
            true => all.extend(read_all(&entry)),
            false => all.push((entry.clone(), fs::read(&entry).expect("bytes"))),
        }
    }
    all.sort();
    all
}

/// One mutation of a cache's files, in words. Nobody but who can write the cache seals what was mutated: then what
/// names the result is altered, not its numbers, since the seal is no signature (SECURITY.md).
fn mutate(files: &mut [(PathBuf, Vec<u8>)], random: &mut ChaCha8Rng) -> String {
    let of = |ending: &str, files: &[(PathBuf, Vec<u8>)]| -> Vec<usize> {
        let has = |path: &Path| path.extension().is_some_and(|found| found == ending);
        (0..files.len()).filter(|&index| has(&files[index].0)).collect()
    };
    let stages = of("h5", files);
    let mut any = |from: &[usize]| from[random.random_range(0..from.len())];
    let (one, other) = (any(&stages), any(&stages));
    let name = |index: usize| files[index].0.file_stem().unwrap_or_default().to_string_lossy()[..8].to_owned();
    let (this, that) = (name(one), name(other));
    let length = files[one].1.len();
    let at = random.random_range(0..length);
    match random.random_range(0..11) {
        0 => {
            files[one].1[at] ^= 1 << random.random_range(0..8);
            format!("{this}: a bit of byte {at}")
        }
        1 => {
            let end = (at + random.random_range(1..200)).min(length);
            random.fill(&mut files[one].1[at..end]);
            format!("{this}: bytes {at} to {end}")
        }
        2 => {
            files[one].1.truncate(at);
            format!("{this}: cut at {at}")
        }
        3 => {
            let (bytes, others) = (files[one].1.clone(), files[other].1.clone());
            (files[one].1, files[other].1) = (others, bytes);
            format!("{this} and {that} exchanged")
        }
        4 => {
            let tail = files[other].1.get(at..).unwrap_or_default().to_vec();
            files[one].1.truncate(at);
            files[one].1.extend(tail);
            format!("{this} to byte {at}, then {that}")
        }
        5 => {
            files[one].1 = sealed(body(&files[other].1));
            format!("{this} is {that}, sealed")
        }
        6 => {
            let cut = at.min(length - SEAL.len() - 65);
            files[one].1 = sealed(&files[one].1[..cut]);
            format!("{this}: cut at {cut}, sealed")
        }
        7 => {
            // the key that it states becomes that of no result, or its stage another's
            let mut bytes = body(&files[one].1).to_vec();
            let key = files[one].0.file_stem().unwrap_or_default().to_string_lossy().into_owned();
            let at = find(&bytes, key.as_bytes()).expect("a stage file states its key") + random.random_range(0..64);
            bytes[at] = if bytes[at] == b'0' { b'1' } else { b'0' };
            files[one].1 = sealed(&bytes);
            format!("{this}: another key in it, sealed")
        }
        8 => {
            let origins = of("json", files);
            let origin = origins[random.random_range(0..origins.len())];
            let at = random.random_range(0..files[origin].1.len());
            files[origin].1[at] = random.random();
            format!("byte {at} of {}", files[origin].0.display())
        }
        9 => {
            let one = (0..files.len()).find(|&index| files[index].0.extension().is_none()).expect("stamps");
            match random.random_range(0..3) {
                0 => {
                    // each of the two files gets the other's name
                    let text = String::from_utf8(files[one].1.clone()).expect("text");
                    let lines: Vec<(&str, &str)> =
                        text.lines().map(|line| line.rsplit_once('\t').expect("fields")).collect();
                    let [(a, name), (b, other)] = lines[..] else { panic!("two stamps: {text}") };
                    files[one].1 = format!("{a}\t{other}\n{b}\t{name}\n").into_bytes();
                }
                1 => {
                    let at = random.random_range(0..files[one].1.len());
                    files[one].1[at] ^= 1 << random.random_range(0..8);
                }
                _ => {
                    let at = random.random_range(0..files[one].1.len());
                    files[one].1.truncate(at);
                }
            }
            "a stamp".to_owned()
        }
        _ => {
            let (path, bytes) = (files[other].0.clone(), files[one].1.clone());
            files[other] = (path, bytes);
            format!("{that} is a copy of {this}")
        }
    }
}

#[test]
fn mutations_of_a_cache_and_no_other_result_is_served() {
    let scratch = folder(2, 20_000);
    let here = scratch.path();
    // so that the hashes of the records are remembered
    std::thread::sleep(std::time::Duration::from_millis(2_200));
    let cache = here.join("cache");
    assert_eq!(run(here, "other.h5", "cache", &["--set", "census.min_bandwidth_share=0.03"]).code, Some(0));
    let small = Small::new(here);
    let (truth, result) = (here.join("truth.h5"), here.join("result.h5"));
    small.run(&here.join("another-cache"), &truth);
    small.run(&cache, &result);
    assert_eq!(small.run(&cache, &result).0, 3, "all three stages are reused");
    let whole = read_all(&cache);
    assert_eq!(whole.iter().filter(|(path, _)| path.extension().is_none()).count(), 1, "a file of stamps");
    let (mut reused, mut noted) = (0, 0);
    let mutations = few_or_all(100, 400);
    for seed in 0..mutations as u64 {
        let mut random = ChaCha8Rng::seed_from_u64(seed);
        let mut files = whole.clone();
        let what = mutate(&mut files, &mut random);
        fs::remove_dir_all(&cache).expect("removed");
        fs::create_dir_all(cache.join("stamps")).expect("a folder");
        files.iter().for_each(|(path, bytes)| fs::write(path, bytes).expect("written"));
        let (came, notes) = small.run(&cache, &result);
        assert_eq!(differences(&truth, &result), [""; 0], "seed {seed}, {what}: {notes:?}");
        reused += came;
        noted += usize::from(!notes.is_empty());
    }
    // a stage of the other config, an origin or a stamp may be hit: then all is reused, and nothing said
    let stages = 3 * mutations;
    println!(
        "{mutations} mutations: {reused} of {stages} stages reused, {noted} runs with a note, 0 with another result"
    );
    assert!((stages / 2..stages).contains(&reused) && noted > mutations / 4, "{reused} reused, {noted} noted");
}
