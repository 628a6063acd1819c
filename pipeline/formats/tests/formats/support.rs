//! What the tests of all formats share: files, values of channels, and damage done to files.
#![allow(dead_code, reason = "each test binary uses a part of it")]

use afmid_formats::{Contents, Format, FormatError, FoundChannel};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// A real file or folder of `loaders`; none, with a counted line, if the folder of real files is missing.
pub fn real(name: &str) -> Option<PathBuf> {
    shared("loaders", name)
}

/// A real file of an oscilloscope, of LabVIEW or of CASSY, or an empty name for all; as [`real`].
pub fn scope(name: &str) -> Option<PathBuf> {
    shared("scopes", name)
}

/// A real folder of hammer tests; as [`real`].
pub fn real_hammer(name: &str) -> Option<PathBuf> {
    shared("hammer", name)
}

fn shared(folder: &str, name: &str) -> Option<PathBuf> {
    static MISSING: AtomicUsize = AtomicUsize::new(0);
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/data");
    let folder = std::env::var_os("AFMID_DATA").map_or_else(beside, PathBuf::from).join(folder);
    if !folder.is_dir() {
        let count = MISSING.fetch_add(1, Ordering::Relaxed) + 1;
        println!("real file {count} not tested: {} is missing, built files stand in", folder.display());
        return None;
    }
    Some(folder.join(name))
}

/// Files written by tests/make_npy.py and tests/make_mat.py.
pub fn written(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// A file of these bytes that is deleted with this value.
pub struct Temporary(pub PathBuf, tempfile::TempDir);

impl Temporary {
    pub fn new(ending: &str, bytes: &[u8]) -> Self {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(format!("file.{ending}"));
        std::fs::write(&path, bytes).unwrap();
        Self(path, folder)
    }
}

/// Writes a file for a test, in a folder of its own: tests that run at once may choose the same name.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    static FILES: AtomicUsize = AtomicUsize::new(0);
    let count = FILES.fetch_add(1, Ordering::Relaxed);
    let folder = std::env::temp_dir().join(format!("afmid-formats-{}", std::process::id())).join(count.to_string());
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Opens bytes as a file.
pub fn open<F: Format>(name: &str, bytes: &[u8]) -> Result<Contents, FormatError> {
    F::open(&file(name, bytes))
}

/// Writes bytes to a file of its own folder and opens it.
pub fn open_bytes<F: Format>(name: &str, bytes: &[u8]) -> (tempfile::TempDir, Result<Contents, FormatError>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let contents = F::open(&path);
    (folder, contents)
}

/// All stored samples; read at once, and again in stretches of odd lengths, which must agree.
pub fn samples(channel: &FoundChannel) -> Vec<f64> {
    let all = channel.source.read(0, channel.samples).unwrap().widened();
    assert_eq!(all.len(), channel.samples);
    let (mut pieces, mut length) = (Vec::new(), 1);
    while pieces.len() < all.len() {
        let count = length.min(all.len() - pieces.len());
        pieces.extend(channel.source.read(pieces.len(), count).unwrap().widened());
        length = length * 2 + 1;
    }
    assert!(pieces.iter().zip(&all).all(|(a, b)| a.to_bits() == b.to_bits()), "stretches differ from the whole");
    assert!(channel.source.read(channel.samples, 1).is_err(), "reads beyond its end");
    assert!(channel.source.read(usize::MAX, 2).is_err(), "start + count overflows");
    all
}

/// All stored codes of a channel.
pub fn codes(channel: &FoundChannel) -> Vec<f64> {
    samples(channel)
}

/// All values of a channel in its unit.
pub fn values(channel: &FoundChannel) -> Vec<f64> {
    samples(channel).into_iter().map(|x| x * channel.scale_factor + channel.add_offset).collect()
}

pub fn channel<'a>(contents: &'a Contents, location: &str) -> &'a FoundChannel {
    let found = contents.channels.iter().find(|channel| channel.location == location);
    found.unwrap_or_else(|| panic!("{location} is not in {:?}", locations(contents)))
}

pub fn locations(contents: &Contents) -> Vec<&str> {
    contents.channels.iter().map(|channel| channel.location.as_str()).collect()
}

