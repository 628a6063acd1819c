//! Beginnings: configs for recordings, completions, manual pages, the doctor.

use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::common::sets::write_set;
use crate::common::{self, measured_page};
use serde_json::Value;

fn afmid(here: &Path, arguments: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_afmid")).current_dir(here).args(arguments).output().expect("afmid starts")
}

fn stdout(here: &Path, arguments: &[&str]) -> String {
    let output = afmid(here, arguments);
    assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    String::from_utf8(output.stdout).expect("text")
}

#[test]
fn a_new_pipeline_finds_its_recordings_from_wherever_it_lies() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    write_set(&here.join("archive/2004"), 0, 3000);
    std::fs::write(here.join("archive/2004/notes.txt"), "of somebody").expect("a file");
    std::fs::create_dir(here.join("configs")).expect("a folder");
    for goal in ["modes", "ringdown", "diagnosis", "coupled"] {
        let config = format!("configs/{goal}.toml");
        let said = stdout(here, &["new", "pipeline", "archive/2004", "--goal", goal, "-o", &config]);
        assert!(said.contains("2 files"), "{said}");
        stdout(here, &["check", &config]);
        let text = std::fs::read_to_string(here.join(&config)).expect("a config");
        assert!(text.contains("\"../archive/2004/*.h5\""), "{text}");
        // the recordings are found and read; that they hold no event is another matter
        let explained = stdout(here, &["explain", &config, "--cache", "cache"]);
        assert!(explained.contains("records"), "{explained}");
    }
}

#[test]
fn completions_know_every_command() {
    let here = tempfile::tempdir().expect("a folder");
    for shell in ["bash", "zsh", "fish", "powershell", "elvish"] {
        let script = stdout(here.path(), &["completions", shell]);
        for command in ["run", "batch", "inspect", "doctor", "export-crate"] {
            assert!(script.contains(command), "{shell}: {command}");
        }
    }
    // what bash says of it, where there is one
    std::fs::write(here.path().join("afmid.bash"), stdout(here.path(), &["completions", "bash"])).expect("a script");
    let asked =
        "source ./afmid.bash; COMP_WORDS=(afmid ins); COMP_CWORD=1; _afmid afmid ins afmid; echo \"${COMPREPLY[@]}\"";
    let reply = Command::new("bash").current_dir(here.path()).args(["-c", asked]).output().expect("bash starts");
    assert_eq!(String::from_utf8_lossy(&reply.stdout).trim(), "inspect", "{}", String::from_utf8_lossy(&reply.stderr));
}

#[test]
fn every_command_has_a_manual_page_with_its_examples() {
    let scratch = tempfile::tempdir().expect("a folder");
    stdout(scratch.path(), &["man", "man1"]);
    let page = |name: &str| std::fs::read_to_string(scratch.path().join("man1").join(name)).expect(name);
    assert!(page("afmid.1").contains("afmid\\-run(1)"));
    assert!(page("afmid-run.1").contains("records.files"));
    assert!(page("afmid-submit-slurm.1").contains("\\-\\-shards"));
    assert!(page("afmid-new-pipeline.1").contains("\\-\\-goal"));
    assert_eq!(stdout(scratch.path(), &["man"]), page("afmid.1"));
}

#[test]
fn the_doctor_finds_this_machine_fit_and_a_blocked_cache_not() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let findings: Value = serde_json::from_str(&stdout(here, &["doctor", "--cache", "cache", "--json"])).expect("JSON");
    let findings = findings["findings"].as_array().expect("findings");
    let state = |what: &str| findings.iter().find(|finding| finding["what"] == what).map(|finding| &finding["state"]);
    assert_eq!(state("model.pem"), Some(&"good".into()), "{findings:?}");
    assert!(findings.iter().all(|finding| finding["state"] != "bad"), "{findings:?}");
    std::fs::write(here.join("file"), "in the way").expect("a file");
    let output = afmid(here, &["doctor", "--cache", "file"]);
    assert_eq!(output.status.code(), Some(1));
    let text = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(text.lines().any(|line| line.starts_with("x cache")) && text.contains("--cache"), "{text}");
}

/// Modes of a file by three commands: frequency, its error, damping ratio, its error.
fn modes_by_three_commands(here: &Path, file: &str, said: &[String]) -> Vec<[f64; 4]> {
    let (config, result) = (format!("{file}.toml"), format!("{file}.result.h5"));
    let mut new = vec!["new", "pipeline", file, "-o", &config];
    new.extend(said.iter().map(String::as_str));
    stdout(here, &new);
    stdout(here, &["run", &config, "-o", &result, "--cache", "cache"]);
    let shown: Value = serde_json::from_str(&stdout(here, &["show", &result, "modes", "--json"])).expect("JSON");
    let names = ["frequency_hz", "frequency_std_hz", "damping_ratio", "damping_ratio_std"];
    let number = |mode: &Value, name: &str| mode[name].as_f64().unwrap_or_else(|| panic!("{file}: {shown}"));
    shown["modes"].as_array().expect("modes").iter().map(|mode| names.map(|name| number(mode, name))).collect()
}

