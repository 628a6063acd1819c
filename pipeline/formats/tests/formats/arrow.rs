//! Files that pyarrow 26.0.1, pandas 3.1.1 and Polars 2.1.0 wrote (tests/make_arrow.py, where the numbers are), and
//! damaged ones.

use crate::support::{channel, locations, open_bytes, remarked, samples, survive, values, written};
use afmid_formats::readers::arrow::Arrow;
use afmid_formats::{Contents, Format, Raw};

const ROWS: usize = 60;

fn bytes(name: &str) -> Vec<u8> {
    std::fs::read(written(&format!("{name}.arrow"))).unwrap()
}

fn open(name: &str) -> Contents {
    let path = written(&format!("{name}.arrow"));
    let head = bytes(name);
    assert!(Arrow::recognises(&head[..head.len().min(4096)], &path), "{name}");
    Arrow::open(&path).unwrap()
}

fn of(number: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..ROWS).map(|row| number(row as f64)).collect()
}

/// Whether values are the same bits, but for numbers that are none.
fn same(found: &[f64], wanted: &[f64]) -> bool {
    found.len() == wanted.len()
        && found.iter().zip(wanted).all(|(a, b)| a.is_nan() && b.is_nan() || a.to_bits() == b.to_bits())
}

fn gap(value: f64, row: f64) -> f64 {
    if row % 7.0 == 3.0 { f64::NAN } else { value }
}

#[test]
fn every_type_of_every_program_plain_and_packed() {
    let outer = |value: f64, row: f64| if row % 10.0 == 9.0 { f64::NAN } else { value };
    let wanted: [(&str, &str, Vec<f64>); 18] = [
        ("/i8", "int8", of(|n| n - 30.0)),
        ("/i16", "int16", of(|n| gap(n % 50.0, n))),
        ("/i32", "int32", of(|n| n - 30.0)),
        ("/i64", "int64", of(|n| n - 30.0)),
        ("/u8", "uint8", of(|n| n)),
        ("/u16", "uint16", of(|n| gap(n % 50.0, n))),
        ("/u32", "uint32", of(|n| n)),
        ("/u64", "uint64", of(|n| n)),
        ("/f16", "float16", of(|n| n / 8.0)),
        ("/f32", "float32", of(|n| f64::from((n * 0.1) as f32))),
        ("/f64", "float64", of(|n| n * 0.1)),
        ("/truth", "uint8", of(|n| f64::from(n % 3.0 == 0.0))),
        ("/maybe", "uint8", of(|n| gap(f64::from(n % 3.0 == 0.0), n))),
        ("/gaps", "float64", of(|n| gap(n / 4.0, n))),
        ("/single", "float32", of(|n| gap(n / 4.0, n))),
        ("/decimal", "int64", of(|n| (n - 30.0) * 0.01)),
        ("/inner.x", "float64", of(|n| outer(n * 0.5, n))),
        ("/inner.y", "int64", of(|n| outer(gap(n, n), n))),
    ];
    let programs = ["types_plain", "types_stream", "types_legacy", "types_lz4", "types_zstd"];
    for name in programs.into_iter().chain(["polars_plain", "polars_lz4", "polars_zstd", "polars_stream"]) {
        let contents = open(name);
        for (location, stored_as, wanted) in &wanted {
            let found = channel(&contents, location);
            assert_eq!((found.stored_as, found.samples), (*stored_as, ROWS), "{name} {location}");
            let found = values(found);
            assert!(same(&found, wanted), "{name} {location}: {found:?}");
        }
        let clock = channel(&contents, "/clock");
        assert_eq!(clock.unit, "s", "{name}");
        assert!(values(clock).iter().zip(of(|n| n)).all(|(a, b)| (a - b).abs() < 1e-9), "{name}");
        assert!(remarked(&contents, "/i64: 64-bit integers beyond 2^53 are rounded"));
    }
}

