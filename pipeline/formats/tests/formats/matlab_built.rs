//! MAT-files put together byte by byte.

use crate::mat_builder::{Order, compressed, level4};
use crate::support::{Temporary, channel, locations, remarked, samples};
use afmid_formats::readers::matlab::Mat;
use afmid_formats::{Contents, Format, FormatError};

fn open(bytes: &[u8]) -> Result<Contents, FormatError> {
    Mat::open(&Temporary::new("mat", bytes).0)
}

/// Opens the file, and leaves it there for reading.
fn opened(bytes: &[u8]) -> (Contents, Temporary) {
    let file = Temporary::new("mat", bytes);
    (Mat::open(&file.0).unwrap(), file)
}

#[test]
fn every_class_of_level_4_in_both_byte_orders() {
    let values = [1.0, 2.0, 200.0];
    for order in [Order(false), Order(true)] {
        let coded = |precision: usize| -> Vec<u8> {
            let one = |value: f64| match precision {
                0 => value.to_le_bytes().to_vec(),
                1 => (value as f32).to_le_bytes().to_vec(),
                2 => (value as i32).to_le_bytes().to_vec(),
                3 => (value as i16).to_le_bytes().to_vec(),
                4 => (value as u16).to_le_bytes().to_vec(),
                _ => vec![value as u8],
            };
            values.iter().flat_map(|&value| order.put(one(value))).collect()
        };
        let names = ["float64", "float32", "int32", "int16", "uint16", "uint8"];
        let mut bytes = Vec::new();
        for (precision, name) in names.iter().enumerate() {
            bytes.extend(level4(order, precision as u32 * 10, [3, 1], 0, name, &coded(precision)));
        }
        bytes.extend(level4(order, 51, [1, 2], 0, "unit", b"nm"));
        bytes.extend(level4(order, 50, [2, 1], 1, "iq", b"abcd"));
        bytes.extend(level4(order, 52, [2, 3], 0, "few", b"abcdef"));
        bytes.extend(level4(order, 0, [1, 1], 0, "fs", &order.put(1e6_f64.to_le_bytes().to_vec())));
        let (contents, _file) = opened(&bytes);
        assert_eq!(locations(&contents), names.map(|name| format!("/{name}")));
        for name in names {
            let channel = channel(&contents, &format!("/{name}"));
            assert_eq!(
                (samples(channel), channel.stored_as, channel.sample_rate_hz),
                (values.to_vec(), name, Some(1e6))
            );
        }
        for text in ["/unit is the text \"nm\"", "/iq is complex", "/few is a sparse matrix"] {
            assert!(remarked(&contents, text), "{text}");
        }
    }
}

#[test]
fn texts_in_a_struct_are_names_and_units_of_its_array() {
    let order = Order(false);
    let text = |text: &str| order.array(4, &[1, text.len() as u32], "", &order.element(16, text.as_bytes()));
    let numbers: Vec<u8> = (0..6).flat_map(|k| f64::from(k).to_le_bytes()).collect();
    let field = |name: &str| {
        let mut bytes = name.as_bytes().to_vec();
        bytes.resize(8, 0);
        bytes
    };
    let fields = [field("acc"), field("names"), field("units")].concat();
    let acc = order.array(6, &[3, 2], "", &order.element(9, &numbers));
    let names = order.array(1, &[1, 2], "", &[text("left"), text("right")].concat());
    let inside = [order.element(5, &order.word(8)), order.element(1, &fields), acc, names, text("m/s^2")].concat();
    let (contents, _file) = opened(&[order.header(), order.array(2, &[1, 1], "Test", &inside)].concat());
    assert_eq!(locations(&contents), ["/Test.acc[1]", "/Test.acc[2]"]);
    for (location, name) in [("/Test.acc[1]", "left"), ("/Test.acc[2]", "right")] {
        let channel = channel(&contents, location);
        assert_eq!((channel.unit.as_str(), channel.long_name.as_str()), ("m/s^2", name));
    }
    assert!(contents.remarks.iter().all(|remark| afmid_formats::is_fact(remark)), "{:?}", contents.remarks);
}

