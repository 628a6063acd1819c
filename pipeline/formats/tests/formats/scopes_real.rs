//! Every real file of `scopes` and `loaders`: what an independent reader finds in it, or the reason why it is refused.

use crate::support::{real, scope, values};
use afmid_formats::{Contents, FormatError, FoundChannel, head_of, recognise};
use std::path::{Path, PathBuf};
use std::process::Command;

/// Files of `scopes` that no independent reader is asked for here: who reads them, or why nobody does.
const ELSEWHERE: [(&str, &str); 7] = [
    ("PROVENANCE.txt", "text"),
    ("das_valencia_febus.h5", "HDF5: read by afmid-pipeline"),
    ("jpk_sample_0.h5-jpk", "HDF5: read by afmid-pipeline"),
    ("objects.npz", "numpy_built.rs"),
    ("rs_rtp_01.bin", "the header of rs_rtp_01.Wfm.bin"),
    ("rs_rtp_01.Wfm.bin", "samples without a header"),
    ("utf8_units.uff", "uff.rs"),
];

fn open(path: &Path) -> Result<Contents, FormatError> {
    let known = recognise(&head_of(path)?, path);
    known.ok_or_else(|| FormatError::new("nobody knows the file", ""))?.open(path)
}

fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    found.sort();
    found
}

fn name(path: &Path) -> &str {
    path.file_name().and_then(|name| name.to_str()).unwrap()
}

/// The lines that tests/independent.py prints of files, as fields.
fn independent(files: &[PathBuf]) -> Vec<Vec<String>> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let python = root.join("../../.tools/bin/python");
    let output = Command::new(&python).arg(root.join("tests/independent.py")).args(files).output();
    let output = output.unwrap_or_else(|error| panic!("{}: {error}: run `make test-deps`", python.display()));
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let text = String::from_utf8(output.stdout).unwrap();
    text.lines().map(|line| line.split('\t').map(str::to_owned).collect()).collect()
}

/// Sums of floats in another order differ in the last bits: by at most as many as there are values.
fn close(found: f64, wanted: f64, magnitudes: f64, samples: usize) -> bool {
    (found - wanted).abs() <= samples as f64 * f64::EPSILON * magnitudes
}

#[test]
fn every_scope_file_is_read_as_an_independent_reader_does() {
    let Some(folder) = scope("") else { return };
    let read: Vec<PathBuf> =
        files(&folder).into_iter().filter(|path| ELSEWHERE.iter().all(|(other, _)| *other != name(path))).collect();
    let lines = independent(&read);
    let mut compared = 0;
    for path in &read {
        let wanted: Vec<&Vec<String>> = lines.iter().filter(|line| line[0].starts_with(name(path))).collect();
        if wanted[0][1] == "refused" {
            let error = open(path).unwrap_err();
            assert!(error.problem.contains("found the end of the file"), "{}: {error:?}", name(path));
            continue;
        }
        let contents = open(path).unwrap_or_else(|error| panic!("{}: {error}", name(path)));
        // calibrations of a force curve are channels of their own, with the same samples
        let base =
            |channel: &&FoundChannel| !name(path).starts_with("jpk") || !channel.long_name.contains("calibrated");
        let channels: Vec<&FoundChannel> = contents.channels.iter().filter(base).collect();
        assert_eq!(channels.len(), wanted.len(), "{}: {:?}", name(path), contents.remarks);
        for line in wanted {
            let location = line[0].strip_prefix(name(path)).unwrap();
            let number = lines.iter().filter(|other| other[0] == line[0]).position(|other| std::ptr::eq(other, line));
            let named = || channels.iter().find(|channel| channel.location == location);
            let channel = if location.is_empty() { channels[number.unwrap()] } else { named().unwrap() };
            let [_, unit, rate, samples, rest @ ..] = line.as_slice() else { panic!("{line:?}") };
            let [sum, magnitudes, weighted, first, last] =
                [0, 1, 2, 3, 4].map(|field: usize| rest[field].parse::<f64>().unwrap());
            let found = values(channel);
            let what = format!("{} {}", name(path), channel.location);
            assert_eq!((&channel.unit, channel.sample_rate_hz), (unit, rate.parse().ok()), "{what}");
            assert_eq!((found.len(), found[0]), (samples.parse().unwrap(), first), "{what}");
            assert_eq!(found.last(), Some(&last), "{what}");
            let count = found.len();
            assert!(close(found.iter().sum(), sum, magnitudes, count), "{what}");
            assert!(close(found.iter().map(|value| value.abs()).sum(), magnitudes, magnitudes, count), "{what}");
            let sum: f64 = found.iter().enumerate().map(|(number, value)| (number + 1) as f64 * value).sum();
            assert!(close(sum, weighted, magnitudes * count as f64, count), "{what}");
            compared += 1;
        }
    }
    println!("{compared} channels of {} files compared", read.len());
}