/// Whether a remark contains the words.
pub fn remarked(contents: &Contents, text: &str) -> bool {
    contents.remarks.iter().any(|remark| remark.contains(text))
}

/// The sum against the reference's. Summing in another order rounds otherwise: by at most n eps of the sum of
/// magnitudes.
pub fn assert_sum(values: &[f64], expected: f64) {
    let magnitudes: f64 = values.iter().map(|v| v.abs()).sum();
    let tolerance = values.len() as f64 * f64::EPSILON * magnitudes;
    let sum: f64 = values.iter().sum();
    assert!((sum - expected).abs() <= tolerance, "{sum} instead of {expected}");
}

/// Asserts a relative difference below `tolerance`.
pub fn near(found: f64, wanted: f64, tolerance: f64) {
    assert!((found - wanted).abs() <= tolerance * wanted.abs(), "found {found:e}, wanted {wanted:e}");
}

/// Most memory this process ever had, in bytes.
pub fn peak_bytes() -> u64 {
    let status = std::fs::read_to_string("/proc/self/status").unwrap();
    let line = status.lines().find(|line| line.starts_with("VmHWM:")).unwrap();
    line.split_whitespace().nth(1).unwrap().parse::<u64>().unwrap() * 1024
}

/// How often a test damages or draws: `few` in every run of the tests, `all` where the variable `AFMID_ACCURACY` is set
/// (`make accuracy`, before a release).
pub fn few_or_all<T>(few: T, all: T) -> T {
    if std::env::var_os("AFMID_ACCURACY").is_some() { all } else { few }
}

/// Marsaglia's xorshift64: the same numbers every time.
pub struct Random(pub u64);

impl Random {
    pub fn next(&mut self) -> u64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        self.0
    }

    pub fn below(&mut self, limit: usize) -> usize {
        (self.next() % limit.max(1) as u64) as usize
    }

    /// From 0 to 1.
    pub fn uniform(&mut self) -> f64 {
        (self.next() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// Normally distributed, by Box and Muller.
    pub fn normal(&mut self) -> f64 {
        let radius = (-2.0 * (1.0 - self.uniform()).ln()).sqrt();
        radius * (std::f64::consts::TAU * self.uniform()).cos()
    }
}

/// Opens and reads cut and damaged copies of a file: whatever comes out, it must come without panic, soon, and be no
/// longer than `most_samples` in all.
pub fn survive<F: Format>(name: &str, sound: &[u8], cuts: usize, flips: usize, most_samples: usize) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    let mut opened = 0;
    let mut try_bytes = |bytes: &[u8]| {
        std::fs::write(&path, bytes).unwrap();
        let start = Instant::now();
        F::recognises(&bytes[..bytes.len().min(4096)], &path);
        if let Ok(contents) = F::open(&path) {
            opened += 1;
            let total: usize = contents.channels.iter().map(|c| c.samples).sum();
            assert!(total <= most_samples, "{total} samples in a file of {} bytes", bytes.len());
            for c in &contents.channels {
                if let Ok(raw) = c.source.read(0, c.samples) {
                    assert_eq!(raw.len(), c.samples);
                }
                assert!(c.source.read(c.samples, 1).is_err());
                assert!(c.source.read(usize::MAX, 2).is_err());
            }
        }
        // a second: hundreds of times what a sound file takes, for the machine may be busy
        assert!(start.elapsed() < Duration::from_secs(1), "took {:?}", start.elapsed());
    };
    let (cuts, flips) = few_or_all((cuts / 4, flips / 4), (cuts, flips));
    for i in 0..cuts {
        try_bytes(&sound[..sound.len() * i / cuts]);
    }
    for i in 0..flips {
        let mut bytes = sound.to_vec();
        for _ in 0..=random.below(4) {
            // half of the damage goes to the first and last kilobyte, where headers and directories are
            let n = bytes.len();
            let near = n.min(1024);
            let at = match i % 4 {
                0 => random.below(near),
                1 => n - 1 - random.below(near),
                _ => random.below(n),
            };
            bytes[at] = random.below(256) as u8;
        }
        try_bytes(&bytes);
    }
    println!("{name}: {opened} of {} damaged copies opened", cuts + flips);
}
