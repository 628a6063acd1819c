//! Measured input and output, diagnosed: silverbox and frid as shipped.

mod common;

use std::f64::consts::TAU;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use common::{afmid, config, number, shown};
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
