//! Universal files: built ones, and real ones against pyuff 2.5.8.

use crate::support::{assert_sum, locations, open, real, remarked, scope, values};
use afmid_formats::readers::uff::Uff;
use afmid_formats::{Contents, Format, FormatError, Raw};

/// What a test varies in a dataset 58.
#[derive(Clone)]
struct Dataset {
    id: String,
    function: u32,
    response: &'static str,
    node: u32,
    direction: i32,
    kind: u32,
    points: usize,
    even: bool,
    start: f64,
    step: f64,
    abscissa: (u32, &'static str, &'static str),
    data: Vec<u8>,
}

fn time(data: &[u8], kind: u32, points: usize) -> Dataset {
    Dataset {
        id: "    58".to_owned(),
        function: 1,
        response: "NONE",
        node: 12,
        direction: -2,
        kind,
        points,
        even: true,
        start: 0.0,
        step: 0.5,
        abscissa: (17, "time", "s"),
        data: data.to_vec(),
    }
}

/// A dataset with its delimiters.
fn bytes(d: &Dataset) -> Vec<u8> {
    let mut text = format!("    -1\n{}\nfirst line\nNONE\n18-Apr-16 13:49:58\nNONE\nNONE\n", d.id);
    text += &format!(
        "{:5}{:10}{:5}{:10} {:10}{:10}{:4} {:10}{:10}{:4}\n",
        d.function, 0, 0, 0, d.response, d.node, d.direction, "NONE", 0, 0
    );
    text += &format!(
        "{:10}{:10}{:10}{:>13}{:>13}{:>13}\n",
        d.kind,
        d.points,
        u8::from(d.even),
        format!("{:.5E}", d.start),
        format!("{:.5E}", d.step),
        "0.00000E+00"
    );
    let axis =
        |quantity: u32, label: &str, unit: &str| format!("{quantity:10}{:5}{:5}{:5} {label:20} {unit:20}\n", 0, 0, 0);
    text += &axis(d.abscissa.0, d.abscissa.1, d.abscissa.2);
    text += &[axis(8, "Displacement", "m"), axis(0, "NONE", "NONE"), axis(0, "NONE", "NONE")].concat();
    let mut bytes = text.into_bytes();
    bytes.extend(&d.data);
    bytes.extend(b"    -1\n");
    bytes
}

fn contents(name: &str, bytes: &[u8]) -> Contents {
    open::<Uff>(&format!("{name}.uff"), bytes).unwrap()
}

fn error(name: &str, bytes: &[u8]) -> FormatError {
    open::<Uff>(&format!("{name}.uff"), bytes).unwrap_err()
}

fn binary_id(order: u8, bytes: usize) -> String {
    format!("    58b{order:6}{:6}{:12}{bytes:12}{:6}{:6}{:12}{:12}", 2, 11, 0, 0, 0, 0)
}

#[test]
fn a_sound_recorded_as_58b() {
    let Some(path) = real("uff/Sample_UFF58b_bin.uff") else { return };
    let found = Uff::open(&path).unwrap();
    // pyuff.UFF(path).read_sets(): id3, rsp_ent_name, abscissa_inc, ordinate_axis_units_lab; data.sum(), data[0], [1],
    // [39646], [-1].
    assert_eq!(
        (found.format.as_str(), found.started_at.as_str()),
        ("Universal File Format, dataset 58b", "2016-04-18T13:49:58")
    );
    assert_eq!(locations(&found), ["Mic 01"]);
    let c = &found.channels[0];
    assert_eq!((c.unit.as_str(), c.sample_rate_hz, c.stored_as), ("Pa", Some(65_536.0), "float32"));
    // the header's step is 1.52588e-05
    assert!(c.long_name.contains("Mic 01.0Scalar") && found.remarks.is_empty());
    let all = values(c);
    assert_eq!(all.len(), 79_292);
    assert_sum(&all, 5.715040058740556);
    let at = [-0.014755260199308395, -0.017295705154538155, -0.010216998867690563, -0.004314688965678215];
    assert_eq!([all[0], all[1], all[39_646], all[79_291]], at);
}

