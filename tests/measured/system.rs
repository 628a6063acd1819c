//! Measured data, diagnosed by the configs that ship: an oscillator, a decay, an axis, an oscillation, a circuit.

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::common::{self, afmid, config, number, shown};
use serde_json::Value;

/// The root of the measured data, or a stand-in below `scratch` that `write` makes, counted in the output.
fn data(scratch: &Path, name: &str, write: fn(&Path)) -> (PathBuf, bool) {
    let root =
        std::env::var_os("AFMID_DATA").map_or_else(|| Path::new(common::ROOT).join("../shared/data"), PathBuf::from);
    if root.join(name).is_file() {
        return (root.join(name), false);
    }
    println!("stand-in: {name} simulated");
    let path = scratch.join("stand-in.csv");
    write(&path);
    (path, true)
}

/// Samples of `q'' + 0.1 w q' + w^2 (q + k3 q^3) + w c q^2 q' = w^2 u(t)` by 40 semi-implicit Euler steps each, u
/// continuous.
fn oscillator(path: &Path, samples: usize, interval_s: f64, start: f64, k3: f64, c: f64, input: impl Fn(f64) -> f64) {
    let omega = TAU * 0.1 / interval_s;
    let (mut q, mut v, mut text) = (start, 0.0, "V1,V2\n".to_owned());
    let step = interval_s / 40.0;
    for k in 0..samples {
        let t = k as f64 * interval_s;
        // a pattern of a tenth of a per cent stands for noise
        let noise = 1e-3 * ((k * k * 7919 % 10_007) as f64 / 10_007.0 - 0.5);
        writeln!(text, "{},{}", input(t), q + noise).expect("text");
        for i in 0..40 {
            let u = input(t + f64::from(i) * step);
            v += step * (omega * omega * (u - q - k3 * q.powi(3)) - omega * (0.03 + c * q * q) * v);
            q += step * v;
        }
    }
    std::fs::write(path, text).expect("a table");
}

fn ids(found: &Value) -> Vec<&str> {
    found["causes"].as_array().into_iter().flatten().filter_map(|cause| cause["id"].as_str()).collect()
}

#[test]
fn silverbox_names_the_cubic_spring_and_the_band_limited_input() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let (file, stand_in) = data(here, "silverbox/SNLS80mV.mat", |path| {
        let lines =
            |t: f64| (1..=30).map(|i| (TAU * 6.1 * f64::from(i) * t + f64::from(i * i)).sin()).sum::<f64>() * 0.1;
        oscillator(path, 8192, 1.0 / 610.351_562_5, 0.0, 0.3, 0.0, lines);
    });
    let path = format!("data.file='{}'", file.display());
    let mut args = vec!["run".to_owned(), config("silverbox.toml"), "--set".to_owned(), path];
    if stand_in {
        for set in ["data.identification=[0,6000]", "data.verification=[6000,8192]"] {
            args.extend(["--set".to_owned(), set.to_owned()]);
        }
        let part = "diagnosis.parts=[{name='multisine',first=6000,end=8192,state_samples=50}]";
        args.extend(["--set".to_owned(), part.to_owned()]);
    }
    args.extend(["-o", "s.h5", "--cache", "cache"].map(str::to_owned));
    afmid(here, &args.iter().map(String::as_str).collect::<Vec<&str>>());
    let found = shown(here, "s.h5", "diagnosis");
    println!("silverbox: {:?} {}", ids(&found), found["validation"]);
    assert_eq!(found["verdict"], "named");
    assert!(ids(&found).contains(&"duffing") && ids(&found).contains(&"intersample"), "{:?}", ids(&found));
    if !stand_in {
        // what a continuous cubic spring under a band-limited input reaches
        for (i, most) in [0.303e-3, 0.389e-3, 0.315e-3].into_iter().enumerate() {
            let rms = number(&found, &format!("/validation/{i}/rms_after"));
            assert!(rms <= most, "part {i}: {rms} V, wanted {most}");
        }
    }
}

