//! TDMS files built byte by byte: what is in them is known.

use crate::support::{channel, locations, open, remarked, values};
use crate::tdms_file::*;
use afmid_formats::readers::tdms::Tdms;
use afmid_formats::{Contents, Format, FormatError, Raw};

const ALL: u32 = META | NEW_LIST | RAW;

fn contents(name: &str, bytes: &[u8]) -> Contents {
    open::<Tdms>(&format!("{name}.tdms"), bytes).unwrap()
}

fn error(name: &str, bytes: &[u8]) -> FormatError {
    open::<Tdms>(&format!("{name}.tdms"), bytes).unwrap_err()
}

fn floats(numbers: &[i16]) -> Vec<f64> {
    numbers.iter().map(|&n| f64::from(n)).collect()
}

#[test]
fn contiguous_chunks_and_segments_without_metadata_join_in_both_byte_orders() {
    for big in [false, true] {
        // Two chunks of 2 + 1 values, then a segment with nothing but raw data, then one in which b has none.
        let mut bytes = segment(big, ALL, &[plain("/'g'/'a'", 2, 2), plain("/'g'/'b'", 10, 1)], &{
            let mut raw = i16s(big, &[1, -2]);
            raw.extend(f64s(big, &[0.5]));
            raw.extend(i16s(big, &[3, 4]));
            raw.extend(f64s(big, &[1.5]));
            raw
        });
        bytes.extend(segment(big, RAW, &[], &[i16s(big, &[5, 6]), f64s(big, &[2.5])].concat()));
        bytes.extend(segment(big, META | RAW, &[object("/'g'/'b'", Index::None, vec![])], &i16s(big, &[7, 8])));
        bytes.extend(segment(
            big,
            META | RAW,
            &[object("/'g'/'b'", Index::Same, vec![])],
            &[i16s(big, &[9, 10]), f64s(big, &[3.5])].concat(),
        ));
        let found = contents(&format!("contiguous-{big}"), &bytes);
        assert_eq!(found.format, format!("NI TDMS 2.0 (4713), {}-endian", if big { "big" } else { "little" }));
        assert_eq!(locations(&found), ["/g/a", "/g/b"]);
        assert_eq!(values(channel(&found, "/g/a")), floats(&[1, -2, 3, 4, 5, 6, 7, 8, 9, 10]));
        assert_eq!(values(channel(&found, "/g/b")), [0.5, 1.5, 2.5, 3.5]);
        assert!(matches!(channel(&found, "/g/a").source.read(0, 1), Ok(Raw::Int16(_))));
        assert!(remarked(&found, "different numbers of samples"));
    }
}

#[test]
fn interleaved_rows_are_taken_apart_in_both_byte_orders() {
    for big in [false, true] {
        let rows = [(1_i16, 0.25), (2, 0.5), (3, 0.75), (4, 1.0)];
        let raw: Vec<u8> = rows.iter().flat_map(|(a, b)| [i16s(big, &[*a]), f64s(big, &[*b])].concat()).collect();
        let objects = || [plain("/'g'/'a'", 2, 2), plain("/'g'/'b'", 10, 2)];
        let found = contents(&format!("interleaved-{big}"), &segment(big, ALL | INTERLEAVED, &objects(), &raw));
        assert_eq!(values(channel(&found, "/g/a")), [1.0, 2.0, 3.0, 4.0]);
        assert_eq!(values(channel(&found, "/g/b")), [0.25, 0.5, 0.75, 1.0]);
    }
}

