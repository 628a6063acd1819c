//! What `afmid new pipeline` makes of names that mislead, of rates that contradict, and what it advises.

use std::path::Path;

use crate::common::{self, said};

fn refused(here: &Path, arguments: &[&str]) -> String {
    let output = common::command(here, arguments).output().expect("afmid starts");
    assert!(!output.status.success(), "{arguments:?}");
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// Noise of variance 1: sums of twelve uniform numbers.
fn noise(seed: u64, samples: usize) -> Vec<f64> {
    let mut state = seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1;
    let mut uniform = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1_u64 << 53) as f64
    };
    (0..samples).map(|_| (0..12).map(|_| uniform()).sum::<f64>() - 6.0).collect()
}

/// 0.05 cycles a sample, Q = 20, `k` samples after it began.
fn ring(k: usize) -> f64 {
    let w = std::f64::consts::TAU * 0.05;
    (-w * k as f64 / 40.0).exp() * (w * k as f64).cos()
}

/// A table with a column of times.
fn table(here: &Path, name: &str, header: &str, times: impl Fn(usize) -> f64, columns: &[Vec<f64>]) {
    let row = |k: usize| {
        let values: Vec<String> = columns.iter().map(|column| format!("{:.9}", column[k])).collect();
        format!("{:.7},{}\n", times(k), values.join(","))
    };
    let rows: String = (0..columns[0].len()).map(row).collect();
    std::fs::write(here.join(name), format!("{header}\n{rows}")).expect("a table");
}

fn even(k: usize) -> f64 {
    k as f64 * 1e-3
}

#[test]
fn a_deflection_is_a_snap_off_s_only_where_a_contact_ruptures_or_the_distance_is_recorded() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let e = noise(1, 20_000);
    let header = "Time (s),Deflection (V)";
    let decay: Vec<f64> = (0..4000).map(|k| ring(k) + 1e-3 * e[k]).collect();
    table(here, "decay.csv", header, even, &[decay]);
    let (mut one, mut two) = (0.0, 0.0);
    let thermal = |e: &f64| {
        let next = 1.88 * one - 0.98 * two + e;
        (two, one) = (one, next);
        next
    };
    let thermal: Vec<f64> = e.iter().map(thermal).collect();
    table(here, "thermal.csv", header, even, std::slice::from_ref(&thermal));
    // pulled down, then let go
    let load = |k: usize| if k < 6000 { 0.0 } else { -1e-4 * (k - 6000) as f64 };
    let curve = |k: usize| if k < 12_000 { load(k) } else { -0.6 * ring(k - 12_000) };
    let curve: Vec<f64> = (0..20_000).map(|k| curve(k) + 1e-3 * e[k]).collect();
    table(here, "curve.csv", header, even, &[curve]);
    let ramp: Vec<f64> = (0..20_000).map(|k| 1e-3 * (k as f64 - 1e4).abs()).collect();
    table(here, "distance.csv", "Time (s),Deflection (V),Z Piezo (um)", even, &[thermal, ramp]);
    for (name, goal, words) in [
        ("decay", "decay", "free decay"),
        ("thermal", "thermal", "stationary noise"),
        ("curve", "modes", "snap-offs: a rupture at 1"),
        ("distance", "modes", "snap-offs: distance.csv has the distance Z Piezo"),
    ] {
        let file = format!("{name}.csv");
        let [stdout, _] = said(here, &["new", "pipeline", &file, "-o", &format!("{name}.toml"), "--json"]);
        assert!(stdout.contains(&format!("\"goal\": \"{goal}\"")) && stdout.contains(words), "{name}: {stdout}");
    }
    said(here, &["new", "pipeline", "decay.csv", "--goal", "snap-off", "-o", "wrong.toml"]);
    let stderr = refused(here, &["run", "wrong.toml", "-o", "wrong.h5", "--cache", "cache"]);
    assert!(stderr.contains("--goal decay") && stderr.contains("--goal thermal"), "{stderr}");
}

