//! Files that pyarrow 26.0.1, pandas 3.1.1 and Polars 2.1.0 wrote (tests/make_parquet.py, where the numbers are), and
//! damaged ones.

use crate::support::{Random, channel, locations, open_bytes, remarked, samples, survive, values, written};
use afmid_formats::readers::parquet::Parquet;
use afmid_formats::{Contents, Format, Raw};

const ROWS: usize = 60;

fn open(name: &str) -> Contents {
    let path = written(&format!("{name}.parquet"));
    assert!(Parquet::recognises(&std::fs::read(&path).unwrap(), &path));
    Parquet::open(&path).unwrap()
}

fn of(number: impl Fn(f64) -> f64) -> Vec<f64> {
    (0..ROWS).map(|row| number(row as f64)).collect()
}

/// Whether values are the same bits, but for numbers that are none.
fn same(found: &[f64], wanted: &[f64]) -> bool {
    found.len() == wanted.len()
        && found.iter().zip(wanted).all(|(a, b)| a.is_nan() && b.is_nan() || a.to_bits() == b.to_bits())
}

#[test]
fn every_type_packed_and_coded_in_every_way() {
    let gap = |value: f64, row: f64| if row % 7.0 == 3.0 { f64::NAN } else { value };
    let wanted: [(&str, &str, Vec<f64>); 14] = [
        ("/i8", "int32", of(|n| n - 30.0)),
        ("/u16", "uint32", of(|n| n * 1000.0)),
        ("/i32", "int32", of(|n| 0.0 - n * 70_000.0)),
        ("/u32", "uint32", of(|n| n * 70_000_000.0)),
        ("/i64", "int64", of(|n| n * 3.0 - 7.0)),
        ("/u64", "uint64", of(|n| n * 3.0)),
        ("/f16", "float16", of(|n| n / 8.0)),
        ("/f32", "float32", of(|n| f64::from((n * 0.1) as f32))),
        ("/f64", "float64", of(|n| n * 0.1)),
        ("/truth", "uint8", of(|n| f64::from(n % 3.0 == 0.0))),
        ("/gaps", "float64", of(|n| gap(n / 4.0, n))),
        ("/few", "int32", of(|n| gap(n % 2.0, n))),
        ("/decimal", "int32", of(|n| n * 0.01)),
        ("/inner.x", "float64", of(|n| n * 0.5)),
    ];
    for name in ["snappy", "gzip", "zstd", "brotli", "lz4", "plain", "streams", "polars"] {
        let contents = open(&format!("types_{name}"));
        // decimals of nine digits lie in bytes unless asked for otherwise
        let decimals = name == "polars" || remarked(&contents, "/decimal holds decimal fractions of many digits");
        for (location, stored_as, wanted) in &wanted {
            if *location == "/decimal" && decimals {
                continue;
            }
            let found = channel(&contents, location);
            assert_eq!((found.stored_as, found.samples), (*stored_as, ROWS), "{name} {location}");
            let found = values(found);
            assert!(same(&found, wanted), "{name} {location}: {found:?}");
        }
        for what in ["/text holds texts", "/lists.list.element holds lists", "/day holds dates"] {
            assert!(remarked(&contents, what), "{what}: {:?}", contents.remarks);
        }
        assert!(remarked(&contents, "/i64: 64-bit integers beyond 2^53 are rounded"));
    }
}

