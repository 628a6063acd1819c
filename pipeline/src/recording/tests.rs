//! Native records: what is written is read, whatever the storage; damage is an error.

use std::path::{Path, PathBuf};

use super::*;
use crate::files::fixture::Folder;

fn deflection() -> Wanted<'static> {
    Wanted { role: "deflection", location: "/deflection", required: true }
}

fn piezo(required: bool) -> Wanted<'static> {
    Wanted { role: "piezo", location: "/piezo", required }
}

/// A code per sample that tells where it lies.
fn codes(samples: usize) -> Vec<i16> {
    (0..samples).map(|index| (index.wrapping_mul(7919) % 4096) as i16 - 2048).collect()
}

fn channel(location: &str, codes: Codes) -> NativeChannel {
    NativeChannel {
        location: location.to_owned(),
        codes,
        unit: "V".to_owned(),
        scale_factor: 0.000977,
        add_offset: 0.25,
        long_name: "photodiode signal".to_owned(),
    }
}

fn record(channels: Vec<NativeChannel>) -> NativeRecord {
    NativeRecord { sample_rate_hz: 5e6, started_at: "2005-03-01T10:00:00Z".to_owned(), channels }
}

#[test]
fn any_stretch_of_any_storage_is_what_was_written() {
    let folder = Folder::new("native");
    let samples = 150_000;
    let floats: Vec<f64> = codes(samples).iter().map(|&code| f64::from(code) * 1e-3).collect();
    let singles: Vec<f32> = floats.iter().map(|&value| value as f32).collect();
    let written = record(vec![
        channel("/deflection", Codes::Int16(codes(samples))),
        channel("single", Codes::Float32(singles.clone())),
        channel("double", Codes::Float64(floats.clone())),
    ]);
    for storage in [RecordStorage::Raw, RecordStorage::Deflate(4)] {
        let path = folder.file("record.h5");
        write_native(&path, &written, storage).unwrap();
        let other = |location| Wanted { role: location, location, required: true };
        let read =
            open_native(&InputFiles::new(), &path, &[deflection(), other("single"), other("double"), piezo(false)])
                .unwrap();
        assert_eq!((read.name.as_str(), read.sample_rate_hz), ("record.h5", 5e6));
        assert_eq!(read.started_at, "2005-03-01T10:00:00Z");
        assert_eq!(read.blake3, blake3::hash(&std::fs::read(&path).unwrap()).to_hex().to_string());
        assert!(read.channel("piezo").is_err(), "an optional channel that is missing");
        let deflection = read.channel("deflection").unwrap();
        assert_eq!((deflection.unit.as_str(), deflection.samples), ("V", samples));
        assert_eq!(deflection.source.preferred_samples(), 65_536);
        for (start, count) in [(0, 0), (0, 1), (65_530, 12), (3, 149_000), (149_999, 1), (samples, 0), (131_072, 100)] {
            let (all, end) = (codes(samples), start + count);
            assert_eq!(deflection.read_raw(start, count).unwrap(), Raw::Int16(all[start..end].to_vec()));
            let single = read.channel("single").unwrap().read_raw(start, count).unwrap();
            assert_eq!(single, Raw::Float32(singles[start..end].to_vec()));
            let double = read.channel("double").unwrap().read_raw(start, count).unwrap();
            assert_eq!(double, Raw::Float64(floats[start..end].to_vec()));
        }
        assert_eq!(deflection.read(10, 1).unwrap(), [f64::from(codes(11)[10]) * 0.000977 + 0.25]);
        let error = deflection.read_raw(149_999, 2).unwrap_err();
        assert!(error.to_string().contains("there are 150000"), "{error}");
        assert!(deflection.read_raw(usize::MAX, 2).is_err());
    }
}

#[test]
fn the_same_record_gives_the_same_bytes() {
    let folder = Folder::new("same");
    let written = record(vec![channel("deflection", Codes::Int16(codes(70_000)))]);
    let bytes = |name: &str| {
        write_native(&folder.file(name), &written, RecordStorage::Deflate(4)).unwrap();
        std::fs::read(folder.file(name)).unwrap()
    };
    assert!(bytes("a.h5") == bytes("b.h5"));
}

