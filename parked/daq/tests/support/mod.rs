//! Files for tests: built ones in a folder of the test's own, real ones where `AFMID_DATA` says.

#![allow(dead_code)] // each test binary uses a part

use common::{Contents, Format, FormatError, FoundChannel, Raw};
use std::path::PathBuf;

/// A real file; none (and a line that says so) if the data are not there.
pub fn real(name: &str) -> Option<PathBuf> {
    let data = std::env::var_os("AFMID_DATA").map(PathBuf::from);
    let data = data.unwrap_or_else(|| PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"));
    let path = data.join("loaders").join(name);
    if !path.exists() {
        println!("skipped: {} is not there", path.display());
        return None;
    }
    Some(path)
}

/// Writes a file for a test. `DAQ_KEEP` names a folder to keep them in, to look at them with other readers.
pub fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let kept = std::env::var_os("DAQ_KEEP").map(PathBuf::from);
    let folder = kept.unwrap_or_else(|| std::env::temp_dir().join(format!("daq-tests-{}", std::process::id())));
    std::fs::create_dir_all(&folder).unwrap();
    let path = folder.join(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

/// Opens bytes as a file.
pub fn open<F: Format>(name: &str, bytes: &[u8]) -> Result<Contents, FormatError> {
    let path = file(name, bytes);
    F::open(&path)
}

pub fn numbers(raw: Raw) -> Vec<f64> {
    match raw {
        Raw::Int16(v) => v.into_iter().map(f64::from).collect(),
        Raw::Int32(v) => v.into_iter().map(f64::from).collect(),
        Raw::Float32(v) => v.into_iter().map(f64::from).collect(),
        Raw::Float64(v) => v,
    }
}

/// All values of a channel, scaled; read at once, and again in stretches of odd lengths, which must agree.
pub fn values(channel: &FoundChannel) -> Vec<f64> {
    let all = numbers(channel.source.read(0, channel.samples).unwrap());
    let (mut pieces, mut length) = (Vec::new(), 1);
    while pieces.len() < all.len() {
        let count = length.min(all.len() - pieces.len());
        pieces.extend(numbers(channel.source.read(pieces.len(), count).unwrap()));
        length = length * 2 + 1;
    }
    assert!(pieces.iter().zip(&all).all(|(a, b)| a.to_bits() == b.to_bits()), "stretches differ from the whole");
    assert!(channel.source.read(channel.samples, 1).is_err(), "reads beyond its end");
    assert!(channel.source.read(usize::MAX, 2).is_err(), "start + count overflows");
    all.into_iter().map(|v| v * channel.scale_factor + channel.add_offset).collect()
}

pub fn channel<'a>(contents: &'a Contents, location: &str) -> &'a FoundChannel {
    let found = contents.channels.iter().find(|c| c.location == location);
    found.unwrap_or_else(|| panic!("no {location} among {:?}", locations(contents)))
}

pub fn locations(contents: &Contents) -> Vec<&str> {
    contents.channels.iter().map(|c| c.location.as_str()).collect()
}

/// Whether a remark contains the words.
pub fn remarks(contents: &Contents, words: &str) -> bool {
    contents.remarks.iter().any(|r| r.contains(words))
}

/// The sum against the reference's. Summing in another order rounds otherwise: by at most n eps of the sum of magnitudes.
pub fn assert_sum(values: &[f64], expected: f64) {
    let magnitudes: f64 = values.iter().map(|v| v.abs()).sum();
    let tolerance = values.len() as f64 * f64::EPSILON * magnitudes;
    let sum: f64 = values.iter().sum();
    assert!((sum - expected).abs() <= tolerance, "{sum} instead of {expected}");
}
