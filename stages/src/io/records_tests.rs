use std::fs;

use afmid_pipeline::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};
use afmid_pipeline::stage::NoProgress;
use afmid_pipeline::{Artifact, InputFiles};

use super::*;

/// A folder of its own for each test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("afmid-records-{}-{name}", std::process::id()));
        fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, rate: f64, samples: usize) -> PathBuf {
        let channel = |location: &str, step: i16| NativeChannel {
            location: location.to_owned(),
            codes: Codes::Int16((0..samples).map(|k| (k as i16).wrapping_mul(step)).collect()),
            unit: "V".to_owned(),
            scale_factor: 1e-3,
            add_offset: 0.5,
            long_name: location.to_owned(),
        };
        let record = NativeRecord {
            sample_rate_hz: rate,
            started_at: "2005-03-01T10:00:00Z".to_owned(),
            channels: vec![channel("deflection", 3), channel("piezo", 1)],
        };
        let path = self.0.join(name);
        write_native(&path, &record, RecordStorage::Deflate(1)).unwrap();
        path
    }

    fn run(&self, stage: &Records) -> Result<(Ports, Vec<String>), StageError> {
        let context = Context::new(&self.0, 1, &NoProgress);
        let ports = stage.run(&Ports::new(), &context)?;
        Ok((ports, context.into_warnings()))
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = fs::remove_dir_all(&self.0);
    }
}

fn all() -> Records {
    Records { files: vec!["*.h5".to_owned()], ..Records::default() }
}

#[test]
fn the_example_runs_and_reaches_its_truth() {
    for example in Records::examples() {
        let stage: Records = afmid_pipeline::toml::from_str(example.params).unwrap();
        afmid_pipeline::stage::check(&stage).unwrap();
        let inputs = (example.inputs)().unwrap();
        println!("{}", (example.expect)(&stage.run(&inputs, &Context::alone(1)).unwrap()).unwrap());
    }
}

#[test]
fn records_come_with_both_channels_and_a_summary() {
    let folder = Folder::new("both");
    folder.write("r2.h5", 5e6, 70_000);
    folder.write("r10.h5", 5e6, 50_000);
    let (ports, warnings) = folder.run(&all()).unwrap();
    let Some(Artifact::Recording(recording)) = ports.artifact("records") else { panic!("no recording") };
    let names: Vec<&str> = recording.records.iter().map(|record| record.name.as_str()).collect();
    assert_eq!(names, ["r2.h5", "r10.h5"]);
    let piezo = recording.records[0].channel("piezo").unwrap();
    assert_eq!(piezo.read(3, 2).unwrap(), vec![0.503, 0.504]);
    assert!(warnings[0].contains("from 50000 samples (r10.h5) to 70000 (r2.h5)"), "{warnings:?}");
    let Some(Artifact::Document(summary)) = ports.artifact("summary") else { panic!("no summary") };
    assert_eq!(summary.0["samples"], 120_000);
    let seen = |channel: &str| serde_json::json!({ "channel": channel, "unit": "V", "records": 2 });
    assert_eq!(summary.0["channels"], serde_json::json!([seen("/deflection"), seen("/piezo")]));
}

#[test]
fn a_slow_archive_is_refused_with_the_reason() {
    let folder = Folder::new("slow");
    folder.write("r1.h5", 10e3, 1000);
    let error = folder.run(&Records { min_sample_rate_hz: 2e5, ..all() }).unwrap_err();
    assert!(
        error.to_string().contains("10000 samples per second, wanted at least 200000: too slow to carry a ringdown"),
        "{error}"
    );
    assert!(folder.run(&all()).is_ok());
}

#[test]
fn files_that_are_no_records_are_errors_that_name_them() {
    let folder = Folder::new("broken");
    let whole = folder.write("r1.h5", 5e6, 70_000);
    fs::write(folder.0.join("r2.h5"), b"this is text").unwrap();
    let bytes = fs::read(whole).unwrap();
    fs::write(folder.0.join("r3.h5"), &bytes[..bytes.len() / 2]).unwrap();
    fs::write(folder.0.join("r4.h5"), b"").unwrap();
    let error = folder.run(&all()).unwrap_err();
    let text = error.to_string();
    assert!(text.contains("r2.h5") && text.contains("the first of 3 files that cannot be used, of 4"), "{text}");
    assert!(error.help.is_some());
    let (ports, warnings) = folder.run(&Records { skip_unreadable: true, ..all() }).unwrap();
    let Some(Artifact::Recording(recording)) = ports.artifact("records") else { panic!("no recording") };
    assert_eq!((recording.records.len(), warnings.len()), (1, 3));
    for (warning, name) in warnings.iter().zip(["r2.h5", "r3.h5", "r4.h5"]) {
        assert!(warning.contains(name), "{warning}");
    }
}

