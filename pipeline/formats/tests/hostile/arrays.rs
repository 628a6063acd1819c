//! Whatever the bytes: no panic, no endless loop, little memory.

use crate::mat_builder::{Order, compressed, level4};
use crate::support::{Random, Temporary, few_or_all, peak_bytes, real, written};
use afmid_formats::RawBinary;
use afmid_formats::SampleType;
use afmid_formats::readers::matlab::Mat;
use afmid_formats::readers::numpy::{Npy, Npz};
use afmid_formats::{Contents, Format, FormatError};
use std::time::{Duration, Instant};

/// The slowest takes some ten milliseconds on an idle machine.
const LONGEST: Duration = Duration::from_secs(5);

fn read(found: Result<Contents, FormatError>) {
    let Ok(contents) = found else { return };
    for channel in contents.channels.iter().take(40) {
        // Compressed channels may be long, and damaged ones may say so.
        channel.source.read(0, channel.samples.min(1 << 20)).ok();
        channel.source.read(channel.samples / 2, channel.samples - channel.samples / 2).ok();
    }
}

fn try_all(ending: &str, bytes: &[u8]) {
    let file = Temporary::new(ending, bytes);
    let began = Instant::now();
    let head = bytes.get(..4096).unwrap_or(bytes);
    Mat::recognises(head, &file.0);
    Npy::recognises(head, &file.0);
    Npz::recognises(head, &file.0);
    match ending {
        "mat" => read(Mat::open(&file.0)),
        "npy" => read(Npy::open(&file.0)),
        "npz" => read(Npz::open(&file.0)),
        _ => read(RawBinary { sample: SampleType::F32, ..RawBinary::default() }.open(&file.0)),
    }
    assert!(began.elapsed() < LONGEST);
}

/// Truncated at up to 200 places, and 100 times (400 in `make accuracy`) with up to 8 bytes changed.
fn damage(ending: &str, bytes: &[u8], seed: u64) {
    let mut random = Random(seed);
    for number in 0..bytes.len().min(few_or_all(80, 200)) {
        let length = if bytes.len() <= few_or_all(80, 200) { number } else { random.below(bytes.len()) };
        try_all(ending, &bytes[..length]);
    }
    for _ in 0..few_or_all(100, 400) {
        let mut bytes = bytes.to_vec();
        // Headers are at the beginning, directories at the end: half of the changes are there.
        let reach = if random.below(2) == 0 { bytes.len() } else { bytes.len().min(400) };
        for _ in 0..=random.below(8) {
            let from_start = random.below(reach);
            let at = if random.below(4) == 0 { bytes.len() - 1 - from_start } else { from_start };
            let extreme = [0, 1, 255, 127, 128, 14, 15][random.below(7)];
            bytes[at] = if random.below(2) == 0 { random.next() as u8 } else { extreme };
        }
        try_all(ending, &bytes);
    }
}

#[test]
fn damaged_files_do_no_harm() {
    let mut seed = 88_172_645_463_325_252;
    let mut files = Vec::new();
    for entry in std::fs::read_dir(written(""))
        .unwrap()
        .chain(real("mat").into_iter().flat_map(|f| std::fs::read_dir(f).unwrap()))
    {
        files.push(entry.unwrap().path());
    }
    files.sort();
    for path in files {
        let ending = path.extension().unwrap().to_str().unwrap().to_owned();
        damage(&ending, &std::fs::read(&path).unwrap(), seed);
        seed = seed.rotate_left(9) ^ 0x9e37;
    }
    // 40 descriptions of 32 MiB at the most would be far more; other tests in this process take some ten megabytes.
    assert!(peak_bytes() < 400 << 20, "{} MiB", peak_bytes() >> 20);
}

#[test]
fn built_files_do_no_harm() {
    let big = Order(true);
    let array = big.array(0x0206, &[3, 4], "x", &big.element(3, &[1; 24]));
    damage("mat", &[big.header(), array].concat(), 4711);
    let little = Order(false);
    damage(
        "mat",
        &[level4(little, 30, [4, 2], 0, "a", &[1; 16]), level4(big, 51, [1, 2], 0, "u", b"nm")].concat(),
        4712,
    );
    damage("bin", &(0..2000).map(|n| (n % 251) as u8).collect::<Vec<u8>>(), 4713);
    // Damage within what is compressed, which a checksum would hide.
    let fields = [little.element(5, &4_u32.to_le_bytes()), little.element(1, b"a\0\0\0b\0\0\0")].concat();
    let parts = [
        little.array(9, &[4, 5], "", &little.element(2, &[5; 20])),
        little.array(4, &[1, 2], "", &little.element(4, b"n\0m\0")),
    ];
    let object = little.array(2, &[1, 1], "s", &[fields, parts.concat()].concat());
    let mut random = Random(4714);
    for _ in 0..few_or_all(500, 2000) {
        let mut inside = object.clone();
        for _ in 0..=random.below(4) {
            let at = random.below(inside.len());
            inside[at] = random.next() as u8;
        }
        try_all("mat", &[little.header(), compressed(&inside)].concat());
    }
}

#[test]
fn a_bomb_is_not_inflated_before_its_sizes_are_believed() {
    // 64 MiB of zeros in 64 kB, in a variable that says it has 8 numbers.
    let little = Order(false);
    let array = little.array(9, &[8, 1], "x", &little.element(2, &[1; 8]));
    let bomb = compressed(&[array, vec![0; 64 << 20]].concat());
    let before = peak_bytes();
    let file = Temporary::new("mat", &[little.header(), bomb].concat());
    assert!(Mat::open(&file.0).is_err());
    // The test itself has the 64 MiB; this only shows that they were not copied again.
    assert!(peak_bytes() < before.max(64 << 20) + (40 << 20));
}
