//! Files of foreign formats as records: what is missing, what differs, gaps, HDF5 of any layout, and reopening.

use std::path::{Path, PathBuf};

use afmid_formats::SampleType;

use super::how::HDF5;
use super::*;
use crate::files::fixture::Folder;

fn wanted(location: &str) -> [Wanted<'_>; 2] {
    [
        Wanted { role: "deflection", location, required: true },
        Wanted { role: "piezo", location: "/piezo", required: false },
    ]
}

fn auto() -> How {
    How { reading: Reading::of("auto", None), ..How::default() }
}

fn written(folder: &Folder, name: &str, bytes: &[u8]) -> PathBuf {
    let path = folder.file(name);
    std::fs::write(&path, bytes).unwrap();
    path
}

fn refused(path: &Path, location: &str, how: &How) -> String {
    let error = open_records(&InputFiles::new(), path, &wanted(location), how).unwrap_err();
    assert_eq!(error.place.as_deref(), Some(path), "{error}");
    format!("{error} {}", error.help.clone().unwrap_or_default())
}

#[test]
fn missing_metadata_is_asked_for_by_name_and_a_given_rate_overrules_the_stated_one() {
    let folder = Folder::new("metadata");
    let bare = written(&folder, "bare.csv", b"deflection,piezo\n1.5,7\n-2,8\n3,9\n");
    assert!(refused(&bare, "deflection", &auto()).contains("sample_rate_hz = "));
    let rated = How { sample_rate_hz: Some(5e6), ..auto() };
    assert!(refused(&bare, "deflection", &rated).contains("unit = "));
    let how = How { unit: Some("V".to_owned()), ..rated };
    let opened = open_records(&InputFiles::new(), &bare, &wanted("/deflection"), &how).unwrap();
    let record = &opened.records[0];
    assert_eq!((opened.format, record.sample_rate_hz, record.name.as_str()), ("text", 5e6, "bare.csv"));
    assert_eq!(record.channel("deflection").unwrap().read(1, 2).unwrap(), [-2.0, 3.0]);
    // the unit is the deflection's
    assert_eq!((record.channels[0].unit.as_str(), record.channels[1].unit.as_str()), ("V", ""));
    assert!(refused(&bare, "height", &how).contains("the file has: deflection, piezo"));

    let stated = written(&folder, "stated.csv", b"Time (s),deflection (V)\n0.0,1.5\n0.1,-2\n0.2,3\n");
    let same = How { sample_rate_hz: Some(10.0), unit: Some("V".to_owned()), ..auto() };
    assert_eq!(
        open_records(&InputFiles::new(), &stated, &wanted("deflection"), &same).unwrap().records[0].sample_rate_hz,
        10.0
    );
    let other = How { sample_rate_hz: Some(11.0), ..auto() };
    let opened =
        open_records(&InputFiles::new(), &stated, &wanted("deflection"), &How { unit: None, ..other }).unwrap();
    assert_eq!(opened.records[0].sample_rate_hz, 11.0);
    assert!(
        opened.remarks.iter().any(|remark| remark.contains("holds, though the file states 10")),
        "{:?}",
        opened.remarks
    );
    let other = How { unit: Some("mV".to_owned()), ..auto() };
    assert!(refused(&stated, "deflection", &other).contains("given as mV"));
}

