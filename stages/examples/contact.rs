//! Monte Carlo check of the contact stiffness from snap-ins and snap-offs; the figures of docs/accuracy.md.
//!
//! `cargo run -p afmid-stages --example contact -- 50`: seeds 1 to 50, 24 snap-ins and 24 snap-offs each; `-- 50 51`: seeds 51 to 100.

#[allow(dead_code, reason = "the world serves the example `accuracy` too")]
#[path = "accuracy/world.rs"]
mod world;

use afmid_stages::model::ModelError;
use afmid_stages::model::contact::{ContactEstimate, CoupledPoles, FreeLever, LOADED_BEAM_SHARES, contact_stiffness};
use afmid_stages::model::ringdown::{Estimate, Ringdown, RingdownOptions, fit_ringdowns};
use afmid_stages::simulate::{Adc, Drive, EventKind, ReadoutNoise, Sampling, TriangleRamp, simulate_motion};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use world::{LSB_V, PINK_V, RATE_HZ, SAMPLES, SENSITIVITY_V_PER_M, WHITE_V, lever, real_event, system};

/// Events of either kind per seed.
const EVENTS: usize = 24;
/// Scatter of the pull-off force.
const SCATTER: f64 = 0.06;
/// Random streams of the snap-ins begin here, beyond those of the snap-offs.
const SNAP_IN_STREAM: u64 = 1 << 32;
/// Samples that the coupled lever's start is made from: it rings for 500.
const START_SAMPLES: usize = 1024;

fn main() {
    let Some(seeds) = std::env::args().nth(1).and_then(|word| word.parse::<u64>().ok()).filter(|seeds| *seeds > 0)
    else {
        eprintln!("usage: contact SEEDS");
        std::process::exit(2);
    };
    let first = std::env::args().nth(2).and_then(|word| word.parse::<u64>().ok()).unwrap_or(1);
    let results: Vec<Result<ContactEstimate, ModelError>> =
        (first..first + seeds).into_par_iter().map(estimate).collect();
    for (seed, result) in (first..).zip(&results) {
        match result {
            Ok(contact) => println!(
                "seed {seed:3}: {:.4} +- {:.4} N/m, {:.4e} +- {:.1e} N s/m, p = {:.3}",
                contact.stiffness_n_per_m.value,
                contact.stiffness_n_per_m.std,
                contact.damping_n_s_per_m.value,
                contact.damping_n_s_per_m.std,
                contact.p_value
            ),
            Err(error) => println!("seed {seed:3}: {error}"),
        }
    }
    let found: Vec<&ContactEstimate> = results.iter().flatten().collect();
    let (_, truth) = system(295.0);
    print("stiffness", &found, seeds, truth.stiffness_n_per_m, |contact| contact.stiffness_n_per_m);
    print("damping", &found, seeds, truth.damping_n_s_per_m, |contact| contact.damping_n_s_per_m);
    let n = found.len() as f64;
    for j in 0..LOADED_BEAM_SHARES.len() {
        let mean = |of: fn(&ContactEstimate, usize) -> f64| found.iter().map(|c| of(c, j)).sum::<f64>() / n;
        println!(
            "pole at {:.0} kHz: weight {:.3} in the stiffness, {:.3} in the damping; alone +- {:.3} N/m",
            mean(|c, j| c.poles[j].pole.norm() / std::f64::consts::TAU / 1e3),
            mean(|c, j| c.poles[j].stiffness_weight),
            mean(|c, j| c.poles[j].damping_weight),
            mean(|c, j| c.poles[j].stiffness_n_per_m.std)
        );
    }
    let small = found.iter().filter(|contact| contact.p_value < 0.05).count();
    println!("p-value below 0.05: {small} of {}", found.len());
}