/// Files of `loaders` that hold no samples of a signal, and words of the reason: of the error, or of a remark where the
/// file is read and has nothing else. What the other files hold is compared by the tests of their formats.
const WITHOUT_SAMPLES: [(&str, &str); 11] = [
    ("PROVENANCE.txt", "nobody knows the file"),
    ("bruker_data_header.000", "found a header only"),
    ("corrupted_zlib_data.mat", "the compressed data give more bytes than their header says"),
    ("mac-version3Dependent.ibw", "were not saved, for the formula gives them"),
    ("mac-zeroPointWave.ibw", "has no points"),
    ("malformed1.mat", "behind what it is part of"),
    ("sample_dataset58_psd.uff", "are complex"),
    ("testcomplex_7.4_GLNX86.mat", "complex"),
    // afmid-pipeline reads it
    ("testhdf5_7.4_GLNX86.mat", "version 7.3, which is HDF5"),
    ("testsparse_7.4_GLNX86.mat", "sparse"),
    ("win-textWave.ibw", "is a text wave"),
];

#[test]
fn every_loader_file_is_read_or_refused_with_a_reason() {
    let Some(folder) = real("") else { return };
    let folders: Vec<PathBuf> = files(&folder).into_iter().filter(|path| path.is_dir()).collect();
    let inside = folders.iter().flat_map(|folder| files(folder));
    let all: Vec<PathBuf> = files(&folder).into_iter().filter(|path| path.is_file()).chain(inside).collect();
    for path in &all {
        let has_samples = |contents: &Contents| contents.channels.iter().any(|channel| channel.samples > 0);
        match (open(path), WITHOUT_SAMPLES.iter().find(|(other, _)| *other == name(path))) {
            (Ok(contents), None) => assert!(has_samples(&contents), "{}: {:?}", name(path), contents.remarks),
            (Ok(contents), Some((_, words))) => {
                let said = contents.remarks.iter().any(|remark| remark.contains(words));
                assert!(said && !has_samples(&contents), "{}: {:?}", name(path), contents.remarks);
            }
            (Err(error), Some((_, words))) => assert!(error.problem.contains(words), "{}: {error}", name(path)),
            (Err(error), None) => panic!("{}: {error}", name(path)),
        }
    }
}

/// The exports of a LabVIEW oscilloscope in `decays/rlc-pulse`, some with many records behind one another: a row of
/// samples begins with a moment, so with a digit, and nothing else does.
#[test]
fn no_header_is_among_the_samples_of_stamped_records() {
    let Some(folder) = real("../decays/rlc-pulse").filter(|folder| folder.is_dir()) else { return };
    let tables = files(&folder).into_iter().filter(|path| path.extension().is_some_and(|ending| ending == "csv"));
    let mut compared = 0;
    for path in tables {
        let text = std::fs::read_to_string(&path).unwrap();
        let rows: Vec<&str> = text.lines().filter(|line| line.starts_with(|c: char| c.is_ascii_digit())).collect();
        let contents = open(&path).unwrap();
        let records = text.lines().filter(|line| line.starts_with("waveform")).count();
        for (number, channel) in contents.channels.iter().enumerate() {
            let wanted: Vec<f64> =
                rows.iter().map(|row| row.split(',').nth(number + 1).unwrap().parse().unwrap()).collect();
            assert_eq!(values(channel), wanted, "{} {}", name(&path), channel.location);
            assert_eq!(channel.gaps.len(), records - 1, "{}", name(&path));
            let step: f64 = text.lines().nth(2).unwrap().split(',').nth(1).unwrap().parse().unwrap();
            // the rate has twelve digits
            assert!((channel.sample_rate_hz.unwrap() * step - 1.0).abs() < 1e-11, "{}", name(&path));
        }
        compared += 1;
    }
    println!("{compared} files of records compared");
}
