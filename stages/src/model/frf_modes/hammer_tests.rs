//! A hammer and several sensors in one file: columns, measured responses, modes with shapes over the sensors.

use std::f64::consts::{PI, TAU};
use std::fmt::Write;
use std::path::Path;

use afmid_pipeline::stage::NoProgress;
use afmid_pipeline::{Context, Document, Ports, Stage};
use num_complex::Complex64;

use super::{FrfModeFit, SUMMARY};
use crate::artifacts::Quantity;
use crate::fixture::white_noise;
use crate::io::columns::{Column, Columns};
use crate::spectrum::{BlocksAre, MeasuredFrf};

const RATE: f64 = 1000.0;
const HITS: usize = 4;
const BLOCK: usize = 2000;
/// Frequency, damping ratio, shape at unit modal mass over three sensors; the hammer strikes at the second.
const MODES: [(f64, f64, [f64; 3]); 2] = [(60.0, 0.01, [0.4, 0.8, 1.0]), (140.0, 0.008, [0.9, -0.6, 0.5])];
const STRUCK: usize = 1;
/// Steps of the simulation in a sample: the force is constant within one.
const FINE: usize = 16;

/// Force and displacements as a table.
fn hammer(file: &Path, seed: u64) {
    let samples = HITS * BLOCK;
    let noise = [0, 1, 2].map(|sensor| white_noise(samples, 1e-8, 10 * seed + sensor));
    let noise = noise[0].iter().zip(&noise[1]).zip(&noise[2]).map(|((left, middle), right)| [*left, *middle, *right]);
    // a pulse of 8 ms, 0.1 s after each block's begin
    let force = |t: f64| {
        let since = t % (BLOCK as f64 / RATE) - 0.1;
        if (0.0..8e-3).contains(&since) { (PI * since / 8e-3).sin().powi(2) } else { 0.0 }
    };
    let step = 1.0 / (RATE * FINE as f64);
    let mut states = MODES.map(|_| Complex64::ZERO);
    let mut text = "force [N],left [m],middle [m],right [m]\n".to_owned();
    for (k, noise) in noise.enumerate() {
        let moved = |sensor: usize| {
            let mode = |((f, damping, shape), state): (&(f64, f64, [f64; 3]), &Complex64)| {
                shape[sensor] * state.im / (TAU * f * (1.0 - damping * damping).sqrt())
            };
            MODES.iter().zip(&states).map(mode).sum::<f64>() + noise[sensor]
        };
        let [left, middle, right] = [0, 1, 2].map(moved);
        writeln!(text, "{:e},{left:e},{middle:e},{right:e}", force(k as f64 / RATE)).unwrap();
        for fine in 0..FINE {
            let middle_of_step = (k as f64 + (fine as f64 + 0.5) / FINE as f64) / RATE;
            for ((f, damping, shape), state) in MODES.iter().zip(&mut states) {
                let pole = TAU * f * Complex64::new(-damping, (1.0 - damping * damping).sqrt());
                let turned = (pole * step).exp();
                *state = turned * *state + (turned - 1.0) / pole * shape[STRUCK] * force(middle_of_step);
            }
        }
    }
    std::fs::write(file, text).unwrap();
}

fn run<S: Stage>(stage: &S, inputs: &Ports, folder: &Path) -> Ports {
    afmid_pipeline::stage::check(stage).unwrap();
    stage.run(inputs, &Context::new(folder, 1, &NoProgress)).unwrap()
}

fn modes_of(folder: &Path) -> Document {
    let name = |name: &str| Column::Name(name.to_owned());
    let columns = Columns {
        file: "hammer.csv".to_owned(),
        inputs: vec![name("force")],
        outputs: ["left", "middle", "right"].map(name).to_vec(),
        sample_rate_hz: Some(RATE),
        ..Columns::default()
    };
    let measured = MeasuredFrf {
        blocks: BlocksAre::Hits,
        block_samples: Some(BLOCK - 200),
        added_decay_per_s: 2.0,
        quantity: Some(Quantity::Receptance),
        driving_point: Some(STRUCK + 1),
        ..MeasuredFrf::default()
    };
    // each stage's outputs have the names of the next one's inputs
    let pair = run(&columns, &Ports::new(), folder);
    let found = run(&FrfModeFit::default(), &run(&measured, &pair, folder), folder);
    found.get(&SUMMARY).unwrap().clone()
}

#[test]
fn one_hammer_and_three_sensors_give_shapes_over_the_sensors() {
    let folder = tempfile::tempdir().unwrap();
    let (mut squares, mut count) = (0.0, 0);
    for seed in 1..=5 {
        hammer(&folder.path().join("hammer.csv"), seed);
        let found = modes_of(folder.path()).0;
        let number = |pointer: String| found.pointer(&pointer).and_then(|v| v.as_f64()).unwrap_or(f64::NAN);
        assert_eq!((found["modes"].as_array().map(Vec::len), &found["driving_point"]), (Some(2), &2.into()), "{found}");
        for (m, (f, damping, shape)) in MODES.iter().enumerate() {
            let mut add = |value: &str, std: &str, truth: f64| {
                let of = |name: &str| number(format!("/modes/{m}/{name}"));
                squares += ((of(value) - truth) / of(std)).powi(2);
                count += 1;
            };
            add("frequency_hz", "frequency_std_hz", *f);
            add("damping_ratio", "damping_ratio_std", *damping);
            let largest = shape.iter().copied().max_by(|a, b| a.abs().total_cmp(&b.abs())).unwrap();
            for (point, phi) in shape.iter().enumerate().filter(|(_, phi)| **phi != largest) {
                let of = |name: &str| format!("shape/{point}/{name}");
                add(&of("re"), &of("re_std"), phi / largest);
                add(&of("im"), &of("im_std"), 0.0);
            }
            for (point, (phi, name)) in shape.iter().zip(["left", "middle", "right"]).enumerate() {
                // the driving point's sign is positive; the pulse's own sampling is 0.2 % there
                let truth = phi * shape[STRUCK].signum();
                let value = number(format!("/modes/{m}/mass_normalised/{point}/value"));
                assert!((value / truth - 1.0).abs() < 0.01, "mode {m}, {name}: {value}, {truth}");
                assert_eq!(found["points"][point]["channel"], name);
            }
        }
    }
    let rms = (squares / f64::from(count)).sqrt();
    println!("{count} numbers: rms z {rms:.2}");
    // 60 unit normal numbers: 9 %; four of these
    assert!((0.6..1.4).contains(&rms), "{rms}");
}
