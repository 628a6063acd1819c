//! The channels of files of several formats, and the split.

use std::path::Path;

use afmid_pipeline::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};
use afmid_pipeline::stage::NoProgress;
use afmid_pipeline::{Context, InputFiles, Ports, Stage};

use super::stage::{PAIR, SUMMARY};
use super::*;

fn run(stage: &Columns, folder: &Path) -> Result<(Ports, Vec<String>), afmid_pipeline::StageError> {
    let cx = Context::new(folder, 1, &NoProgress);
    let ports = stage.run(&Ports::new(), &cx)?;
    Ok((ports, cx.into_warnings()))
}

#[test]
fn trends_come_from_the_identification_stretch_alone() {
    let folder = tempfile::tempdir().unwrap();
    // a line of slope 2 in the first stretch, then an unrelated level
    let y = |k: usize| if k < 60 { 7.0 + 2.0 * k as f64 } else { 1000.0 };
    let rows: String = (0..100).map(|k| format!("{} {} {}\n", k % 3, k % 5, y(k))).collect();
    std::fs::write(folder.path().join("a.dat"), rows).unwrap();
    let stage = Columns {
        file: "a.dat".to_owned(),
        inputs: vec![Column::Number(1), Column::Number(2)],
        output: Column::Number(3),
        sample_rate_hz: Some(10.0),
        identification: Some([0, 60]),
        verification: Some([55, 100]),
        remove: Removal::Line,
        ..Columns::default()
    };
    let (ports, warnings) = run(&stage, folder.path()).unwrap();
    let pair = ports.get(&PAIR).unwrap();
    pair.validate().unwrap();
    // rounding of sums of 60 values of 100
    assert!(pair.real("response_identification").unwrap().iter().all(|y| y.abs() < 1e-10));
    let held_out = pair.real("response_verification").unwrap();
    assert!((held_out[44] - (1000.0 - 7.0 - 2.0 * 99.0)).abs() < 1e-10, "{}", held_out[44]);
    assert_eq!(pair.real("force_verification").unwrap().len(), 2 * 45);
    assert_eq!(pair.axis("time_verification").unwrap().values[0], 5.5);
    assert!(warnings[0].contains("share 5 samples"), "{warnings:?}");
    assert!(
        (ports.get(&SUMMARY).unwrap().0["removed"]["output"]["slope_per_s"].as_f64().unwrap() - 20.0).abs() < 1e-10
    );
}

#[test]
fn what_cannot_be_used_is_refused_with_the_reason() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("a.csv"), "t,u,y\n0,1,2\n1,,3\n2,5,6\n3.5,7,8\n").unwrap();
    let stage = |change: fn(&mut Columns)| {
        let mut stage = Columns {
            file: "a.csv".to_owned(),
            // the times, which are no signal and have no number
            inputs: vec![Column::Name("t".to_owned())],
            output: Column::Number(2),
            missing: vec![-1.0],
            sample_rate_hz: Some(1.0),
            ..Columns::default()
        };
        change(&mut stage);
        stage
    };
    let error = |stage: &Columns| run(stage, folder.path()).map(|_| ()).unwrap_err().to_string();
    assert!(run(&stage(|_| {}), folder.path()).is_ok());
    assert!(error(&stage(|s| s.inputs = vec![Column::Number(1)])).contains("misses sample 1"));
    assert!(error(&stage(|s| s.sample_rate_hz = None)).contains("no sample rate"));
    let unequal = |s: &mut Columns| {
        s.sample_rate_hz = None;
        s.time = Some(Column::Name("t".to_owned()));
    };
    assert!(error(&stage(unequal)).contains("not equally spaced"));
    assert!(error(&stage(|s| s.verification = Some([2, 9]))).contains("the record has 4 samples"));
    for wrong in [
        stage(|s| s.file.clear()),
        stage(|s| s.inputs.clear()),
        stage(|s| s.output = Column::Number(0)),
        stage(|s| s.sample_rate_hz = Some(0.0)),
        stage(|s| s.identification = Some([5, 5])),
    ] {
        assert!(afmid_pipeline::stage::check(&wrong).is_err());
    }
    assert!(stage(|s| s.file = "b.csv".to_owned()).sources(folder.path(), &InputFiles::new()).is_err());
}

