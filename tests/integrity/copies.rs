//! What was recorded once counts once, under however many names, formats and attributes it lies there.

use std::f64::consts::TAU;
use std::fs;
use std::path::Path;

use afmid_pipeline::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde_json::Value;

use super::common::{said, shown};

const RATE_HZ: f64 = 1e4;

/// Decays of one mode in noise, each sample a code.
fn hit(seed: u64) -> Vec<i16> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let amplitude = 8000.0 * (1.0 + 0.1 * seed as f64);
    let ring = |k: usize| match k.checked_sub(1000) {
        Some(after) => (-0.004 * after as f64).exp() * (TAU * 0.05 * after as f64).sin(),
        None => 0.0,
    };
    (0..6000).map(|k| (amplitude * ring(k)) as i16 + random.random_range(-40..40)).collect()
}

/// A record of such channels, and how it is written.
fn write(path: &Path, channels: &[(&str, Codes, f64)], storage: RecordStorage) {
    let channel = |(location, codes, scale_factor): &(&str, Codes, f64)| NativeChannel {
        location: (*location).to_owned(),
        codes: codes.clone(),
        unit: "V".to_owned(),
        scale_factor: *scale_factor,
        add_offset: 0.0,
        long_name: path.display().to_string(),
    };
    let channels = channels.iter().map(channel).collect();
    let record = NativeRecord { sample_rate_hz: RATE_HZ, started_at: String::new(), channels };
    write_native(path, &record, storage).expect("a record");
}

fn single(path: &Path, codes: Codes, scale_factor: f64, storage: RecordStorage) {
    write(path, &[("deflection", codes, scale_factor)], storage);
}

/// Modes of the hits in records.
const MODES: &str = r#"[pipeline]
name = "hits"
seed = 1

[[stage]]
id = "records"
uses = "io.records"
params = { files = ["archive/*"], piezo_channel = "" }

[[stage]]
id = "decays"
uses = "events.decay"
inputs = { records = "records.records" }

[[stage]]
id = "modes"
uses = "model.decay"
inputs = { decays = "decays.decays" }
"#;

fn folder() -> tempfile::TempDir {
    let scratch = tempfile::tempdir().expect("a folder");
    fs::write(scratch.path().join("modes.toml"), MODES).expect("a config");
    fs::create_dir(scratch.path().join("archive")).expect("a folder");
    scratch
}

/// The modes, and what was said on the way.
fn modes(here: &Path, more: &[&str]) -> (Value, String) {
    let run = ["run", "modes.toml", "-o", "out.h5", "--cache", "cache"];
    let [_, stderr] = said(here, &[&run[..], more].concat());
    (shown(here, "out.h5", "modes"), stderr)
}

#[test]
fn ten_copies_of_a_recording_give_its_own_modes_and_errors_and_a_warning_with_their_names() {
    let scratch = folder();
    let here = scratch.path();
    let path = |name: &str| here.join("archive").join(name);
    for seed in 1..=2 {
        single(&path(&format!("a{seed}.h5")), Codes::Int16(hit(seed)), 1e-3, RecordStorage::Raw);
    }
    let (truth, quiet) = modes(here, &[]);
    assert!(!quiet.contains("counts once"), "{quiet}");
    for copy in 1..=10 {
        fs::copy(path("a1.h5"), path(&format!("b{copy}.h5"))).expect("a copy");
    }
    let (found, stderr) = modes(here, &[]);
    assert_eq!(found, truth);
    for word in ["10 copies", "b1.h5 (as a1.h5)", "b2.h5", "5 more", "same bytes"] {
        assert!(stderr.contains(word), "{word}: {stderr}");
    }
    assert_eq!(shown(here, "out.h5", "records")["records"], 2);
}

#[test]
fn other_storage_attributes_and_formats_make_no_other_recording() {
    let scratch = folder();
    let here = scratch.path();
    let path = |name: &str| here.join("archive").join(name);
    let codes = hit(1);
    for seed in 1..=2 {
        single(&path(&format!("a{seed}.h5")), Codes::Int16(hit(seed)), 1e-3, RecordStorage::Raw);
    }
    let (truth, _) = modes(here, &[]);
    let values: Vec<f64> = codes.iter().map(|&code| f64::from(code) * 1e-3).collect();
    let wider: Vec<f32> = codes.iter().map(|&code| f32::from(code)).collect();
    single(&path("b-deflated.h5"), Codes::Int16(codes.clone()), 1e-3, RecordStorage::Deflate(3));
    single(&path("c-values.h5"), Codes::Float64(values.clone()), 1.0, RecordStorage::Raw);
    single(&path("d-scaled.h5"), Codes::Int16(codes.clone()), 2e-3, RecordStorage::Raw);
    single(&path("e-wider.h5"), Codes::Float32(wider), 1e-3, RecordStorage::Raw);
    // a table of the same values
    let rows: String =
        values.iter().enumerate().map(|(k, value)| format!("{},{value:?}\n", k as f64 / RATE_HZ)).collect();
    fs::write(path("f-table.csv"), format!("time (s),deflection (V)\n{rows}")).expect("a table");
    let (found, stderr) = modes(here, &["--set", "records.skip_unreadable=true"]);
    assert_eq!(found, truth, "{stderr}");
    for name in ["b-deflated.h5", "c-values.h5", "d-scaled.h5", "e-wider.h5", "f-table.csv"] {
        assert!(stderr.contains(&format!("{name} (as a1.h5)")), "{name}: {stderr}");
    }
    // one sample that is another makes another recording
    let mut other = codes;
    other[5999] += 1;
    single(&path("b-deflated.h5"), Codes::Int16(other), 1e-3, RecordStorage::Deflate(3));
    modes(here, &["--set", "records.skip_unreadable=true"]);
    assert_eq!(shown(here, "out.h5", "records")["records"], 3);
}