fn print(name: &str, found: &[&ContactEstimate], seeds: u64, truth: f64, pick: fn(&ContactEstimate) -> Estimate) {
    let z: Vec<f64> = found.iter().map(|contact| (pick(contact).value - truth) / pick(contact).std).collect();
    let n = z.len() as f64;
    let rms = |values: &mut dyn Iterator<Item = f64>| (values.map(|v| v * v).sum::<f64>() / n).sqrt();
    println!(
        "{name}: {} of {seeds} within 2 standard errors, rms z {:.3}, mean z {:+.3}, rms error {:.3} %, stated {:.3} %",
        z.iter().filter(|z| z.abs() <= 2.0).count(),
        rms(&mut z.iter().copied()),
        z.iter().sum::<f64>() / n,
        100.0 * rms(&mut found.iter().map(|contact| pick(contact).value / truth - 1.0)),
        100.0 * rms(&mut found.iter().map(|contact| pick(contact).std / truth)),
    );
}

/// Everything from the records of one seed: nothing but the lever's stiffness and tip shares is given.
fn estimate(seed: u64) -> Result<ContactEstimate, ModelError> {
    let snap_offs: Vec<Vec<f64>> = (0..EVENTS).map(|event| real_event(seed, event, SCATTER, SAMPLES).0).collect();
    let snap_ins: Vec<Vec<f64>> = (0..EVENTS).map(|event| snap_in(seed, event, SAMPLES)).collect();
    let free = fit(&snap_offs, None)?;
    let coupled = fit(&snap_ins, Some(START_SAMPLES))?;
    let stiffness = Estimate { value: lever().stiffness_n_per_m, std: 0.0 };
    let lever = FreeLever::new(stiffness, free.modes(), LOADED_BEAM_SHARES.to_vec(), 0.0)?;
    contact_stiffness(&lever, &CoupledPoles::of(&coupled, &coupled.covariance))
}

fn fit(events: &[Vec<f64>], start_samples: Option<usize>) -> Result<Ringdown, ModelError> {
    let lent: Vec<&[f64]> = events.iter().map(Vec::as_slice).collect();
    fit_ringdowns(&lent, &[], 1.0 / RATE_HZ, &RingdownOptions { start_samples, ..RingdownOptions::default() })
}

/// One catch through the whole microscope, as [`real_event`] makes a release; the samples from the first one after it on.
fn snap_in(seed: u64, event: usize, samples: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(SNAP_IN_STREAM + event as u64);
    let (system, contact) = system(295.0);
    let ramp = TriangleRamp { frequency_hz: 5.58, range_m: 200e-9, phase: 0.0 };
    let drive = Drive { ramp, surface_m: -22e-9, pull_off_n: &[contact.adhesion_n] };
    let expected_s = ramp.passes_s(0, drive.surface_m + contact.snap_in_gap_m);
    // thermal peaks of 0.2 nm are caught 0.1 ms earlier; a uniform start makes the sub-sample onset uniform
    let start_s = expected_s - 0.3e-3 - rng.random::<f64>() / RATE_HZ;
    let before = (0.4e-3 * RATE_HZ) as usize;
    let sampling = Sampling { start_s, interval_s: 1.0 / RATE_HZ, samples: before + samples + 64 };
    let motion = simulate_motion(&system, &lever(), &contact, &drive, sampling, &mut rng);
    let catch = motion.events.iter().find(|e| e.kind == EventKind::SnapIn).expect("the tip is caught");
    let first = ((catch.time_s - start_s) * RATE_HZ).ceil() as usize;
    let mut volts: Vec<f64> = motion.signal_m[first..first + samples].iter().map(|m| SENSITIVITY_V_PER_M * m).collect();
    let noise = ReadoutNoise { white_v: WHITE_V, pink_v: PINK_V, drift_v: 0.0 };
    noise.add_random(&mut volts, RATE_HZ, &mut rng);
    let (adc, offset) = (Adc { bits: 12, lsb_v: LSB_V }, LSB_V * rng.random::<f64>());
    volts.iter().map(|v| f64::from(adc.code(v + offset)) * LSB_V).collect()
}
