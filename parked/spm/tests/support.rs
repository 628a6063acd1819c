//! What the tests of all formats share: the data folder, values of channels, and damage done to files.
#![allow(dead_code, reason = "each test file uses its part of it")]

use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use common::{Contents, Format, FormatError, FoundChannel, Raw};

/// A real file; none, with a printed line, if the data folder is missing.
pub fn real(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("AFMID_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from);
    let path = folder.join("loaders").join(name);
    if !path.exists() {
        println!("SKIPPED: no {}", path.display());
        return None;
    }
    Some(path)
}

/// Writes bytes to a file of its own folder and opens it.
pub fn open_bytes<F: Format>(name: &str, bytes: &[u8]) -> (tempfile::TempDir, Result<Contents, FormatError>) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    std::fs::write(&path, bytes).unwrap();
    let contents = F::open(&path);
    (folder, contents)
}

/// All stored codes of a channel as f64.
pub fn codes(channel: &FoundChannel) -> Vec<f64> {
    widen(channel.source.read(0, channel.samples).unwrap())
}

pub fn widen(raw: Raw) -> Vec<f64> {
    match raw {
        Raw::Int16(v) => v.into_iter().map(f64::from).collect(),
        Raw::Int32(v) => v.into_iter().map(f64::from).collect(),
        Raw::Float32(v) => v.into_iter().map(f64::from).collect(),
        Raw::Float64(v) => v,
    }
}

/// All values of a channel in its unit.
pub fn values(channel: &FoundChannel) -> Vec<f64> {
    codes(channel).into_iter().map(|x| x * channel.scale_factor + channel.add_offset).collect()
}

pub fn channel<'c>(contents: &'c Contents, location: &str) -> &'c FoundChannel {
    let locations: Vec<_> = contents.channels.iter().map(|c| &c.location).collect();
    contents
        .channels
        .iter()
        .find(|c| c.location == location)
        .unwrap_or_else(|| panic!("no {location} in {locations:?}"))
}

pub fn remarked(contents: &Contents, what: &str) -> bool {
    contents.remarks.iter().any(|r| r.contains(what))
}

/// Asserts a relative difference below `tolerance`.
pub fn near(found: f64, wanted: f64, tolerance: f64) {
    assert!((found - wanted).abs() <= tolerance * wanted.abs(), "found {found:e}, wanted {wanted:e}");
}

/// Small generator of random numbers (xorshift64), seeded so that failures repeat.
pub struct Random(pub u64);

impl Random {
    pub fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % n as u64) as usize
    }
}

/// Opens and reads cut and damaged copies of a file: whatever comes out, it must come without panic, soon, and be no longer than
/// `most_samples` in all.
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
                    assert_eq!(widen(raw).len(), c.samples);
                }
                assert!(c.source.read(c.samples, 1).is_err());
                assert!(c.source.read(usize::MAX, 2).is_err());
            }
        }
        // a second: hundreds of times what a sound file takes, for the machine may be busy
        assert!(start.elapsed() < Duration::from_secs(1), "took {:?}", start.elapsed());
    };
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