#[test]
fn a_complex_spectrum_is_a_remark() {
    let Some(path) = real("uff/sample_dataset58_psd.uff") else { return };
    let found = Uff::open(&path).unwrap();
    // pyuff: ord_data_type 5, 3201 points, id3 13-Apr-23 09:57:51.
    assert_eq!(found.started_at, "2023-04-13T09:57:51");
    assert!(
        found.channels.is_empty()
            && remarked(&found, "Pilot 1 (power spectral density), is left out: its 3201 values are complex")
    );
}

#[test]
fn text_in_every_real_form() {
    // Fields that touch; a D for an exponent; fewer in the last line.
    let single = b" 1.000000E+00-2.000000E+00 3.000000E+00 4.000000E+00 5.000000E+00 6.000000E+00\n 7.000000D+00\n";
    let found = contents("single", &bytes(&time(single, 2, 7)));
    assert_eq!(locations(&found), ["12-Y"]);
    let c = &found.channels[0];
    assert_eq!(values(c), [1.0, -2.0, 3.0, 4.0, 5.0, 6.0, 7.0]);
    assert_eq!((c.unit.as_str(), c.sample_rate_hz, c.stored_as), ("m", Some(2.0), "text"));
    let double =
        b"  1.000000000001E+00 -2.000000000000E+00  3.000000000000E+00  4.000000000000E+00\n  5.000000000000E+00\n";
    assert_eq!(
        values(&contents("double", &bytes(&time(double, 4, 5))).channels[0]),
        [1.000_000_000_001, -2.0, 3.0, 4.0, 5.0]
    );
    // Not at the standard's columns.
    assert_eq!(values(&contents("free", &bytes(&time(b"1.0 2.0 3.0\n4.0\n", 2, 4))).channels[0]), [1.0, 2.0, 3.0, 4.0]);
}

#[test]
fn uneven_abscissas_are_channels_of_their_own() {
    let pairs = Dataset {
        even: false,
        ..time(b"  0.00000E+00  1.00000E+00  0.50000E+00  2.00000E+00  2.00000E+00  3.00000E+00\n", 2, 3)
    };
    let found = contents("uneven", &bytes(&pairs));
    assert_eq!(locations(&found), ["12-Y", "12-Y/abscissa"]);
    assert_eq!(values(&found.channels[0]), [1.0, 2.0, 3.0]);
    assert_eq!(values(&found.channels[1]), [0.0, 0.5, 2.0]);
    assert!(found.channels.iter().all(|c| c.sample_rate_hz.is_none()) && remarked(&found, "point by point"));
    let double = b"  0.00000E+00  1.000000000000E+00  0.50000E+00  2.000000000001E+00\n";
    let found = contents("uneven-double", &bytes(&Dataset { even: false, ..time(double, 4, 2) }));
    assert_eq!(values(&found.channels[0]), [1.0, 2.000_000_000_001]);
    // 58b: single precision abscissa, double precision ordinate.
    let mut data = Vec::new();
    for (x, y) in [(0.0_f32, 1.5_f64), (0.5, 2.5)] {
        data.extend(x.to_le_bytes());
        data.extend(y.to_le_bytes());
    }
    let found =
        contents("uneven-58b", &bytes(&Dataset { even: false, id: binary_id(1, data.len()), ..time(&data, 4, 2) }));
    assert_eq!((values(&found.channels[0]), values(&found.channels[1])), (vec![1.5, 2.5], vec![0.0, 0.5]));
    // As pyuff writes and reads it: both double.
    let data: Vec<u8> = [0.0_f64, 1.5, 0.5, 2.5].iter().flat_map(|v| v.to_le_bytes()).collect();
    let found = contents(
        "uneven-58b-wide",
        &bytes(&Dataset { even: false, id: binary_id(1, data.len()), ..time(&data, 4, 2) }),
    );
    assert_eq!((values(&found.channels[0]), values(&found.channels[1])), (vec![1.5, 2.5], vec![0.0, 0.5]));
}