#[test]
fn every_type_of_number_decodes_in_both_byte_orders() {
    for big in [false, true] {
        let put = |f: &dyn Fn(&mut Bytes)| {
            let mut bytes = Bytes::new(big);
            f(&mut bytes);
            bytes.bytes
        };
        let cases: [(u32, Vec<u8>, f64, &str); 12] = [
            (1, vec![0xFE], -2.0, "int8"),
            (2, put(&|b| b.put((-300_i16).to_le_bytes())), -300.0, "int16"),
            (3, put(&|b| b.put((-70_000_i32).to_le_bytes())), -70_000.0, "int32"),
            (4, put(&|b| b.put((-5_000_000_000_i64).to_le_bytes())), -5e9, "int64"),
            (5, vec![0xFE], 254.0, "uint8"),
            (6, put(&|b| b.put(65_000_u16.to_le_bytes())), 65_000.0, "uint16"),
            (7, put(&|b| b.u32(4_000_000_000)), 4e9, "uint32"),
            (8, put(&|b| b.u64(1 << 63)), 9_223_372_036_854_775_808.0, "uint64"),
            (9, put(&|b| b.put(0.1_f32.to_le_bytes())), f64::from(0.1_f32), "float32"),
            (10, put(&|b| b.put(0.1_f64.to_le_bytes())), 0.1, "float64"),
            (0x1A, put(&|b| b.put(0.1_f64.to_le_bytes())), 0.1, "float64"),
            (0x21, vec![1], 1.0, "boolean"),
        ];
        for (code, raw, expected, name) in cases {
            let found =
                contents(&format!("type-{code}-{big}"), &segment(big, ALL, &[plain("/'g'/'a'", code, 1)], &raw));
            let a = channel(&found, "/g/a");
            assert_eq!((values(a), a.stored_as), (vec![expected], name), "type {code}");
            assert_eq!(remarked(&found, "2^53"), name.ends_with("64") && name.contains("int"));
        }
    }
}

#[test]
fn text_stamps_and_complex_numbers_are_remarks_and_do_not_shift_their_neighbours() {
    let raw = [b"\x02\0\0\0\x03\0\0\0abc".to_vec(), vec![0; 16], vec![0; 8], i16s(false, &[7, 8])].concat();
    let objects = [
        object("/'g'/'text'", Index::Text { values: 2, size: 11 }, vec![]),
        plain("/'g'/'time'", 0x44, 1),
        plain("/'g'/'z'", 0x0008_000C, 1),
        plain("/'g'/'a'", 2, 2),
    ];
    let found = contents("text", &segment(false, ALL, &objects, &raw));
    assert_eq!(locations(&found), ["/g/a"]);
    assert_eq!(values(channel(&found, "/g/a")), [7.0, 8.0]);
    for words in ["/g/text is left out", "/g/time is left out", "/g/z is left out"] {
        assert!(remarked(&found, words), "{words}: {:?}", found.remarks);
    }
}

#[test]
fn daqmx_scalers_take_their_part_of_the_rows() {
    for big in [false, true] {
        // Buffer 0: rows of 4 bytes (a, b); buffer 1: rows of 2 bytes (c). Two chunks of 2 rows.
        let chunk = |n: i16| i16s(big, &[n, n + 10, n + 1, n + 11, n + 100, n + 101]);
        let raw = [chunk(1), chunk(3)].concat();
        let linear = vec![
            ("NI_Number_Of_Scales", Property::U32(2)),
            ("NI_Scale[1]_Scale_Type", Property::Text("Linear")),
            ("NI_Scale[1]_Linear_Slope", Property::F64(0.5)),
            ("NI_Scale[1]_Linear_Y_Intercept", Property::F64(-1.0)),
            ("NI_Scale[1]_Linear_Input_Source", Property::U32(0)),
        ];
        let daqmx =
            |offset, buffer| Index::Daqmx { values: 2, scalers: vec![(3, offset, buffer, 0)], widths: vec![4, 2] };
        let objects = [
            object("/'g'/'a'", daqmx(0, 0), linear),
            object("/'g'/'b'", daqmx(2, 0), vec![]),
            object("/'g'/'c'", daqmx(0, 1), vec![]),
        ];
        let found = contents(&format!("daqmx-{big}"), &segment(big, ALL | DAQMX | INTERLEAVED, &objects, &raw));
        let a = channel(&found, "/g/a");
        assert_eq!((a.scale_factor, a.add_offset), (0.5, -1.0));
        assert_eq!(values(a), [-0.5, 0.0, 0.5, 1.0]);
        assert_eq!(values(channel(&found, "/g/b")), [11.0, 12.0, 13.0, 14.0]);
        assert_eq!(values(channel(&found, "/g/c")), [101.0, 102.0, 103.0, 104.0]);
    }
}

#[test]
fn digital_lines_are_bits() {
    let line = |bit| Index::Digital { values: 4, code: 0, bit, width: 2 };
    let objects = [object("/'g'/'l3'", line(3), vec![]), object("/'g'/'l9'", line(9), vec![])];
    let raw = [0b1000, 0b10, 0, 0b10, 0b1000, 0, 0xFF, 0xFF];
    let found = contents("digital", &segment(false, ALL | DAQMX | INTERLEAVED, &objects, &raw));
    assert_eq!(values(channel(&found, "/g/l3")), [1.0, 0.0, 1.0, 1.0]);
    assert_eq!(values(channel(&found, "/g/l9")), [1.0, 1.0, 0.0, 1.0]);
}