#[test]
fn one_decay_gives_the_same_modes_from_any_file_by_three_commands() {
    let python = common::python_bin().join("python");
    let script = Path::new(common::ROOT).join("tests/decay_files.py");
    let (mut covered, mut all) = (0, 0);
    for seed in 0..5 {
        let scratch = tempfile::tempdir().expect("a folder");
        let here = scratch.path();
        let written =
            Command::new(&python).arg(&script).arg(here).arg(seed.to_string()).output().expect("python starts");
        assert!(written.status.success(), "{}", String::from_utf8_lossy(&written.stderr));
        let written: Value = serde_json::from_slice(&written.stdout).expect("JSON");
        let truth: Vec<[f64; 2]> = serde_json::from_value(written["modes"].clone()).expect("modes");
        let mut first: Option<Vec<[f64; 4]>> = None;
        for (file, said) in written["files"].as_object().expect("files") {
            let said: Vec<String> = serde_json::from_value(said.clone()).expect("arguments");
            let modes = modes_by_three_commands(here, file, &said);
            assert_eq!(modes.len(), truth.len(), "{file}, seed {seed}: {modes:?}");
            let first = first.get_or_insert_with(|| modes.clone());
            for (own, other) in modes.iter().zip(first) {
                // twelve digits of a universal file, and where the search ends
                let far = (own[0] - other[0]).abs() / other[1] + (own[2] - other[2]).abs() / other[3];
                assert!(far < 1e-3, "{file}, seed {seed}: {own:?} {other:?}");
            }
        }
        for (mode, [frequency, damping]) in first.expect("files").iter().zip(truth) {
            let inside = |value: f64, std: f64, truth: f64| usize::from((value - truth).abs() < 1.96 * std);
            covered += inside(mode[0], mode[1], frequency) + inside(mode[2], mode[3], damping);
            all += 2;
        }
    }
    // of 30 intervals of 95 % fewer than 25 hold the truth once in a thousand times
    assert!(covered >= 25, "{covered} of {all} intervals hold the truth");
}

/// White noise: sums of twelve uniform numbers.
pub(super) fn white(seed: u64, samples: usize) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut uniform = || {
        state ^= state << 13;
        state ^= state >> 7;
        state ^= state << 17;
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..samples).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
}

/// What comes out of a resonance of 50 Hz, Q = 5, at 1 kHz.
fn resonance(input: &[f64]) -> Vec<f64> {
    let w = std::f64::consts::TAU * 50.0 / 1e3;
    let (decay, turn) = ((-w / 10.0).exp(), w * (1.0 - 0.01_f64).sqrt());
    let (mut last, mut before, mut before_input) = (0.0, 0.0, 0.0);
    let step = |u: &f64| {
        let next = 2.0 * decay * turn.cos() * last - decay * decay * before + before_input;
        (before, last, before_input) = (last, next, *u);
        next
    };
    input.iter().map(step).collect()
}

fn table(here: &Path, name: &str, header: &str, columns: &[&[f64]]) {
    let row = |k: usize| {
        let values: Vec<String> = columns.iter().map(|column| format!("{:.9}", column[k])).collect();
        format!("{:.4},{}\n", k as f64 * 1e-3, values.join(","))
    };
    let rows: String = (0..columns[0].len()).map(row).collect();
    std::fs::write(here.join(name), format!("{header}\n{rows}")).expect("a table");
}

