//! LVM files and plain tables: built ones, and real ones against lvm_read 1.26.

use crate::support::{assert_sum, channel, locations, open, real, remarked, values};
use afmid_formats::readers::text_table::TextTable;
use afmid_formats::{Contents, Format, FormatError};
use std::path::Path;

fn table(name: &str, text: &str) -> Contents {
    open::<TextTable>(name, text.as_bytes()).unwrap()
}

fn error(name: &str, bytes: &[u8]) -> FormatError {
    open::<TextTable>(name, bytes).unwrap_err()
}

type Expected<'a> = (&'a str, &'a str, Option<f64>, usize, f64, f64);

/// Location, unit, rate, samples, sum and first value. The reference:
/// `lvm_read.read(path, read_from_pickle=False, dump_file=False)[0]`, of it `np.nansum(s['data'], axis=0)` and the
/// header.
fn real_lvm(name: &str, started_at: &str, channels: &[Expected]) -> Option<Contents> {
    let found = TextTable::open(&real(&format!("lvm/{name}"))?).unwrap();
    assert_eq!(found.started_at, started_at);
    assert_eq!(locations(&found), channels.iter().map(|c| c.0).collect::<Vec<_>>());
    for (location, unit, rate, samples, sum, first) in channels {
        let c = channel(&found, location);
        let found = values(c);
        assert_eq!(
            (c.unit.as_str(), c.sample_rate_hz, found.len(), found[0]),
            (*unit, *rate, *samples, *first),
            "{location}"
        );
        assert_sum(&found, *sum);
        assert!(c.gaps.is_empty());
    }
    Some(found)
}

#[test]
fn lvm_with_x_for_every_channel() {
    let channels = [
        ("Voltage", "Volts", Some(51200.0), 3, -0.104302, -0.035229),
        ("Acceleration", "g", Some(51200.0), 3, 1.50314, 0.532608),
    ];
    if let Some(found) = real_lvm("multi_time_column.lvm", "2016-08-23T10:45:47.035255731", &channels) {
        // The file was shortened by hand.
        assert!(remarked(&found, "says 51200 samples, there are 3"));
        assert_eq!(found.format, "LabVIEW measurement (LVM 2)");
    }
}

#[test]
fn lvm_without_a_decimal_separator() {
    let channels = [
        ("ax", "g", Some(4000.0), 4, 0.012475000000000007, -0.008807),
        ("ay", "g", Some(4000.0), 4, -0.093938, -0.028189),
        ("az", "g", Some(4000.0), 4, 0.014253000000000002, 0.021503),
    ];
    real_lvm("no_decimal_separator.lvm", "2016-12-12T09:54:07.483999", &channels);
}

#[test]
fn lvm_with_decimal_commas_and_no_x() {
    let channels = [
        ("Excitation (Trigger)", "Newtons", Some(25600.0), 10, 6.917138, 0.914018),
        ("Response (Trigger)", "m/s^2", Some(25600.0), 10, 12.138708000000001, 1.204792),
    ];
    real_lvm("short.lvm", "2013-02-19T09:51:40.727189064", &channels);
}

#[test]
fn lvm_with_comments_and_uneven_x() {
    let channels = [
        ("Pressão ABS. (MPa)", "MPa", None, 9, 15.257150000000001, 1.833787),
        ("X_Value", "s", None, 9, 29.362344999999998, 0.0),
        ("Temperatura (°C)", "°C", None, 9, 48.866488000000004, 5.479238),
        ("Volume (ml)", "ml", None, 9, 718.5731000000001, 0.0),
    ];
    if let Some(found) = real_lvm("with_comments.lvm", "2020-08-07T09:47:02.101084232", &channels) {
        assert!(remarked(&found, "9 rows have comments"));
        assert!(remarked(&found, "no sample rate"));
    }
}

#[test]
fn lvm_with_empty_fields() {
    let channels = [
        ("Dev0/Ai0", "", Some(1000.0), 7, -0.09976299999999999, -0.011923),
        ("Dev0/Ai2", "", Some(1000.0), 7, 50.767824999999995, 7.254639),
        ("Dev0/Ai0 1", "", Some(1000.0), 7, -0.09976299999999999, -0.011923),
    ];
    if let Some(found) = real_lvm("with_empty_fields.lvm", "2016-08-11T15:37:48.375", &channels) {
        assert!(remarked(&found, "Untitled 3 has no samples"));
    }
}

