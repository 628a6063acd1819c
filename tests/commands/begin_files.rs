//! Configs for files that do not all go together, and for channels that do not.

use std::path::Path;
use std::process::Command;

use crate::common::{self, said};
use serde_json::Value;

/// A decay of 0.05 cycles a sample and Q = 20 from sample 300 on, of this amplitude, with noise of a hundredth of 1.
fn decay(amplitude: f64, seed: u32) -> Vec<f64> {
    let w = std::f64::consts::TAU * 0.05;
    let ring = |k: f64| if k < 0.0 { 0.0 } else { amplitude * (-w * k / 40.0).exp() * (w * k).sin() };
    noise(seed).iter().enumerate().map(|(k, e)| ring(k as f64 - 300.0) + 0.01 * e).collect()
}

/// Noise of variance 1: sums of twelve uniform numbers.
pub(super) fn noise(seed: u32) -> Vec<f64> {
    let mut state = u64::from(seed).wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..2000).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
}

/// A table with a column of times.
fn table(here: &Path, name: &str, step_s: f64, header: &str, columns: &[Vec<f64>]) {
    let row = |k: usize| {
        let values: Vec<String> = columns.iter().map(|column| format!("{:.9}", column[k])).collect();
        format!("{:.6},{}\n", k as f64 * step_s, values.join(","))
    };
    let rows: String = (0..columns[0].len()).map(row).collect();
    std::fs::write(here.join(name), format!("{header}\n{rows}")).expect("a table");
}

/// The modes' frequencies of a config that runs.
pub(super) fn frequencies(here: &Path, config: &str) -> Vec<f64> {
    let result = format!("{config}.h5");
    said(here, &["run", config, "-o", &result, "--cache", "cache"]);
    let [shown, _] = said(here, &["show", &result, "modes", "--json"]);
    let shown: Value = serde_json::from_str(&shown).expect("JSON");
    let modes = shown["modes"].as_array().expect("modes");
    modes.iter().map(|mode| mode["frequency_hz"].as_f64().expect("a number")).collect()
}

/// Three files of 1 kHz, two of 2 kHz, one of other channels, and what else lies in such a folder.
fn of_several_kinds(folder: &Path) {
    std::fs::create_dir(folder).expect("a folder");
    for (number, step_s) in [(1, 1e-3), (2, 5e-4), (3, 1e-3), (4, 1e-3), (5, 5e-4)] {
        table(folder, &format!("hit {number}.csv"), step_s, "Time (s),tip (m)", &[decay(1.0, number)]);
    }
    table(folder, "other.csv", 1e-3, "Time (s),root (m)", &[decay(1.0, 6)]);
    for (name, text) in [("README.md", "Hits of a beam."), ("LICENSE", "MIT"), ("PROVENANCE.txt", "name: hits\n")] {
        std::fs::write(folder.join(name), text).expect("a file");
    }
    table(folder, "short.csv", 1e-3, "Time (s),tip (m)", &[decay(1.0, 7)[..20].to_vec()]);
}

#[test]
fn of_files_of_several_rates_the_most_are_taken_and_the_commands_for_the_others_work() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    of_several_kinds(&here.join("hits"));
    let [stdout, stderr] = said(here, &["new", "pipeline", "hits", "-o", "c.toml"]);
    assert!(stdout.contains("3 files"), "{stdout}");
    for words in [
        "left out: 2 files at 2000 Hz (tip); for a config of them: afmid new pipeline hits --rate 2000 -o c-2.toml",
        "left out: 1 file at 1000 Hz (root); for a config of them: afmid new pipeline hits/other.csv -o c-3.toml",
        "skipped: LICENSE, PROVENANCE.txt, README.md: of no format that is known",
        "skipped: short.csv: no channel of 64 samples",
    ] {
        assert!(stderr.contains(words), "{words} in {stderr}");
        let config = std::fs::read_to_string(here.join("c.toml")).expect("a config");
        assert!(config.contains(&format!("# {words}\n")), "{words} in {config}");
    }
    for command in stderr.lines().filter_map(|line| line.split_once("of them: afmid ")) {
        said(here, &command.1.split(' ').collect::<Vec<&str>>());
    }
    // as many hertz as samples a second times 0.05, to a thousandth: 20 standard errors
    for (config, frequency) in [("c.toml", 50.0), ("c-2.toml", 100.0), ("c-3.toml", 50.0)] {
        let found = frequencies(here, config);
        assert!(found.len() == 1 && (found[0] / frequency - 1.0).abs() < 1e-3, "{config}: {found:?}");
    }
    let config = std::fs::read_to_string(here.join("c-2.toml")).expect("a config");
    assert!(config.contains("files = [\"hits/hit 2.csv\", \"hits/hit 5.csv\"]"), "{config}");
}