#[test]
fn the_data_choose_the_pipeline_and_its_numbers_hold() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let (force, sensor) = (white(1, 20_000), white(2, 20_000));
    let moved: Vec<f64> = resonance(&force).iter().zip(&sensor).map(|(y, e)| y + 0.1 * e).collect();
    let hum = |k: usize| (std::f64::consts::TAU * 0.0321 * k as f64).sin() + 0.05 * sensor[k];
    table(here, "hum.csv", "Time (s),Signal (V)", &[&(0..20_000).map(hum).collect::<Vec<f64>>()]);
    table(here, "noise.csv", "Time (s),Signal (V)", &[&moved]);
    table(here, "both.csv", "Time (s),force (N),motion (m)", &[&force, &moved]);
    let shown = |file: &str, goal: &str, id: &str| -> Value {
        let (config, result) = (format!("{file}.toml"), format!("{file}.h5"));
        let new: Value =
            serde_json::from_str(&stdout(here, &["new", "pipeline", file, "-o", &config, "--json"])).expect("JSON");
        assert_eq!(new["goal"], goal, "{new}");
        stdout(here, &["run", &config, "-o", &result, "--cache", "cache"]);
        measured_page(here, &result);
        serde_json::from_str(&stdout(here, &["show", &result, id, "--json"])).expect("JSON")
    };
    // within four standard errors
    let near = |found: &Value, std: &Value, truth: f64| {
        let (value, std) = (found.as_f64().expect("a value"), std.as_f64().expect("an error"));
        assert!((value - truth).abs() < 4.0 * std, "{value} +- {std}, wanted {truth}");
    };
    let steady = &shown("hum.csv", "steady", "oscillation")["oscillations"][0];
    near(&steady["frequency_hz"], &steady["frequency_std_hz"], 32.1);
    let thermal = shown("noise.csv", "thermal", "thermal");
    near(&thermal["frequency"]["value"], &thermal["frequency"]["robust_std"], 50.0);
    near(&thermal["quality_factor"]["value"], &thermal["quality_factor"]["robust_std"], 5.0);
    let modes = &shown("both.csv", "input-output", "modes")["modes"];
    near(&modes[0]["frequency_hz"], &modes[0]["frequency_std_hz"], 50.0);
    near(&modes[0]["damping_ratio"], &modes[0]["damping_ratio_std"], 0.1);
    let page = measured_page(here, "both.csv.h5");
    for words in ["<h2>Transfer function</h2>", ">Magnitude (m/N)<", ">force (N)<", ">motion (m)<", ">damping ratio<"] {
        assert!(page.contains(words), "{words}");
    }
    assert!(measured_page(here, "hum.csv.h5").contains("<h2>Oscillation</h2>"));
    let missing = afmid(here, &["show", "hum.csv.h5", "modes"]);
    let said = String::from_utf8_lossy(&missing.stderr).into_owned();
    assert!(missing.status.code() == Some(2) && said.contains("of a config `steady`"), "{said}");
    assert!(said.contains("there is: records, oscillation"), "{said}");
    assert!(measured_page(here, "noise.csv.h5").contains("<h2>Resonance</h2>"));
    stdout(here, &["new", "pipeline", "both.csv", "--goal", "frf", "-o", "frf.toml"]);
    stdout(here, &["run", "frf.toml", "-o", "frf.h5", "--cache", "cache"]);
    let page = measured_page(here, "frf.h5");
    for words in [">motion / force<", ">Phase (°)<", ">Coherence<", ">measured<", ">fitted<", ">damping ratio<"] {
        assert!(page.contains(words), "{words}");
    }
}

#[test]
fn a_decay_s_page_names_its_channels() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    // the response to one sample of force, and noise of a thousandth
    let [mut hit, noise] = [vec![0.0; 4000], white(5, 4000)];
    hit[500] = 1.0;
    let moved: Vec<f64> = resonance(&hit).iter().zip(&noise).map(|(y, e)| y + 1e-3 * e).collect();
    table(here, "hit.csv", "Time (s),rib (m/s^2)", &[&moved]);
    stdout(here, &["new", "pipeline", "hit.csv", "--goal", "decay", "-o", "hit.toml"]);
    stdout(here, &["run", "hit.toml", "-o", "hit.h5", "--cache", "cache"]);
    let page = measured_page(here, "hit.h5");
    for words in [">rib (m/s²)<", ">measured<", ">fitted<", ">damping ratio<"] {
        assert!(page.contains(words), "{words}");
    }
}