#[test]
fn a_clashing_or_impossible_channel_name_is_an_error() {
    let folder = Folder::new("names");
    for names in [vec!["a", "a"], vec![""], vec!["a/b"], vec!["."]] {
        let channels = names.iter().map(|name| channel(name, Codes::Int16(vec![1]))).collect();
        let path = folder.file("x.h5");
        let error = write_native(&path, &record(channels), RecordStorage::Raw).unwrap_err();
        assert_eq!(error.file, path, "{error}");
        assert!(!path.exists());
    }
}

#[test]
fn errors_say_what_was_found_and_what_is_wanted() {
    let folder = Folder::new("errors");
    let path = folder.file("record.h5");
    let says = |path: &Path, wanted: &[Wanted], words: &[&str]| {
        let error = open_native(&InputFiles::new(), path, wanted).unwrap_err();
        let text = format!("{error} {}", error.help.clone().unwrap_or_default());
        for word in words {
            assert!(text.contains(word), "{word:?} in {text:?}");
        }
        assert!(error.place.is_some(), "{text}");
    };
    says(&path, &[deflection()], &["cannot be read", "No such file"]);
    std::fs::write(&path, b"").unwrap();
    says(&path, &[deflection()], &["empty"]);
    std::fs::write(&path, vec![7; 4096]).unwrap();
    says(&path, &[deflection()], &["not a readable HDF5 file"]);
    std::fs::remove_file(&path).unwrap();
    write_native(&path, &record(vec![channel("laser", Codes::Int16(codes(9)))]), RecordStorage::Raw).unwrap();
    says(&path, &[deflection()], &["no channel `/deflection`", "/laser", "channel"]);
    says(&path, &[Wanted { role: "x", location: "/", required: true }], &["`/` is a group"]);

    let foreign = |make: &dyn Fn(&hdf5::File) -> hdf5::Result<()>| {
        let _ = std::fs::remove_file(&path);
        let file = hdf5::File::create(&path).unwrap();
        make(&file).unwrap();
    };
    foreign(&|_| Ok(()));
    says(&path, &[], &["sample_rate_hz", "missing", "attrs"]);
    foreign(&|file| file.new_attr::<i32>().shape([2]).create("sample_rate_hz")?.write_raw(&[1, 2]));
    says(&path, &[], &["sample_rate_hz", "not a single number"]);
    foreign(&|file| file.new_attr::<i32>().create("sample_rate_hz")?.write_scalar(&-5));
    says(&path, &[], &["sample_rate_hz is -5"]);
    let rate = |file: &hdf5::File| file.new_attr::<u32>().create("sample_rate_hz")?.write_scalar(&5);
    foreign(&|file| {
        rate(file)?;
        file.new_dataset::<i16>().create("deflection")?.write_scalar(&3_i16)
    });
    says(&path, &[deflection()], &["single value", "one dimension"]);
    foreign(&|file| {
        rate(file)?;
        file.new_dataset::<i16>().shape([3, 2]).create("deflection").map(|_| ())
    });
    says(&path, &[deflection()], &["[3, 2]", "one dimension"]);
    foreign(&|file| {
        rate(file)?;
        file.new_dataset::<u64>().shape([3]).create("deflection").map(|_| ())
    });
    says(&path, &[deflection()], &["uint64", "wanted int8 to int32"]);
    foreign(&|file| {
        rate(file)?;
        file.new_dataset_builder().with_data(&[1_i16, 2]).create("deflection").map(|_| ())
    });
    says(&path, &[deflection()], &["`units` is missing"]);
}

