//! Classic netCDF: files of SciPy and of Unidata's library, and built ones for what these do not write.

use crate::netcdf_builder::{Built, Type, Var};
use crate::support::{channel, codes, locations, open, remarked, values, written};
use afmid_formats::readers::netcdf::NetCdf;
use afmid_formats::{Contents, Format};
use std::path::Path;

fn opened(name: &str) -> Contents {
    NetCdf::open(&written(name)).unwrap()
}

fn number(times: f64, plus: f64) -> Vec<f64> {
    (0..40).map(|n| f64::from(n) * times + plus).collect()
}

#[test]
fn records_of_several_variables_are_kept_apart() {
    let contents = opened("records.netcdf");
    assert_eq!(contents.format, "netCDF classic, CDF-2 (offsets of 64 bits)");
    assert_eq!(locations(&contents), ["/volts", "/small", "/both[0]", "/both[1]"], "{:?}", contents.remarks);
    let volts = channel(&contents, "/volts");
    assert_eq!((volts.unit.as_str(), volts.long_name.as_str()), ("V", "the voltage"));
    assert_eq!((volts.stored_as, volts.fill_code), ("int16", Some(-99.0)));
    assert_eq!(values(volts), number(1.5, -29.0));
    assert_eq!(values(channel(&contents, "/small")), number(1.0, -20.0));
    assert_eq!(values(channel(&contents, "/both[0]")), number(0.125, 0.0));
    assert_eq!(values(channel(&contents, "/both[1]")), number(-1.0, 0.0));
    for found in &contents.channels {
        // time runs by 0.25 ms
        assert_eq!(found.sample_rate_hz, Some(4000.0), "{}", found.location);
    }
    assert!(remarked(&contents, "/both: its 2 channels run along its dimension time"));
}

#[test]
fn rows_of_a_wide_array_are_channels_and_a_number_is_the_rate() {
    let contents = opened("fixed.netcdf");
    assert_eq!(locations(&contents), ["/rows[0]", "/rows[1]", "/rows[2]"], "{:?}", contents.remarks);
    let wanted: Vec<f64> = (0..60).map(|n| f64::from(n) * 100.0).collect();
    assert_eq!(values(channel(&contents, "/rows[1]")), wanted);
    assert!(contents.channels.iter().all(|channel| channel.sample_rate_hz == Some(1000.0)));
    assert!(remarked(&contents, "/dt is the single number 0.001 s") && remarked(&contents, "/name holds characters"));
    let single = opened("single.netcdf");
    assert_eq!(values(channel(&single, "/y")), number(5.0, 0.0));
    assert_eq!(single.channels[0].sample_rate_hz, Some(2000.0), "{:?}", single.remarks);
}

#[test]
fn all_types_of_cdf_5_are_read_and_other_dimensions_of_the_same_length_get_no_rate() {
    let contents = opened("wide.netcdf");
    for (name, top) in [("i", -3.0), ("u", 3.0), ("f", 0.5)] {
        for bytes in [1, 2, 4, 8] {
            let location = format!("/{name}{bytes}");
            let Some(found) = contents.channels.iter().find(|channel| channel.location == location) else {
                assert!(name == "f" && bytes < 4, "{location} is missing");
                continue;
            };
            assert_eq!(values(found), number(top, 0.0), "{location}");
            assert_eq!(found.sample_rate_hz, Some(1000.0), "{location}");
        }
    }
    let beside = channel(&contents, "/beside");
    assert_eq!((values(beside), beside.sample_rate_hz), (number(0.25, 0.0), None));
    assert!(remarked(&contents, "/u8: 64-bit integers beyond 2^53 are rounded"));
}

/// Three records of a short and of three bytes.
fn built(version: u8) -> Built {
    let mut file = Built::of(version);
    file.records = Some(3);
    file.dimensions = vec![("n", 0), ("three", 3)];
    file.variables = vec![Var::new("a", &[0], Type::Short), Var::new("b", &[0, 1], Type::Byte)];
    // shorts and triples are filled up to four bytes
    file.data = [[0, 7, 0, 0, 1, 2, 3, 0], [0, 8, 0, 0, 4, 5, 6, 0], [0, 9, 0, 0, 7, 8, 255, 0]].concat();
    file
}