#[test]
fn frid_names_nonlinear_stiffness_and_damping_of_a_decay() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let (file, stand_in) = data(here, "frid/decay_f_42p05_ampl_2p0_0.lvm", |path| {
        oscillator(path, 1800, 1e-3, 1.0, 0.4, 0.03, |_| 0.0);
    });
    let path = format!("data.file='{}'", file.display());
    let mut args = vec!["run".to_owned(), config("frid.toml"), "--set".to_owned(), path];
    if stand_in {
        let part = "diagnosis.parts=[{name='last third',first=1200,end=1800,state_samples=0}]";
        for set in [
            "data.identification=[0,1200]",
            "data.verification=[1200,1800]",
            "data.inputs=[1]",
            "data.output=2",
            "data.sample_rate_hz=1000.0",
            part,
        ] {
            args.extend(["--set".to_owned(), set.to_owned()]);
        }
    }
    args.extend(["-o", "f.h5", "--cache", "cache"].map(str::to_owned));
    afmid(here, &args.iter().map(String::as_str).collect::<Vec<&str>>());
    let found = shown(here, "f.h5", "diagnosis");
    println!("frid: {:?} {}", ids(&found), found["validation"]);
    assert_eq!(found["verdict"], "named");
    let any = |wanted: &[&str]| ids(&found).iter().any(|id| wanted.contains(id));
    assert!(any(&["duffing", "quintic-stiffness", "quadratic-stiffness"]), "{:?}", ids(&found));
    assert!(any(&["nonlinear-damping", "quadratic-damping", "coulomb-friction"]), "{:?}", ids(&found));
    let (before, after) = (number(&found, "/validation/0/rms_before"), number(&found, "/validation/0/rms_after"));
    assert!(after < before, "the last third: {before} to {after}");
}

/// A mass with friction under a controller that asks for a speed: reference, drive and position at 1 kHz.
fn axis(path: &Path) {
    let (mass, viscous, dry, step, inner) = (90.0, 200.0, 20.0, 1e-3, 50);
    let (mut q, mut v, mut last, mut text) = (0.0, 0.0, [0.0; 2], "qg,vir,qm\n".to_owned());
    for k in 0..16_000_u32 {
        let t = f64::from(k) * step;
        let reference = 0.05 * (1.0 - (TAU * 0.25 * t).cos()) * (1.0 + 0.3 * (TAU * 0.11 * t).sin());
        // a pattern of a tenth of a micrometre stands for the encoder's noise
        let measured = q + 1e-7 * (f64::from(k * k % 10_007) / 10_007.0 - 0.5);
        let drive = 243.0 * (160.0 * (reference - measured) - (measured - last[1]) / (2.0 * step)) / 35.0;
        last = [measured, last[0]];
        writeln!(text, "{reference},{drive},{measured}").expect("text");
        for _ in 0..inner {
            let force = 35.0 * drive - 3.0 - viscous * v;
            let moves = v != 0.0 || force.abs() > dry;
            let sign = if v == 0.0 { force.signum() } else { v.signum() };
            let next = if moves { v + step / f64::from(inner) * (force - dry * sign) / mass } else { 0.0 };
            // dry friction stops a motion and does not turn it
            v = if next * v < 0.0 { 0.0 } else { next };
            q += step / f64::from(inner) * v;
        }
    }
    std::fs::write(path, text).expect("a table");
}