#[test]
fn a_rate_is_not_carried_over_to_files_with_times_and_a_contradiction_is_said() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    std::fs::create_dir(here.join("mixed")).expect("a folder");
    let e = noise(2, 4000);
    let decay: Vec<f64> = (0..4000).map(|k| if k < 500 { 0.0 } else { ring(k - 500) } + 1e-2 * e[k]).collect();
    // a phone's clock: 200 Hz, give or take
    let uneven = |k: usize| 5e-3 * k as f64 + 4e-4 * e[k].tanh();
    table(here, "mixed/phone.csv", "Time (s),acc (m/s^2)", uneven, std::slice::from_ref(&decay));
    let bare: String = decay.iter().map(|value| format!("{value:.6}\n")).collect();
    for number in 1..=2 {
        std::fs::write(here.join(format!("mixed/bare{number}.txt")), &bare).expect("a table");
    }
    let [_, stderr] = said(here, &["new", "pipeline", "mixed", "--rate", "44100", "-o", "mixed.toml"]);
    let line = stderr.lines().find(|line| line.contains("mixed/phone.csv")).expect("a command");
    assert!(line.contains("--rate 199.997") && !line.contains("44100"), "{line}");
    let [_, stderr] = said(here, &["new", "pipeline", "mixed/phone.csv", "--rate", "44100", "-o", "phone.toml"]);
    assert!(stderr.contains("44100 Hz") && stderr.contains("Time have 200 samples a second"), "{stderr}");
    let [_, stderr] = said(here, &["run", "phone.toml", "-o", "phone.h5", "--cache", "cache"]);
    assert!(stderr.contains("44100 Hz") && stderr.contains("Time have 200 samples a second"), "{stderr}");
    let [_, stderr] = said(here, &["new", "pipeline", "mixed/phone.csv", "--rate", "200", "-o", "right.toml"]);
    assert!(!stderr.contains("on average"), "{stderr}");
    let stderr = refused(here, &["new", "pipeline", "mixed/phone.csv"]);
    assert!(stderr.contains("Time have 200") || stderr.contains("Time have 199.9"), "{stderr}");
}

#[test]
fn what_drives_in_steps_is_offered_as_the_input() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let e = noise(3, 8000);
    let level = |k: usize| f64::from(u32::try_from(k / 1000 % 2).expect("0 or 1"));
    let steps: Vec<f64> = (0..8000).map(level).collect();
    // steps of up and down with a ring that dies
    let moved = |k: usize| level(k) - (2.0 * level(k) - 1.0) * ring(k % 1000) * f64::from(u8::from(k >= 1000));
    let moved: Vec<f64> = (0..8000).map(|k| moved(k) + 1e-2 * e[k]).collect();
    table(here, "servo.csv", "Time (s),ref (V),position (mm)", even, &[steps.clone(), moved]);
    let [_, stderr] = said(here, &["new", "pipeline", "servo.csv", "-o", "s.toml"]);
    assert!(stderr.contains("ref has 2 levels") && stderr.contains("new pipeline servo.csv --input ref"), "{stderr}");
    // nothing rings: it follows as a heater does
    let mut y = 0.0;
    let slow = |u: &f64| {
        y += 0.01 * (u - y);
        y
    };
    let slow: Vec<f64> = steps.iter().map(slow).zip(&e).map(|(y, e)| y + 1e-2 * e).collect();
    table(here, "heater.csv", "Time (s),power (W),T (K)", even, &[steps, slow]);
    let output =
        common::command(here, &["new", "pipeline", "heater.csv", "-o", "h.toml"]).output().expect("afmid starts");
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(stderr.contains("--input power"), "{stderr}");
    // what it does not follow is not offered
    let other: Vec<f64> = (0..8000).map(|k| if k < 500 { 0.0 } else { ring(k - 500) } + 1e-2 * e[k]).collect();
    let gate = (0..8000).map(|k| f64::from(u8::from(k % 14 < 7))).collect();
    table(here, "gate.csv", "Time (s),gate (V),acc (g)", even, &[gate, other]);
    let [_, stderr] = said(here, &["new", "pipeline", "gate.csv", "-o", "g.toml"]);
    assert!(!stderr.contains("--input gate"), "{stderr}");
}