#[test]
fn binary_in_both_byte_orders_and_precisions() {
    // 10 (a line feed) is among the bytes, and a line that looks like a delimiter.
    let single = [1.5_f32, -2.5, f32::from_le_bytes(*b"\n\n\n\n")];
    let double = [1.5_f64, -2.5, f64::from_le_bytes(*b"\n    -1\n")];
    let wide: Vec<f64> = single.iter().map(|&v| f64::from(v)).collect();
    let cases: [(u8, u32, Vec<u8>, &[f64]); 4] = [
        (1, 2, single.iter().flat_map(|v| v.to_le_bytes()).collect(), &wide),
        (2, 2, single.iter().flat_map(|v| v.to_be_bytes()).collect(), &wide),
        (1, 4, double.iter().flat_map(|v| v.to_le_bytes()).collect(), &double),
        (2, 4, double.iter().flat_map(|v| v.to_be_bytes()).collect(), &double),
    ];
    for (order, kind, data, expected) in cases {
        let dataset = Dataset { id: binary_id(order, data.len()), ..time(&data, kind, 3) };
        let found = contents(&format!("binary-{order}-{kind}"), &bytes(&dataset));
        assert_eq!(values(&found.channels[0]), expected);
        assert_eq!(matches!(found.channels[0].source.read(0, 1), Ok(Raw::Float32(_))), kind == 2);
    }
}

/// As pyuff 2.5.8 writes 58b: double precision throughout, and as many bytes stated as the points take as single numbers
/// of the type that is stated.
fn of_pyuff(kind: u32, even: bool, rows: &[&[f64]]) -> Vec<u8> {
    let complex = kind > 4;
    let stated = rows.len() * if matches!(kind, 4 | 6) { 8 } else { 4 };
    let mut text = format!("    -1\n    58b{:6}{:6}{:12}{stated:12}{:6}{:6}{:12}{:12}\n", 1, 2, 11, 0, 0, 0, 0);
    for line in ["id1", "NONE", "NONE", "NONE", "NONE"] {
        text += &format!("{line:80}\n");
    }
    let (function, quantity) = if complex { (4, 18) } else { (1, 17) };
    text += &format!("{function:5}{:10}{:5}{:10}       NONE{:10}{:4}       NONE{:10}{:4}\n", 0, 0, 0, 1, 1, 2, 1);
    let step = if even { "2.50000e-04" } else { "0.00000e+00" };
    text += &format!("{kind:10}{:10}{:10}  0.00000e+00  {step}  0.00000e+00\n", rows.len(), u8::from(even));
    for quantity in [quantity, 8, 13, 0] {
        text += &format!("{quantity:10}{:5}{:5}{:5} {:20} {:20}\n", 0, 0, 0, "NONE", "NONE");
    }
    let data = rows.iter().flat_map(|row| row.iter().skip(usize::from(even))).flat_map(|number| number.to_le_bytes());
    let mut bytes = text.into_bytes();
    bytes.extend(data);
    bytes.extend(b"    -1\n");
    bytes
}