const LVM_HEAD: &str = "LabVIEW Measurement\t\r\nWriter_Version\t2\r\nSeparator\tTab\r\nDecimal_Separator\t.\r\n\
    Multi_Headings\tYes\r\nX_Columns\tNo\r\n***End_of_Header***\t\r\n\r\n";

fn section(time: &str, x0: &str, rows: &str) -> String {
    let head = format!("Channels\t2\t\t\nSamples\t2\t2\t\nDate\t2020/01/01\t2020/01/01\t\nTime\t{time}\t{time}\t\n");
    let units = "Y_Unit_Label\tV\tnm\t\nX_Dimension\tTime\tTime\t\n";
    format!(
        "{head}{units}X0\t{x0}\t{x0}\t\nDelta_X\t0.5\t0.5\t\n***End_of_Header***\t\t\t\nX_Value\ta\tb\tComment\n{rows}"
    )
}

#[test]
fn lvm_sections_join_and_gaps_show() {
    let rows = "\t1\t2\n\t3\t4\n";
    // The second goes on (by its time), the third as well (by X0), the fourth begins 10 s later.
    let text = [
        LVM_HEAD.to_owned(),
        section("00:00:00.0", "0", rows),
        "\r\n".to_owned(),
        section("00:00:01.0", "0", rows),
        section("00:00:01.0", "1.0", rows),
        "\t\n".to_owned(),
        section("00:00:13.0", "0", rows),
    ]
    .concat();
    let found = table("sections.lvm", &text);
    let a = channel(&found, "a");
    assert_eq!(values(a), [1.0, 3.0, 1.0, 3.0, 1.0, 3.0, 1.0, 3.0]);
    assert_eq!((a.gaps.as_slice(), a.sample_rate_hz, a.unit.as_str()), (&[6][..], Some(2.0), "V"));
    assert_eq!(found.started_at, "2020-01-01T00:00:00");
    assert!(found.remarks.is_empty(), "{:?}", found.remarks);
}

#[test]
fn lvm_times_that_jump_are_gaps_and_sections_behind_them_go_on() {
    let row = |x: f64| format!("{x:.2}\t{x}\t1\n");
    let part = |from: f64| (0..40).map(|k| row(from + 0.5 * f64::from(k))).collect::<String>();
    let rows = part(0.0) + &part(30.0);
    let head = LVM_HEAD.replace("X_Columns\tNo", "X_Columns\tOne");
    assert_ne!(head, LVM_HEAD);
    for step in ["0.5", ""] {
        let sections = [section("00:00:00.0", "0", &rows), "\n".to_owned(), section("00:00:00.0", "0", &part(50.0))];
        let text = head.clone() + &sections.concat().replace("Delta_X\t0.5\t0.5", &format!("Delta_X\t{step}\t{step}"));
        let found = table("jump.lvm", &text);
        let a = channel(&found, "a");
        assert_eq!((a.sample_rate_hz, a.gaps.as_slice()), (Some(2.0), &[40][..]), "{step} {:?}", found.remarks);
        assert!(remarked(&found, "a gap"), "{:?}", found.remarks);
    }
}

#[test]
fn lvm_rows_behind_a_blank_line_go_on_and_holes_are_nan() {
    let special = "***Start_Special***\nanything\t1\n***End_Special***\n";
    let text =
        [LVM_HEAD, special, &section("00:00:00.0", "0", "\t1\t2\tok\n\t\t4\n\t5\tx\n\t7\t8\n\n\t9\t10\n")].concat();
    let found = table("holes.lvm", &text);
    let a = values(channel(&found, "a"));
    assert!(a[1].is_nan() && a[0] == 1.0 && a[2..] == [5.0, 7.0, 9.0]);
    assert!(channel(&found, "a").gaps.is_empty());
    for words in ["1 samples are missing", "1 fields are text", "1 rows have comments", "special block"] {
        assert!(remarked(&found, words), "{words}: {:?}", found.remarks);
    }
}