fn scaled(name: &str, properties: Vec<(&'static str, Property)>) -> Contents {
    let objects = [object("/'g'/'a'", Index::Plain { code: 2, values: 3 }, properties)];
    contents(name, &segment(false, ALL, &objects, &i16s(false, &[0, 1, 2])))
}

#[test]
fn scales_chain() {
    let found = scaled(
        "chain",
        vec![
            ("NI_Scaling_Status", Property::Text("unscaled")),
            ("NI_Number_Of_Scales", Property::U32(2)),
            ("NI_Scale[0]_Scale_Type", Property::Text("Linear")),
            ("NI_Scale[0]_Linear_Slope", Property::F64(2.0)),
            ("NI_Scale[0]_Linear_Y_Intercept", Property::F64(1.0)),
            ("NI_Scale[0]_Linear_Input_Source", Property::U32(u32::MAX)),
            ("NI_Scale[1]_Scale_Type", Property::Text("Polynomial")),
            ("NI_Scale[1]_Polynomial_Coefficients_Size", Property::U32(3)),
            ("NI_Scale[1]_Polynomial_Coefficients[0]", Property::F64(0.5)),
            ("NI_Scale[1]_Polynomial_Coefficients[1]", Property::F64(0.0)),
            ("NI_Scale[1]_Polynomial_Coefficients[2]", Property::F64(1.0)),
            ("NI_Scale[1]_Polynomial_Input_Source", Property::U32(0)),
            ("unit_string", Property::Text("nm")),
        ],
    );
    let a = channel(&found, "/g/a");
    // (2 n + 1)^2 + 0.5
    assert_eq!(values(a), [1.5, 9.5, 25.5]);
    assert_eq!((a.scale_factor, a.add_offset, a.unit.as_str()), (1.0, 0.0, "nm"));
    assert!(matches!(a.source.read(0, 1), Ok(Raw::Float64(_))));
}

#[test]
fn scales_that_cannot_be_applied_leave_the_channel_out_by_name() {
    for kind in ["Table", "RTD", "Thermistor", "Strain", "Thermocouple", "Add", "Subtract"] {
        let found = scaled(
            kind,
            vec![("NI_Number_Of_Scales", Property::U32(1)), ("NI_Scale[0]_Scale_Type", Property::Text(kind))],
        );
        assert!(found.channels.is_empty() && remarked(&found, kind), "{kind}: {:?}", found.remarks);
    }
    let circle = scaled(
        "circle",
        vec![
            ("NI_Scale[0]_Scale_Type", Property::Text("Linear")),
            ("NI_Scale[0]_Linear_Slope", Property::F64(2.0)),
            ("NI_Scale[0]_Linear_Y_Intercept", Property::F64(1.0)),
            ("NI_Scale[0]_Linear_Input_Source", Property::U32(0)),
        ],
    );
    assert!(remarked(&circle, "no end"));
    let lacking = scaled("lacking", vec![("NI_Scale[0]_Scale_Type", Property::Text("Linear"))]);
    assert!(remarked(&lacking, "lacks the property"));
    let done = scaled(
        "done",
        vec![("NI_Scaling_Status", Property::Text("scaled")), ("NI_Scale[0]_Scale_Type", Property::Text("Linear"))],
    );
    assert_eq!(values(channel(&done, "/g/a")), [0.0, 1.0, 2.0]);
}

/// A segment of four samples that states a start.
fn timed(start: i64, fraction: u64) -> Vec<u8> {
    let properties = vec![("wf_start_time", Property::Time(start, fraction)), ("wf_increment", Property::F64(0.25))];
    let objects = [object("/'g'/'a'", Index::Plain { code: 2, values: 4 }, properties)];
    segment(false, ALL, &objects, &i16s(false, &[1, 2, 3, 4]))
}

#[test]
fn a_start_that_does_not_follow_is_a_gap() {
    // Continues after 4 samples of 0.25 s; is then repeated; begins again 10 s later.
    let bytes = [timed(1000, 0), timed(1001, 0), timed(1001, 0), timed(1013, 1 << 63)].concat();
    let found = contents("gaps", &bytes);
    let a = channel(&found, "/g/a");
    assert_eq!((a.gaps.as_slice(), a.sample_rate_hz), (&[12][..], Some(4.0)));
    assert_eq!(found.started_at, "1904-01-01T00:16:40Z");
}

#[test]
fn another_increment_is_a_gap_and_leaves_no_rate() {
    let slower = [object("/'g'/'a'", Index::Same, vec![("wf_increment", Property::F64(0.5))])];
    let found =
        contents("rates", &[timed(1000, 0), segment(false, META | RAW, &slower, &i16s(false, &[5, 6, 7, 8]))].concat());
    let a = channel(&found, "/g/a");
    assert_eq!((a.gaps.as_slice(), a.sample_rate_hz), (&[4][..], None));
    assert!(remarked(&found, "no one sample rate"));
}

#[test]
fn cut_off_segments_give_what_is_whole() {
    let contiguous = segment(
        false,
        ALL,
        &[plain("/'g'/'a'", 2, 4), plain("/'g'/'b'", 2, 4)],
        &i16s(false, &[1, 2, 3, 4, 5, 6, 7, 8]),
    );
    let found = contents("cut-contiguous", &contiguous[..contiguous.len() - 3]);
    assert_eq!(values(channel(&found, "/g/a")), [1.0, 2.0, 3.0, 4.0]);
    assert_eq!(values(channel(&found, "/g/b")), [5.0, 6.0]);
    assert!(remarked(&found, "the file ends before the segment at byte 0 does"));
    let rows = segment(
        false,
        ALL | INTERLEAVED,
        &[plain("/'g'/'a'", 2, 4), plain("/'g'/'b'", 2, 4)],
        &i16s(false, &[1, 2, 3, 4, 5, 6, 7, 8]),
    );
    let found = contents("cut-interleaved", &rows[..rows.len() - 3]);
    assert_eq!(values(channel(&found, "/g/a")), [1.0, 3.0, 5.0]);
    assert_eq!(values(channel(&found, "/g/b")), [2.0, 4.0, 6.0]);
    // A length of 2^64 - 1: the program ended before it closed the file.
    let mut open_end = contiguous.clone();
    open_end[12..20].fill(0xFF);
    assert_eq!(values(channel(&contents("never-closed", &open_end), "/g/b")), [5.0, 6.0, 7.0, 8.0]);
    // Within the second segment's lead-in and metadata.
    let two = [contiguous.clone(), timed(1000, 0)].concat();
    for cut in [10, 60] {
        let found = contents("cut-metadata", &two[..contiguous.len() + cut]);
        assert_eq!(values(channel(&found, "/g/a")).len(), 4);
        assert!(remarked(&found, "within the metadata"));
    }
    // A whole segment whose last chunk is smaller: fewer values of each.
    let smaller = segment(
        false,
        ALL,
        &[plain("/'g'/'a'", 2, 4), plain("/'g'/'b'", 2, 4)],
        &i16s(false, &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12]),
    );
    let found = contents("smaller-chunk", &smaller);
    assert_eq!(values(channel(&found, "/g/a")), [1.0, 2.0, 3.0, 4.0, 9.0, 10.0]);
    assert_eq!(values(channel(&found, "/g/b")), [5.0, 6.0, 7.0, 8.0, 11.0, 12.0]);
}