fn read(file: &Built) -> Contents {
    open::<NetCdf>("built.nc", &file.bytes()).unwrap()
}

#[test]
fn every_version_has_the_same_records() {
    for version in [1, 2, 5] {
        let file = built(version);
        assert!(NetCdf::recognises(&file.bytes(), Path::new("x")));
        let contents = read(&file);
        assert_eq!(locations(&contents), ["/a", "/b[0]", "/b[1]", "/b[2]"]);
        assert_eq!(codes(channel(&contents, "/a")), [7.0, 8.0, 9.0]);
        assert_eq!(codes(channel(&contents, "/b[2]")), [3.0, 6.0, -1.0]);
        assert!(contents.channels.iter().all(|channel| channel.sample_rate_hz.is_none()));
    }
}

#[test]
fn cut_and_uncounted_records_are_those_that_are_there() {
    let sound = built(2).bytes();
    // the padding behind the last record may be missing
    for (cut, records) in [(0, 3), (1, 3), (2, 2), (8, 2), (9, 2), (10, 1)] {
        let contents = open::<NetCdf>("cut.nc", &sound[..sound.len() - cut]).unwrap();
        let fewer = remarked(&contents, "the file is cut off: its header says 3 records");
        assert_eq!(fewer, records < 3, "{cut}: {:?}", contents.remarks);
        if records > 1 {
            assert!(contents.channels.iter().all(|channel| channel.samples == records), "{cut}");
        }
    }
    let contents = read(&Built { records: None, ..built(1) });
    assert_eq!(codes(channel(&contents, "/a")), [7.0, 8.0, 9.0]);
    assert!(remarked(&contents, "does not say how many records there are: 3"));
    // header and no data
    let head = &sound[..sound.len() - 24];
    assert!(open::<NetCdf>("head.nc", head).is_ok_and(|contents| contents.channels.is_empty()));
    let error = open::<NetCdf>("half.nc", &head[..head.len() / 2]).unwrap_err();
    assert!(error.problem.contains("no end of the header") && error.at_byte.is_some(), "{error:?}");
}