#[test]
fn lvm_damage_is_refused() {
    let cases = [
        ("no-end", "LabVIEW Measurement\nSeparator\tTab\n".to_owned(), "***End_of_Header*** was wanted"),
        ("nothing", LVM_HEAD.to_owned(), "rows were wanted"),
        ("no-titles", format!("{LVM_HEAD}Channels\t1\n***End_of_Header***\n1\t2\n"), "row of titles"),
        ("no-section-end", format!("{LVM_HEAD}Channels\t1\n"), "***End_of_Header*** was wanted"),
        ("no-special-end", format!("{LVM_HEAD}***Start_Special***\n"), "***End_Special***"),
        ("decimal", LVM_HEAD.replace("Decimal_Separator\t.", "Decimal_Separator\t;"), "«.» or «,»"),
    ];
    for (name, text, words) in cases {
        let error = error(&format!("{name}.lvm"), text.as_bytes());
        assert!(error.problem.contains(words) && error.at_byte.is_some(), "{name}: {error:?}");
    }
}

#[test]
fn plain_tables_are_understood_whatever_their_delimiter() {
    let cases = [
        ("tab.txt", "Time (s)\tDeflection (V)\n0.0\t1.5\n0.1\t-2.5\n0.2\t3e-3\n"),
        ("comma.csv", "Time [s],Deflection [V]\n0.0,1.5\n0.1,-2.5\n0.2,3e-3\n"),
        ("semicolon.csv", "\u{feff}\"Time (s)\";\"Deflection (V)\"\r\n0,0;1,5\r\n0,1;-2,5\r\n0,2;3e-3\r\n"),
        ("blanks.dat", "# recorded today\n# Time (s)  Deflection (V)\n  0.0   1.5\n  0.1  -2.5\n  0.2  3e-3\n"),
        ("units.dat", "% a comment\nTime\tDeflection\ns\tV\n0,0\t1,5\n0,1\t-2,5\n0,2\t3e-3\n"),
        ("bracket-units.tsv", "Time\tDeflection\n[s]\t[V]\n0.0\t1.5\n\n# in between\n0.1\t-2.5\n0.2\t3e-3"),
    ];
    for (name, text) in cases {
        let found = table(name, text);
        assert_eq!(locations(&found), ["Deflection"], "{name}: {found:?}");
        let c = channel(&found, "Deflection");
        assert_eq!(values(c), [1.5, -2.5, 3e-3], "{name}");
        assert_eq!((c.unit.as_str(), c.sample_rate_hz), ("V", Some(10.0)), "{name}");
        assert!(remarked(&found, "given as the sample rate"));
    }
}

#[test]
fn times_that_are_not_even_or_in_another_unit() {
    let lost = table("lost.csv", "Time (s),a\n0.000,1\n0.100,2\n0.200,3\n0.400,4\n");
    assert_eq!(locations(&lost), ["Time", "a"]);
    assert_eq!(channel(&lost, "a").sample_rate_hz, None);
    assert!(remarked(&lost, "gives no sample rate: it wanders: row 3 is furthest"), "{:?}", lost.remarks);
    let micro = table("micro.csv", "time (us),a\n0,1\n2,2\n4,3\n6,4\n");
    assert_eq!(channel(&micro, "a").sample_rate_hz, Some(500_000.0));
    let odd = table("odd.csv", "t (weeks),a\n0,1\n2,2\n4,3\n");
    assert!(remarked(&odd, "no unit of time") && channel(&odd, "a").sample_rate_hz.is_none());
    let rounded = table("rounded.csv", "t (s),a\n0.000000,1\n0.000020,2\n0.000039,3\n0.000059,4\n0.000078,5\n");
    assert!(remarked(&rounded, "is rounded") && channel(&rounded, "a").sample_rate_hz.is_some());
    let unnamed = table("unnamed.txt", "0 5\n1 6\n2 7\n");
    assert_eq!(locations(&unnamed), ["column_1", "column_2"]);
    assert!(remarked(&unnamed, "rises evenly") && unnamed.channels[1].sample_rate_hz.is_none());
}