#[test]
fn tables_over_frequencies_are_read_for_what_they_are() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let f = |k: usize| 10.0 * (k + 1) as f64;
    // the receptance of a mode at 5 kHz with Q = 50
    let h = |k: usize| {
        let x = f(k) / 5e3;
        let (re, im) = (1.0 - x * x, x / 50.0);
        (1.0 / re.hypot(im), -im.atan2(re).to_degrees())
    };
    let columns = |scale: f64| -> Vec<Vec<f64>> {
        vec![(0..1000).map(|k| scale * h(k).0).collect(), (0..1000).map(|k| h(k).1).collect()]
    };
    table(here, "impedance.csv", "Frequency (Hz),Impedance (Ohm),Phase (deg)", f, &columns(4.0));
    table(here, "admittance.csv", "Frequency(Hz),Y(S),theta-deg", f, &columns(1.0));
    for name in ["impedance", "admittance"] {
        let (file, config, result) = (format!("{name}.csv"), format!("{name}.toml"), format!("{name}.h5"));
        let [stdout, _] = said(here, &["new", "pipeline", &file, "-o", &config]);
        assert!(stdout.contains("frequency responses"), "{stdout}");
        said(here, &["run", &config, "-o", &result, "--cache", "cache"]);
        let [shown, _] = said(here, &["show", &result, "modes", "--json"]);
        let shown: serde_json::Value = serde_json::from_str(&shown).expect("JSON");
        let found = shown["modes"][0]["frequency_hz"].as_f64().expect("a mode");
        assert!((found / 5e3 - 1.0).abs() < 1e-3, "{name}: {shown}");
    }
    // 64 averages
    let scatter: Vec<Vec<f64>> = (0..128).map(|seed| noise(seed, 1000)).collect();
    let mean = |k: usize| scatter.iter().map(|one| one[k] * one[k]).sum::<f64>() / 128.0;
    let density = (0..1000).map(|k| mean(k) * (h(k).0.powi(2) + 0.1)).collect();
    table(here, "psd.csv", "Frequency (Hz),PSD (V^2/Hz)", f, &[density]);
    for (config, goal) in [("psd.toml", &[][..]), ("asked.toml", &["--goal", "thermal"])] {
        said(here, &[&["new", "pipeline", "psd.csv", "-o", config], goal].concat());
        let text = std::fs::read_to_string(here.join(config)).expect("a config");
        assert!(text.contains("io.spectrum") && text.contains("unit = \"V\""), "{text}");
    }
    let [_, stderr] = said(here, &["run", "psd.toml", "-o", "psd.h5", "--cache", "cache"]);
    // 64 within 8 %
    let count = stderr.split("spectra were averaged: ").nth(1).and_then(|rest| rest.split(' ').next());
    let count: f64 = count.and_then(|count| count.parse().ok()).unwrap_or_else(|| panic!("{stderr}"));
    assert!((count / 64.0 - 1.0).abs() < 0.24 && stderr.contains("set `averages`"), "{stderr}");
    let [shown, _] = said(here, &["show", "psd.h5", "thermal", "--json"]);
    let shown: serde_json::Value = serde_json::from_str(&shown).expect("JSON");
    let found = shown["frequency"]["value"].as_f64().expect("a resonance");
    assert!((found / 5e3 - 1.0).abs() < 2e-3, "{shown}");
    // which of both they are, the file does not say: what to say is named with the stage
    table(here, "bare.csv", "Frequency (Hz),a,b", f, &columns(1.0));
    said(here, &["new", "pipeline", "bare.csv", "--goal", "frf", "-o", "bare.toml"]);
    let stderr = refused(here, &["run", "bare.toml", "-o", "bare.h5", "--cache", "cache"]);
    assert!(stderr.contains("--set frf.values=amplitude-degrees"), "{stderr}");
}

#[test]
fn a_run_takes_other_files_and_bare_text_from_where_it_is_called() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let e = noise(7, 20_000);
    let decay = |seed: usize| -> Vec<f64> {
        (0..4000).map(|k| if k < 300 { 0.0 } else { ring(k - 300) } + 1e-3 * e[k + seed]).collect()
    };
    std::fs::create_dir(here.join("configs")).expect("a folder");
    for (name, seed) in [("one.csv", 0), ("two.csv", 5000), ("three.csv", 9000)] {
        table(here, name, "Time (s),a (V)", even, &[decay(seed)]);
    }
    said(here, &["new", "pipeline", "one.csv", "-o", "configs/decay.toml"]);
    let run = ["run", "configs/decay.toml", "two.csv", "three.csv", "--set", "events.as=hits", "-o", "r.h5"];
    said(here, &[&run[..], &["--cache", "cache"]].concat());
    let events = &common::shown(here, "r.h5", "events")["events"];
    assert_eq!(events["found"], 2, "{events}");
    // the result says what it read, so that it can be run again
    let [again, _] = said(here, &["rerun", "r.h5", "--cache", "cache"]);
    assert!(again.contains("identical"), "{again}");
    let bad = refused(here, &["run", "configs/decay.toml", "nowhere.csv", "-o", "n.h5", "--cache", "cache"]);
    assert!(bad.contains("nowhere.csv"), "{bad}");
}