#[test]
fn an_axis_under_its_controller_names_friction_and_offset() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let (file, stand_in) = data(here, "emps/DATA_EMPS.mat", axis);
    let path = format!("data.file='{}'", file.display());
    let mut args = vec!["run".to_owned(), config("emps.toml"), "--set".to_owned(), path];
    if stand_in {
        for set in [
            "data.identification=[0,16000]",
            "data.verification=[0,16000]",
            "diagnosis.drive_scale=35.0",
            "diagnosis.parts=[{name='all',first=0,end=16000,state_samples=0}]",
        ] {
            args.extend(["--set".to_owned(), set.to_owned()]);
        }
    }
    args.extend(["-o", "e.h5", "--cache", "cache"].map(str::to_owned));
    afmid(here, &args.iter().map(String::as_str).collect::<Vec<&str>>());
    let found = shown(here, "e.h5", "diagnosis");
    println!("emps: {:?} {}", ids(&found), found["baseline"]["parameters"]);
    assert_eq!(found["verdict"], "named");
    assert_eq!(ids(&found), ["coulomb-friction", "offset"]);
    // what is published, to 3 %; what was simulated
    let wanted = if stand_in { [90.0, 200.0, 20.0] } else { [95.1, 203.5, 20.4] };
    let places = [
        "/baseline/parameters/mass/value",
        "/baseline/parameters/viscous_friction/value",
        "/causes/0/parameters/friction_force/value",
    ];
    for (place, wanted) in places.into_iter().zip(wanted) {
        let value = number(&found, place);
        assert!((value / wanted - 1.0).abs() < 0.03, "{place}: {value}, wanted {wanted}");
    }
    if !stand_in {
        let rms = number(&found, "/validation/0/rms_after");
        assert!(rms < 1e-5, "{rms} m");
    }
}

/// A steady oscillation seen by an interferometer.
fn fringe(path: &Path) {
    let mut text = "s\n".to_owned();
    for k in 0..60_000_u32 {
        let noise = 1e-4 * (f64::from(k * (k % 4001) % 10_007) / 10_007.0 - 0.5);
        let x = 0.6 * (TAU * 0.05273 * f64::from(k)).cos();
        writeln!(text, "{}", 0.4 * (0.64 + x).sin() + noise).expect("text");
    }
    std::fs::write(path, text).expect("a table");
}

#[test]
fn a_steady_oscillation_names_the_interferometer_and_no_line_at_a_harmonic() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let (file, stand_in) = data(here, "skpm/JAM_9p90.h5", fringe);
    let path = format!("records.files=['{}']", file.display());
    let mut args = vec!["run".to_owned(), config("skpm.toml"), "--set".to_owned(), path];
    if stand_in {
        for set in ["records.channel='s'", "diagnosis.parts=[{name='end',first=50000,end=60000,state_samples=0}]"] {
            args.extend(["--set".to_owned(), set.to_owned()]);
        }
    }
    args.extend(["-o", "s.h5", "--cache", "cache"].map(str::to_owned));
    afmid(here, &args.iter().map(String::as_str).collect::<Vec<&str>>());
    let found = shown(here, "s.h5", "diagnosis");
    println!("skpm: {:?}", ids(&found));
    assert_eq!(found["verdict"], "named");
    assert_eq!(ids(&found)[0], "self-fringe");
    let of = |name: &str| number(&found, &format!("/causes/0/parameters/{name}/value"));
    let (predicted, measured) = (of("fourth_harmonic_predicted_v"), of("fourth_harmonic_measured_v"));
    assert!((predicted / measured - 1.0).abs() < 0.2, "{predicted} V for {measured} V");
    let fundamental = number(&found, "/baseline/parameters/frequency_hz/value");
    for (i, id) in ids(&found).into_iter().enumerate().skip(1) {
        assert_eq!(id, "spurious-line");
        let ratio = number(&found, &format!("/causes/{i}/parameters/frequency_hz/value")) / fundamental;
        assert!((ratio - ratio.round()).abs() > 1e-3 || ratio < 0.5, "a line at {ratio} of the fundamental");
    }
}

/// A low pass, a diode, a low pass, under an input without a pattern.
fn circuit(path: &Path) {
    let (mut state, mut a, mut b, mut text) = (1_u32, 0.0, 0.0, "uBenchMark,yBenchMark\n".to_owned());
    for _ in 0..16_000 {
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1_u32 << 23) - 1.0
        };
        let (u, noise) = (3.0 * random(), 1e-4 * random());
        a = 0.8 * a + 0.2 * u;
        let passed: f64 = if a > 0.3 { 0.3 + 0.3 * (a - 0.3) } else { a };
        b = 0.6 * b + 0.4 * passed;
        writeln!(text, "{u},{}", b + noise).expect("text");
    }
    std::fs::write(path, text).expect("a table");
}

