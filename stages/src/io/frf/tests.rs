//! Files of one and of many responses, their points, and real ones.

use std::io::Write;
use std::path::{Path, PathBuf};

use afmid_pipeline::stage::NoProgress;
use afmid_pipeline::{Context, Ports, Stage, StageError};
use flate2::Compression;
use flate2::write::GzEncoder;
use num_complex::Complex64;

use super::stage::{FRF, SUMMARY};
use super::*;
use crate::artifacts::{self, Quantity};

fn run(stage: &Frf, folder: &Path) -> Result<(Ports, Vec<String>), StageError> {
    let cx = Context::new(folder, 1, &NoProgress);
    let ports = stage.run(&Ports::new(), &cx)?;
    ports.get(&FRF)?.validate()?;
    Ok((ports, cx.into_warnings()))
}

fn value(f: f64, point: usize) -> Complex64 {
    1.0 / Complex64::new(100.0 - f * f, point as f64 * f)
}

fn lines(point: usize) -> String {
    (1..=30)
        .map(|k| (f64::from(k), value(f64::from(k), point)))
        .map(|(f, h)| format!("{f}\t{}\t{}\n", h.re, h.im))
        .collect()
}

fn packed(path: &Path, text: &str) {
    let mut encoder = GzEncoder::new(std::fs::File::create(path).unwrap(), Compression::default());
    encoder.write_all(text.as_bytes()).unwrap();
    encoder.finish().unwrap();
}

#[test]
fn a_file_a_point_packed_or_not_gives_a_row_each_with_the_points_that_are_given() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("p1.txt"), lines(1)).unwrap();
    packed(&folder.path().join("p2.txt.gz"), &lines(2));
    packed(&folder.path().join("p10.txt.gz"), &lines(10));
    let stage = Frf {
        files: vec!["p*".to_owned()],
        unit: Some("m/N".to_owned()),
        positions_m: vec![0.1, 0.2, 0.3],
        directions: vec![1.0, -1.0, 1.0],
        driving_point: Some(3),
        band_hz: Some([5.0, 20.0]),
        ..Frf::default()
    };
    let (ports, warnings) = run(&stage, folder.path()).unwrap();
    let frf = artifacts::Frf::new(ports.get(&FRF).unwrap()).unwrap();
    assert_eq!((frf.frequency_hz.len(), frf.frequency_hz[0], frf.quantity), (16, 5.0, Quantity::Receptance));
    for (row, (point, sign)) in [(1, 1.0), (2, -1.0), (10, 1.0)].into_iter().enumerate() {
        // written and read in full
        let wanted: Vec<Complex64> = frf.frequency_hz.iter().map(|f| sign * value(*f, point)).collect();
        assert_eq!(frf.row(row), wanted);
    }
    let [first, second, third] = &frf.responses[..] else { panic!("{:?}", frf.responses) };
    assert_eq!((first.input.name.as_str(), first.output.name.as_str()), ("p1.txt", "p10.txt.gz"));
    assert_eq!((first.output.position_m, second.input.position_m, second.input.turned), (Some(0.3), Some(0.2), true));
    assert!(third.output.is(&third.input) && frf.driving_point == Some(2));
    assert!(warnings.iter().any(|warning| warning.contains("taken as real and imaginary part")), "{warnings:?}");
    assert_eq!(ports.get(&SUMMARY).unwrap().0["driving_point"], 3);
}

#[test]
fn motion_over_force_comes_in_si_whatever_the_unit_and_a_quantity_that_is_none_of_it_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("p1.txt"), lines(1)).unwrap();
    let stage = |quantity, unit: &str| Frf {
        files: vec!["p1.txt".to_owned()],
        unit: Some(unit.to_owned()),
        quantity,
        driving_point: Some(1),
        ..Frf::default()
    };
    let (ports, _) = run(&stage(None, "g/N"), folder.path()).unwrap();
    let frf = artifacts::Frf::new(ports.get(&FRF).unwrap()).unwrap();
    assert_eq!((frf.quantity, frf.unit), (Quantity::Accelerance, "(m/s^2)/N"));
    // to rounding
    assert!((frf.row(0)[4] / (9.806_65 * value(5.0, 1)) - 1.0).norm() < 1e-12);
    let error = run(&stage(Some(Quantity::Mobility), "mm/N"), folder.path()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("mm/N is the unit of a `receptance`"), "{error}");
}