#[test]
fn times_that_are_rounded_to_their_last_digit_give_the_rate() {
    let folder = tempfile::tempdir().unwrap();
    let run_with = |title: &str, lost: usize| {
        let rows = (0..3000)
            .filter(|k| *k != lost)
            .map(|k| format!("{:.4},{},{}\n", f64::from(k as u16) / 2560.0, k % 3, k % 5));
        std::fs::write(folder.path().join("a.csv"), format!("{title},u,y\n{}", rows.collect::<String>())).unwrap();
        let time = (title == "clock").then(|| Column::Name(title.to_owned()));
        let inputs = vec![Column::Name("u".to_owned())];
        let (file, output) = ("a.csv".to_owned(), Column::Name("y".to_owned()));
        run(&Columns { file, inputs, output, time, ..Columns::default() }, folder.path())
    };
    for title in ["Time (s)", "clock"] {
        let (ports, _) = run_with(title, usize::MAX).unwrap();
        let rate = ports.get(&SUMMARY).unwrap().0["sample_rate_hz"].as_f64().unwrap();
        assert!((rate - 2560.0).abs() < 1e-9, "{rate}");
        assert!(run_with(title, 1700).is_err());
    }
}

#[test]
fn several_files_are_records_in_a_row_each_without_its_own_mean() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, header: &str, samples: u32, level: f64| {
        let row = |k: u32| format!("{},{},{}\n", f64::from(k) / 100.0, k % 2, level + f64::from(k % 5));
        let rows: String = (0..samples).map(row).collect();
        std::fs::write(folder.path().join(name), format!("{header}\n{rows}")).unwrap();
    };
    write("hit_2.csv", "Time (s),u (N),y (V)", 20, 7.0);
    write("hit_10.csv", "Time (s),u (N),y (V)", 40, -3.0);
    let of = |files: &[&str]| {
        let files = files.iter().map(|file| (*file).to_owned()).collect();
        Columns { files, ..Columns::default() }
    };
    let (ports, _) = run(&of(&["hit_*.csv"]), folder.path()).unwrap();
    let pair = ports.get(&PAIR).unwrap();
    pair.validate().unwrap();
    assert_eq!(pair.real("first_sample").unwrap(), [0.0, 20.0]);
    assert_eq!(pair.real("response").unwrap().len(), 60);
    for (set, samples) in [("response_identification", 20), ("response_verification", 40)] {
        let values = pair.real(set).unwrap();
        // both hold whole cycles about a mean of their own
        assert!(values.len() == samples && values[0] == -2.0 && values[samples - 1] == 2.0, "{values:?}");
    }
    let pair = crate::artifacts::Pair::new(pair);
    let refused = pair.series(crate::artifacts::DataSet::All, 0).map(|_| ()).unwrap_err();
    assert!(refused.to_string().contains("2 records in a row"), "{refused}");
    write("other.csv", "Time (s),u (N),y (g)", 20, 0.0);
    let error = run(&of(&["hit_2.csv", "other.csv"]), folder.path()).map(|_| ()).unwrap_err().to_string();
    assert!(error.contains("the output's unit is g, that of the first of `files` V"), "{error}");
    let both = Columns { file: "hit_2.csv".to_owned(), ..of(&["hit_10.csv"]) };
    assert!(afmid_pipeline::stage::check(&both).is_err());
}

const LVM: &str = "LabVIEW Measurement\t\nSeparator\tTab\nDecimal_Separator\t,\nX_Columns\tNo\n***End_of_Header***\t\n\t\n\
    Channels\t2\nSamples\t4\t4\t\nY_Unit_Label\tN\tV\nDelta_X\t2,5E-2\t2,5E-2\t\n***End_of_Header***\t\t\t\n\
    X_Value\tforce\tresponse\tComment\n\t1\t2\n\t2\t4\n\t3\t9\n\t5\t7\n";

