//! Frequency responses in files of each form, over known truth; real ones against readers written apart.

use crate::mat_builder::{Order, compressed, level4};
use crate::support::{Temporary, real_hammer, values};
use afmid_formats::{Contents, FormatError, FoundResponse, Parts, gains_without_phase, head_of, recognise, responses};
use std::f64::consts::TAU;

/// Real and imaginary part of an oscillator's receptance.
fn truth(f: f64) -> (f64, f64) {
    let (w, n) = (TAU * f, TAU * 7.0);
    let (re, im) = (n * n - w * w, 0.1 * n * w);
    let size = re * re + im * im;
    (re / size, -im / size)
}

const LINES: usize = 40;

fn polar(f: f64) -> (f64, f64) {
    let (re, im) = truth(f);
    (re.hypot(im), im.atan2(re))
}

/// A file's contents, by the format that recognises it.
fn contents(ending: &str, bytes: &[u8]) -> Contents {
    let file = Temporary::new(ending, bytes);
    let found = recognise(&head_of(&file.0).unwrap(), &file.0).unwrap().open(&file.0).unwrap();
    // samples are read from the file: it must live on
    std::mem::forget(file);
    found
}

/// Frequencies, first and second part.
fn read(contents: &Contents, response: &FoundResponse) -> Vec<(f64, f64, f64)> {
    let frequency = values(&response.frequency_channel(&contents.channels).unwrap());
    let [first, second] = response.values.each_ref().map(values);
    frequency.into_iter().zip(first).zip(second).map(|((f, a), b)| (f, a, b)).collect()
}

/// Whether all lines are those of the truth, to `digits`.
fn holds(contents: &Contents, response: &FoundResponse, digits: i32) {
    let lines = read(contents, response);
    assert_eq!(lines.len(), LINES);
    for (f, a, b) in lines {
        let (re, im) = truth(f);
        let near = 10_f64.powi(-digits) * re.hypot(im);
        assert!((a - re).abs() <= near && (b - im).abs() <= near, "{f}: {a} {b}, wanted {re} {im}");
    }
}

fn table(head: &str, separator: &str, line: impl Fn(f64) -> Vec<f64>) -> Vec<u8> {
    let row = |k: usize| {
        let f = 0.5 * (k + 1) as f64;
        let fields: Vec<String> = std::iter::once(f).chain(line(f)).map(|value| format!("{value:.12e}")).collect();
        fields.join(separator) + "\n"
    };
    (head.to_owned() + &(0..LINES).map(row).collect::<String>()).into_bytes()
}

fn cartesian(f: f64) -> Vec<f64> {
    let (re, im) = truth(f);
    vec![re, im]
}

#[test]
fn tables_of_real_and_imaginary_part_in_every_separation() {
    for (head, separator, ending) in [
        ("frequency (Hz),Re (m/N),Im (m/N)\n", ",", "csv"),
        ("Frequency [Hz]\tReal\tImaginary\n", "\t", "txt"),
        ("# f (Hz)  real  imag\n", "  ", "dat"),
        (
            "Units: Ratio\nRef Chan:Resp Chan\t1-Z:2-Z\n\nFrequency\t Real\t Imaginary\n\nUnits:\nHz\t(m/s\u{b2})(N)\t \n",
            "\t",
            "txt",
        ),
    ] {
        let found = contents(ending, &table(head, separator, cartesian));
        let all = responses(&found, None).unwrap_or_else(|error| panic!("{head}: {error}"));
        assert_eq!((all.len(), all[0].guessed, all[0].parts), (1, false, Parts::RealImaginary), "{head}");
        // printed to 13 digits
        holds(&found, &all[0], 11);
        assert_eq!(all[0].frequency_unit, "Hz", "{head}");
    }
    let signal_calc = "Frequency\t Real\t Imaginary\n\nUnits:\nHz\t(m/s\u{b2})(N)\t \n";
    let found = contents("txt", &table(signal_calc, "\t", cartesian));
    assert_eq!(responses(&found, None).unwrap()[0].unit, "(m/s²)/N");
}

