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

/// Location, rate and unit of each channel of a file; a star marks axes.
fn described(path: &std::path::Path) -> (Vec<String>, Contents) {
    let (_, contents) = open_contents(&InputFiles::new(), path, &Reading::of("hdf5", None)).unwrap();
    let describe = |channel: &FoundChannel| {
        let rate = channel.sample_rate_hz.map_or("-".to_owned(), |rate| rate.to_string());
        let star = if channel.is_axis { "*" } else { "" };
        format!("{}{star} {rate} {}", channel.location, channel.unit).trim_end().to_owned()
    };
    (contents.channels.iter().map(describe).collect(), contents)
}

#[test]
fn tables_and_times_of_pandas_pytables_and_others_are_columns_and_rates() {
    let folder = Folder::new("tables");
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let python = root.join(".tools/bin/python");
    assert!(python.exists(), "h5py is missing: run `make test-deps`");
    let output = Command::new(python).arg(root.join("tests/foreign_tables.py")).arg(&folder.0).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let both = (0..40).map(|column| format!("/signals/both[{column}] 1000"));
    let arrays = ["/codes 1000".to_owned()].into_iter().chain(both);
    let arrays: Vec<String> = arrays.chain(["/signals/longer -".to_owned(), "/signals/y 1000".to_owned()]).collect();
    let owned = |texts: &[&str]| texts.iter().map(|text| (*text).to_owned()).collect::<Vec<String>>();
    let cases = [
        ("fixed", owned(&["/df/y 1000", "/df/z 1000"]), "/df/y"),
        ("fixed-moments", owned(&["/df/y 1000", "/df/z 1000"]), "/df/y"),
        ("fixed-column", owned(&["/df/axis1* -", "/df/y 1000", "/df/z 1000"]), "/df/y"),
        ("series", owned(&["/df/values 1000"]), "/df/values"),
        ("table", owned(&["/df/table.y 1000", "/df/table.z 1000"]), "/df/table.y"),
        ("table-moments", owned(&["/df/table.y 1000", "/df/table.z 1000"]), "/df/table.y"),
        ("table-columns", owned(&["/df/table.y 1000", "/df/table.z 1000"]), "/df/table.y"),
        ("pytables", owned(&["/run/records.y 1000", "/run/records.code 1000"]), "/run/records.y"),
        ("arrays", arrays, "/signals/y"),
        ("scale", owned(&["/y 1000"]), "/y"),
        ("jpk", owned(&["/Channel_000/y - V"]), "/Channel_000/y"),
    ];
    for (name, wanted, y) in cases {
        let path = folder.file(&format!("{name}.h5"));
        let (found, contents) = described(&path);
        assert_eq!(found, wanted, "{name}: {:?}", contents.remarks);
        let channel = contents.channels.iter().find(|channel| channel.location == y).unwrap();
        let mut values = Vec::new();
        let raw = channel.source.read(0, channel.samples).unwrap();
        raw.scale_into(channel.scale_factor, channel.add_offset, &mut values);
        assert_eq!(values.len(), 500, "{name}");
        // codes of 1e-9, and the rounding of exp and cos in another library
        let tolerance = if name == "jpk" { 1e-9 } else { 1e-14 };
        for (sample, value) in values.iter().enumerate() {
            let t = sample as f64 * 1e-3;
            let truth = (-8.0 * t).exp() * (2.0 * std::f64::consts::PI * 50.0 * t).cos();
            assert!((value - truth).abs() <= tolerance, "{name}: {value} instead of {truth} at {sample}");
        }
        assert_eq!(channel.source.read(499, 1).unwrap().widened().len(), 1);
        assert!(channel.source.read(500, 1).is_err());
    }
    let (found, contents) = described(&folder.file("half.h5"));
    let columns = (0..40).map(|column| format!("/columns[{column}] 1000"));
    let others = ["/little 1000", "/records.y 1000", "/records.z 1000", "/rows[0] 1000", "/rows[1] 1000"];
    let wanted = ["/big 1000", "/big_deflated 1000"].into_iter().map(str::to_owned).chain(columns);
    let wanted: Vec<String> = wanted.chain(owned(&others)).collect();
    assert_eq!(found, wanted, "{:?}", contents.remarks);
    let odd = |remark: &String| remark.starts_with("/brain is left out") && remark.contains("IEEE 754");
    assert!(contents.remarks.iter().any(odd), "{:?}", contents.remarks);
    for channel in &contents.channels {
        assert_eq!(channel.stored_as, "float16");
        let sign = if channel.location == "/rows[1]" { -1.0 } else { 1.0 };
        let values = channel.source.read(0, 500).unwrap().widened();
        assert_eq!(values[3..300], channel.source.read(3, 297).unwrap().widened());
        for (sample, value) in values.iter().enumerate() {
            let t = sample as f64 * 1e-3;
            let truth = if channel.location == "/records.z" {
                0.0
            } else {
                sign * (-8.0 * t).exp() * (2.0 * std::f64::consts::PI * 50.0 * t).cos()
            };
            // half a unit of the 11th digit, or of the smallest number
            let tolerance = (truth.abs() / 2048.0).max(0.5_f64.powi(25));
            assert!((value - truth).abs() <= tolerance, "{}: {value}, not {truth}", channel.location);
        }
    }
    let (found, contents) = described(&folder.file("struct.mat"));
    assert_eq!(found, ["/Test/acc[1] 1000 m/s^2", "/Test/acc[2] 1000 m/s^2"], "{:?}", contents.remarks);
    let names: Vec<&str> = contents.channels.iter().map(|channel| channel.long_name.as_str()).collect();
    assert_eq!(names, ["left", "right"], "{:?}", contents.remarks);
    let (_, contents) = described(&folder.file("arrays.h5"));
    let said = |words: &str| contents.remarks.iter().any(|remark| remark.contains(words));
    assert!(said("/codes holds whole numbers in «V» without a scale"), "{:?}", contents.remarks);
}
