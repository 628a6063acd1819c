//! Recordings that look like something else: thermal noise like decays, an input of one sine like any system, hits into the
//! ringing of the one before like blocks.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::path::Path;

use super::begin::white;
use crate::common::{command, said, shown};

fn table(here: &Path, titles: &str, rate_hz: f64, columns: &[Vec<f64>]) {
    let mut text = format!("Time (s),{titles}\n");
    for k in 0..columns[0].len() {
        let _ = write!(text, "{:.9}", k as f64 / rate_hz);
        columns.iter().for_each(|column| {
            let _ = write!(text, ",{:.7}", column[k]);
        });
        text.push('\n');
    }
    std::fs::write(here.join("data.csv"), text).expect("a table");
}

/// Thermal motion of unit variance: exact steps of the Langevin equation of an oscillator.
fn thermal(frequency_hz: f64, quality: f64, rate_hz: f64, samples: usize, seed: u64) -> Vec<f64> {
    let (w, step_s) = (TAU * frequency_hz, 1.0 / rate_hz);
    let rate = 0.5 * w / quality;
    let turn = (w * w - rate * rate).sqrt();
    let (decay, sin, cos) = ((-rate * step_s).exp(), (turn * step_s).sin(), (turn * step_s).cos());
    // of deflection and of speed over w
    let a = [
        [decay * (cos + rate / turn * sin), decay * w / turn * sin],
        [-decay * w / turn * sin, decay * (cos - rate / turn * sin)],
    ];
    let rest = |i: usize, j: usize| f64::from(i == j) - a[i][0] * a[j][0] - a[i][1] * a[j][1];
    let l00 = rest(0, 0).sqrt();
    let l10 = rest(1, 0) / l00;
    let l11 = (rest(1, 1) - l10 * l10).sqrt();
    let draws = white(seed, 2 * samples);
    let mut state = [1.0, 0.0];
    draws
        .chunks_exact(2)
        .map(|draw| {
            let now = state[0];
            state = [
                a[0][0] * state[0] + a[0][1] * state[1] + l00 * draw[0],
                a[1][0] * state[0] + a[1][1] * state[1] + l10 * draw[0] + l11 * draw[1],
            ];
            now
        })
        .collect()
}

#[test]
fn thermal_motion_is_no_decay() {
    for (seed, frequency_hz, quality, rate_hz) in
        [(1, 12e3, 100.0, 100e3), (2, 3.1e3, 30.0, 20e3), (3, 65e3, 500.0, 400e3)]
    {
        let scratch = tempfile::tempdir().expect("a folder");
        let here = scratch.path();
        let samples = 1 << 16;
        let motion = thermal(frequency_hz, quality, rate_hz, samples, seed);
        let record = motion.iter().zip(white(seed + 100, samples)).map(|(x, e)| x + 0.05 * e).collect();
        table(here, "deflection (V)", rate_hz, &[record]);
        said(here, &["new", "pipeline", "data.csv", "-o", "c.toml"]);
        said(here, &["run", "c.toml", "-o", "c.h5"]);
        let found = shown(here, "c.h5", "thermal");
        for (name, truth) in [("frequency", frequency_hz), ("quality_factor", quality)] {
            let of = |key: &str| found[name][key].as_f64().expect("a number");
            // five standard errors: one number in two millions beyond
            assert!((of("value") - truth).abs() < 5.0 * of("std"), "{name}: {found}");
        }
    }
}

#[test]
fn an_input_that_does_nothing_is_named() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    table(here, "force (N),acc (m/s^2)", 1e3, &[vec![0.0; 4096], white(3, 4096)]);
    let output = command(here, &["new", "pipeline", "data.csv", "-o", "c.toml"]).output().expect("afmid starts");
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(!output.status.success() && said.contains("force is the same number throughout"), "{said}");
}

#[test]
fn an_input_of_one_sine_claims_nothing_elsewhere() {
    // two real poles; an oscillation; an oscillation and a real pole: y(k) = a y(k-1) + b y(k-2) + c y(k-3) + u(k-1)
    for (seed, turn, of) in [(1, 0.1, [1.2, -0.35, 0.0]), (2, 0.8, [0.5, -0.9, 0.0]), (3, 1.2, [2.4, -2.05, 0.63])] {
        let scratch = tempfile::tempdir().expect("a folder");
        let here = scratch.path();
        let u: Vec<f64> = (0..4000).map(|k| 5.0 * (turn * f64::from(k)).sin()).collect();
        let mut y = vec![0.0; u.len()];
        for k in 3..u.len() {
            y[k] = of[0] * y[k - 1] + of[1] * y[k - 2] + of[2] * y[k - 3] + u[k - 1];
        }
        // after the transient
        let shows = y.iter().zip(white(seed, y.len())).map(|(y, e)| y + 0.01 * e).skip(1500).collect();
        table(here, "u (V),y (V)", 100.0, &[u[1500..].to_vec(), shows]);
        said(here, &["new", "pipeline", "data.csv", "-o", "c.toml"]);
        let run = command(here, &["run", "c.toml", "-o", "c.h5"]).output().expect("afmid runs");
        let errors = String::from_utf8_lossy(&run.stderr);
        assert!(!run.status.success() && errors.contains("the input is a sine of"), "{errors}");
    }
}