#[test]
fn a_file_that_changes_under_the_reader_is_an_error() {
    let folder = Folder::new("changes");
    let path = folder.file("record.h5");
    write_native(&path, &record(vec![channel("deflection", Codes::Int16(codes(90_000)))]), RecordStorage::Raw).unwrap();
    let read = open_native(&InputFiles::new(), &path, &[deflection()]).unwrap();
    let bytes = std::fs::read(&path).unwrap();
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let error = read.channel("deflection").unwrap().read_raw(80_000, 10).unwrap_err();
    assert!(error.to_string().contains("it had"), "{error}");
    std::fs::remove_file(&path).unwrap();
    assert!(read.channel("deflection").unwrap().read_raw(0, 10).is_err());
}

/// Reads everything that can be read of a file.
fn read_all(path: &Path) {
    let Ok(record) = open_native(&InputFiles::new(), path, &[deflection(), piezo(false)]) else { return };
    for channel in &record.channels {
        let step = channel.source.preferred_samples();
        for start in (0..channel.samples.min(400_000)).step_by(step) {
            let _ = channel.read(start, step.min(channel.samples - start));
        }
    }
}

#[test]
fn damaged_files_are_errors_never_panics() {
    let folder = Folder::new("fuzz");
    let (whole_path, path) = (folder.file("whole.h5"), folder.file("damaged.h5"));
    let written = record(vec![
        channel("deflection", Codes::Int16(codes(70_000))),
        channel("piezo", Codes::Float32(vec![1.0; 500])),
    ]);
    write_native(&whole_path, &written, RecordStorage::Deflate(1)).unwrap();
    let mut wholes = vec![std::fs::read(&whole_path).unwrap()];
    // the oldest format, without checksums, as h5py writes it
    let old = folder.file("old.h5");
    {
        let file = hdf5::File::create(&old).unwrap();
        file.new_attr::<f64>().create("sample_rate_hz").unwrap().write_scalar(&5e6).unwrap();
        for name in ["deflection", "piezo"] {
            let codes = codes(5000);
            let builder = file.new_dataset_builder().with_data(&codes).chunk(2048).shuffle().deflate(4);
            let dataset = builder.create(name).unwrap();
            let unit: hdf5::types::VarLenUnicode = "V".parse().unwrap();
            dataset.new_attr::<hdf5::types::VarLenUnicode>().create("units").unwrap().write_scalar(&unit).unwrap();
        }
    }
    wholes.push(std::fs::read(&old).unwrap());
    let mut state = 1_u64;
    let mut random = |below: usize| {
        // a linear congruential generator is random enough to place damage
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    for whole in &wholes {
        for _ in 0..200 {
            let mut bytes = whole.clone();
            match random(3) {
                0 => bytes.truncate(random(whole.len())),
                1 => bytes[random(whole.len())] ^= 1 << random(8),
                // headers lie at the front
                _ => (0..=random(4)).for_each(|_| bytes[random(whole.len().min(4096))] = random(256) as u8),
            }
            std::fs::write(&path, &bytes).unwrap();
            read_all(&path);
        }
    }
}

#[test]
fn measured_archives_open() {
    let archive = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data/afm/lever-a/record_0000.h5");
    if !archive.exists() {
        let folder = Folder::new("stand-in");
        let path = folder.file("record.h5");
        let written = record(vec![channel("deflection", Codes::Int16(codes(900_000)))]);
        write_native(&path, &written, RecordStorage::Deflate(4)).unwrap();
        assert_eq!(open_native(&InputFiles::new(), &path, &[deflection()]).unwrap().channels[0].samples, 900_000);
        println!("stand-in: 1 record in place of shared/data/afm/lever-a");
        return;
    }
    let record = open_native(&InputFiles::new(), &archive, &[deflection(), piezo(true)]).unwrap();
    assert_eq!(record.sample_rate_hz, 5e6);
    for channel in &record.channels {
        assert_eq!((channel.samples, channel.unit.as_str()), (900_000, "V"));
        let values = channel.read(0, channel.samples).unwrap();
        let short: Vec<f64> =
            (0..channel.samples).step_by(1000).flat_map(|start| channel.read(start, 1000).unwrap()).collect();
        assert_eq!(values, short, "{}", channel.location);
    }
}