#[test]
fn a_missing_channel_says_what_there_is() {
    let folder = Folder::new("channel");
    folder.write("r1.h5", 5e6, 100);
    let text = folder.run(&Records { channel: "/signal".to_owned(), ..all() }).unwrap_err().to_string();
    assert!(text.contains("/signal") && text.contains("deflection") && text.contains("r1.h5"), "{text}");
    // a piezo channel may be missing
    assert!(folder.run(&Records { piezo_channel: "/z".to_owned(), ..all() }).is_ok());
}

#[test]
fn damaged_bytes_stop_with_an_error_and_never_a_panic() {
    let folder = Folder::new("damaged");
    let path = folder.write("r1.h5", 5e6, 70_000);
    let bytes = fs::read(&path).unwrap();
    let mut refused = 0;
    for k in 0..60usize {
        let mut damaged = bytes.clone();
        let at = k * 7919 % bytes.len();
        damaged[at..(at + 4).min(bytes.len())].iter_mut().for_each(|byte| *byte ^= 0xa5);
        fs::write(&path, &damaged).unwrap();
        let read = folder.run(&all()).and_then(|(ports, _)| {
            let Some(Artifact::Recording(recording)) = ports.artifact("records") else { panic!("no recording") };
            let channel = recording.records[0].channel("deflection")?;
            channel.read(0, channel.samples)
        });
        if let Err(error) = read {
            assert!(error.to_string().contains("r1.h5"), "{error}");
            refused += 1;
        }
    }
    println!("{refused} of 60 damaged copies refused");
    // deflate's checksum sees every change of a chunk; what is left are unused bytes and other numbers
    assert!(refused > 10, "{refused}");
}

#[test]
fn parameters_are_checked_alone() {
    for (stage, named) in [
        (Records::default(), "files"),
        (Records { channel: String::new(), ..all() }, "channel"),
        (Records { min_sample_rate_hz: f64::NAN, ..all() }, "min_sample_rate_hz"),
        (Records { min_sample_rate_hz: -1.0, ..all() }, "min_sample_rate_hz"),
    ] {
        assert!(afmid_pipeline::stage::check(&stage).unwrap_err().to_string().contains(named));
    }
}

#[test]
fn results_of_afmids_own_are_left_out_with_a_counted_warning() {
    use afmid_pipeline::{RunInfo, RunResult, store::write_result};
    let folder = Folder::new("own");
    folder.write("r1.h5", 5e6, 1000);
    let run = RunResult {
        name: "own".to_owned(),
        seed: 0,
        config: String::new(),
        overrides: Vec::new(),
        program: "afmid".to_owned(),
        stages: Vec::new(),
        info: RunInfo::default(),
    };
    for name in ["a-result.h5", "result.h5"] {
        write_result(&folder.0.join(name), &run).unwrap();
    }
    let (ports, warnings) = folder.run(&all()).unwrap();
    let Some(Artifact::Recording(recording)) = ports.artifact("records") else { panic!("no recording") };
    assert_eq!((recording.records.len(), warnings.len()), (1, 1));
    assert!(warnings[0].starts_with("2 files of those that match are results of afmid's"), "{warnings:?}");
    // what is left out is no source either: the key does not depend on it
    assert_eq!(all().sources(&folder.0, &InputFiles::new()).unwrap(), [folder.0.join("r1.h5")]);
    let alone = Records { files: vec!["result.h5".to_owned()], ..all() };
    assert!(folder.run(&alone).unwrap_err().to_string().contains("all files that match"));
}

#[test]
fn facts_of_a_file_are_no_warnings_and_what_was_taken_for_granted_is_one() {
    let folder = Folder::new("facts");
    let read = |title: &str| {
        let rows: String = (0..300).map(|k| format!("{:.4},{}\n", f64::from(k) / 2560.0, k % 7)).collect();
        fs::write(folder.0.join("a.csv"), format!("{title},Acc (V)\n{rows}")).unwrap();
        let files = vec!["a.csv".to_owned()];
        let (channel, piezo_channel) = ("Acc".to_owned(), String::new());
        folder.run(&Records { files, channel, piezo_channel, min_sample_rate_hz: 0.0, ..Records::default() }).unwrap().1
    };
    assert_eq!(read("Time (s)"), Vec::<String>::new());
    let warnings = read("Time");
    assert!(warnings.len() == 1 && warnings[0].contains("no unit: taken as seconds"), "{warnings:?}");
}