/// Writes the same force (N) and response (V) at 40 Hz in several formats.
fn write_each(folder: &Path) -> Vec<&'static str> {
    let (force, response) = ([1.0, 2.0, 3.0, 5.0], [2.0, 4.0, 9.0, 7.0]);
    std::fs::write(folder.join("a.lvm"), LVM).unwrap();
    let rows: String = (0..4).map(|k| format!("{};{};{}\n", k as f64 * 0.025, force[k], response[k])).collect();
    std::fs::write(folder.join("a.csv"), format!("time (s);force (N);response (V)\n{rows}")).unwrap();
    let channel = |location: &str, unit: &str, values: &[f64]| NativeChannel {
        location: location.to_owned(),
        unit: unit.to_owned(),
        long_name: location.to_owned(),
        scale_factor: 0.5,
        add_offset: 0.0,
        codes: Codes::Int16(values.iter().map(|value| (2.0 * value) as i16).collect()),
    };
    let record = NativeRecord {
        sample_rate_hz: 40.0,
        started_at: "2026-11-26T00:00:00Z".to_owned(),
        channels: vec![channel("/force", "N", &force), channel("/response", "V", &response)],
    };
    write_native(&folder.join("a.h5"), &record, RecordStorage::Raw).unwrap();
    vec!["a.lvm", "a.csv", "a.h5"]
}

#[test]
fn any_format_gives_the_same_pair_with_rate_and_units() {
    let folder = tempfile::tempdir().unwrap();
    for file in write_each(folder.path()) {
        for inputs in [Column::Number(1), Column::Name("force".to_owned())] {
            let stage = Columns {
                file: file.to_owned(),
                inputs: vec![inputs],
                output: Column::Name("response".to_owned()),
                remove: Removal::None,
                ..Columns::default()
            };
            let (ports, warnings) = run(&stage, folder.path()).unwrap_or_else(|error| panic!("{file}: {error}"));
            let pair = ports.get(&PAIR).unwrap();
            assert_eq!(pair.real("force").unwrap(), [1.0, 2.0, 3.0, 5.0], "{file}");
            assert_eq!(pair.real("response").unwrap(), [2.0, 4.0, 9.0, 7.0], "{file}");
            assert!((pair.number("sample_rate_hz").unwrap() - 40.0).abs() < 1e-9, "{file}");
            assert!(warnings.is_empty(), "{warnings:?}");
        }
    }
}

#[test]
fn scales_want_their_unit_and_units_that_differ_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    write_each(folder.path());
    let stage = |change: fn(&mut Columns)| {
        let mut stage = Columns { file: "a.csv".to_owned(), remove: Removal::None, ..Columns::default() };
        change(&mut stage);
        run(&stage, folder.path()).map(|(ports, _)| ports.get(&PAIR).unwrap().clone())
    };
    let scaled = stage(|s| (s.output_scale, s.output_unit) = (-2.0, Some("m".to_owned()))).unwrap();
    assert_eq!(scaled.real("response").unwrap(), [-4.0, -8.0, -18.0, -14.0]);
    let error = |change| stage(change).map(|_| ()).unwrap_err().to_string();
    assert!(error(|s| s.input_scale = 3.0).contains("`input_unit` is missing"));
    assert!(error(|s| s.input_unit = Some("V".to_owned())).contains("is in N, wanted V"));
    // the user's rate takes the place of the file's
    let overruled = stage(|s| s.sample_rate_hz = Some(41.0)).unwrap();
    assert_eq!(overruled.number("sample_rate_hz").unwrap(), 41.0);
    assert!(error(|s| s.inputs = vec![Column::Name("time".to_owned())]).contains("1 `force`, 2 `response`"));
}