#[test]
fn files_that_were_given_by_name_are_grouped_too_and_one_that_is_none_is_an_error() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    of_several_kinds(&here.join("hits"));
    let all: Vec<String> = (1..=5).map(|number| format!("hits/hit {number}.csv")).collect();
    let mut arguments = vec!["new", "pipeline", "-o", "c.toml"];
    arguments.extend(all.iter().map(String::as_str));
    let [stdout, stderr] = said(here, &arguments);
    assert!(stdout.contains("3 files"), "{stdout}");
    assert!(stderr.contains("afmid new pipeline 'hits/hit 2.csv' 'hits/hit 5.csv' -o c-2.toml"), "{stderr}");
    arguments[3] = "other.toml";
    arguments.push("hits/LICENSE");
    let output = common::command(here, &arguments).output().expect("afmid starts");
    let refused = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.code() == Some(2) && refused.contains("hits/LICENSE: "), "{refused}");
    // a config that names all of them says how to make one that does not
    let config = std::fs::read_to_string(here.join("c.toml")).expect("a config");
    let from = config.find("files = [").expect("files");
    let to = from + config[from..].find(']').expect("an end");
    let mixed = format!("{}files = [\"hits/hit*.csv\"{}", &config[..from], &config[to..]);
    std::fs::write(here.join("mixed.toml"), mixed).expect("a config");
    let output =
        common::command(here, &["run", "mixed.toml", "-o", "m.h5", "--cache", "cache"]).output().expect("afmid starts");
    let refused = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(!output.status.success(), "{refused}");
    for words in ["2 sample rates: 3 at 1000 Hz", "takes the files of the rate that most have"] {
        assert!(refused.contains(words), "{words} in {refused}");
    }
}

#[test]
fn like_channels_that_ring_go_before_one_that_drives_and_the_others_are_named_with_the_reason() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let constant = vec![0.5; 2000];
    let columns = [decay(1.0, 1), decay(1.0, 2), decay(-0.4, 3), constant.clone(), noise(5), constant];
    let header = "Time (s),monitor (V),gauge_0 (Strain),gauge_1 (Strain),gauge_2 (Strain),room (K),Drive (V)";
    table(here, "units.csv", 1e-3, header, &columns);
    let [_, stderr] = said(here, &["new", "pipeline", "units.csv", "-o", "u.toml"]);
    let config = std::fs::read_to_string(here.join("u.toml")).expect("a config");
    assert!(config.contains("channels = [\"gauge_0\", \"gauge_1\"]"), "{config}");
    let words = "channels left out: monitor (in V); gauge_2, Drive (constant); room (in K); --channel NAME takes";
    assert!(stderr.contains(words) && config.contains(words), "{stderr}");
    let found = frequencies(here, "u.toml");
    assert!(found.len() == 1 && (found[0] / 50.0 - 1.0).abs() < 1e-3, "{found:?}");
    said(here, &["new", "pipeline", "units.csv", "--channel", "monitor", "-o", "m.toml"]);
    // no units: names that differ in their number alone
    table(here, "names.csv", 1e-3, "Time (s),volt,acc 1,acc 2", &columns[..3]);
    let [_, stderr] = said(here, &["new", "pipeline", "names.csv", "--unit", "g", "-o", "n.toml"]);
    let config = std::fs::read_to_string(here.join("n.toml")).expect("a config");
    assert!(config.contains("channels = [\"acc 1\", \"acc 2\"]"), "{config}");
    assert!(stderr.contains("volt (of another name)"), "{stderr}");
    // a unit scales the amplitudes alone; modes are whatever the data have
    for (goal, config) in [(&[][..], "w.toml"), (&["--goal", "modes"], "g.toml")] {
        let [_, stderr] = said(here, &[&["new", "pipeline", "names.csv", "-o", config], goal].concat());
        assert!(stderr.contains("no unit is stated") && stderr.contains("--unit UNIT"), "{stderr}");
        assert_eq!(frequencies(here, config), frequencies(here, "n.toml"));
    }
    let [overview, _] = said(here, &["show", "n.toml.h5"]);
    let place = |what: &str| overview.find(what).unwrap_or_else(|| panic!("no {what}: {overview}"));
    assert!(place("modes.modes (table)\nfrequency_hz [Hz]") < place("\nstage "), "{overview}");
}