#[test]
fn what_a_file_does_not_say_of_its_input_is_asked_for() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let force = white(3, 2000);
    let [first, second] = [resonance(&force), white(4, 2000)];
    table(here, "t.csv", "Time (s),force,a,b", &[&force, &first, &second]);
    let refused = |arguments: &[&str]| {
        let output = afmid(here, arguments);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let one = refused(&["new", "pipeline", "t.csv", "--goal", "input-output"]);
    assert!(one.contains("say with --channel which one of a, b"), "{one}");
    stdout(here, &["new", "pipeline", "t.csv", "-o", "t.toml"]);
    let text = std::fs::read_to_string(here.join("t.toml")).expect("a config");
    assert!(text.contains("outputs = [\"a\", \"b\"]") && text.contains("blocks = \"segments\""), "{text}");
    let named = refused(&["new", "pipeline", "t.csv", "--input", "c"]);
    assert!(named.contains("no channel `c`") && named.contains("force, a, b"), "{named}");
    stdout(here, &["new", "pipeline", "t.csv", "--input", "force", "--channel", "b", "-o", "c.toml"]);
    let text = std::fs::read_to_string(here.join("c.toml")).expect("a config");
    assert!(text.contains("inputs = [\"force\"]") && text.contains("output = \"b\""), "{text}");
    // no titles: a column of times, a hammer's pulse, what rings after it
    let pulse: Vec<f64> = (0..2000).map(|k| if (300..304).contains(&k) { 5.0 } else { 1e-3 * first[k] }).collect();
    table(here, "h.csv", "Time (s),force (N),a (m),b (m)", &[&pulse, &resonance(&pulse), &resonance(&pulse)]);
    stdout(here, &["new", "pipeline", "h.csv", "-o", "h.toml"]);
    let text = std::fs::read_to_string(here.join("h.toml")).expect("a config");
    assert!(text.contains("outputs = [\"a\", \"b\"]") && text.contains("blocks = \"hits\""), "{text}");
    stdout(here, &["check", "h.toml"]);
    table(here, "u.txt", "", &[&pulse, &resonance(&pulse)]);
    let asked = refused(&["new", "pipeline", "u.txt"]);
    assert!(asked.contains("no sample rate and no unit") && asked.contains("there are 1000 samples"), "{asked}");
    assert!(asked.contains("--goal frf if column_1 is a frequency"), "{asked}");
    let said = stdout(here, &["new", "pipeline", "u.txt", "--rate", "1000", "--unit", "m/s^2", "-o", "u.toml"]);
    assert!(said.contains("column_2 is short as a hammer's force: --input column_2"), "{said}");
}

/// A measured recording: its file below the shared data, what has to be said, and what is known of its modes: frequency
/// and how far reports of it differ.
type Measured = (&'static str, &'static [&'static str], &'static [(f64, f64)]);

/// Known values are those of the recordings' authors (docs/results/decay.md, docs/results/frf.md).
const MEASURED: [Measured; 5] = [
    // 57.0549 to 57.060 krad/s
    ("decays/rlc-pulse/Pulse_3.14-oscilloscope.csv", &["--channel", "V_C", "--unit", "V"], &[(9081.0, 1.5)]),
    ("decays/flexible-link/resultID.mat", &["--rate", "333.3333333333", "--unit", "m/s^2"], &[(15.985, 0.025)]),
    (
        "decays/pcb-strip/HM_b04_100mO_#8_12in_16thflt_wR2841_10.lvm",
        &["--rate", "200000", "--unit", "g"],
        &[(762.0, 2.0)],
    ),
    (
        "decays/brake-reuss/HammerImpact.mat",
        &["--unit", "m/s^2"],
        &[(80.42, 0.12), (297.7, 0.3), (845.5, 0.5), (1527.0, 1.0)],
    ),
    // read off the responses' imaginary parts by their authors
    ("hammer/tool-frf", &["--unit", "m/N"], &[(1074.0, 11.0), (1961.0, 20.0), (2617.0, 26.0)]),
];

#[test]
fn measured_recordings_reach_their_known_modes_by_three_commands() {
    let data =
        std::env::var_os("AFMID_DATA").map_or_else(|| Path::new(common::ROOT).join("../shared/data"), Into::into);
    let mut missing = 0;
    for (number, (file, said, known)) in MEASURED.iter().enumerate() {
        let path = data.join(file);
        if !path.exists() {
            missing += 1;
            continue;
        }
        let scratch = tempfile::tempdir().expect("a folder");
        let here = scratch.path();
        let (config, result) = (format!("{number}.toml"), format!("{number}.h5"));
        let path = path.canonicalize().expect("a path");
        // of a folder the five points, not what is written about them
        let points = (1..=5).map(|point| path.join(format!("Point_{point}_Channel_1_CH1.txt")));
        let files: Vec<PathBuf> = if path.is_dir() { points.collect() } else { vec![path.clone()] };
        let mut new = vec!["new", "pipeline", "-o", &config];
        new.extend(files.iter().map(|file| file.to_str().expect("text")));
        new.extend(*said);
        stdout(here, &new);
        stdout(here, &["run", &config, "-o", &result, "--cache", "cache"]);
        let shown: Value = serde_json::from_str(&stdout(here, &["show", &result, "modes", "--json"])).expect("JSON");
        let modes = shown["modes"].as_array().expect("modes");
        for (frequency, range) in *known {
            let near = |mode: &Value| (mode["frequency_hz"].as_f64().unwrap_or(f64::NAN) - frequency).abs() < *range;
            assert!(modes.iter().any(near), "{file}: no mode at {frequency} Hz in {shown}");
        }
    }
    if missing > 0 {
        println!(
            "stand-in: {missing} measured recordings are not here; the simulated ones of this file are tried alone"
        );
    }
}