#[test]
fn a_unit_over_that_of_a_force_is_a_frequency_response_s() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let e = noise(8, 2000);
    let hz = |k: usize| k as f64 + 1.0;
    let response = |k: usize| {
        let (w, n) = (hz(k) / 200.0, 1.0 - (hz(k) / 200.0).powi(2));
        let (d, b) = (n * n + (0.05 * w).powi(2), 0.05 * w);
        [n / d + 0.01 * e[2 * k], -b / d + 0.01 * e[2 * k + 1]]
    };
    let rows: String = (0..600)
        .map(|k| {
            let [re, im] = response(k);
            format!("{:e}\t{re:e}\t{im:e}\n", hz(k))
        })
        .collect();
    std::fs::write(here.join("point.txt"), rows).expect("a table");
    let [said, _] = said(here, &["new", "pipeline", "point.txt", "--unit", "m/N", "-o", "point.toml"]);
    assert!(said.contains("frequency responses in point.txt"), "{said}");
    let text = std::fs::read_to_string(here.join("point.toml")).expect("a config");
    assert!(text.contains("io.frf"), "{text}");
    // with a rate they are samples of time
    let timed = ["new", "pipeline", "point.txt", "--unit", "m/N", "--rate", "1", "-o", "t.toml"];
    common::command(here, &timed).output().expect("afmid starts");
    let text = std::fs::read_to_string(here.join("t.toml")).unwrap_or_default();
    assert!(!text.contains("io.frf"), "{text}");
}

/// Motion of an oscillator that white noise drives, of variance 1: `turn` rad a sample.
fn driven_by_noise(turn: f64, quality: f64, force: &[f64]) -> Vec<f64> {
    let fall = (-0.5 * turn / quality).exp();
    let [mut last, mut before] = [0.0; 2];
    let next = |force: &f64| {
        let next = 2.0 * fall * turn.cos() * last - fall * fall * before + force;
        (before, last) = (last, next);
        next
    };
    let moved: Vec<f64> = force.iter().map(next).collect();
    let rms = (moved.iter().map(|y| y * y).sum::<f64>() / moved.len() as f64).sqrt();
    moved.iter().map(|y| y / rms).collect()
}

#[test]
fn what_is_stationary_is_no_decay_and_its_kind_is_said() {
    let scratch = tempfile::tempdir().expect("a folder");
    let samples = 40_000;
    let sum = |parts: [(f64, &[f64]); 3]| -> Vec<f64> {
        (0..samples).map(|k| parts.iter().map(|(weight, part)| weight * part[k]).sum()).collect()
    };
    for (seed, turn, quality) in [(11, 0.88, 60.0), (12, 0.3, 150.0), (13, 1.4, 600.0)] {
        let own = scratch.path().join(format!("seed {seed}"));
        std::fs::create_dir(&own).expect("a folder");
        let here = own.as_path();
        let [force, other, e] = [0, 1, 2].map(|part| noise(100 * seed + part, samples));
        let (one, two) = (driven_by_noise(turn, quality, &force), driven_by_noise(0.55 * turn, 80.0, &other));
        let tone: Vec<f64> = (0..samples).map(|k| (turn * k as f64).sin() + 0.1 * e[k]).collect();
        let mut place = 0.0;
        let walk = |e: &f64| {
            place += e;
            place
        };
        let walk: Vec<f64> = e.iter().map(walk).collect();
        table(here, "thermal.csv", "Time (s),x (V)", even, &[sum([(1.0, &one), (0.0, &two), (0.2, &e)])]);
        table(here, "tone.csv", "Time (s),x (V)", even, &[tone]);
        table(here, "walk.csv", "Time (s),x (V)", even, &[walk]);
        let sensors = [(1.0, 0.5), (0.7, -0.6), (0.3, 0.9)].map(|(a, b)| sum([(a, &one), (b, &two), (0.1, &e)]));
        table(here, "ambient.csv", "Time (s),acc1 (m/s^2),acc2 (m/s^2),acc3 (m/s^2)", even, &sensors);
        for (name, goal) in [("thermal", "thermal"), ("tone", "steady")] {
            let file = format!("{name}.csv");
            let [stdout, _] = said(here, &["new", "pipeline", &file, "-o", &format!("{name}.toml"), "--json"]);
            assert!(stdout.contains(&format!("\"goal\": \"{goal}\"")), "{name}, Q {quality}: {stdout}");
        }
        let stderr = refused(here, &["new", "pipeline", "walk.csv", "-o", "walk.toml"]);
        assert!(stderr.contains("random walk"), "{stderr}");
        let stderr = refused(here, &["new", "pipeline", "ambient.csv", "-o", "ambient.toml"]);
        assert!(stderr.contains("3 sensors of a stationary random vibration"), "Q {quality}: {stderr}");
        // who says decay hears what it is
        said(here, &["new", "pipeline", "thermal.csv", "--goal", "decay", "-o", "decay.toml"]);
        let stderr = refused(here, &["run", "decay.toml", "-o", "decay.h5", "--cache", "cache"]);
        assert!(stderr.contains("no free decay") && stderr.contains("--goal thermal"), "Q {quality}: {stderr}");
    }
}