#[test]
fn the_byte_counts_of_pyuff_are_made_good() {
    // abscissa, ordinate, imaginary part
    let real: [&[f64]; 3] = [&[0.0, -1.0], &[1e-3, 0.5], &[2.5e-3, 2.0]];
    let complex: [&[f64]; 3] = [&[0.0, -1.0, 3.0], &[1.0, 0.5, 0.1], &[2.5, 2.0, -7.0]];
    for kind in [2, 4, 5, 6] {
        for even in [true, false] {
            let rows = if kind > 4 { &complex } else { &real };
            let once = of_pyuff(kind, even, rows);
            let found = contents("pyuff", &[once.clone(), once].concat());
            let column = |at: usize| rows.iter().map(|row| row[at]).collect::<Vec<f64>>();
            let case = format!("type {kind}, even {even}");
            let miscounted = found.remarks.iter().filter(|remark| remark.contains("bytes of data and has")).count();
            assert_eq!(miscounted, if (kind, even) == (4, true) { 0 } else { 2 }, "{case}: {:?}", found.remarks);
            let single = found.remarks.iter().filter(|remark| remark.contains("single precision is stated")).count();
            assert_eq!(single, if matches!(kind, 2 | 5) { 2 } else { 0 }, "{case}: {:?}", found.remarks);
            if kind > 4 {
                assert_eq!(found.responses.len(), 2, "{case}");
                let [re, im] = &found.responses[1].values;
                assert_eq!((values(re), values(im)), (column(1), column(2)), "{case}");
                assert_eq!(re.stored_as, "float64");
            } else {
                let ordinate = &found.channels[if even { 1 } else { 2 }];
                assert_eq!((values(ordinate), ordinate.stored_as), (column(1), "float64"), "{case}");
                assert_eq!(ordinate.sample_rate_hz, even.then_some(4000.0), "{case}");
                if !even {
                    assert_eq!(values(&found.channels[3]), column(0), "{case}");
                }
            }
        }
    }
    // what is no multiple of the count, or is not followed by another dataset, is refused as before
    let good = of_pyuff(4, false, &real);
    let stated = |count: &str| String::from_utf8_lossy(&good).replacen("          24     0", count, 1).into_bytes();
    assert_ne!(stated("          20     0"), stated("          24     0"));
    assert!(error("pyuff-20", &stated("          20     0")).problem.contains("36 or 48 by type"));
    let followed = [good, b"something else".to_vec()].concat();
    assert!(error("pyuff-else", &followed).problem.contains("something else is there"));
}

/// The only channel of a dataset whose step or times are printed so.
fn rate_of(dataset: &Dataset) -> (Option<f64>, Contents) {
    let found = contents("rate", &bytes(dataset));
    (found.channels[0].sample_rate_hz, found)
}

#[test]
fn the_rate_is_the_round_one_that_a_printed_step_allows() {
    for rate in [51_200.0, 65_536.0, 44_100.0, 48_828.125, 2560.0, 102_400.0, 3e5, 1000.0 / 3.0, 2.5e9] {
        let (found, _) = rate_of(&Dataset { step: 1.0 / rate, ..time(b"  1.00000E+00\n", 2, 1) });
        // thirds have no end: to twelve digits
        assert!(
            (found.unwrap() / rate - 1.0).abs() < if rate.fract() > 0.3 { 1e-11 } else { 1e-15 },
            "{rate} {found:?}"
        );
    }
    // a step that is round itself, and a rate that is not round beyond its six digits
    assert_eq!(rate_of(&Dataset { step: 3e-4, ..time(b"  1.00000E+00\n", 2, 1) }).0, Some(3_333.333_333_33));
    let odd = rate_of(&Dataset { step: 1.234_57e-5, ..time(b"  1.00000E+00\n", 2, 1) }).0.unwrap();
    assert!((odd * 1.234_57e-5 - 1.0).abs() <= 0.5e-5 / 1.234_57, "{odd}");
    // frequency responses have the step that was meant, too
    let third = Dataset { function: 4, step: 1.0 / 3.0, abscissa: (18, "Frequency", "Hz"), ..time(b"", 5, 2) };
    let data = b"  1.00000E+00  0.00000E+00  1.00000E+00  0.00000E+00\n".to_vec();
    let found = contents("third", &bytes(&Dataset { data, ..third }));
    let step = format!("{:?}", found.responses[0].frequencies);
    assert_eq!(step, format!("Even(0.0, {:?})", 1.0 / 3.0));
}

/// Uneven data of a rate, times printed as E13.5.
fn printed_times(rate: f64, points: usize) -> Dataset {
    let line = |k: usize| format!("  {:.5E}  {:.5E}\n", k as f64 / rate, 1.0);
    let text: String = (0..points).map(line).collect();
    Dataset { even: false, ..time(text.replace("E0", "E+00").replace("E-", "E-0").as_bytes(), 2, points) }
}