#[test]
fn columns_without_titles_are_taken_in_turn_and_said_to_be_a_guess() {
    let found = contents("txt", &table("", "\t", cartesian));
    let all = responses(&found, None).unwrap();
    assert!(all[0].guessed);
    holds(&found, &all[0], 11);
    let given = responses(&found, Some(Parts::RealImaginary)).unwrap();
    assert!(!given[0].guessed);
    let odd = contents("txt", &table("", "\t", |f| vec![f, f, f]));
    assert!(responses(&odd, None).unwrap_err().problem.contains("3 columns beside the frequencies"));
}

#[test]
fn amplitude_and_phase_with_coherence_of_several_points_in_one_table() {
    let head = "Frequency (Hz);Mag a (dB);Phase a (deg);Coherence a;Mag b (m/N);Phase b (rad);Coherence b\n";
    let line = |f: f64| {
        let (amplitude, phase) = polar(f);
        vec![20.0 * amplitude.log10(), phase.to_degrees(), 0.9, 2.0 * amplitude, phase, 0.8]
    };
    let found = contents("csv", &table(head, ";", line));
    let all = responses(&found, None).unwrap();
    let polar_parts = |decibels, degrees| Parts::AmplitudePhase { decibels, degrees };
    assert_eq!([all[0].parts, all[1].parts], [polar_parts(true, true), polar_parts(false, false)]);
    assert_eq!(all[1].unit, "m/N");
    let coherence: Vec<f64> = all.iter().map(|one| values(one.coherence.as_ref().unwrap())[3]).collect();
    assert_eq!(coherence, [0.9, 0.8]);
    for (f, amplitude, phase) in read(&found, &all[0]) {
        let wanted = polar(f);
        assert!((10_f64.powf(amplitude / 20.0) / wanted.0 - 1.0).abs() < 1e-10);
        assert!((phase.to_radians() - wanted.1).abs() < 1e-10);
    }
    let unclear = contents("csv", &table("Frequency (Hz),Amplitude,Phase\n", ",", cartesian));
    assert!(responses(&unclear, None).unwrap_err().problem.contains("degrees or in radians"));
    let alone = contents("csv", &table("Frequency (Hz),Amplitude,Level\n", ",", cartesian));
    assert!(responses(&alone, None).unwrap_err().problem.contains("no column of its phase"));
}

/// Heads of Bode tables as instruments write them (Bode 100, WaveForms, Keysight, Siglent and Teledyne scopes, Red
/// Pitaya), and what is left out of them.
const BODE_HEADS: [(&str, &str); 12] = [
    ("Frequency (Hz),Gain (dB),Phase (deg)", ""),
    ("Frequency [Hz],Gain [dB],Phase [deg]", ""),
    ("Frequency (Hz),Magnitude (dB),Phase (degrees)", ""),
    ("Frequency (Hz),CH2 Gain (dB),CH2 Phase (°)", ""),
    ("Frequency(Hz),CH1 Amplitude(dB),CH1 Phase(Deg)", ""),
    ("Frequency (Hz);Trace 1: Gain: Magnitude (dB);Trace 2: Gain: Phase (°)", ""),
    ("freq,mag_db,phase_deg", ""),
    ("Frequency (Hz),Gain (dB),Phase Shift (°)", ""),
    ("#, Frequency (Hz), Amplitude (Vpp), Gain (dB), Phase (°)", "Amplitude"),
    ("#,Frequency (Hz),Gain (dB),Amplitude (Vpp),Phase (°)", "Amplitude"),
    ("Frequency (Hz),Channel 1 Magnitude (dB),Channel 2 Magnitude (dB),Channel 2 Phase (deg)", "Channel 1 Magnitude"),
    ("Frequency (Hz),Input (dB),Magnitude (dBV),Phase (°)", "Input"),
];