#[test]
fn channels_of_one_file_that_are_equal_count_once_as_hits_and_as_sensors() {
    let scratch = folder();
    let here = scratch.path();
    let path = here.join("archive/a.h5");
    let channels = |names: &[&'static str], seeds: &[u64]| {
        let all: Vec<(&str, Codes, f64)> =
            names.iter().zip(seeds).map(|(name, seed)| (*name, Codes::Int16(hit(*seed)), 1e-3)).collect();
        write(&path, &all, RecordStorage::Raw);
        format!("records.channels={names:?}")
    };
    for (set, word) in [("decays.as=hits", "are equal"), ("decays.as=auto", "every record")] {
        let two = channels(&["a", "b"], &[1, 2]);
        let (truth, _) = modes(here, &["--set", &two, "--set", set]);
        let three = channels(&["a", "b", "c"], &[1, 2, 1]);
        let (found, stderr) = modes(here, &["--set", &three, "--set", set]);
        assert_eq!(found, truth, "{set}: {stderr}");
        assert!(stderr.contains("a.h5 c (as a.h5 a)") && stderr.contains(word), "{set}: {stderr}");
    }
}

/// A table of force and response.
fn table(path: &Path, seed: u64, head: &str) {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut y = [0.0; 2];
    let rows: String = (0..4000)
        .map(|_| {
            let u: f64 = random.random_range(-1.0..1.0);
            y = [1.6 * y[0] - 0.8 * y[1] + u, y[0]];
            format!("{u:?},{:?}\n", y[0] + random.random_range(-0.1..0.1))
        })
        .collect();
    fs::write(path, format!("{head}{rows}")).expect("a table");
}

const RESPONSE: &str = r#"[pipeline]
name = "response"
seed = 1

[[stage]]
id = "data"
uses = "io.columns"
params = { files = ["archive/*.csv"], sample_rate_hz = 100.0, input_unit = "N", output_unit = "m" }

[[stage]]
id = "frf"
uses = "spectrum.measured_frf"
inputs = { pair = "data.pair" }
params = { block_samples = 400 }
"#;

#[test]
fn files_of_force_and_response_that_are_copies_count_once() {
    let scratch = folder();
    let here = scratch.path();
    fs::write(here.join("response.toml"), RESPONSE).expect("a config");
    let run = || {
        let [_, stderr] = said(here, &["run", "response.toml", "-o", "out.h5", "--cache", "cache"]);
        (shown(here, "out.h5", "frf"), stderr)
    };
    ["a", "b"].iter().zip(1..).for_each(|(name, seed)| table(&here.join(format!("archive/{name}.csv")), seed, "u,y\n"));
    let (truth, quiet) = run();
    assert!(!quiet.contains("counts once"), "{quiet}");
    // the same bytes, and the same values under another head
    fs::copy(here.join("archive/a.csv"), here.join("archive/c.csv")).expect("a copy");
    table(&here.join("archive/d.csv"), 2, "force,motion\n");
    let (found, stderr) = run();
    assert_eq!(found, truth, "{stderr}");
    for word in ["c.csv (as a.csv)", "d.csv (as b.csv)"] {
        assert!(stderr.contains(word), "{word}: {stderr}");
    }
}

const FRF: &str = r#"[pipeline]
name = "frf"
seed = 1

[[stage]]
id = "frf"
uses = "io.frf"
params = { files = ["archive/*.txt"], unit = "m/N" }
"#;

#[test]
fn frequency_responses_that_are_copies_count_once_and_those_of_other_points_do_not() {
    let scratch = folder();
    let here = scratch.path();
    fs::write(here.join("frf.toml"), FRF).expect("a config");
    let lines = |point: f64| -> String {
        let value = |f: f64| [1e4 - f * f, -point * f].map(|part| part / ((1e4 - f * f).powi(2) + (point * f).powi(2)));
        (1..=150)
            .map(|k| (f64::from(k), value(f64::from(k))))
            .map(|(f, [re, im])| format!("{f}\t{re:?}\t{im:?}\n"))
            .collect()
    };
    let write = |name: &str, text: &str| fs::write(here.join("archive").join(name), text).expect("a file");
    write("p1.txt", &lines(1.0));
    write("p2.txt", &lines(2.0));
    // the same bytes, and the same values with more digits
    write("p3.txt", &lines(1.0));
    write("p4.txt", &lines(2.0).replace("\n7\t", "\n7.0\t"));
    let run = |more: &[&str]| {
        let [_, stderr] = said(here, &[&["run", "frf.toml", "-o", "out.h5", "--cache", "cache"][..], more].concat());
        (shown(here, "out.h5", "frf"), stderr)
    };
    let (found, stderr) = run(&[]);
    assert!(stderr.contains("p3.txt (as p1.txt)") && stderr.contains("p4.txt (as p2.txt)"), "{stderr}");
    assert!(found.to_string().contains("\"responses\":2"), "{found}");
    // who states other points has measured there
    let (found, stderr) = run(&["--set", "frf.positions_m=[0.1,0.2,0.3,0.4]"]);
    assert!(stderr.contains("p3.txt (as p1.txt)") && !stderr.contains("p4.txt"), "{stderr}");
    assert!(found.to_string().contains("\"responses\":3"), "{found}");
}