#[test]
fn level_4_that_cannot_be_read_is_refused() {
    let little = Order(false);
    for (machine, name) in [(2, "VAX D-float"), (3, "VAX G-float"), (4, "Cray")] {
        let error = open(&level4(little, machine * 1000, [1, 2], 0, "x", &[0; 16])).unwrap_err();
        assert!(error.problem.contains(name) && error.at_byte == Some(0) && error.help.is_some(), "{error:?}");
    }
    let good = level4(little, 0, [1, 2], 0, "x", &[0; 16]);
    let error = open(&good[..good.len() - 1]).unwrap_err();
    assert_eq!(error.at_byte, Some(22), "{error:?}");
    let error = open(&level4(little, 0, [1 << 30, 1 << 30], 1, "x", &[0; 16])).unwrap_err();
    assert!(error.problem.contains("the file ends before"), "{error:?}");
    let error = open(&[good.clone(), vec![9; 40]].concat()).unwrap_err();
    assert_eq!(error.at_byte, Some(good.len() as u64));
    let error = open(&[good, level4(little, 0, [1, 1], 0, "!", &[0; 8])].concat()).unwrap_err();
    assert!(error.problem.contains("name"), "{error:?}");
}

#[test]
fn every_type_of_level_5_in_both_byte_orders() {
    let values = [1.0, 2.0, 100.0];
    for order in [Order(false), Order(true)] {
        let names =
            [(1, "int8"), (2, "uint8"), (3, "int16"), (4, "uint16"), (5, "int32"), (6, "uint32"), (7, "float32")];
        let mut bytes = order.header();
        let all = names.into_iter().chain([(9, "float64"), (12, "int64"), (13, "uint64")]);
        for (kind, name) in all.clone() {
            let one = |value: f64| match kind {
                1 | 2 => vec![value as u8],
                3 | 4 => (value as i16).to_le_bytes().to_vec(),
                5 | 6 => (value as i32).to_le_bytes().to_vec(),
                7 => (value as f32).to_le_bytes().to_vec(),
                9 => value.to_le_bytes().to_vec(),
                _ => (value as i64).to_le_bytes().to_vec(),
            };
            let data: Vec<u8> = values.iter().flat_map(|&value| order.put(one(value))).collect();
            // Class double, whatever the numbers are stored as: three bytes are in the short form.
            bytes.extend(order.array(6, &[3, 1], name, &order.element(kind, &data)));
        }
        let (contents, _file) = opened(&bytes);
        assert_eq!(contents.channels.len(), 10);
        for (_, name) in all {
            let channel = channel(&contents, &format!("/{name}"));
            assert_eq!((samples(channel), channel.stored_as), (values.to_vec(), name));
        }
    }
}

#[test]
fn flags_objects_functions_and_the_workspace() {
    let little = Order(false);
    let data = little.element(2, &[0, 1, 1]);
    let part = little.array(9, &[1, 3], "", &data);
    let fields = [little.element(5, &4_u32.to_le_bytes()), little.element(1, b"a\0\0\0")].concat();
    let object = [little.element(1, b"thing"), fields, part].concat();
    let bytes = [
        little.header(),
        little.array(0x0609, &[1, 3], "flagged", &data),
        little.array(3, &[1, 1], "o", &object),
        little.array(16, &[1, 1], "f", &little.array(9, &[1, 3], "", &data)),
        little.element(
            14,
            &[little.element(6, &[17, 0, 0, 0, 0, 0, 0, 0]), little.element(1, b"new"), vec![7; 48]].concat(),
        ),
        little.array(9, &[1, 3], "", &data),
        little.array(9, &[1, 3], "flagged", &data),
        little.array(4, &[1, 2], "text", &little.element(4, b"n\0m\0")),
    ]
    .concat();
    let (contents, _file) = opened(&bytes);
    assert_eq!(locations(&contents), ["/flagged", "/o.a", "/flagged#2"]);
    assert!(contents.channels[0].long_name.contains("global logical uint8 1x3"), "{:?}", contents.channels[0]);
    for text in [
        "object of class thing",
        "/f is a function",
        "/new is an object",
        "without a name",
        "/flagged occurs again",
        "\"nm\"",
    ] {
        assert!(remarked(&contents, text), "{text}: {:?}", contents.remarks);
    }
}