#[test]
fn stored_times_that_run_evenly_to_within_their_printing_are_a_rate() {
    for rate in [2560.0, 4096.0, 1000.0, 48_828.125, 51_200.0] {
        // the last time is below 0.1 s: half a step and more is seen
        let points = (rate * 0.09) as usize;
        let (found, contents) = rate_of(&printed_times(rate, points));
        assert_eq!(found, Some(rate), "{:?}", contents.remarks);
        assert_eq!(locations(&contents), ["12-Y"]);
        assert!(remarked(&contents, "12-Y/abscissa is given as the sample rate"), "{:?}", contents.remarks);
    }
    // a lost sample
    let mut lost = printed_times(2560.0, 200);
    let at = lost.data.iter().enumerate().filter(|(_, byte)| **byte == b'\n').nth(150).unwrap().0;
    let line = lost.data.iter().skip(at + 1).position(|byte| *byte == b'\n').unwrap() + 1;
    lost.data.drain(at + 1..at + 1 + line);
    let (found, contents) = rate_of(&Dataset { points: 199, ..lost });
    assert_eq!((found, contents.channels.len()), (Some(2560.0), 1), "{:?}", contents.remarks);
    assert!(contents.channels[0].gaps.len() == 1 && remarked(&contents, "a gap"), "{:?}", contents.remarks);
    // times that repeat: neighbours 0 or 1e-5 s apart, at 51.2 kHz behind the first second
    let (found, contents) = rate_of(&printed_times(102_400.0, 110_000));
    if let Some(rate) = found {
        assert_eq!(rate, 102_400.0, "{:?}", contents.remarks);
    }
    // what is not time is no rate
    let (found, contents) = rate_of(&Dataset { abscissa: (18, "Frequency", "Hz"), ..printed_times(2560.0, 20) });
    assert!(found.is_none() && contents.channels.len() == 2 && remarked(&contents, "point by point"));
}

#[test]
fn padding_is_less_than_a_point() {
    let padded = |extra: usize| {
        let mut data: Vec<u8> = [1.5_f32, -2.5, 3.5].iter().flat_map(|v| v.to_le_bytes()).collect();
        data.extend(vec![0; extra]);
        contents("padded", &bytes(&Dataset { id: binary_id(1, data.len()), ..time(&data, 2, 3) }))
    };
    assert_eq!(values(&padded(2).channels[0]), [1.5, -2.5, 3.5]);
    assert!(remarked(&padded(4), "do not match"));
}

#[test]
fn spectra_other_datasets_and_second_responses() {
    let one = b" 1.00000E+00\n";
    let spectrum = Dataset { function: 12, abscissa: (18, "Frequency", "Hz"), response: "Mic", ..time(one, 2, 1) };
    let later = Dataset { start: 2.0, abscissa: (0, "NONE", "ms"), response: "Mic", ..time(one, 2, 1) };
    let complex = Dataset { kind: 5, ..time(b" 1.00000E+00 0.00000E+00\n", 5, 1) };
    let other = b"    -1\n   151\nmodel\n    -1\n\n".to_vec();
    let file = [other.clone(), bytes(&spectrum), other, bytes(&later), bytes(&complex)].concat();
    let found = contents("several", &file);
    assert_eq!(locations(&found), ["Mic", "Mic[2]"]);
    assert_eq!(found.channels[0].sample_rate_hz, None);
    // 0.5 ms.
    assert_eq!(found.channels[1].sample_rate_hz, Some(2000.0));
    for words in [
        "Frequency is not time; it runs from 0 in steps of 0.5 Hz",
        "begins at 2 ms",
        "2 datasets 151",
        "12-Y (time response), is left out",
    ] {
        assert!(remarked(&found, words), "{words}: {:?}", found.remarks);
    }
}