/// One variable of four bytes, with attributes.
fn four(kind: Type, attributes: Vec<(&'static str, Type, Vec<u8>)>) -> Built {
    let mut file = Built::of(1);
    file.dimensions = vec![("n", 4)];
    file.variables = vec![Var { attributes, ..Var::new("y", &[0], kind) }];
    file.data = vec![0, 1, 127, 255];
    file
}

#[test]
fn attributes_scale_mark_and_make_unsigned() {
    let double = |value: f64| (Type::Double, value.to_be_bytes().to_vec());
    let with = |name, (kind, bytes): (Type, Vec<u8>)| (name, kind, bytes);
    let scaled = read(&four(
        Type::Byte,
        vec![
            with("scale_factor", double(0.5)),
            with("add_offset", double(-1.0)),
            with("missing_value", (Type::Byte, vec![255])),
            ("units", Type::Char, b"V\0".to_vec()),
            with("valid_max", double(3.0)),
        ],
    ));
    let y = channel(&scaled, "/y");
    assert_eq!((values(y), y.fill_code, y.unit.as_str()), (vec![-1.0, -0.5, 62.5, -1.5], Some(-1.0), "V"));
    assert!(remarked(&scaled, "a valid range is stated"));
    let unsigned = read(&four(
        Type::Byte,
        vec![("_Unsigned", Type::Char, b"true".to_vec()), with("_FillValue", (Type::Byte, vec![255]))],
    ));
    let y = channel(&unsigned, "/y");
    assert_eq!((values(y), y.fill_code, y.stored_as), (vec![0.0, 1.0, 127.0, 255.0], Some(255.0), "uint8"));
    let rate = read(&four(Type::Byte, vec![with("sampling_rate", double(500.0))]));
    assert_eq!(rate.channels[0].sample_rate_hz, Some(500.0));
    for (attribute, words) in [
        (with("scale_factor", double(0.0)), "its scale_factor is 0"),
        (("scale_factor", Type::Char, b"0.5".to_vec()), "scale_factor is the text «0.5»"),
        (with("add_offset", (Type::Double, [0; 16].to_vec())), "add_offset has 2 numbers"),
    ] {
        let error = open::<NetCdf>("refused.nc", &four(Type::Byte, vec![attribute]).bytes()).unwrap_err();
        assert!(error.problem.contains(words), "{words}: {error:?}");
    }
}

#[test]
fn a_number_in_another_unit_is_no_rate_in_hertz() {
    for (unit, rate) in [("Hz", Some(50.0)), ("kHz", None), ("V", None), ("", Some(50.0))] {
        let mut file = four(Type::Byte, Vec::new());
        let attributes = vec![("units", Type::Char, unit.as_bytes().to_vec())];
        file.variables.push(Var { attributes, begin: 4, ..Var::new("fs", &[], Type::Byte) });
        file.data.extend([50, 0, 0, 0]);
        assert_eq!(read(&file).channels[0].sample_rate_hz, rate, "{unit}");
    }
}

#[test]
fn headers_that_cannot_be_are_refused_and_what_contradicts_itself_is_left_out() {
    let refused = |bytes: &[u8]| open::<NetCdf>("refused.nc", bytes).unwrap_err();
    let sound = four(Type::Byte, Vec::new());
    let mut other = sound.bytes();
    other[3] = 7;
    assert!(refused(&other).problem.starts_with("not read: this file is netCDF of version 7"));
    assert!(!NetCdf::recognises(&other, Path::new("x")));
    let cases: [(Built, &str); 9] = [
        (Built { dimensions: vec![("n", 0), ("m", 0)], ..sound.clone() }, "two dimensions of records"),
        (Built { variables: vec![Var::new("y", &[5], Type::Byte)], ..sound.clone() }, "has the dimension 5 of 1"),
        (Built { variables: vec![Var::new("y", &[0], Type::Other(12))], ..sound.clone() }, "is of type 12"),
        (Built { variables: vec![Var::new("y", &[0], Type::Other(7))], ..sound.clone() }, "wanted 1 to 6"),
        (Built { dimensions: vec![("m", 2), ("n", 0)], ..sound.clone() }.with(&[0, 1]), "not the first dimension of y"),
        (sound.clone().changed(|variable| variable.bytes = Some(12)), "12 bytes are stated"),
        (sound.clone().changed(|variable| variable.absolute = Some(8)), "within the header"),
        (sound.clone().changed(|variable| variable.absolute = Some(1 << 20)), "it ends at byte 1048580"),
        (Built { dimensions: vec![("n", 1 << 31)], ..sound.clone() }, "it ends at byte"),
    ];
    for (file, words) in cases {
        let error = refused(&file.bytes());
        assert!(error.problem.contains(words) && error.help.is_some() && error.at_byte.is_some(), "{words}: {error:?}");
    }
    // counts that no file holds
    for at in [12, 16, 24] {
        let mut bytes = sound.bytes();
        bytes[at..at + 4].copy_from_slice(&[0x7F, 0xFF, 0xFF, 0xFF]);
        assert!(open::<NetCdf>("many.nc", &bytes).is_err(), "{at}");
    }
    let mut wide = Built::of(5);
    wide.dimensions = vec![("n", 1 << 40), ("m", 1 << 40), ("k", 1 << 40)];
    wide.variables = vec![Var::new("y", &[0, 1, 2], Type::Byte)];
    wide.data = vec![0; 4];
    assert!(refused(&wide.bytes()).problem.contains("more than any file has"));
}

#[test]
fn lanes_of_a_map_are_too_many_to_list() {
    let mut file = Built::of(1);
    file.dimensions = vec![("n", 40), ("m", 20_000)];
    file.variables = vec![Var::new("y", &[0, 1], Type::Byte)];
    file.data = vec![0; 800_000];
    let error = open::<NetCdf>("map.nc", &file.bytes()).unwrap_err();
    assert!(error.problem.contains("its 20000 channels of 40 samples are too many to list"), "{error:?}");
}