#[test]
fn bode_tables_of_instruments_are_responses_with_the_gain_in_decibels() {
    for (head, left_out) in BODE_HEADS {
        let separator = if head.contains(';') { ";" } else { "," };
        let titles: Vec<String> = head.split(separator).map(str::to_lowercase).collect();
        let lines: String = (0..LINES)
            .map(|k| {
                let f = 0.5 * (k + 1) as f64;
                let (amplitude, phase) = polar(f);
                let field = |title: &String| match title.trim() {
                    "#" => (k + 1) as f64,
                    title if title.starts_with("freq") => f,
                    title if title.contains("pha") => phase.to_degrees(),
                    title if left_out.is_empty() || !title.starts_with(&left_out.to_lowercase()) => {
                        20.0 * amplitude.log10()
                    }
                    _ => 0.2,
                };
                titles.iter().map(|title| format!("{:.12e}", field(title))).collect::<Vec<_>>().join(separator) + "\n"
            })
            .collect();
        let found = contents("csv", format!("{head}\n{lines}").as_bytes());
        let all = responses(&found, None).unwrap_or_else(|error| panic!("{head}: {error}"));
        assert_eq!(all.len(), 1, "{head}");
        assert_eq!(all[0].parts, Parts::AmplitudePhase { decibels: true, degrees: true }, "{head}");
        let said = all[0].remarks.join("; ");
        assert!(said.contains("left out") != left_out.is_empty() && said.contains(left_out), "{head}: {said}");
        let read = read(&found, &all[0]);
        assert_eq!(read.len(), LINES, "{head}");
        for (k, (f, gain, phase)) in read.into_iter().enumerate() {
            assert_eq!(f, 0.5 * (k + 1) as f64, "{head}");
            let wanted = polar(f);
            // printed to 13 digits
            assert!((10_f64.powf(gain / 20.0) / wanted.0 - 1.0).abs() < 1e-10, "{head}: {gain} at {f}");
            assert!((phase.to_radians() - wanted.1).abs() < 1e-10, "{head}");
        }
        assert!(gains_without_phase(&found).is_empty());
    }
}

#[test]
fn a_gain_without_a_phase_is_no_response() {
    let found = contents("csv", &table("Frequency (Hz),CH2 Gain (dB)\n", ",", |f| vec![20.0 * polar(f).0.log10()]));
    assert!(responses(&found, None).unwrap_err().problem.contains("CH2 Gain has no column of its phase"));
    assert_eq!(gains_without_phase(&found), ["CH2 Gain"]);
}

#[test]
fn a_record_over_time_is_no_response() {
    let found = contents("csv", &table("Time (s),Real,Imaginary\n", ",", cartesian));
    let error: FormatError = responses(&found, None).unwrap_err();
    assert!(error.problem.contains("no frequencies"), "{error}");
}

/// A dataset 58 of function 4 between points 3 (-Z) and 12 (+X).
fn universal(kind: u32, even: bool, binary: Option<bool>) -> Vec<u8> {
    let double = kind == 6;
    let mut data = Vec::new();
    for k in 0..LINES {
        let f = 0.5 * (k + 1) as f64;
        let (re, im) = truth(f);
        match binary {
            None => {
                let wide = |value: f64| if double { format!("{value:20.12E}") } else { format!("{value:13.5E}") };
                let abscissa = if even { String::new() } else { format!("{f:13.5E}") };
                data.extend(format!("{abscissa}{}{}", wide(re), wide(im)).into_bytes());
                data.push(b'\n');
            }
            Some(big) => {
                let mut put = |value: f64, double: bool| match (double, big) {
                    (true, true) => data.extend(value.to_be_bytes()),
                    (true, false) => data.extend(value.to_le_bytes()),
                    (false, true) => data.extend((value as f32).to_be_bytes()),
                    (false, false) => data.extend((value as f32).to_le_bytes()),
                };
                if !even {
                    put(f, false);
                }
                put(re, double);
                put(im, double);
            }
        }
    }
    let id = match binary {
        None => "    58".to_owned(),
        Some(big) => {
            format!("    58b{:6}{:6}{:12}{:12}{:6}{:6}{:12}{:12}", 1 + u8::from(big), 2, 11, data.len(), 0, 0, 0, 0)
        }
    };
    let mut text = format!("    -1\n{id}\nan FRF\nNONE\n18-Apr-16 13:49:58\nNONE\nNONE\n");
    text += &format!("{:5}{:10}{:5}{:10} {:10}{:10}{:4} {:10}{:10}{:4}\n", 4, 0, 0, 0, "NONE", 3, -3, "NONE", 12, 1);
    text += &format!("{kind:10}{LINES:10}{:10}{:>13}{:>13}{:>13}\n", u8::from(even), "5.00000E-01", "5.00000E-01", "0");
    let axis = |quantity: u32, unit: &str| format!("{quantity:10}{:5}{:5}{:5} {:20} {unit:20}\n", 0, 0, 0, "NONE");
    text += &[axis(18, "Hz"), axis(8, "m"), axis(13, "N"), axis(0, "NONE")].concat();
    let mut bytes = text.into_bytes();
    bytes.extend(data);
    bytes.extend(b"    -1\n");
    bytes
}