#[test]
fn a_circuit_names_the_curve_between_two_linear_parts() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let (file, stand_in) = data(here, "wiener-hammerstein/WienerHammerBenchMark.mat", circuit);
    let path = format!("data.file='{}'", file.display());
    let mut args = vec!["run".to_owned(), config("wiener-hammerstein.toml"), "--set".to_owned(), path];
    if stand_in {
        for set in [
            "data.identification=[500,12000]",
            "data.verification=[12000,16000]",
            "diagnosis.parts=[{name='test',first=12000,end=16000,state_samples=0}]",
        ] {
            args.extend(["--set".to_owned(), set.to_owned()]);
        }
    }
    args.extend(["-o", "w.h5", "--cache", "cache"].map(str::to_owned));
    afmid(here, &args.iter().map(String::as_str).collect::<Vec<&str>>());
    let found = shown(here, "w.h5", "diagnosis");
    println!("wiener-hammerstein: {:?} {}", ids(&found), found["validation"]);
    assert_eq!(found["verdict"], "named");
    assert_eq!(ids(&found), ["wiener-hammerstein-curve"]);
    if !stand_in {
        let rms = number(&found, "/validation/0/rms_after");
        assert!(rms < 1e-3, "{rms} V");
    }
}

/// Twelve hits of two modes at a ratio of 2, whose stiffness falls and whose damping rises with their amplitudes; by 16
/// semi-implicit Euler steps a sample.
fn joint(path: &Path) {
    let (rate, hits) = (2000.0, 12_u32);
    let omega = [TAU * 122.4, TAU * 243.5];
    let mut rows = vec![String::new(); 2000];
    for hit in 0..hits {
        let level = 0.4 + 0.05 * f64::from(hit);
        let (mut q, mut v) = ([level, 0.5 * level], [0.0_f64; 2]);
        for (k, row) in rows.iter_mut().enumerate() {
            let noise = 1e-3 * ((((k * k + 31 * k * hit as usize) * 7919) % 10_007) as f64 / 10_007.0 - 0.5);
            write!(row, ",{}", q[0] + q[1] + noise).expect("text");
            for _ in 0..16 {
                for m in 0..2 {
                    let w = omega[m];
                    let force = w * w * (q[m] - 0.02 * q[m].abs() * q[m]) + v[m] * (0.003 * w + 0.002 * v[m].abs());
                    v[m] -= force / (16.0 * rate);
                    q[m] += v[m] / (16.0 * rate);
                }
            }
        }
    }
    let names: Vec<String> = (1..=hits).map(|hit| format!("hit {hit}")).collect();
    let mut text = format!("Time (s),{}\n", names.join(","));
    for (k, row) in rows.iter().enumerate() {
        writeln!(text, "{}{row}", k as f64 / rate).expect("text");
    }
    std::fs::write(path, text).expect("a table");
}