#[test]
fn what_does_not_belong_together_is_refused_with_place_found_and_wanted() {
    let folder = tempfile::tempdir().unwrap();
    let titled = |lines: &str| format!("frequency (Hz)\tre\tim\n{lines}");
    std::fs::write(folder.path().join("a.txt"), titled(&lines(1))).unwrap();
    std::fs::write(folder.path().join("b.txt"), titled(&lines(1).replacen("\n7\t", "\n7.5\t", 1))).unwrap();
    std::fs::write(folder.path().join("c.txt"), titled("3\t-1\t2\n2\t1\t2\n1\t3\t4\n2\t3\t4\n")).unwrap();
    let stage = |files: &[&str], change: fn(&mut Frf)| {
        let mut stage = Frf { files: files.iter().map(|file| (*file).to_owned()).collect(), ..Frf::default() };
        change(&mut stage);
        run(&stage, folder.path()).map(|_| ()).unwrap_err().to_string()
    };
    assert!(stage(&["a.txt", "b.txt"], |_| ()).contains("line 7 is at 7.5 Hz, in a.txt at 7 Hz"));
    assert!(stage(&["c.txt"], |_| ()).contains("have 2 Hz twice, at lines 2 and 4"));
    assert!(stage(&["a.txt"], |s| s.positions_m = vec![1.0, 2.0]).contains("`positions_m` has 2, there are 1"));
    assert!(stage(&["a.txt"], |s| s.driving_point = Some(2)).contains("`driving_point` is 2"));
    assert!(stage(&["a.txt"], |s| s.band_hz = Some([40.0, 50.0])).contains("run from 1 to 30"));
    for wrong in [
        Frf::default(),
        Frf { files: vec!["a".to_owned()], directions: vec![0.5], ..Frf::default() },
        Frf { files: vec!["a".to_owned()], band_hz: Some([2.0, 1.0]), ..Frf::default() },
    ] {
        assert!(afmid_pipeline::stage::check(&wrong).is_err());
    }
}

/// Two modes seen at two points, in columns; `signs` of their imaginary parts.
fn two_points(unit: &str, signs: [f64; 2], noise: impl Fn(usize) -> f64) -> String {
    let of =
        |f: f64, share: f64| 1.0 / Complex64::new(1e4 - f * f, 2.0 * f) + share / Complex64::new(9e4 - f * f, 3.6 * f);
    let mut text = format!("Frequency (Hz),Real a ({unit}),Imag a ({unit}),Real b ({unit}),Imag b ({unit})\n");
    for k in 0..800 {
        let f = 20.0 + 0.5 * k as f64;
        let [a, b] = [of(f, 1.0), of(f, -0.7)];
        let e = |at: usize| 1e-6 * noise(4 * k + at);
        text += &format!("{f},{},{},{},{}\n", a.re + e(0), signs[0] * a.im + e(1), b.re + e(2), signs[1] * b.im + e(3));
    }
    text
}

#[test]
fn imaginary_parts_of_the_other_sign_are_turned_and_those_of_both_refused() {
    let folder = tempfile::tempdir().unwrap();
    for seed in 1..=5_usize {
        let noise = |k: usize| (((k + 7) * (k + 3 * seed)) as f64).sin();
        let write =
            |unit: &str, signs| std::fs::write(folder.path().join("a.csv"), two_points(unit, signs, noise)).unwrap();
        let stage = |phase| Frf { files: vec!["a.csv".to_owned()], phase, ..Frf::default() };
        let values = |phase| {
            let (ports, warnings) = run(&stage(phase), folder.path()).unwrap();
            let frf = artifacts::Frf::new(ports.get(&FRF).unwrap()).unwrap();
            ([frf.row(0).to_vec(), frf.row(1).to_vec()], warnings.iter().any(|text| text.contains("the other sign")))
        };
        write("m/N", [1.0, 1.0]);
        let (right, warned) = values(PhaseSign::Auto);
        assert!(!warned && right == values(PhaseSign::AsStored).0);
        write("m/N", [-1.0, -1.0]);
        let (turned, warned) = values(PhaseSign::Auto);
        assert!(warned && turned == values(PhaseSign::Turned).0);
        let largest = right[0].iter().zip(&turned[0]).map(|(a, b)| (a - b).norm()).fold(0.0, f64::max);
        // the noise is not turned with them
        assert!(largest < 4e-6, "{largest}");
        let (left, warned) = values(PhaseSign::AsStored);
        assert!(!warned && left[0][3] == turned[0][3].conj());
        write("m/N", [1.0, -1.0]);
        let error = run(&stage(PhaseSign::Auto), folder.path()).map(|_| ()).unwrap_err().to_string();
        assert!(error.contains("of Real b are of exp(-i w t), those of Real a of exp(+i w t)"), "{error}");
        // ratios of two motions may have poles that do not decay
        write("g/g", [-1.0, -1.0]);
        let (left, warned) = values(PhaseSign::Auto);
        assert!(warned && left == values(PhaseSign::AsStored).0);
    }
}