#[test]
fn universal_files_in_every_form_with_points_and_directions() {
    for kind in [5, 6] {
        for even in [true, false] {
            for binary in [None, Some(false), Some(true)] {
                let file = [universal(kind, even, binary), universal(kind, even, binary)].concat();
                let found = contents("uff", &file);
                assert!(found.channels.is_empty(), "{:?}", found.remarks);
                let all = responses(&found, None).unwrap();
                assert_eq!(all.len(), 2, "{kind} {even} {binary:?}: {:?}", found.remarks);
                // six digits, or what single precision has
                let digits = if kind == 6 { 10 } else { 5 };
                holds(&found, &all[1], digits);
                let (output, input) = (all[0].output.as_ref().unwrap(), all[0].input.as_ref().unwrap());
                assert_eq!((output.name.as_str(), output.direction.as_str(), output.against), ("3", "z", true));
                assert_eq!((input.name.as_str(), input.direction.as_str(), input.against), ("12", "x", false));
                assert_eq!((all[0].unit.as_str(), all[0].frequency_unit.as_str()), ("m/N", "Hz"));
            }
        }
    }
}

#[test]
fn complex_arrays_of_matlab_beside_their_frequencies() {
    let f: Vec<f64> = (0..LINES).map(|k| 0.5 * (k + 1) as f64).collect();
    let (re, im): (Vec<f64>, Vec<f64>) = f.iter().map(|f| truth(*f)).unzip();
    let both =
        |one: &[f64], factor: f64| one.iter().copied().chain(one.iter().map(|v| factor * v)).collect::<Vec<f64>>();
    let bytes = |values: &[f64]| values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>();
    let little = Order(false);
    // class 6 is double, flag 8 complex, element 9 float64
    let array = |name: &str, columns: u32, flags: u32, parts: &[&[f64]]| {
        let data: Vec<u8> = parts.iter().flat_map(|part| little.element(9, &bytes(part))).collect();
        little.array(flags, &[LINES as u32, columns], name, &data)
    };
    let frequency = array("frequency", 1, 6, &[&f]);
    let response = array("H", 2, 0x0806, &[&both(&re, 3.0), &both(&im, 3.0)]);
    let level5 = [little.header(), frequency.clone(), response.clone()].concat();
    let packed = [little.header(), compressed(&frequency), compressed(&response)].concat();
    let rows = LINES as u32;
    let values4 = [bytes(&both(&re, 3.0)), bytes(&both(&im, 3.0))].concat();
    let level4 =
        [level4(little, 0, [rows, 1], 0, "frequency", &bytes(&f)), level4(little, 0, [rows, 2], 1, "H", &values4)]
            .concat();
    for file in [level5, packed, level4] {
        let found = contents("mat", &file);
        let all = responses(&found, None).unwrap();
        assert_eq!(all.iter().map(|one| one.location.as_str()).collect::<Vec<_>>(), ["/H[1]", "/H[2]"]);
        holds(&found, &all[0], 14);
        assert!((read(&found, &all[1])[4].1 / re[4] - 3.0).abs() < 1e-14);
    }
    let alone = contents("mat", &[little.header(), response].concat());
    let error = responses(&alone, None).unwrap()[0].frequency_channel(&alone.channels).unwrap_err();
    assert!(error.problem.contains("no frequencies as many"), "{error}");
}

#[test]
fn five_responses_of_a_tool() {
    let Some(folder) = real_hammer("tool-frf") else { return };
    for point in 1..=5 {
        let path = folder.join(format!("Point_{point}_Channel_1_CH1.txt"));
        let found = recognise(&head_of(&path).unwrap(), &path).unwrap().open(&path).unwrap();
        let all = responses(&found, None).unwrap();
        // read line by line here
        let text = std::fs::read_to_string(&path).unwrap();
        let number = |field: &str| field.trim().parse::<f64>().unwrap();
        let wanted: Vec<(f64, f64, f64)> = text
            .lines()
            .map(|line| {
                let fields: Vec<f64> = line.split_whitespace().map(number).collect();
                (fields[0], fields[1], fields[2])
            })
            .collect();
        assert_eq!((all.len(), wanted.len()), (1, 5001));
        assert_eq!(read(&found, &all[0]), wanted);
    }
}