#[test]
fn damage_is_refused_with_its_byte() {
    let good = segment(false, ALL, &[plain("/'g'/'a'", 2, 2)], &i16s(false, &[1, 2]));
    let changed = |at: usize, bytes: &[u8]| {
        let mut copy = good.clone();
        copy[at..at + bytes.len()].copy_from_slice(bytes);
        copy
    };
    // Metadata: 28 number of objects, 32 path's length, 36 path, 44 index, 48 type, 52 dimension, 56 values.
    let cases = [
        ("tag", changed(0, b"TDSx"), 0, "«TDSm» was wanted"),
        ("index-file", changed(0, b"TDSh"), 0, "«TDSm» was wanted"),
        ("version", changed(8, &[1]), 8, "4712 (1.0) or 4713"),
        ("lengths", changed(20, &[200]), 12, "the whole segment"),
        ("path", changed(32, &[255]), 36, "bytes"),
        ("index", changed(44, &[21]), 44, "raw data index"),
        ("type", changed(48, &[99]), 48, "which TDMS does not have"),
        ("extended", changed(48, &[11]), 48, "not defined"),
        ("dimension", changed(52, &[2]), 52, "dimensions"),
        ("values", changed(56, &[255; 8]), 56, "no file holds"),
        ("same-as-nothing", changed(44, &[0; 4]), 44, "none came before"),
        ("no-values", changed(56, &[0; 8]), 68, "none of its objects has any"),
        ("empty", Vec::new(), 0, "empty"),
        ("cut-lead-in", good[..20].to_vec(), 0, "within the first segment's metadata"),
        ("cut-first-metadata", good[..50].to_vec(), 0, "within the first segment's metadata"),
    ];
    for (name, bytes, at, words) in cases {
        let error = error(name, &bytes);
        assert!(error.problem.contains(words) && error.help.is_some(), "{name}: {error:?}");
        assert_eq!(error.at_byte, Some(at), "{name}: {error:?}");
    }
    let property = segment(false, META | NEW_LIST, &[object("/", Index::None, vec![("p", Property::U32(1))])], &[]);
    let mut unknown = property.clone();
    unknown[28 + 4 + 5 + 4 + 4 + 5] = 11;
    assert!(error("property", &unknown).problem.contains("extended float"));
    let mixed =
        [plain("/'g'/'a'", 2, 1), object("/'g'/'b'", Index::Digital { values: 1, code: 0, bit: 0, width: 1 }, vec![])];
    assert!(error("mixed", &segment(false, ALL, &mixed, &[0; 3])).problem.contains("mixes DAQmx"));
    let outside = [object("/'g'/'b'", Index::Digital { values: 1, code: 0, bit: 8, width: 1 }, vec![])];
    assert!(error("outside", &segment(false, ALL, &outside, &[0; 3])).problem.contains("the row has 1 bytes"));
    let uneven = [plain("/'g'/'a'", 2, 1), plain("/'g'/'b'", 2, 2)];
    assert!(error("uneven", &segment(false, ALL | INTERLEAVED, &uneven, &[0; 6])).problem.contains("another number"));
}