#[test]
fn an_interrupted_recording_is_one_record_per_stretch() {
    let folder = Folder::new("gaps");
    let section = |time: &str, values: &str| {
        format!(
            "Channels\t1\t\nSamples\t2\t\nDate\t2020/01/01\t\nTime\t{time}\t\nY_Unit_Label\tV\t\nDelta_X\t0.5\t\n\
             X0\t0\t\n\
             ***End_of_Header***\t\t\nX_Value\tdeflection\tComment\n{values}\n"
        )
    };
    let head = "LabVIEW Measurement\t\nWriter_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nMulti_Headings\tYes\n\
        X_Columns\tNo\n\
                ***End_of_Header***\t\n\n";
    let text = [
        head.to_owned(),
        section("00:00:00.0", "\t1\n\t2\n"),
        section("00:00:01.0", "\t3\n\t4\n"),
        section("00:01:00.0", "\t5\n\t6\n\t7\n"),
    ]
    .concat();
    let path = written(&folder, "r.lvm", text.as_bytes());
    let opened = open_records(&InputFiles::new(), &path, &wanted("deflection"), &auto()).unwrap();
    let found: Vec<(&str, usize, usize)> = opened
        .records
        .iter()
        .map(|record| (record.name.as_str(), record.first_sample, record.channels[0].samples))
        .collect();
    assert_eq!(found, [("r.lvm[1]", 0, 4), ("r.lvm[2]", 4, 3)], "{:?}", opened.remarks);
    let [first, second] = &opened.records[..] else { panic!("two records") };
    assert_eq!(first.channels[0].read(0, 4).unwrap(), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(second.channels[0].read(1, 2).unwrap(), [6.0, 7.0]);
    assert!(second.channels[0].read(1, 3).is_err(), "beyond the stretch");
    assert!(!first.started_at.is_empty() && second.started_at.is_empty());
    assert!(opened.remarks[0].contains("2 uninterrupted stretches"), "{:?}", opened.remarks);

    // as a stored recording is reopened
    let again = LazySource::new(&InputFiles::new(), &path, (second.size, &second.blake3), "deflection", 3)
        .of_stretch(4, &second.reading);
    assert_eq!(again.read(0, 3).unwrap().widened(), [5.0, 6.0, 7.0]);
    std::fs::write(&path, "other").unwrap();
    let error = StageError::from(again.read(0, 3).unwrap_err());
    assert!(error.to_string().contains("it had") && error.place.is_some(), "{error}");
}

#[test]
fn files_without_a_header_are_what_the_user_says() {
    let folder = Folder::new("raw");
    let bytes: Vec<u8> = (0..40_i16).flat_map(i16::to_be_bytes).collect();
    let path = written(&folder, "r.bin", &bytes);
    let raw =
        RawBinary { sample: SampleType::I16, big_endian: true, channels: 2, scale_factor: 0.5, ..RawBinary::default() };
    let how = How { reading: Reading::of("auto", Some(raw)), sample_rate_hz: Some(1e6), unit: Some("V".to_owned()) };
    let record = open_records(&InputFiles::new(), &path, &wanted("/channel[1]"), &how).unwrap().records.remove(0);
    assert_eq!(record.channels[0].read(2, 3).unwrap(), [2.5, 3.5, 4.5]);
    assert_eq!(record.reading.format, "raw");
    let json = serde_json::to_string(&record.reading).unwrap();
    assert_eq!(serde_json::from_str::<Reading>(&json).unwrap(), record.reading);
    assert!(Reading::of("raw", None).check().is_err() && Reading::of("tdsm", None).check().is_err());
    assert!(Reading::of("npy", record.reading.raw).check().is_err());
    assert!(refused(&path, "x", &auto()).contains("raw"), "nobody recognises it");
}

/// An HDF5 file of another layout than the native one.
fn foreign(path: &Path) {
    let file = hdf5::File::create(path).unwrap();
    let inner = file.create_group("Measurement_000").unwrap().create_group("Channel_000").unwrap();
    inner.new_attr::<f64>().create("sampling_rate").unwrap().write_scalar(&4e6).unwrap();
    let text = |owner: &hdf5::Location, name: &str, value: &str| {
        let value: hdf5::types::VarLenUnicode = value.parse().unwrap();
        owner.new_attr::<hdf5::types::VarLenUnicode>().create(name).unwrap().write_scalar(&value).unwrap();
    };
    let rows = ndarray::Array2::from_shape_fn((3, 2000), |(row, column)| (1000 * row + column % 700) as f32);
    let data = inner.new_dataset_builder().with_data(&rows).chunk((2, 512)).deflate(3).create("Raw_Data").unwrap();
    text(&data, "units", "V");
    text(&data, "quantity", "Deflection");
    let columns = ndarray::Array2::from_shape_fn((900, 2), |(row, column)| (row * 10 + column) as i16);
    let pair = file.new_dataset_builder().with_data(&columns).create("pair").unwrap();
    pair.new_attr::<f64>().create("dt").unwrap().write_scalar(&1e-6).unwrap();
    pair.new_attr::<f64>().create("scale_factor").unwrap().write_scalar(&0.5).unwrap();
    file.new_dataset_builder().with_data(&[1_i64, -5, 1 << 40]).create("long").unwrap();
    file.new_dataset_builder().with_data(&ndarray::Array3::<u8>::zeros((2, 2, 2))).create("cube").unwrap();
    file.new_dataset::<f64>().create("fs").unwrap().write_scalar(&7e5).unwrap();
}

#[test]
fn hdf5_of_any_layout_gives_rows_or_columns_with_units_and_rates() {
    let folder = Folder::new("layout");
    let path = folder.file("gmode.h5");
    foreign(&path);
    let (format, contents) = open_contents(&InputFiles::new(), &path, &Reading::of("auto", None)).unwrap();
    let found: Vec<(&str, usize, Option<f64>, &str)> = contents
        .channels
        .iter()
        .map(|c| (c.location.as_str(), c.samples, c.sample_rate_hz.map(f64::round), c.unit.as_str()))
        .collect();
    let raw = "/Measurement_000/Channel_000/Raw_Data";
    let rows: Vec<String> = (0..3).map(|row| format!("{raw}[{row}]")).collect();
    assert_eq!(
        found,
        [
            (rows[0].as_str(), 2000, Some(4e6), "V"),
            (&rows[1], 2000, Some(4e6), "V"),
            (&rows[2], 2000, Some(4e6), "V"),
            ("/long", 3, Some(7e5), ""),
            ("/pair[0]", 900, Some(1e6), ""),
            ("/pair[1]", 900, Some(1e6), ""),
        ],
        "{:?}",
        contents.remarks
    );
    assert_eq!((format, contents.channels[0].long_name.as_str()), (HDF5, "Deflection"));
    assert!(contents.remarks.iter().any(|remark| remark.contains("/cube is left out")), "{:?}", contents.remarks);
    let record = open_records(&InputFiles::new(), &path, &wanted(&rows[2]), &auto()).unwrap().records.remove(0);
    assert_eq!(record.channels[0].read(699, 3).unwrap(), [2699.0, 2000.0, 2001.0]);
    assert_eq!(record.channels[0].read(0, 2000).unwrap().len(), 2000);
    let volts = How { unit: Some("V".to_owned()), ..auto() };
    let record = open_records(&InputFiles::new(), &path, &wanted("pair[1]"), &volts).unwrap().records.remove(0);
    assert_eq!(record.channels[0].read(898, 2).unwrap(), [4490.5, 4495.5]);
    let record = open_records(&InputFiles::new(), &path, &wanted("/long"), &volts).unwrap().records.remove(0);
    assert_eq!(record.channels[0].read(1, 2).unwrap(), [-5.0, (1_u64 << 40) as f64]);
}

#[test]
fn damaged_hdf5_of_other_layouts_is_an_error_never_a_panic() {
    let folder = Folder::new("damaged-layout");
    let path = folder.file("gmode.h5");
    foreign(&path);
    let whole = std::fs::read(&path).unwrap();
    let mut state = 7_u64;
    let mut random = |below: usize| {
        // a linear congruential generator is random enough to place damage
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize % below
    };
    for round in 0..300 {
        let mut bytes = whole.clone();
        match round % 3 {
            0 => bytes.truncate(random(whole.len())),
            1 => bytes[random(whole.len())] ^= 1 << random(8),
            _ => (0..=random(4)).for_each(|_| bytes[random(whole.len().min(4096))] = random(256) as u8),
        }
        std::fs::write(&path, &bytes).unwrap();
        let Ok((_, contents)) = open_contents(&InputFiles::new(), &path, &Reading::of("auto", None)) else { continue };
        for channel in contents.channels.iter().take(20) {
            let _ = channel.source.read(0, channel.samples.min(1 << 16));
            let _ = channel.source.read(channel.samples / 2, 1);
        }
    }
}