#[test]
fn holes_text_columns_and_one_column() {
    let found = table("holes.csv", "n,a,when,b\n1,1.5,12:00:01,\n2,,12:00:02,\n3,oops,12:00:03,\n4,4.5,12:00:04,\n");
    assert_eq!(locations(&found), ["n", "a"]);
    let a = values(channel(&found, "a"));
    assert!(a[0] == 1.5 && a[1].is_nan() && a[2].is_nan() && a[3] == 4.5);
    for words in [
        "a: 2 samples are missing and given as NaN, 1 fields are text (the first in line 4)",
        "when is text",
        "b is empty",
    ] {
        assert!(remarked(&found, words), "{words}: {:?}", found.remarks);
    }
    // a mark in a row is no header
    let marked = table("marked.csv", "t,mark,a\n0,,1\n1,,2\n2,trigger,3\n3,,4\n");
    assert_eq!(values(marked.channels.last().unwrap()), [1.0, 2.0, 3.0, 4.0]);
    let one = table("one.txt", "Deflection (V)\n1.5\n2.5\n3.5\n");
    assert_eq!((locations(&one), values(&one.channels[0])), (vec!["Deflection"], vec![1.5, 2.5, 3.5]));
    let comma = table("decimal.txt", "0,05\n1,10\n");
    assert_eq!(values(&comma.channels[0]), [0.05, 1.1]);
    let pairs = table("pairs.csv", "1,2\n3,4\n");
    assert!(pairs.channels.len() == 2 && remarked(&pairs, "decimal comma"));
    let cut = table("cut.csv", "a,b\n1,2\n3,4\n5");
    assert!(values(&cut.channels[0]) == [1.0, 3.0] && remarked(&cut, "cut off"));
    for (name, text) in [
        ("end.csv", "a;b\n1;2.5;\n3;4.5;\n"),
        ("ends.csv", "a;b;\n1;2.5;\n3;4.5;\n"),
        ("head.csv", "a;b;\n1;2.5\n3;4.5\n"),
    ] {
        let end = table(name, text);
        assert_eq!((locations(&end), values(&end.channels[1])), (vec!["a", "b"], vec![2.5, 4.5]), "{name}");
        assert!(!remarked(&end, "empty"), "{name}: {:?}", end.remarks);
    }
    let same = table("same.csv", "a,a\n1,2.5\n3,4.5\n");
    assert_eq!(locations(&same), ["a", "a[2]"]);
}

#[test]
fn what_is_no_table_is_refused() {
    let cases: [(&str, Vec<u8>, &str); 5] = [
        ("words.txt", b"no numbers\nhere\n".to_vec(), "row of numbers"),
        ("empty.csv", Vec::new(), "row of numbers"),
        ("zero.dat", b"1,2\n3,4\n\0\n".to_vec(), "byte 0"),
        ("wide.csv", b"1,2\n3,4\n5,6,7\n8,9\n".to_vec(), "line 3 has 3 fields, 2 were wanted"),
        ("long.txt", vec![b'1'; 3 << 20], "longer than"),
    ];
    for (name, bytes, words) in cases {
        let error = error(name, &bytes);
        assert!(error.problem.contains(words) && error.help.is_some() && error.at_byte.is_some(), "{name}: {error:?}");
    }
    // Rows that lack nearly all of 4000 fields, but for the last one: 64 MB of NaN from 50 kB.
    let names: Vec<String> = (0..4000).map(|n| n.to_string()).collect();
    let short = "1\n".repeat(2000);
    let bomb = format!("{LVM_HEAD}X_Value\t{}\n{short}{}\n", names.join("\t"), names.join("\t"));
    assert!(error("bomb.lvm", bomb.as_bytes()).problem.contains("more empty fields than the file has bytes"));
}

#[test]
fn tables_are_recognised_by_name_and_looks() {
    let is = |name: &str, head: &[u8]| TextTable::recognises(head, std::path::Path::new(name));
    assert!(is("x", b"LabVIEW Measurement\t\r\n") && is("x", b"\xEF\xBB\xBFLabVIEW Measurement"));
    assert!(is("a.CSV", b"t,a\n1,2\n") && is("a.dat", b"1 2\n3 4\n"));
    assert!(
        !is("a.bin", b"1 2\n") && !is("a", b"1 2\n") && !is("a.dat", b"1 2\n\0") && !is("a.txt", b"Dear reader,\n")
    );
    assert!(!is("a.txt", b"    -1\n    58\n1 2 3\n") && !is("a.csv", b""));
}