#[test]
fn what_rings_into_the_next_hit_has_all_its_modes_by_the_default_path() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    // rate, hits, modes with frequency and damping ratio: of the slowest the decay time is longer than hits are apart
    type Case<'a> = (&'a str, f64, &'a [f64], [[f64; 2]; 2]);
    let cases: [Case<'_>; 4] = [
        ("quick", 2000.0, &[0.15, 1.1, 2.3, 3.2], [[96.2, 4e-4], [231.0, 9e-4]]),
        ("slow", 1000.0, &[0.3, 5.1, 9.6], [[40.7, 8e-4], [111.3, 1e-3]]),
        ("one", 4000.0, &[0.1], [[210.0, 5e-4], [644.0, 6e-4]]),
        ("weaker", 1600.0, &[0.2, 1.7, 3.0, 4.4, 5.6], [[61.0, 7e-4], [188.0, 8e-4]]),
    ];
    for (case, (name, rate, hits, modes)) in cases.into_iter().enumerate() {
        let samples = ((hits[hits.len() - 1] + if hits.len() > 1 { 1.4 } else { 1.2 }) * rate) as usize;
        let mut force = noise(600 + case as u64, samples).iter().map(|e| 0.02 * e).collect::<Vec<f64>>();
        let mut sensors =
            [0, 1].map(|c| noise(700 + 10 * case as u64 + c, samples).iter().map(|e| 1e-3 * e).collect::<Vec<f64>>());
        for (number, at) in hits.iter().enumerate() {
            let size = if name == "weaker" { 1.0 - 0.15 * number as f64 } else { 1.0 };
            for (k, f) in [30.0, 90.0, 70.0, 10.0].into_iter().enumerate() {
                let hit = (at * rate) as usize + k;
                force[hit] += size * f;
                let answer = |mode: usize, t: f64| {
                    let ([frequency, damping], tau) = (modes[mode], std::f64::consts::TAU);
                    let turn = tau * frequency * (1.0 - damping * damping).sqrt();
                    0.01 * size * f * (-damping * tau * frequency * t).exp() * (turn * t).sin()
                };
                for (sensor, shape) in sensors.iter_mut().zip([[1.0, 0.5], [-0.6, 0.9]]) {
                    for (since, y) in sensor[hit..].iter_mut().enumerate() {
                        let t = since as f64 / rate;
                        *y += shape[0] * answer(0, t) + shape[1] * answer(1, t);
                    }
                }
            }
        }
        let [one, two] = sensors;
        let time = move |k: usize| k as f64 / rate;
        let file = format!("{name}.csv");
        table(here, &file, "Time (s),Force (N),Acc1 (m/s^2),Acc2 (m/s^2)", time, &[force, one, two]);
        for (ending, goal) in [("", &[][..]), ("-decay", &["--goal", "decay"])] {
            let (config, result) = (format!("{name}{ending}.toml"), format!("{name}{ending}.h5"));
            said(here, &[&["new", "pipeline", &file, "-o", &config], goal].concat());
            let text = std::fs::read_to_string(here.join(&config)).expect("a config");
            assert!(text.contains("model.decay") && text.contains("force_channel = \"Force\""), "{name}: {text}");
            said(here, &["run", &config, "-o", &result, "--cache", "cache"]);
            let events = &common::shown(here, &result, "events")["events"];
            assert_eq!(events["found"], hits.len(), "{name}: {events}");
            let found = common::shown(here, &result, "modes");
            let found = found["modes"].as_array().expect("modes");
            assert_eq!(found.len(), 2, "{name}: {found:?}");
            for (mode, [frequency, damping]) in found.iter().zip(modes) {
                let number = |key: &str| mode[key].as_f64().expect("a number");
                // five standard errors: sixteen numbers, one of them beyond once in a hundred thousand times
                let [df, dz] = [number("frequency_hz") - frequency, number("damping_ratio") - damping];
                assert!(df.abs() < 5.0 * number("frequency_std_hz"), "{name}: {mode}, wanted {frequency}");
                assert!(dz.abs() < 5.0 * number("damping_ratio_std"), "{name}: {mode}, wanted {damping}");
            }
        }
    }
}