#[test]
fn other_packings_are_named() {
    assert_eq!(values(channel(&open("zstd"), "/f64")), of(|n| n * 0.1));
    let mut bytes = std::fs::read(written("zstd.parquet")).unwrap();
    // the number of the packing, twice, behind the name of the column
    let place = bytes.windows(6).position(|word| word == b"f64\x15\x0c\x16").unwrap() + 4;
    for (number, name) in [(3, "LZO"), (5, "LZ4 in Hadoop's frames"), (9, "an unknown codec")] {
        bytes[place] = 2 * number;
        let contents = open_bytes::<Parquet>("x.parquet", &bytes).1.unwrap();
        assert!(contents.channels.is_empty());
        let remark = format!("/f64 is left out: it is packed with {name}, wanted Snappy");
        assert!(remarked(&contents, &remark), "{:?}", contents.remarks);
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
    for (name, rate) in [("moments_ms", 500.0), ("moments_ns", 5000.0), ("pandas_moments", 5000.0)] {
        let contents = open(name);
        assert_eq!(locations(&contents), ["/y"], "{name}: {:?}", contents.remarks);
        assert_eq!(contents.channels[0].sample_rate_hz, Some(rate), "{name}: {:?}", contents.remarks);
    }
    assert_eq!(open("moments_ms").started_at, "1969-12-31T23:59:59");
}

#[test]
fn times_and_texts_give_the_rate_and_counters_none() {
    let rates = [
        ("times", Some(1000.0)),
        ("pandas_times", Some(1000.0)),
        ("rate", Some(2500.0)),
        ("differences", Some(5000.0)),
        ("pandas_differences", Some(2000.0)),
    ];
    for (name, rate) in rates {
        let contents = open(name);
        assert_eq!(locations(&contents), ["/y"], "{name}: {:?}", contents.remarks);
        assert_eq!(contents.channels[0].sample_rate_hz, rate, "{name}: {:?}", contents.remarks);
    }
    let contents = open("pandas_numbers");
    assert_eq!(contents.channels.iter().map(|found| found.sample_rate_hz).collect::<Vec<_>>(), [None, None]);
    assert!(channel(&contents, "/index").is_axis && remarked(&contents, "gives no sample rate"));
}

#[test]
fn numbers_that_may_be_missing_are_of_one_type_throughout() {
    let contents = open("types_gzip");
    for (from, count) in [(0, 1), (20, 30), (59, 1), (0, 0)] {
        assert!(matches!(channel(&contents, "/i32").source.read(from, count).unwrap(), Raw::Float64(_)));
        assert!(matches!(channel(&contents, "/f32").source.read(from, count).unwrap(), Raw::Float32(_)));
    }
    assert!(samples(channel(&contents, "/few"))[3].is_nan());
}

#[test]
fn damaged_files_do_no_harm() {
    for name in ["types_lz4", "types_zstd", "types_brotli", "types_streams", "types_plain", "named", "pandas_moments"] {
        let sound = std::fs::read(written(&format!("{name}.parquet"))).unwrap();
        survive::<Parquet>("x.parquet", &sound, 200, 2000, 16 << 20);
    }
}

#[test]
fn a_changed_page_is_found_by_its_checksum() {
    let mut bytes = std::fs::read(written("types_plain.parquet")).unwrap();
    // a value in the first column's only page
    bytes[4 + 60] ^= 1;
    let (_folder, contents) = open_bytes::<Parquet>("x.parquet", &bytes);
    let error = channel(&contents.unwrap(), "/i8").source.read(0, ROWS).unwrap_err();
    assert!(error.problem.contains("checksum"), "{error:?}");
}

#[test]
fn files_that_lie_are_refused() {
    let sound = std::fs::read(written("times.parquet")).unwrap();
    let refused = |bytes: &[u8], words: &str| {
        let error = open_bytes::<Parquet>("x.parquet", bytes).1.unwrap_err();
        assert!(error.problem.contains(words) && error.help.is_some(), "{words}: {error:?}");
    };
    refused(b"PAR1", "does not end with PAR1");
    refused(b"PAR", "too short");
    refused(&sound[..sound.len() - 1], "does not end with PAR1");
    let length = sound.len() - 8;
    let mut longer = sound.clone();
    longer[length..length + 4].copy_from_slice(&u32::MAX.to_le_bytes());
    refused(&longer, "longer than the file");
    let mut shorter = sound.clone();
    shorter[length..length + 4].copy_from_slice(&7_u32.to_le_bytes());
    refused(&shorter, "no readable Parquet file");
    // pages of zeros and of noise: the description is sound, the samples are not
    let mut random = Random(7);
    for noise in [false, true] {
        let mut pages = sound.clone();
        let description = u32::from_le_bytes(sound[length..length + 4].try_into().unwrap()) as usize;
        for byte in &mut pages[4..length - description] {
            *byte = if noise { random.next() as u8 } else { 0 };
        }
        let (_folder, contents) = open_bytes::<Parquet>("x.parquet", &pages);
        for found in contents.unwrap().channels {
            let error = found.source.read(0, found.samples).unwrap_err();
            assert!(error.at_byte.is_some() && error.problem.starts_with(&found.location), "{error:?}");
        }
    }
}