/// Location, unit and rate of each channel.
fn described(contents: &Contents) -> Vec<(&str, &str, Option<f64>)> {
    contents.channels.iter().map(|c| (c.location.as_str(), c.unit.as_str(), c.sample_rate_hz)).collect()
}

#[test]
fn headers_of_oscilloscopes_are_no_samples() {
    // The layouts are those of the writers' files; three rows of samples each, at 1 kHz.
    let files = [
        ("keysight.csv", "x-axis,1,2\nsecond,Volt,Volt\n-1.0E-03,1,4\n+0.0E+00,2,5\n+1.0E-03,3,6\n", ["1", "2"]),
        (
            "rigol_z.csv",
            "X,CH1,CH2,Start,Increment,\r\nSequence,Volt,Volt,-2.0e-03,1.0e-03\r\n0,1,4,,\r\n1,2,5,,\r\n2,3,6,,\r\n",
            ["CH1", "CH2"],
        ),
        ("rigol_5.csv", "CH1(V),CH2(V),,t0 =-5e-05, tInc = 1e-03,\n1,4,,\n2,5,,\n3,6,,\n", ["CH1", "CH2"]),
        (
            "rigol_e.csv",
            "\"Number of Data points =\",3,\n\"Sampling Frequency (Hz)=\",1000,\n\"Scale (V/DIV) = \",0.1,2\n\
             \"Time (s)\",\"a (V)\",\"b (V)\"\n0,1,4\n1E-3,2,5\n2E-3,3,6\n",
            ["a", "b"],
        ),
        (
            "tektronix.csv",
            "Model,TBS\r\n\r\nHorizontal Units,S\r\nHorizontal Scale,0.1\r\nSample Interval,0.001\r\n\
             Vertical Units,V\r\nLabel,\r\nTIME,CH1,CH2\r\n-8.000e-01,1,4\r\n-7.990e-01,2,5\r\n-7.980e-01,3,6\r\n",
            ["CH1", "CH2"],
        ),
        (
            "siglent.csv",
            "Record Length,Analog:3\nSample Interval,Analog:0.001\nVertical Units,CH1:V,CH2:V\nSource,CH1,CH2\n\
             Second,Volt,Volt\n-0.001,1,4\n0,2,5\n0.001,3,6\n",
            ["CH1", "CH2"],
        ),
        ("rohde.csv", "in s,C1 in V,C2 in V\n0E+00,1,4\n1E-03,2,5\n2E-03,3,6\n", ["C1", "C2"]),
        ("rigol_d.csv", "X,CH1,CH2,\nSecond,Volt,Volt,\n-1.0e-03,1,4,\n0,2,5,\n1.0e-03,3,6,\n", ["CH1", "CH2"]),
        (
            "lecroy.csv",
            "LECROYWR64Xi-A,50672,Waveform\nSegments,1,SegmentSize,3\nSegment,TrigTime,TimeSinceSegment1\n\
             #1,09-Nov-2022 09:23:52,0\nTime,C1 (V),C2 (V)\n-1e-03,1,4\n0,2,5\n1e-03,3,6\n",
            ["C1", "C2"],
        ),
        (
            "yokogawa.csv",
            "\"Header Size\",6\n\"Model Name\",\"DL850\"\n\"TraceName\",\"A\",\"B\"\n\"BlockSize\",3,3\n\
             \"VUnit\",\"V\",\"V\"\n\"HResolution\",1E-03,1E-03\n\"\",\"A (V)\",\"B (V)\"\n,1,4\n,2,5\n,3,6\n",
            ["A", "B"],
        ),
        ("pico.csv", "Time,A,B\n(ms),(V),(V)\n\n0.0,1,4\n1.0,2,5\n2.0,3,6\n", ["A", "B"]),
        (
            "cassy.txt",
            "MIN=0\t-1\t-5\r\nMAX=905,1\t1\t5\r\nSCALE=905,1\t0,5\t5\r\nDEC=1\t3\t4\r\n\
             DEF=\"Zeit\" t / s\t\"U\" U_B1 / V\t\"U_k\" U_k / V\r\n0\t1\t4\r\n0,001\t2\t5\r\n0,002\t3\t6\r\n",
            ["U", "U_k"],
        ),
        (
            "labview.csv",
            "waveform,a (V),b (V)\nt0,4/16/2021  11:31:19.5,4/16/2021  11:31:19.5\ndelta t,1E-3,1E-3\n\n\
             time,a (V),b (V)\n4/16/2021  11:31:19.5,1,4\n4/16/2021  11:31:19.501,2,5\n4/16/2021  11:31:19.502,3,6\n",
            ["a", "b"],
        ),
        ("comments.dat", "# fs = 1 kHz\n# n\ta [V]\tb [V]\n0\t1\t4\n1\t2\t5\n2\t3\t6\n", ["a", "b"]),
    ];
    for (name, text, locations) in files {
        let found = table(name, text);
        let wanted: Vec<_> = locations.iter().map(|location| (*location, "V", Some(1000.0))).collect();
        assert_eq!(described(&found), wanted, "{name}: {:?}", found.remarks);
        assert_eq!(values(&found.channels[0]), [1.0, 2.0, 3.0], "{name}");
        assert_eq!(values(&found.channels[1]), [4.0, 5.0, 6.0], "{name}");
    }
}