/// Frequencies and the receptance of a mode at 200 Hz of 1 % damping, and what somebody's Python wrote of it.
const SPECTRA: &str = "
import sys, h5py, numpy as np, scipy.io
here = sys.argv[1]
f = np.arange(1, 2001) * 0.5
s = 2j * np.pi * f
h = 1 / (s**2 + 2 * 0.01 * 400 * np.pi * s + (400 * np.pi)**2)
for name in ['f', 'freq', 'Hz', 'frequencies_hz']:
    np.savez(f'{here}/density_{name}.npz', **{name: f, 'psd': abs(h)**2})
    np.savez(f'{here}/complex_{name}.npz', **{name: f, 'H': h})
    scipy.io.savemat(f'{here}/density_{name}.mat', {name: f, 'psd': abs(h)**2})
    scipy.io.savemat(f'{here}/complex_{name}.mat', {name: f, 'H': h})
    with h5py.File(f'{here}/density_{name}.h5', 'w') as file:
        file[name], file['psd'] = f, abs(h)**2
    with h5py.File(f'{here}/complex_{name}.h5', 'w') as file:
        file[name], file['H'] = f, h
with h5py.File(f'{here}/density_x.h5', 'w') as file:
    file['x'], file['y'] = f, abs(h)**2
    file['x'].attrs['units'] = 'Hz'
np.savez(f'{here}/complex_kHz.npz', freq_kHz=f / 1000, H=h)
np.savez(f'{here}/complex_alone.npz', H=h)
t = np.arange(2000) / 1000
y = np.where(t < 0.3, 0, np.exp(-8 * (t - 0.3)) * np.sin(314 * (t - 0.3))) + 0.01 * np.random.default_rng(1).normal(size=2000)
np.savez(f'{here}/record.npz', t=t, f=y)
";

#[test]
fn what_lies_over_frequencies_is_no_record() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let python = Command::new(common::python_bin().join("python")).args(["-c", SPECTRA]).arg(here).output();
    let python = python.expect("python starts");
    assert!(python.status.success(), "{}", String::from_utf8_lossy(&python.stderr));
    let mut seen = 0;
    for entry in std::fs::read_dir(here).expect("a folder") {
        let name = entry.expect("a file").file_name().to_string_lossy().into_owned();
        let config = format!("{name}.toml");
        let output = common::command(here, &["new", "pipeline", &name, "--unit", "m", "-o", &config])
            .output()
            .expect("afmid starts");
        let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
        if name == "density_x.h5" {
            // nothing says what `y` is
            assert_eq!(output.status.code(), Some(2), "{name}: {stderr}");
            assert!(stderr.contains("a spectrum, no record over time"), "{name}: {stderr}");
            assert!(stderr.contains("--goal thermal") && stderr.contains("--goal frf"), "{name}: {stderr}");
            said(here, &["new", "pipeline", &name, "--goal", "thermal", "-o", &config]);
        } else if name.starts_with("density") {
            assert!(output.status.success(), "{name}: {stderr}");
            let text = std::fs::read_to_string(here.join(&config)).expect("a config");
            assert!(text.contains("io.spectrum") && text.contains("unit = \"m\""), "{name}: {text}");
            said(here, &["check", &config]);
        } else if name == "complex_alone.npz" {
            assert!(stderr.contains("no frequencies as many are in the file"), "{stderr}");
        } else {
            assert!(output.status.success(), "{name}: {stderr}");
            let (found, truth) = (frequencies(here, &config), if name == "record.npz" { 49.97 } else { 200.0 });
            assert!(found.len() == 1 && (found[0] / truth - 1.0).abs() < 1e-3, "{name}: {found:?}");
        }
        seen += 1;
    }
    assert_eq!(seen, 4 * 6 + 4);
}

/// Points of a beam that is struck, and where the sensor is, as shares of its length.
const POINTS: [f64; 5] = [0.1, 0.25, 0.4, 0.65, 0.8];
const SENSOR: f64 = 0.25;
/// Frequency in Hz and damping ratio of the modes sin(pi x), sin(2 pi x).
pub(super) const MODES: [[f64; 2]; 2] = [[40.0, 0.02], [130.0, 0.01]];

fn mode_shape(mode: usize, x: f64) -> f64 {
    (std::f64::consts::PI * (mode + 1) as f64 * x).sin()
}

