//! What the tests share.

use common::{Contents, FoundChannel, Raw};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};

/// A file of these bytes that is deleted with this value.
pub struct Temporary(pub PathBuf);

impl Temporary {
    pub fn new(ending: &str, bytes: &[u8]) -> Self {
        static COUNT: AtomicUsize = AtomicUsize::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = std::env::temp_dir().join(format!("arrays-{}-{number}.{ending}", std::process::id()));
        std::fs::write(&path, bytes).unwrap();
        Self(path)
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        std::fs::remove_file(&self.0).ok();
    }
}

/// Files written by tests/make_npy.py and tests/make_mat.py.
pub fn written(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/data").join(name)
}

/// A real file, if the folder of real files is there.
pub fn real(name: &str) -> Option<PathBuf> {
    let folder = std::env::var_os("AFMID_DATA")
        .map_or_else(|| Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"), PathBuf::from)
        .join("loaders/mat");
    if !folder.is_dir() {
        println!("skipped: {} is missing", folder.display());
        return None;
    }
    Some(folder.join(name))
}

pub fn widened(raw: Raw) -> Vec<f64> {
    match raw {
        Raw::Int16(codes) => codes.into_iter().map(f64::from).collect(),
        Raw::Int32(codes) => codes.into_iter().map(f64::from).collect(),
        Raw::Float32(values) => values.into_iter().map(f64::from).collect(),
        Raw::Float64(values) => values,
    }
}

/// All samples, and the same again in two stretches.
pub fn samples(channel: &FoundChannel) -> Vec<f64> {
    let all = widened(channel.source.read(0, channel.samples).unwrap());
    let half = channel.samples / 2;
    let mut parts = widened(channel.source.read(0, half).unwrap());
    parts.extend(widened(channel.source.read(half, channel.samples - half).unwrap()));
    assert!(all.iter().zip(&parts).all(|(a, b)| a.to_bits() == b.to_bits()) && all.len() == parts.len());
    assert!(channel.source.read(half, channel.samples - half + 1).is_err());
    assert!(channel.source.read(usize::MAX, 2).is_err());
    all
}

pub fn channel<'a>(contents: &'a Contents, location: &str) -> &'a FoundChannel {
    let found = contents.channels.iter().find(|channel| channel.location == location);
    found.unwrap_or_else(|| panic!("{location} is not in {:?}", locations(contents)))
}

pub fn locations(contents: &Contents) -> Vec<&str> {
    contents.channels.iter().map(|channel| channel.location.as_str()).collect()
}

pub fn remarked(contents: &Contents, text: &str) -> bool {
    contents.remarks.iter().any(|remark| remark.contains(text))
}

/// Marsaglia's xorshift64.
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