#[test]
fn sweeps_from_high_to_low_are_sorted_with_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let up = two_points("m/N", [1.0, 1.0], |_| 0.0);
    let (head, lines) = up.split_once('\n').unwrap();
    let down: String = lines.lines().rev().map(|line| format!("{line}\n")).collect();
    let mixed: String = lines.lines().skip(9).chain(lines.lines().take(9)).map(|line| format!("{line}\n")).collect();
    for (name, lines) in [("up.csv", lines), ("down.csv", &down), ("mixed.csv", &mixed)] {
        std::fs::write(folder.path().join(name), format!("{head}\n{lines}")).unwrap();
    }
    let read = |name: &str| {
        let stage = Frf { files: vec![name.to_owned()], ..Frf::default() };
        let (ports, warnings) = run(&stage, folder.path()).unwrap();
        let frf = artifacts::Frf::new(ports.get(&FRF).unwrap()).unwrap();
        let values = (frf.frequency_hz.to_vec(), frf.row(0).to_vec(), frf.row(1).to_vec());
        (values, warnings.iter().any(|text| text.contains("the lines are sorted")))
    };
    let (wanted, warned) = read("up.csv");
    assert!(!warned && wanted.0[0] == 20.0);
    assert_eq!(read("down.csv"), (wanted.clone(), true));
    assert_eq!(read("mixed.csv"), (wanted, true));
}

#[test]
fn a_file_that_unpacks_without_end_is_refused() {
    let folder = tempfile::tempdir().unwrap();
    // zeros shrink a thousandfold: beyond 32 times the file and 64 MiB
    let path = folder.path().join("bomb.txt.gz");
    let mut encoder = GzEncoder::new(std::fs::File::create(&path).unwrap(), Compression::best());
    (0..80).for_each(|_| encoder.write_all(&vec![b'0'; 1 << 20]).unwrap());
    encoder.finish().unwrap();
    let stage = Frf { files: vec!["bomb.txt.gz".to_owned()], ..Frf::default() };
    assert!(run(&stage, folder.path()).map(|_| ()).unwrap_err().to_string().contains("unpacks to more than"));
}

/// The folder of real hammer tests; none, with a line, where it is missing.
fn real() -> Option<PathBuf> {
    let beside = || Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/data");
    let folder = std::env::var_os("AFMID_DATA").map_or_else(beside, PathBuf::from).join("hammer");
    if !folder.is_dir() {
        println!("real responses not tested: {} is missing, built files stand in", folder.display());
        return None;
    }
    Some(folder)
}

#[test]
fn nine_points_of_a_free_beam_by_signal_calc() {
    let Some(folder) = real() else { return };
    let stage = Frf {
        files: vec!["free-beam/*.txt.gz".to_owned()],
        positions_m: vec![0.1, 0.25, 0.375, 0.5, 0.65, 0.8, 0.925, 1.05, 1.2],
        directions: vec![-1.0],
        driving_point: Some(4),
        ..Frf::default()
    };
    let (ports, warnings) = run(&stage, &folder).unwrap();
    let frf = artifacts::Frf::new(ports.get(&FRF).unwrap()).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    assert_eq!((frf.responses.len(), frf.frequency_hz.len()), (9, 51_201));
    assert_eq!((frf.quantity, frf.unit), (Quantity::Accelerance, "(m/s²)/N"));
    // line 101 of the fourth file, by eye: zcat Hxysv00004.txt.gz | sed -n 109p
    let text = {
        let mut text = Vec::new();
        let file = std::fs::File::open(folder.join("free-beam/Hxysv00004.txt.gz")).unwrap();
        std::io::Read::read_to_end(&mut flate2::read::GzDecoder::new(file), &mut text).unwrap();
        text.iter().map(|&byte| char::from(byte)).collect::<String>()
    };
    let rows = text
        .lines()
        .filter(|line| line.contains("e+") || line.contains("e-"))
        .map(|line| line.split_whitespace().map(|field| field.parse::<f64>().unwrap()).collect::<Vec<f64>>());
    let wanted: Vec<Complex64> = rows.map(|row| -Complex64::new(row[1], row[2])).collect();
    assert_eq!(frf.row(3), wanted);
}