/// What a sensor sees of a force of 1000 samples a second at `x`, with noise.
pub(super) fn moved(force: &[f64], x: f64, seed: u32) -> Vec<f64> {
    let mut sum: Vec<f64> = noise(seed).iter().cycle().take(force.len()).map(|e| 1e-3 * e).collect();
    for (mode, [frequency, damping]) in MODES.iter().enumerate() {
        let w = std::f64::consts::TAU * frequency / 1e3;
        let (decay, turn) = ((-damping * w).exp(), w * (1.0 - damping * damping).sqrt());
        let gain = mode_shape(mode, x) * mode_shape(mode, SENSOR);
        let (mut last, mut before, mut force_before) = (0.0, 0.0, 0.0);
        for (sum, force) in sum.iter_mut().zip(force) {
            let next = 2.0 * decay * turn.cos() * last - decay * decay * before + force_before;
            (before, last, force_before) = (last, next, *force);
            *sum += gain * next;
        }
    }
    sum
}

/// Hits of a hammer, three in a record, not at the same times in each.
fn hits(number: u32) -> Vec<f64> {
    let mut force = vec![0.0; 6000];
    for (hit, start) in [200_usize, 2100, 4050].iter().enumerate() {
        let start = start + (number as usize * 37 + hit * 11) % 90;
        for (k, value) in [0.4, 1.0, 0.5].iter().enumerate() {
            force[start + k] = value * (1.0 + 0.2 * hit as f64);
        }
    }
    let added = noise(50 + number);
    force.iter().zip(added.iter().cycle()).map(|(f, e)| f + 1e-4 * e).collect()
}

/// The modes that `show` states, and that they have the shapes of the beam at its points.
fn of_the_beam(here: &Path, config: &str, within: f64) {
    let result = format!("{config}.h5");
    said(here, &["run", config, "-o", &result, "--cache", "cache"]);
    let [shown, _] = said(here, &["show", &result, "modes", "--json"]);
    let shown: Value = serde_json::from_str(&shown).expect("JSON");
    let number = |value: &Value| value.as_f64().unwrap_or_else(|| panic!("{shown}"));
    let modes = shown["modes"].as_array().expect("modes");
    assert_eq!(modes.len(), MODES.len(), "{shown}");
    for (mode, [frequency, _]) in MODES.iter().enumerate() {
        let found = number(&modes[mode]["frequency_hz"]);
        assert!((found / frequency - 1.0).abs() < 0.1 * within, "{found} Hz: {shown}");
        let shape = modes[mode]["shape"].as_array().expect("a shape");
        assert_eq!(shape.len(), POINTS.len(), "{shown}");
        let largest =
            POINTS.iter().map(|x| mode_shape(mode, *x)).fold(0.0, |a: f64, b| if b.abs() > a.abs() { b } else { a });
        for (at, x) in POINTS.iter().enumerate() {
            assert_eq!(shape[at]["channel"], format!("p{}", at + 1), "{shown}");
            let truth = mode_shape(mode, *x) / largest;
            assert!((number(&shape[at]["re"]) - truth).abs() < within, "mode {mode}, point {at}: {truth}, {shown}");
        }
    }
}