#[test]
fn damage_is_refused_with_its_byte() {
    let good = time(b" 1.00000E+00\n", 2, 1);
    let whole = bytes(&good);
    let f32s = |n: usize| vec![0; 4 * n];
    let binary = |id: String, points| bytes(&Dataset { id, ..time(&f32s(3), 2, points) });
    let cases: [(&str, Vec<u8>, &str); 11] = [
        ("empty", Vec::new(), "no dataset"),
        ("no-delimiter", b"hello\n".to_vec(), "«hello» was found"),
        ("cut-header", whole[..100].to_vec(), "within its 11 header records"),
        ("cut-data", whole[..whole.len() - 7].to_vec(), "the file ends within this dataset"),
        ("cut-other", b"    -1\n   151\nmodel\n".to_vec(), "the file ends within this dataset"),
        ("type", bytes(&Dataset { kind: 3, ..good.clone() }), "2, 4, 5 or 6 was wanted"),
        ("beyond", binary(binary_id(1, 4000), 3), "4000 bytes of data are stated"),
        ("wrong-size", binary(binary_id(1, 8), 3), "a line «    -1» was wanted"),
        ("order", binary(binary_id(3, 12), 3), "byte order «3»"),
        ("vax", binary(binary_id(1, 12).replace("     2   ", "     1   "), 3), "2 (IEEE 754) was wanted"),
        ("records", binary(binary_id(1, 12).replace("          11", "          10"), 3), "header lines"),
    ];
    for (name, bytes, words) in cases {
        let error = error(name, &bytes);
        assert!(error.problem.contains(words) && error.at_byte.is_some(), "{name}: {error:?}");
    }
    // Lengths that do not fit leave the function out; what is no number shows when it is read.
    assert!(remarked(&contents("points", &binary(binary_id(1, 12), 4)), "do not match"));
    assert!(remarked(&contents("many", &bytes(&Dataset { points: 900_000_000, ..good.clone() })), "cannot hold them"));
    assert!(remarked(&contents("none", &bytes(&Dataset { points: 0, ..good.clone() })), "no values"));
    let words = contents("words", &bytes(&time(b" one\n", 2, 1)));
    assert!(words.channels[0].source.read(0, 1).unwrap_err().problem.contains("«one» was found"));
    let few = contents("few", &bytes(&time(b" 1.00000E+00\n", 2, 3)));
    assert!(few.channels[0].source.read(0, 1).unwrap_err().problem.contains("3 were wanted"));
}

#[test]
fn universal_files_are_recognised() {
    let is = |head: &[u8]| Uff::recognises(head, std::path::Path::new("x"));
    assert!(is(b"    -1\n    58\n") && is(b"\r\n    -1\r\n    58b     1\r\n") && is(b"    -1\n   151\n"));
    assert!(!is(b"") && !is(b"-1\nhello\n") && !is(b"1\n2\n") && !is(b"    -1\n"));
}

#[test]
fn units_in_utf_8_and_latin_1() {
    let dataset = bytes(&time(b" 1.00000E+00 2.00000E+00\n", 2, 2));
    let text = String::from_utf8(dataset).unwrap();
    // as many characters as before: the field is padded to 20
    let changed = text.replace("Displacement         m   ", "Beschl. °            m/s²");
    assert_ne!(text, changed);
    let latin: Vec<u8> = changed.chars().map(|letter| u8::try_from(u32::from(letter)).unwrap()).collect();
    for bytes in [changed.into_bytes(), latin] {
        let contents = open::<Uff>("units.uff", &bytes).unwrap();
        assert_eq!(contents.channels[0].unit, "m/s²");
        assert_eq!(values(&contents.channels[0]), [1.0, 2.0]);
    }
    if let Some(path) = scope("utf8_units.uff") {
        // pyuff 2.5.8: 13 values at 20 kHz, the first -3.81956, the last -5.84096; the file's unit is m/s²
        let contents = Uff::open(&path).unwrap();
        let found = values(&contents.channels[0]);
        assert_eq!((found.len(), found[0], found[12]), (13, -3.81956, -5.84096));
        assert_eq!((contents.channels[0].unit.as_str(), contents.channels[0].sample_rate_hz), ("m/s²", Some(20_000.0)));
    }
}