#[test]
fn columns_of_other_kinds_are_named_and_in_nobodys_way() {
    for name in ["others_plain", "others_lz4"] {
        let contents = open(name);
        assert_eq!(locations(&contents), ["/behind"], "{:?}", contents.remarks);
        assert!(same(&samples(&contents.channels[0]), &of(|n| gap(n / 8.0, n))), "{name}");
        let said = [
            ("text", "texts or bytes"),
            ("views", "texts or bytes"),
            ("long_text", "texts or bytes"),
            ("bytes", "texts or bytes"),
            ("lists", "lists"),
            ("pairs", "lists"),
            ("map", "lists"),
            ("list_view", "lists"),
            ("nothing", "nothing"),
            ("category", "entries of a dictionary"),
            ("day", "dates"),
            ("sparse", "values of several types"),
            ("dense", "values of several types"),
            ("months", "stretches of a calendar"),
            ("many_digits", "decimal fractions of many digits"),
            ("structs", "lists"),
            ("runs", "runs of equal values"),
        ];
        for (column, what) in said {
            let remark = format!("/{column} holds {what}, no channel");
            assert!(remarked(&contents, &remark), "{name}: {remark}: {:?}", contents.remarks);
        }
    }
}

#[test]
fn moments_give_the_rate_and_the_beginning() {
    let contents = open("named");
    assert_eq!(locations(&contents), ["/acc", "/force"]);
    assert_eq!(contents.started_at, "2024-05-06T07:08:09.250000Z");
    let described = contents.channels.iter().map(|found| (found.unit.as_str(), found.sample_rate_hz));
    assert_eq!(described.collect::<Vec<_>>(), [("m/s^2", Some(5000.0)), ("N", Some(5000.0))], "{:?}", contents.remarks);
    // names that say milliseconds of moments, which are in seconds here
    for (unit, rate) in [("s", 1.0), ("ms", 500.0), ("us", 20_000.0), ("ns", 5000.0)] {
        for (name, started_at) in [("moments", "1969-12-31T23:59:59"), ("differences", "")] {
            let contents = open(&format!("{name}_{unit}"));
            assert_eq!(locations(&contents), ["/y"], "{name} {unit}: {:?}", contents.remarks);
            assert_eq!(contents.channels[0].sample_rate_hz, Some(rate), "{name} {unit}: {:?}", contents.remarks);
            assert_eq!(contents.started_at, started_at, "{name} {unit}");
        }
    }
}

#[test]
fn times_and_texts_give_the_rate_and_counters_none() {
    let rates = [
        ("pandas_times", 1000.0),
        ("pandas_moments", 5000.0),
        ("pandas_differences", 2000.0),
        ("polars_differences", 5000.0),
        ("rate", 2500.0),
    ];
    for (name, rate) in rates {
        let contents = open(name);
        assert_eq!(locations(&contents), ["/y"], "{name}: {:?}", contents.remarks);
        assert_eq!(contents.channels[0].sample_rate_hz, Some(rate), "{name}: {:?}", contents.remarks);
    }
    let contents = open("pandas_numbers");
    assert_eq!(contents.channels.iter().map(|found| found.sample_rate_hz).collect::<Vec<_>>(), [None, None]);
    assert!(channel(&contents, "/index").is_axis && remarked(&contents, "gives no sample rate"));
}

#[test]
fn numbers_keep_their_type_unless_some_are_missing() {
    let contents = open("types_lz4");
    for (from, count) in [(0, 1), (20, 30), (59, 1), (0, 0)] {
        assert!(matches!(channel(&contents, "/i16").source.read(from, count).unwrap(), Raw::Float64(_)));
        assert!(matches!(channel(&contents, "/single").source.read(from, count).unwrap(), Raw::Float32(_)));
    }
    let codes = open("codes");
    let code = channel(&codes, "/code");
    assert_eq!(samples(code), of(|n| n - 30.0));
    assert!(matches!(code.source.read(5, 30).unwrap(), Raw::Int16(_)));
    // plain buffers are read where they are, packed ones by whole batches of which one is kept
    assert!(code.source.is_direct() && code.source.kept_bytes() == 0);
    let packed = &channel(&contents, "/f64").source;
    assert!(!packed.is_direct() && packed.kept_bytes() == 8 * 31);
}

