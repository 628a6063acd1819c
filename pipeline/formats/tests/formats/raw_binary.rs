//! Headerless files: sizes, layouts, and what cannot be.

use crate::support::{Temporary, locations, remarked, samples};
use afmid_formats::{RawBinary, SampleType};

pub fn described(sample: SampleType, big_endian: bool) -> RawBinary {
    RawBinary { sample, big_endian, ..RawBinary::default() }
}

pub const TYPES: [(SampleType, &str); 8] = [
    (SampleType::I8, "int8"),
    (SampleType::U8, "uint8"),
    (SampleType::I16, "int16"),
    (SampleType::U16, "uint16"),
    (SampleType::I32, "int32"),
    (SampleType::U32, "uint32"),
    (SampleType::F32, "float32"),
    (SampleType::F64, "float64"),
];

/// Numbers in a type and byte order.
pub fn coded(values: &[f64], sample_type: SampleType, big_endian: bool) -> Vec<u8> {
    let one = |&value: &f64| {
        let mut bytes = match sample_type {
            SampleType::I8 => (value as i8).to_le_bytes().to_vec(),
            SampleType::U8 => (value as u8).to_le_bytes().to_vec(),
            SampleType::I16 => (value as i16).to_le_bytes().to_vec(),
            SampleType::U16 => (value as u16).to_le_bytes().to_vec(),
            SampleType::I32 => (value as i32).to_le_bytes().to_vec(),
            SampleType::U32 => (value as u32).to_le_bytes().to_vec(),
            SampleType::F32 => (value as f32).to_le_bytes().to_vec(),
            SampleType::F64 => value.to_le_bytes().to_vec(),
        };
        if big_endian {
            bytes.reverse();
        }
        bytes
    };
    values.iter().flat_map(one).collect()
}

#[test]
fn every_type_and_layout_is_read() {
    let values: Vec<f64> = (0..60).map(f64::from).collect();
    for (sample_type, name) in TYPES {
        for big_endian in [false, true] {
            for interleaved in [false, true] {
                let mut bytes = b"seven b".to_vec();
                bytes.extend(coded(&values, sample_type, big_endian));
                let file = Temporary::new("bin", &bytes);
                let raw = RawBinary {
                    header_bytes: 7,
                    channels: 3,
                    interleaved,
                    scale_factor: 2.0,
                    ..described(sample_type, big_endian)
                };
                let contents = raw.open(&file.0).unwrap();
                assert_eq!(locations(&contents), ["/channel[0]", "/channel[1]", "/channel[2]"]);
                for (number, channel) in contents.channels.iter().enumerate() {
                    let (first, step) = if interleaved { (number, 3) } else { (20 * number, 1) };
                    let wanted: Vec<f64> = values.iter().copied().skip(first).step_by(step).take(20).collect();
                    assert_eq!(samples(channel), wanted, "{name} {big_endian} {interleaved}");
                    assert_eq!((channel.stored_as, channel.unit.as_str()), (name, ""));
                    assert_eq!((channel.scale_factor, channel.sample_rate_hz), (2.0, None));
                }
                assert!(contents.remarks.is_empty());
            }
        }
    }
}

#[test]
fn incomplete_rows_are_left_out_or_refused() {
    let file = Temporary::new("bin", &[1; 6 * 10 + 4]);
    let interleaved = RawBinary { channels: 3, ..described(SampleType::I16, false) };
    let contents = interleaved.open(&file.0).unwrap();
    assert!(contents.channels.iter().all(|channel| channel.samples == 10));
    assert!(remarked(&contents, "10 rows of 6 bytes and 4 bytes: the incomplete last row is left out"));
    assert!(!remarked(&contents, "check"));
    let planar = RawBinary { interleaved: false, ..interleaved.clone() };
    let error = planar.open(&file.0).unwrap_err();
    assert!(error.at_byte == Some(60) && error.help.is_some(), "{error:?}");
    let odd = RawBinary { header_bytes: 1, ..interleaved.clone() };
    assert!(remarked(&odd.open(&file.0).unwrap(), "check header_bytes"));
    let single = RawBinary { header_bytes: 1, interleaved: false, ..described(SampleType::I16, false) };
    assert_eq!(single.open(&file.0).unwrap().channels[0].samples, 31);
    for header_bytes in [59, 64, 65, u64::MAX] {
        let beyond = RawBinary { header_bytes, ..interleaved.clone() };
        assert!(beyond.open(&file.0).unwrap_err().problem.contains("at least 6 were wanted"));
    }
}

#[test]
fn values_out_of_range_are_refused() {
    let file = Temporary::new("bin", &[1; 64]);
    let good = described(SampleType::I16, false);
    let cases = [
        ("channels", RawBinary { channels: 0, ..good.clone() }),
        ("channels", RawBinary { channels: usize::MAX, ..good.clone() }),
        ("scale_factor", RawBinary { scale_factor: 0.0, ..good.clone() }),
        ("scale_factor", RawBinary { scale_factor: f64::INFINITY, ..good.clone() }),
        ("add_offset", RawBinary { add_offset: f64::NAN, ..good }),
    ];
    for (name, raw) in cases {
        assert!(raw.open(&file.0).unwrap_err().problem.starts_with(name), "{name}");
    }
}
