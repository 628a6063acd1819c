//! Records that other programs wrote: every storage that h5py offers.

use std::path::PathBuf;
use std::process::Command;

use super::*;
use crate::files::fixture::Folder;

fn expected(name: &str, sample: usize) -> f64 {
    if name == "partly-written" && sample >= 5000 {
        return -7.0 * 0.5;
    }
    ((sample * 7919) % 4096) as f64 * 0.5 - 1024.0
}

#[test]
fn every_storage_of_other_programs_is_read_or_refused_clearly() {
    let folder = Folder::new("foreign");
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let python = root.join(".tools/bin/python");
    assert!(python.exists(), "h5py is missing: run `make test-deps`");
    let output = Command::new(python).arg(root.join("tests/foreign_records.py")).arg(&folder.0).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let mut files = 0;
    for entry in std::fs::read_dir(&folder.0).unwrap() {
        let path = entry.unwrap().path();
        let name = path.file_stem().unwrap().to_string_lossy().into_owned();
        let wanted = [Wanted { role: "deflection", location: "deflection", required: true }];
        let read = open_native(&InputFiles::new(), &path, &wanted).and_then(|record| {
            assert_eq!((record.sample_rate_hz, record.started_at.as_str()), (5e6, "2005-03-01T10:00:00Z"), "{name}");
            let channel = &record.channels[0];
            assert_eq!((channel.unit.as_str(), channel.samples), ("V", 70_000), "{name}");
            assert_eq!(channel.fill_code, (name == "byte-attributes").then_some(-2048.0), "{name}");
            for (start, count) in [(4000, 300), (0, 70_000), (69_999, 1), (65_000, 5000)] {
                let values = channel.read(start, count)?;
                assert_eq!(values.len(), count);
                let wrong = values.iter().zip(start..).find(|(value, sample)| **value != expected(&name, *sample));
                assert!(wrong.is_none(), "{name}: {wrong:?}");
            }
            Ok(())
        });
        assert_eq!(read.is_err(), name.starts_with("unreadable"), "{name}: {read:?}");
        if let Err(error) = read {
            assert!(error.place.is_some() && error.to_string().contains("deflection"), "{error}");
            assert!(error.help.is_some(), "{error}");
        }
        files += 1;
    }
    assert_eq!(files, 25);
}