#[test]
fn files_that_were_not_finished_are_read_as_far_as_they_are_whole() {
    let sound = bytes("types_plain");
    let (list, _) = sound[..sound.len() - 10].split_at(sound.len() - 2000);
    let (_folder, contents) = open_bytes::<Arrow>("x.arrow", list);
    let contents = contents.unwrap();
    assert!(remarked(&contents, "the file was not finished"), "{:?}", contents.remarks);
    let whole = channel(&contents, "/f64").samples;
    assert!(whole.is_multiple_of(25) && whole > 0, "{whole}");
    assert!(same(&samples(channel(&contents, "/f64")), &of(|n| n * 0.1)[..whole]));
    // within the last batch of a stream
    let sound = bytes("types_stream");
    let (_folder, contents) = open_bytes::<Arrow>("x.arrow", &sound[..sound.len() - 100]);
    let contents = contents.unwrap();
    assert!(remarked(&contents, "the 2 before are read"), "{:?}", contents.remarks);
    assert_eq!(channel(&contents, "/f64").samples, 50);
    // without its end mark alone
    let (_folder, contents) = open_bytes::<Arrow>("x.arrow", &sound[..sound.len() - 8]);
    assert_eq!(channel(&contents.unwrap(), "/f64").samples, ROWS);
}

#[test]
fn damaged_files_do_no_harm() {
    for name in ["types_stream", "types_lz4", "types_legacy", "polars_zstd", "others_plain"] {
        survive::<Arrow>("x.arrow", &bytes(name), 200, 1000, 16 << 20);
    }
}

#[test]
fn files_that_lie_are_refused() {
    let refused = |bytes: &[u8], words: &str| {
        let error = open_bytes::<Arrow>("x.arrow", bytes).1.unwrap_err();
        assert!(error.problem.contains(words) && error.help.is_some(), "{words}: {error:?}");
    };
    refused(b"FEA1 and so on", "first version of Feather");
    refused(b"ARROW1", "ends before its schema does");
    refused(b"ARROW1\0\0\xff\xff\xff\xff\xff\xff\xff\x7f", "more than");
    refused(b"ARROW1\0\0\xff\xff\xff\xff\x08\0\0\0\0\0\0\0\0\0\0\0", "no description");
    refused(b"ARROW1\0\0\xff\xff\xff\xffARROW1", "longer than the file");
    let sound = bytes("rate");
    let length = sound.len() - 10;
    let list = u32::from_le_bytes(sound[length..length + 4].try_into().unwrap()) as usize;
    let mut none = sound.clone();
    none[length - list..length].fill(0);
    refused(&none, "its schema is missing, damaged");
    // the place of the first record batch, 24 bytes with the lengths behind it
    let place = sound[length - list..length].windows(8).position(|word| {
        let at = u64::from_le_bytes(word.try_into().unwrap()) as usize;
        at > 8 && at < length - list && sound[at..].starts_with(&[0xff; 4])
    });
    let place = length - list + place.unwrap();
    let mut elsewhere = sound.clone();
    elsewhere[place..place + 8].copy_from_slice(&8_u64.to_le_bytes());
    refused(&elsewhere, "there is no record batch 0 where the list has it");
    elsewhere[place..place + 8].copy_from_slice(&u64::MAX.to_le_bytes());
    refused(&elsewhere, "record batch 0 is not where the list has it");
}

#[test]
fn packed_buffers_that_come_to_too_much_are_refused() {
    // a stream with one column of 60 numbers, packed: its length stands before it
    let mut bytes = bytes("pandas_times");
    let length = 480_i64.to_le_bytes();
    let places: Vec<usize> =
        bytes.windows(8).enumerate().filter(|(_, word)| *word == length).map(|(at, _)| at).collect();
    assert!(!places.is_empty());
    for wrong in [479, 4 << 30, -2, i64::MAX] {
        for at in &places {
            bytes[*at..at + 8].copy_from_slice(&i64::to_le_bytes(wrong));
        }
        let (_folder, contents) = open_bytes::<Arrow>("x.arrow", &bytes);
        for found in contents.unwrap().channels {
            let error = found.source.read(0, ROWS).unwrap_err();
            assert!(error.at_byte.is_some() && error.problem.contains("480"), "{error:?}");
        }
    }
}
