//! The reconstructed force against the simulator's own.

use super::*;
use crate::model::pem::{Experiment, Identified, PemOptions, identify};
use crate::simulate::{Afm, Archive, ArchiveLayout, Scatter, Target};

const SAMPLES: usize = 8192;
const T0: usize = 1500;

/// Event windows, each with the true force (in volts, mean over each sample's interval), from a simulated archive.
struct World {
    windows: Vec<Vec<f64>>,
    forces: Vec<Vec<f64>>,
}

fn world(seed: u64, records: usize) -> World {
    let afm = Afm { ramp_hz: 30.0, samples: 200_000, ..Afm::default() };
    let microscope = afm.microscope();
    let layout = ArchiveLayout {
        records,
        samples: afm.samples,
        margin_samples: 10_000,
        target: Target { snap_ins: None, snap_offs: Some(records) },
        phases: None,
        scatter: Scatter { surface_m: afm.surface_m, surface_std_m: afm.surface_std_m },
        seed,
    };
    let archive = Archive::plan(&microscope, &layout).unwrap();
    let volts_per_newton = afm.sensitivity_v_per_m / afm.stiffness_n_per_m;
    let mut world = World { windows: Vec::new(), forces: Vec::new() };
    for number in 0..records {
        let record = archive.simulate(&microscope, number);
        for event in record.events.iter().filter(|e| e.counted && e.event.force_n < 0.0) {
            let snap_off = matches!(event.event.kind, crate::simulate::EventKind::SnapOff);
            let first = event.sample.floor() as usize + 1 - T0;
            if !snap_off || first + SAMPLES + 1 > record.deflection.len() {
                continue;
            }
            world.windows.push((0..SAMPLES).map(|k| f64::from(record.deflection[first + k]) * afm.lsb_v).collect());
            let f = |k: usize| volts_per_newton * record.force_n[first + k];
            let held = |k: usize| {
                // the interval that holds the rupture: the force's share of it
                if k + 1 == T0 { f(k) * event.sample.fract() } else { 0.5 * (f(k) + f(k + 1)) }
            };
            world.forces.push((0..SAMPLES).map(held).collect());
        }
    }
    world
}

/// The model as `model.pem` finds it from the mean: force from the lines before and after.
fn model(world: &World) -> Identified {
    let n = world.windows.len() as f64;
    let mean: Vec<f64> = (0..SAMPLES).map(|k| world.windows.iter().map(|w| w[k]).sum::<f64>() / n).collect();
    let before = fit_line(&mean, 0, T0 - 50, Weighting::Uniform, true);
    let after = fit_line(&mean, T0 + 50, SAMPLES, Weighting::Hann, false);
    let output: Vec<f64> = mean.iter().enumerate().map(|(k, y)| y - after.at(k as f64)).collect();
    let input: Vec<f64> =
        (0..SAMPLES).map(|k| if k < T0 { before.at(k as f64) - after.at(k as f64) } else { 0.0 }).collect();
    let options = PemOptions { order: 11, ..PemOptions::default() };
    identify(&[Experiment { input: &input, output: &output }], 2e-7, &options).unwrap()
}

#[test]
fn the_band_holds_the_simulators_true_force() {
    let seeds = 3;
    let (mut before, mut after, mut events, mut rises, mut load) = ([0.0; 2], [0.0; 2], 0.0, Vec::new(), 0.0);
    for seed in 0..seeds {
        let world = world(900 + seed, 24);
        let fit = model(&world);
        let (a, b, c, k) = fit.model.matrices();
        let n = b.len();
        let a: Vec<f64> = (0..n * n).map(|ij| a[(ij / n, ij % n)]).collect();
        let identified = IdentifiedModel { a: &a, b: &b, c: &c, d: fit.model.feedthrough, k: &k };
        for (window, truth) in world.windows.iter().zip(&world.forces).take(8) {
            let line = fit_line(window, T0 + 50, SAMPLES, Weighting::Hann, false);
            let y: Vec<f64> = window.iter().map(|y| y - line.level).collect();
            let settings = ReconstructionSettings {
                prior: ForcePrior::RandomWalk,
                transition: T0 - 10..T0 + 20,
                noise_variance: None,
            };
            let found = reconstruct(identified, &y, &settings).unwrap();
            let zero = line.std_at(0.0, 2.0 * found.noise_variance.sqrt());
            let share = |range: std::ops::Range<usize>, level: f64| {
                let inside = |k: &usize| (found.force[*k] - truth[*k]).abs() <= level * found.std[*k].hypot(zero);
                range.clone().filter(inside).count() as f64 / range.len() as f64
            };
            for (i, level) in [1.0, 2.0].into_iter().enumerate() {
                before[i] += share(0..T0 - 10, level);
                after[i] += share(T0 + 20..SAMPLES, level);
            }
            events += 1.0;
            let risen = rise(&found.force, &found.std, settings.transition, 120).unwrap();
            rises.push(risen.samples * 0.2);
            load += (risen.before - risen.after) / (truth[T0 - 20] - truth[T0 + 20]);
            if events == 1.0 {
                println!(
                    "noise {:e} walk {:e} jump {:e} std {:e} {:e} {:e} passes {}",
                    found.noise_variance.sqrt(), found.walk_std, found.jump_std, found.std[700], found.std[T0], found.std[5000], found.evaluations
                );
                for k in (T0 - 12..T0 + 16).chain([300, 800, 1200, 1700, 2500, 4000, 6000]) {
                    println!("{k}: {:.5} +- {:.5}, truth {:.5}", found.force[k], found.std[k], truth[k]);
                }
            }
        }
    }
    let mean = |sums: [f64; 2]| sums.map(|s| s / events);
    let rise_us = rises.iter().sum::<f64>() / events;
    println!("before {:?} after {:?}, rise {rise_us:.3} us, load over truth {:.4}", mean(before), mean(after), load / events);
}