#[test]
fn a_header_beside_the_rows_is_no_channel() {
    // Tektronix TDS: 18 lines of the header, then rows go on without it.
    let mut text = "Record Length,5.0e+01,,0.0000,1\nSample Interval,1.0e-03,,0.0010,2\nSource,CH1,,0.0020,3\n\
        Vertical Units,V,,0.0030,4\nHorizontal Units,s,,0.0040,5\n"
        .to_owned();
    for row in 5..50 {
        text += &format!(",,,0.{row:03}0,{}\n", row + 1);
    }
    let found = table("tds.csv", &text);
    assert_eq!(described(&found), [("CH1", "V", Some(1000.0))], "{:?}", found.remarks);
    assert_eq!(values(&found.channels[0]), (1..=50).map(f64::from).collect::<Vec<f64>>());
    assert!(remarked(&found, "numbers behind words, values of a header"), "{:?}", found.remarks);
}

#[test]
fn each_channel_s_own_times_are_no_signals() {
    // Tektronix MSO: a pair of columns for each channel
    let mut text =
        "Model,MSO44\nSample Interval,1.0e-03,,1.0e-03,\nVertical Units,V,,V,\nLabel,,,,\nTIME,CH1,,TIME,CH2\n"
            .to_owned();
    for row in 0..40 {
        text += &format!("0.{row:03}0,{row},,0.{row:03}0,{}\n", row * row);
    }
    let found = table("mso.csv", &text);
    assert_eq!(described(&found), [("CH1", "V", Some(1000.0)), ("CH2", "V", Some(1000.0))], "{:?}", found.remarks);
    assert!(remarked(&found, "TIME[2] has the same times as TIME"), "{:?}", found.remarks);
}

#[test]
fn a_first_row_with_fewer_delimiters_is_no_header() {
    // Rigol: the first row ends before the columns of start and increment
    let mut text = "X,CH1,CH2,Start,Increment\nSequence,Volt,Volt,-2.0e-03,1.0e-03\n0,5,7,\n".to_owned();
    for row in 1..40 {
        text += &format!("{row},{},{},,\n", 5 + row, 7 * row);
    }
    let found = table("rigol.csv", &text);
    assert_eq!(described(&found), [("CH1", "V", Some(1000.0)), ("CH2", "V", Some(1000.0))], "{:?}", found.remarks);
    assert_eq!((values(&found.channels[0])[0], found.channels[0].samples), (5.0, 40));
}