/// A mode: frequency, damping ratio, share of the force, what each sensor sees.
type Mode = (f64, f64, f64, [f64; 2]);

/// When a hammer hits, for how long.
struct Blows {
    rate_hz: f64,
    duration_s: f64,
    hits_s: &'static [f64],
    width_s: f64,
}

/// A hammer's force and the accelerations of two sensors, sixteen steps of Runge and Kutta a sample.
fn hammered(blows: &Blows, modes: &[Mode]) -> [Vec<f64>; 3] {
    const STEPS: usize = 16;
    let Blows { rate_hz, duration_s, hits_s, width_s } = *blows;
    let samples = (duration_s * rate_hz) as usize;
    let h = 1.0 / rate_hz / STEPS as f64;
    let force = |t: f64| -> f64 {
        let of = |hit: &f64| if (0.0..width_s).contains(&(t - hit)) { (PI * (t - hit) / width_s).sin() } else { 0.0 };
        100.0 * hits_s.iter().map(of).sum::<f64>()
    };
    let hammer: Vec<f64> = (0..samples).map(|k| force(k as f64 / rate_hz)).collect();
    let (mut one, mut two) = (vec![0.0; samples], vec![0.0; samples]);
    for (frequency_hz, damping, share, shape) in modes {
        let w = TAU * frequency_hz;
        let a = |x: f64, v: f64, t: f64| share * force(t) - 2.0 * damping * w * v - w * w * x;
        let (mut x, mut v) = (0.0, 0.0);
        for (k, (one, two)) in one.iter_mut().zip(&mut two).enumerate() {
            let t = k as f64 / rate_hz;
            let now = a(x, v, t);
            *one += shape[0] * now;
            *two += shape[1] * now;
            for step in 0..STEPS {
                let t = t + step as f64 * h;
                let (k1, l1) = (v, a(x, v, t));
                let (k2, l2) = (v + 0.5 * h * l1, a(x + 0.5 * h * k1, v + 0.5 * h * l1, t + 0.5 * h));
                let (k3, l3) = (v + 0.5 * h * l2, a(x + 0.5 * h * k2, v + 0.5 * h * l2, t + 0.5 * h));
                let (k4, l4) = (v + h * l3, a(x + h * k3, v + h * l3, t + h));
                x += h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4);
                v += h / 6.0 * (l1 + 2.0 * l2 + 2.0 * l3 + l4);
            }
        }
    }
    [hammer, one, two]
}

#[test]
fn hits_into_the_ringing_of_the_one_before_show_every_mode() {
    let quick = Blows { rate_hz: 1024.0, duration_s: 8.0, hits_s: &[0.3, 1.7, 3.1, 4.4, 6.0], width_s: 4e-3 };
    let one = Blows { rate_hz: 2048.0, duration_s: 3.0, hits_s: &[0.25], width_s: 2.5e-3 };
    let close = Blows { rate_hz: 1024.0, duration_s: 6.0, hits_s: &[0.2, 1.0, 1.9, 2.7, 3.8, 4.9], width_s: 4e-3 };
    let cases = [
        (quick, [(61.7, 6e-4, 1.0, [1.0, -0.5]), (148.3, 1e-3, 0.7, [0.4, 1.0])]),
        (one, [(88.0, 7e-4, 1.0, [1.0, 0.7]), (203.5, 6e-4, 0.6, [-0.6, 1.0])]),
        (close, [(74.2, 9e-4, 1.0, [0.8, -0.6]), (121.9, 1.2e-3, 0.8, [0.5, 1.0])]),
    ];
    for (seed, (blows, modes)) in (1..).zip(cases) {
        let scratch = tempfile::tempdir().expect("a folder");
        let here = scratch.path();
        let mut columns = hammered(&blows, &modes);
        for (channel, column) in (0..).zip(&mut columns) {
            let largest = column.iter().fold(0.0, |most: f64, y| most.max(y.abs()));
            let noise = white(10 * seed + channel, column.len());
            column.iter_mut().zip(noise).for_each(|(y, e)| *y += 1e-3 * largest * e);
        }
        table(here, "Force (N),Acc1 (m/s^2),Acc2 (m/s^2)", blows.rate_hz, &columns);
        said(here, &["new", "pipeline", "data.csv", "-o", "c.toml"]);
        said(here, &["run", "c.toml", "-o", "c.h5"]);
        let shown = shown(here, "c.h5", "modes");
        let found = shown["modes"].as_array().expect("modes");
        assert_eq!(found.len(), 2, "{seed}: {shown}");
        for (found, (frequency_hz, damping, ..)) in found.iter().zip(&modes) {
            let of = |key: &str| found[key].as_f64().expect("a number");
            // five standard errors: one number in two millions beyond; the steps shift a period by 1e-8
            let near =
                |name: &str, truth: f64| (of(name) - truth).abs() < 5.0 * of(&format!("{name}_std")) + 1e-7 * truth;
            let frequency =
                (of("frequency_hz") - frequency_hz).abs() < 5.0 * of("frequency_std_hz") + 1e-7 * frequency_hz;
            assert!(frequency && near("damping_ratio", *damping), "{seed}: {found}");
        }
    }
}