#[test]
fn a_structure_that_was_struck_point_by_point_gives_common_modes_and_shapes_over_the_points() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let (mut struck, mut shaken) = (Vec::new(), Vec::new());
    for (number, x) in (1..).zip(POINTS) {
        let force = hits(number);
        struck.push(format!("p{number}.csv"));
        table(
            here,
            &struck[struck.len() - 1],
            1e-3,
            "Time (s),force (N),tip (m/s^2)",
            &[force.clone(), moved(&force, x, number)],
        );
        // driven throughout: 40,000 samples of noise
        let force: Vec<f64> = (0..20).flat_map(|piece| noise(1000 * number + piece)).collect();
        std::fs::create_dir_all(here.join("shaken")).expect("a folder");
        shaken.push(format!("shaken/p{number}.csv"));
        table(
            here,
            &shaken[shaken.len() - 1],
            1e-3,
            "Time (s),force (N),tip (m/s^2)",
            &[force.clone(), moved(&force, x, number)],
        );
    }
    let new = |files: &[String], more: &[&'static str]| -> Vec<String> {
        let words = ["new", "pipeline"].into_iter().chain(more.iter().copied()).map(str::to_owned);
        words.chain(files.iter().cloned()).collect()
    };
    let words = |all: &[String]| -> Vec<String> { all.to_vec() };
    let run = |all: Vec<String>| {
        common::command(here, &words(&all).iter().map(String::as_str).collect::<Vec<&str>>())
            .output()
            .expect("afmid starts")
    };
    let output = run(new(&struck, &["-o", "none.toml"]));
    let refused = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.code() == Some(2) && refused.contains("--as points if each is of another point"),
        "{refused}"
    );
    assert!(run(new(&struck, &["--as", "points", "-o", "struck.toml"])).status.success());
    let config = std::fs::read_to_string(here.join("struck.toml")).expect("a config");
    assert!(config.contains("blocks = \"hits\"") && config.contains("quantity = \"accelerance\""), "{config}");
    assert!(config.contains("before = \"frf_4.frf\""), "{config}");
    // noise of a thousandth in blocks that the slow mode has not quite left
    of_the_beam(here, "struck.toml", 0.02);
    let page = common::measured_page(here, "struck.toml.h5");
    assert_eq!(page.matches(">Phase (°)<").count(), POINTS.len(), "each response once");
    assert!(page.contains("<h1>frf: p1.csv, p2.csv and 3 more</h1>"));
    assert!(run(new(&["shaken".to_owned()], &["--as", "points", "-o", "shaken.toml"])).status.success());
    // the same seen through Hann windows of 5000 samples, a fifth of whose bins is the width of the slow mode
    of_the_beam(here, "shaken.toml", 0.05);
}

#[test]
fn a_force_is_the_input_by_its_name_or_unit_and_one_set_of_like_sensors_the_outputs() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let force = hits(1);
    let [near, far] = [(0.4, 3), (0.8, 4)].map(|(x, seed)| moved(&force, x, seed));
    let room: Vec<f64> = noise(9).into_iter().cycle().take(force.len()).collect();
    let columns = [room.clone(), force.clone(), near.clone(), far.clone(), room];
    let header = "Time (s),Drive (V),F (N),acc 1 (g),acc 2 (g),room (K)";
    table(here, "units.csv", 1e-3, header, &columns);
    let [stdout, stderr] = said(here, &["new", "pipeline", "units.csv", "-o", "u.toml"]);
    assert!(stdout.contains("measured input F, which is short as a hammer's, and output acc 1, acc 2"), "{stdout}");
    assert!(stderr.contains("Drive (an excitation by its name or unit: --input Drive); room (in K)"), "{stderr}");
    let found = frequencies(here, "u.toml");
    assert!(found.len() == 2 && (found[0] / MODES[0][0] - 1.0).abs() < 2e-3, "{found:?}");
    // a binary sequence drives; one output gives a transfer function
    let binary: Vec<f64> = noise(4).iter().cycle().take(6000).map(|e| if *e > 0.0 { 1.0 } else { -1.0 }).collect();
    table(here, "binary.csv", 1e-3, "Time (s),u,y", &[binary.clone(), moved(&binary, 0.4, 5)]);
    let [stdout, _] = said(here, &["new", "pipeline", "binary.csv", "-o", "b.toml"]);
    assert!(stdout.contains("input u, which repeats itself every 2000 samples, and output y"), "{stdout}");
    let text = std::fs::read_to_string(here.join("b.toml")).expect("a config");
    assert!(text.contains("model.pem"), "{text}");
    // a step or two leave what follows to ring freely
    let once = decay(1.0, 8);
    let step: Vec<f64> = (0..2 * once.len()).map(|k| if k < once.len() { 0.0 } else { 1.0 }).collect();
    table(here, "steps.csv", 1e-3, "Time (s),u,y", &[step, [once.clone(), once].concat()]);
    let [stdout, stderr] = said(here, &["new", "pipeline", "steps.csv", "-o", "s.toml"]);
    assert!(stdout.contains("2 free decays") && stderr.contains("u (only 2 different values)"), "{stdout} {stderr}");
    // a load cell alone is the signal
    table(here, "cell.csv", 1e-3, "Time (s),load (N)", &[decay(1.0, 8)]);
    said(here, &["new", "pipeline", "cell.csv", "-o", "l.toml"]);
    assert_eq!(frequencies(here, "l.toml").len(), 1);
}