#[test]
fn a_file_that_changes_its_size_is_refused() {
    let bytes = timed(1000, 0);
    let path = crate::support::file("grows.tdms", &bytes);
    let found = Tdms::open(&path).unwrap();
    std::fs::write(&path, [bytes.clone(), bytes].concat()).unwrap();
    assert!(found.channels[0].source.read(0, 1).unwrap_err().problem.contains("bytes when it was opened"));
    assert!(Tdms::open(&path.join("nowhere")).is_err());
}

#[test]
fn files_are_recognised() {
    let path = std::path::Path::new("x");
    assert!(Tdms::recognises(b"TDSm\x0e\0\0\0", path));
    assert!(!Tdms::recognises(b"TDSh", path) && !Tdms::recognises(b"", path));
}

#[test]
fn a_rate_by_name_is_taken_where_there_is_no_waveform() {
    let named = |name, value| vec![(name, value)];
    let channel_of = |properties| object("/'g'/'a'", Index::Plain { code: 2, values: 2 }, properties);
    let open = |name: &str, objects: &[Object]| contents(name, &segment(false, ALL, objects, &i16s(false, &[1, -2])));
    let rate = |found: &Contents| channel(found, "/g/a").sample_rate_hz;
    let own = open("own", &[channel_of(named("SamplingFrequency", Property::F64(5120.0)))]);
    assert_eq!(rate(&own), Some(5120.0));
    assert!(remarked(&own, "the sampling rate is taken from /'g'/'a'@SamplingFrequency = 5120"));
    let root = object("/", Index::None, named("Sampling Rate", Property::Text("2000")));
    assert_eq!(rate(&open("root", &[root, channel_of(Vec::new())])), Some(2000.0));
    let group = object("/'g'", Index::None, named("dt", Property::F64(0.01)));
    assert_eq!(rate(&open("group", &[group, channel_of(Vec::new())])), Some(100.0));
    let both = vec![("wf_increment", Property::F64(0.5)), ("fs", Property::F64(7.0))];
    assert_eq!(rate(&open("both", &[channel_of(both)])), Some(2.0));
}

#[test]
fn a_channel_of_times_is_an_axis() {
    let objects = [plain("/'g'/'Time'", 10, 4), plain("/'g'/'a'", 2, 4)];
    let raw = [f64s(false, &[0.0, 0.25, 0.5, 0.75]), i16s(false, &[1, -2, 3, -4])].concat();
    let found = contents("times", &segment(false, ALL, &objects, &raw));
    assert_eq!(locations(&found), ["/g/a"]);
    assert_eq!(channel(&found, "/g/a").sample_rate_hz, Some(4.0));
}