#[test]
fn nesting_without_end_is_left_out() {
    let little = Order(false);
    let mut bytes = little.array(9, &[1, 3], "", &little.element(2, &[1, 2, 3]));
    for depth in 0..200 {
        bytes = little.array(1, &[1, 1], if depth == 199 { "c" } else { "" }, &bytes);
    }
    let (contents, _file) = opened(&[little.header(), bytes].concat());
    assert!(contents.channels.is_empty() && remarked(&contents, "nested more than 32 deep"));
}

#[test]
fn sizes_that_lie_are_refused() {
    let little = Order(false);
    let file = |array: &[u8]| [&little.header(), array].concat();
    let three = little.element(2, &[1, 2, 3]);
    let cases: [(&str, Vec<u8>); 10] = [
        ("4 numbers of 1 bytes, in 3", little.array(9, &[4, 1], "x", &three)),
        ("two or more from 0", little.array(9, &[4], "x", &three)),
        ("two or more from 0", little.array(9, &[u32::MAX, 1], "x", &three)),
        ("two or more from 0", little.array(9, &[1 << 30, 1 << 30, 1 << 30], "x", &three)),
        ("class 99", little.array(99, &[3, 1], "x", &three)),
        ("none of numbers", little.array(9, &[3, 1], "x", &little.element(99, &[1, 2, 3]))),
        ("no room for them", little.array(1, &[1 << 20, 1], "x", &[])),
        ("ends", little.array(9, &[3, 1], "x", &[2, 0, 0, 0, 255, 255, 255, 127])),
        ("at most 4 fit", little.array(9, &[3, 1], "x", &[2, 0, 9, 0, 1, 1, 1, 1])),
        ("type 14 or 15", little.element(9, &[0; 16])),
    ];
    for (problem, array) in cases {
        let error = open(&file(&array)).unwrap_err();
        assert!(error.problem.contains(problem) && error.at_byte.is_some(), "{problem}: {error:?}");
    }
    let array = file(&little.array(9, &[3, 1], "x", &three));
    assert!(open(&array[..array.len() - 8]).is_err());
    let error = open(b"something else altogether").unwrap_err();
    assert!(error.problem.contains("MATLAB"));
}

#[test]
fn compressed_variables_must_be_what_they_say() {
    let little = Order(false);
    let array = little.array(9, &[1000, 1], "x", &little.element(2, &[7; 1000]));
    let good = compressed(&array);
    let (contents, _file) = opened(&[little.header(), good.clone()].concat());
    assert_eq!(samples(&contents.channels[0]), vec![7.0; 1000]);
    let refused = |element: &[u8], problem: &str| {
        let error = open(&[&little.header(), element].concat()).unwrap_err();
        assert!(error.problem.contains(problem), "{problem}: {error:?}");
    };
    let mut sum = good.clone();
    *sum.last_mut().unwrap() ^= 1;
    refused(&sum, "cannot be inflated");
    let mut short = good[..good.len() - 2].to_vec();
    short[4] -= 2;
    refused(&short, "before their end mark");
    refused(&compressed(&[array.clone(), vec![0; 8]].concat()), "more bytes than");
    refused(&compressed(&array[..500]), "fewer bytes than");
    let mut huge = array.clone();
    huge[4..8].copy_from_slice(&0xffff_fff0_u32.to_le_bytes());
    refused(&compressed(&huge), "cannot come from");
    refused(&compressed(&little.element(9, &[0; 16])), "type 14");
}

#[test]
fn a_file_that_changes_is_noticed() {
    let little = Order(false);
    let bytes = [little.header(), little.array(9, &[9, 1], "x", &little.element(2, &[7; 9]))].concat();
    let (contents, file) = opened(&bytes);
    std::fs::write(&file.0, &bytes[1..]).unwrap();
    assert!(contents.channels[0].source.read(0, 1).is_err());
    std::fs::remove_file(&file.0).unwrap();
    assert!(contents.channels[0].source.read(0, 1).is_err());
    assert!(Mat::open(&file.0).is_err() && Mat::open(&std::env::temp_dir()).is_err());
}