#[test]
fn a_beam_of_two_modes_names_what_moves_with_the_amplitude() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let (file, stand_in) = data(here, "beam/data.mat", joint);
    let path = format!("records.files=['{}']", file.display());
    let mut args = vec!["run".to_owned(), config("beam.toml"), "--set".to_owned(), path];
    if stand_in {
        let names: Vec<String> = (1..=12).map(|hit| format!("'hit {hit}'")).collect();
        for set in ["records.channel='hit 1'".to_owned(), format!("records.channels=[{}]", names.join(","))] {
            args.extend(["--set".to_owned(), set]);
        }
    }
    args.extend(["-o", "b.h5", "--cache", "cache"].map(str::to_owned));
    afmid(here, &args.iter().map(String::as_str).collect::<Vec<&str>>());
    let found = shown(here, "b.h5", "diagnosis");
    println!("beam: {:?} {}", ids(&found), found["validation"]);
    assert_eq!(found["verdict"], "named");
    let any = |wanted: &[&str]| ids(&found).iter().any(|id| wanted.contains(id));
    assert!(any(&["absolute-stiffness", "duffing"]), "{:?}", ids(&found));
    assert!(any(&["quadratic-damping", "nonlinear-damping"]), "{:?}", ids(&found));
    for (i, hit) in [2, 6, 10].into_iter().enumerate() {
        let of = |name: &str| number(&found, &format!("/validation/{i}/{name}"));
        let (before, after) = (of("rms_before"), of("rms_after"));
        assert!(after < before, "hit {hit}: {before} to {after}");
        if !stand_in {
            // rms over the signal's from 5.3 ms on, as the source's own nonlinear model reaches it
            let most = [0.056 * 0.2989, 0.105 * 0.3534, 0.086 * 0.3306][i];
            assert!(after <= most, "hit {hit}: {after} m/s, wanted {most}");
        }
    }
}

#[test]
fn a_bolted_beam_names_its_softening_and_its_damping() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let (file, stand_in) = data(here, "decays/brake-reuss/HammerImpact.mat", joint);
    let path = format!("records.files=['{}']", file.display());
    let mut args = vec!["run".to_owned(), config("brake-reuss.toml"), "--set".to_owned(), path];
    if stand_in {
        args.extend(["--set".to_owned(), "records.channel='hit 12'".to_owned()]);
    }
    args.extend(["-o", "b.h5", "--cache", "cache"].map(str::to_owned));
    afmid(here, &args.iter().map(String::as_str).collect::<Vec<&str>>());
    let found = shown(here, "b.h5", "diagnosis");
    println!("brake-reuss: {:?}", ids(&found));
    assert_eq!(found["verdict"], "named");
    let names = ids(&found);
    let stiffness = names.iter().position(|id| *id == "absolute-stiffness").expect("micro-slip");
    assert!(number(&found, &format!("/causes/{stiffness}/parameters/k/value")) < 0.0, "it softens");
    assert!(names.iter().any(|id| ["quadratic-damping", "nonlinear-damping"].contains(id)), "{names:?}");
    // without the joint's law: another of its kind, or none
    let mut args: Vec<&str> = args.iter().map(String::as_str).collect();
    args.truncate(args.len() - 4);
    args.extend(["--set", "diagnosis.without=['absolute-stiffness']", "-o", "w.h5", "--cache", "cache"]);
    afmid(here, &args);
    let found = shown(here, "w.h5", "diagnosis");
    println!("brake-reuss without absolute-stiffness: {} {:?}", found["verdict"], ids(&found));
    let kind = ["duffing", "quintic-stiffness", "quadratic-damping", "nonlinear-damping", "coulomb-friction"];
    assert!(ids(&found).iter().all(|id| kind.contains(id)), "{:?}", ids(&found));
}

#[test]
fn a_series_circuit_is_clean() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let (file, stand_in) = data(here, "decays/rlc-pulse/Pulse_3.8-oscilloscope.csv", |path| {
        oscillator(path, 600, 2e-6, 1.0, 0.0, 0.0, |_| 0.0);
    });
    let path = format!("records.files=['{}']", file.display());
    let mut args = vec!["run".to_owned(), config("rlc-pulse.toml"), "--set".to_owned(), path];
    if stand_in {
        for set in ["records.channel='V2'", "records.sample_rate_hz=5e5"] {
            args.extend(["--set".to_owned(), set.to_owned()]);
        }
    }
    args.extend(["-o", "r.h5", "--cache", "cache"].map(str::to_owned));
    afmid(here, &args.iter().map(String::as_str).collect::<Vec<&str>>());
    let found = shown(here, "r.h5", "diagnosis");
    println!("rlc-pulse: {} {:?}", found["verdict"], ids(&found));
    assert_eq!(found["verdict"], "clean");
    assert_eq!(found["baseline"]["order"], 2);
}