/// Two sensors after a hit of the hammer at sample `start`; a file of its own.
fn hit_file(here: &Path, name: &str, number: u32, start: usize) {
    let mut force = vec![0.0; 2500 + 100 * number as usize];
    for (k, value) in [0.4, 1.0, 0.5].iter().enumerate() {
        force[start + k] = value * (1.0 + 0.2 * f64::from(number));
    }
    let added = noise(70 + number);
    let force: Vec<f64> = force.iter().zip(added.iter().cycle()).map(|(f, e)| f + 1e-4 * e).collect();
    // each file with an offset of its own
    let offset = |values: Vec<f64>| values.iter().map(|y| y + 0.3 * f64::from(number)).collect();
    let columns = [force.clone(), offset(moved(&force, 0.4, number)), offset(moved(&force, 0.8, 100 + number))];
    table(here, name, 1e-3, "Time (s),Hammer (N),near (m/s^2),far (m/s^2)", &columns);
}

#[test]
fn a_decay_beside_hum_that_is_stronger_gives_its_mode() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    // a mode of 50 Hz beside a line of 31.3 Hz and its third harmonic, of Q = 20 in two seconds and of Q = 100 in four
    let line = |k: usize| {
        let turn = std::f64::consts::TAU * 0.0313 * k as f64;
        2.0 * (turn + 0.7).sin() + 0.3 * (3.0 * turn).sin()
    };
    let ring = |k: usize| {
        let (w, since) = (std::f64::consts::TAU * 0.05, k as f64 - 300.0);
        if since < 0.0 { 0.0 } else { (-w * since / 200.0).exp() * (w * since).sin() }
    };
    let long = noise(3).into_iter().chain(noise(4)).enumerate().map(|(k, e)| ring(k) + 0.01 * e);
    // stated error: 0.2 Hz; the bound is 1e-5 of it
    for (name, values, off) in [("hum", decay(1.0, 3), 0.012), ("long", long.collect(), 1e-4)] {
        let values: Vec<f64> = values.iter().enumerate().map(|(k, y)| y + line(k)).collect();
        table(here, &format!("{name}.csv"), 1e-3, "Time (s),Acc (m/s^2)", &[values]);
        let [stdout, _] = said(here, &["new", "pipeline", &format!("{name}.csv"), "-o", &format!("{name}.toml")]);
        assert!(stdout.contains("free decay") && stdout.contains("beside a line at 31.3"), "{stdout}");
        let found = frequencies(here, &format!("{name}.toml"));
        assert!(found.len() == 1 && (found[0] / 50.0 - 1.0).abs() < off, "{name}: {found:?}");
    }
}

#[test]
fn hits_with_a_file_each_are_averaged_to_one_response_of_each_sensor() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    std::fs::create_dir_all(here.join("by name")).expect("a folder");
    for number in 1..=5 {
        hit_file(here, &format!("by name/hit_{number}.csv"), number, 20 + 60 * number as usize);
        hit_file(here, &format!("a{number}.csv"), number, 20 + 60 * number as usize);
    }
    let files: Vec<String> = (1..=5).map(|number| format!("a{number}.csv")).collect();
    let mut words = vec!["new", "pipeline", "-o", "none.toml"];
    words.extend(files.iter().map(String::as_str));
    let output = common::command(here, &words).output().expect("afmid starts");
    let refused = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(
        output.status.code() == Some(2) && refused.contains("--as hits if all are of the same points"),
        "{refused}"
    );
    words[3] = "said.toml";
    words.extend(["--as", "hits"]);
    said(here, &words);
    let [stdout, _] = said(here, &["new", "pipeline", "by name", "-o", "named.toml"]);
    assert!(stdout.contains("hits by the names of the 5 files"), "{stdout}");
    for config in ["said.toml", "named.toml"] {
        let found = frequencies(here, config);
        assert_eq!(found.len(), MODES.len(), "{config}: {found:?}");
        for (found, [frequency, _]) in found.iter().zip(MODES) {
            // noise of a thousandth
            assert!((found / frequency - 1.0).abs() < 2e-3, "{config}: {found}");
        }
        let [shown, _] = said(here, &["show", &format!("{config}.h5"), "frf", "--json"]);
        let shown: Value = serde_json::from_str(&shown).expect("JSON");
        assert_eq!(shown["blocks"], 5, "{shown}");
        assert!(shown["median_coherence"].as_f64().is_some_and(|coherence| coherence > 0.99), "{shown}");
    }
    let named = std::fs::read_to_string(here.join("named.toml")).expect("a config");
    assert!(
        named.contains("files = [\"by name/*.csv\"]") && named.contains("# chosen: measured input Hammer"),
        "{named}"
    );
}