#[test]
fn times_of_day_give_the_rate_where_nothing_else_does() {
    let rows = |time: &dyn Fn(usize) -> String| (0..40).map(|k| format!("{},{k}\n", time(k))).collect::<String>();
    let table_of =
        |name: &str, header: &str, time: &dyn Fn(usize) -> String| table(name, &(header.to_owned() + &rows(time)));
    let of_day = table_of("clock.csv", "Time,Acc (g)\n", &|k| format!("12:00:00.{:03}", 4 * k));
    assert_eq!(described(&of_day), [("Acc", "g", Some(250.0))], "{:?}", of_day.remarks);
    let iso = table_of("iso.csv", "when,a\n", &|k| format!("2023-03-01T10:00:00.{:03}Z", 2 * k));
    assert_eq!(described(&iso), [("a", "", Some(500.0))], "{:?}", iso.remarks);
    // a header that states the interval is believed, and so are times in numbers
    let stated = table_of("stated.csv", "delta t,1E-3\nTime,a\n", &|k| format!("12:00:{:02}", k));
    assert_eq!(described(&stated), [("a", "", Some(1000.0))], "{:?}", stated.remarks);
    // seconds alone do not show the step
    let coarse = table_of("coarse.csv", "Time,a\n", &|k| format!("12:00:0{}", k / 10));
    assert_eq!(described(&coarse), [("Time", "s", None), ("a", "", None)], "{:?}", coarse.remarks);
}

#[test]
fn utf16_is_text_like_any_other() {
    let text = "Zeit/s,Größe (µm)\r\n0.0,1\r\n0.1,2\r\n0.2,3\r\n";
    for big in [false, true] {
        let units = std::iter::once(0xFEFF).chain(text.encode_utf16());
        let bytes: Vec<u8> = units.flat_map(|unit| if big { unit.to_be_bytes() } else { unit.to_le_bytes() }).collect();
        assert!(TextTable::recognises(&bytes, Path::new("a.csv")));
        let found = open::<TextTable>("utf16.csv", &bytes).unwrap();
        assert_eq!(described(&found), [("Größe", "µm", Some(10.0))], "{:?}", found.remarks);
    }
}

#[test]
fn headers_among_the_rows_are_gaps_unless_time_goes_on() {
    let head = "waveform,a\nt0,1/1/2021 10:00:00\ndelta t,1E-3\n\ntime,a\n";
    let blocks = format!("{head}1/1/2021 10:00:00,1\n1/1/2021 10:00:01,2\n{head}1/1/2021 10:00:09,3\n{head}");
    let found = table("blocks.csv", &blocks);
    assert_eq!(described(&found), [("a", "", Some(1000.0))]);
    assert_eq!((values(&found.channels[0]), found.channels[0].gaps.as_slice()), (vec![1.0, 2.0, 3.0], &[2][..]));
    assert!(remarked(&found, "8 lines among the rows are no rows"), "{:?}", found.remarks);
    // The times begin again behind the second header and go on behind the other.
    let again = table("again.csv", "Time (s),a\n0,1\n0.1,2\n0.2,3\nTime (s),a\n0,4\n0.1,5\n0.2,6\n");
    assert_eq!((again.channels[0].sample_rate_hz, again.channels[0].gaps.as_slice()), (Some(10.0), &[3][..]));
    let on = table("on.csv", "Time (s),a\n0,1\n0.1,2\n0.2,3\nTime (s),a\n0.3,4\n0.4,5\n");
    assert_eq!((on.channels[0].sample_rate_hz, on.channels[0].gaps.len(), on.channels[0].samples), (Some(10.0), 0, 5));
    let other = table("other.csv", "dt,1E-3\nn,a\n0,1\n1,2\n2,3\ndt,2E-3\nn,a\n0,4\n1,5\n2,6\n");
    assert!(
        other.channels.iter().all(|c| c.sample_rate_hz.is_none())
            && remarked(&other, "no sample rate: the header says")
    );
}

#[test]
fn a_stated_interval_and_the_times_must_agree() {
    // Printed too coarsely to show the step, which the header states.
    let coarse = table("coarse.csv", "Sample Interval,0.00025\nTIME,a\n0.000,1\n0.000,2\n0.001,3\n0.001,4\n0.001,5\n");
    assert_eq!(described(&coarse), [("a", "", Some(4000.0))], "{:?}", coarse.remarks);
    let wrong = table("wrong.csv", "Sample Interval,0.5\nTIME,a\n0.0,1\n0.1,2\n0.2,3\n");
    assert_eq!(described(&wrong), [("TIME", "", None), ("a", "", None)]);
    assert!(remarked(&wrong, "no sample rate: TIME steps by 0.1, the header says «Sample Interval 0.5»"));
}
