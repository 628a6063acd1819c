//! Monte Carlo check of the contact stiffness from snap-ins and snap-offs; the figures of docs/results/contact.md.
//!
//! `cargo run -p afmid-stages --example contact -- 50`: seeds 1 to 50, 24 snap-ins and 24 snap-offs each; `-- 50 51`:
//! seeds 51 to 100.

#[allow(dead_code, reason = "the world serves the example `accuracy` too")]
#[path = "accuracy/world.rs"]
mod world;

use afmid_kernels::contact::{
    FreeLever, JointContact, JointOptions, LOADED_BEAM_SHARES, LawChoice, Ringing, coupled_poles, joint_contact,
};
use afmid_kernels::model::ModelError;
use afmid_kernels::ringdown::{Estimate, ModeEstimate, Ringdown, RingdownOptions, fit_ringdowns};
use afmid_kernels::simulate::{Adc, Drive, EventKind, ReadoutNoise, Sampling, TriangleRamp, simulate_motion};
use faer::c64;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use world::{
    FREQUENCY_HZ, LSB_V, PINK_V, QUALITY_FACTOR, RATE_HZ, SAMPLES, SENSITIVITY_V_PER_M, WHITE_V, lever, real_event,
    system,
};

/// Events of either kind per seed.
const EVENTS: usize = 24;
/// Scatter of the pull-off force.
const SCATTER: f64 = 0.06;
/// Random streams of the snap-ins begin here, beyond those of the snap-offs.
const SNAP_IN_STREAM: u64 = 1 << 32;
/// Tip shares that the estimate starts from where they are unknown: a fifth to a quarter off, but for the first.
const GUESSED_SHARES: [f64; 4] = [0.9664, 0.03, 0.0026, 0.001];
/// Samples that the coupled lever's start is made from: it rings for 500.
const START_SAMPLES: usize = 1024;

/// The ways to the contact, from the same two fits of a seed.
const WAYS: [&str; 5] = [
    "poles, shares given",
    "poles, shares unknown",
    "poles and residues, shares given",
    "poles and residues, shares unknown",
    "poles and residues, shares unknown, second order",
];

fn main() {
    let Some(seeds) = std::env::args().nth(1).and_then(|word| word.parse::<u64>().ok()).filter(|seeds| *seeds > 0)
    else {
        eprintln!("usage: contact SEEDS [FIRST]");
        std::process::exit(2);
    };
    let first = std::env::args().nth(2).and_then(|word| word.parse::<u64>().ok()).unwrap_or(1);
    let results: Vec<Result<Vec<JointContact>, ModelError>> =
        (first..first + seeds).into_par_iter().map(estimates).collect();
    for (seed, result) in (first..).zip(&results) {
        if let Err(error) = result {
            println!("seed {seed:3}: {error}");
        }
    }
    for (way, name) in WAYS.iter().enumerate() {
        let found: Vec<&JointContact> = results.iter().flatten().map(|contacts| &contacts[way]).collect();
        println!("{name}");
        figures(&found, seeds);
    }
}

fn figures(found: &[&JointContact], seeds: u64) {
    let (_, truth) = system(295.0);
    print("stiffness", found, seeds, truth.stiffness_n_per_m, |contact| contact.stiffness_n_per_m);
    print("damping", found, seeds, truth.damping_n_s_per_m, |contact| contact.damping_n_s_per_m);
    let poles = true_poles();
    for (n, &share) in LOADED_BEAM_SHARES.iter().enumerate() {
        if found.iter().all(|contact| contact.tip_shares[n].std > 0.0) {
            print(&format!("tip share {}", n + 1), found, seeds, share, |contact| contact.tip_shares[n]);
        }
    }
    for (j, pole) in poles.iter().enumerate() {
        let (f, q) = (pole.norm() / std::f64::consts::TAU, -0.5 * pole.norm() / pole.re);
        let both = |pick: fn(&ModeEstimate) -> Estimate, name: &str, truth: f64| {
            print(&format!("{name} {} alone", j + 1), found, seeds, truth, |c| pick(&c.resonances[j].measured));
            print(&format!("{name} {}", j + 1), found, seeds, truth, |c| pick(&c.resonances[j].estimated));
        };
        both(|mode| mode.frequency_hz, "f", f);
        both(|mode| mode.quality_factor, "Q", q);
        let mean =
            |of: fn(&JointContact, usize) -> f64| found.iter().map(|c| of(c, j)).sum::<f64>() / found.len() as f64;
        println!(
            "  pole at {:.0} kHz: weight {:.4} in the stiffness, {:.4} in the damping",
            f / 1e3,
            mean(|c, j| c.resonances[j].alone.stiffness_weight),
            mean(|c, j| c.resonances[j].alone.damping_weight),
        );
    }
    let count = |what: &dyn Fn(&&JointContact) -> bool| found.iter().filter(|c| what(c)).count();
    println!("  p-value below 0.05: {} of {}", count(&|c| c.p_value < 0.05), found.len());
    println!("  second order chosen: {}", count(&|c| c.law_gain.is_some()));
    println!("  residues refused: {}", count(&|c| c.residues.is_some_and(|test| !test.used)));
}

fn print(name: &str, found: &[&JointContact], seeds: u64, truth: f64, pick: impl Fn(&JointContact) -> Estimate) {
    let z: Vec<f64> = found.iter().map(|contact| (pick(contact).value - truth) / pick(contact).std).collect();
    let n = z.len() as f64;
    let rms = |values: &mut dyn Iterator<Item = f64>| (values.map(|v| v * v).sum::<f64>() / n).sqrt();
    println!(
        "  {name}: {} of {seeds} within 2 standard errors, rms z {:.3}, mean z {:+.3}, rms error {:.4} %, stated {:.4} %",
        z.iter().filter(|z| z.abs() <= 2.0).count(),
        rms(&mut z.iter().copied()),
        z.iter().sum::<f64>() / n,
        100.0 * rms(&mut found.iter().map(|contact| pick(contact).value / truth - 1.0)),
        100.0 * rms(&mut found.iter().map(|contact| pick(contact).std / truth)),
    );
}

/// Everything from the records of one seed: nothing but the lever's stiffness is given, and its tip shares where the
/// way says so.
fn estimates(seed: u64) -> Result<Vec<JointContact>, ModelError> {
    let snap_offs: Vec<Vec<f64>> = (0..EVENTS).map(|event| real_event(seed, event, SCATTER, SAMPLES).0).collect();
    let snap_ins: Vec<Vec<f64>> = (0..EVENTS).map(|event| snap_in(seed, event, SAMPLES)).collect();
    let (free, coupled) = (fit(&snap_offs, None)?, fit(&snap_ins, Some(START_SAMPLES))?);
    let stiffness = Estimate { value: lever().stiffness_n_per_m, std: 0.0 };
    let given = FreeLever::new(stiffness, free.modes(), LOADED_BEAM_SHARES.to_vec(), 0.0)?;
    // the start where shares are unknown: a lever that they are not those of
    let guessed = FreeLever::new(stiffness, free.modes(), GUESSED_SHARES.to_vec(), 0.0)?;
    let (free, coupled) = (Ringing::of(&free, &free.covariance), Ringing::of(&coupled, &coupled.covariance));
    let poles = [free.poles_only(), coupled.poles_only()];
    let (plain, second) = (LawChoice::Auto, LawChoice::SecondOrder);
    let joint = |lever, free, coupled, law, share_error| {
        joint_contact(lever, free, coupled, &JointOptions { law, tip_share_error: share_error })
    };
    Ok(vec![
        joint(&given, &poles[0], &poles[1], plain, Some(0.0))?,
        joint(&guessed, &poles[0], &poles[1], plain, None)?,
        joint(&given, &free, &coupled, plain, Some(0.0))?,
        joint(&guessed, &free, &coupled, plain, None)?,
        joint(&guessed, &free, &coupled, second, None)?,
    ])
}

/// Coupled poles, exact.
fn true_poles() -> Vec<c64> {
    let exact = |value| Estimate { value, std: 0.0 };
    let (_, contact) = system(0.0);
    let modes = FREQUENCY_HZ.iter().zip(QUALITY_FACTOR);
    let modes = modes.map(|(&f, q)| ModeEstimate { frequency_hz: exact(f), quality_factor: exact(q) }).collect();
    let stiffness = exact(lever().stiffness_n_per_m);
    let lever = FreeLever::new(stiffness, modes, LOADED_BEAM_SHARES.to_vec(), 0.0).expect("the paper's lever");
    // rad/s, as `model.ringdown` finds them
    let start = [(-3e4, 9.3e5), (-1e5, 1.92e6), (-6.7e4, 3.75e6), (-4.6e4, 6.65e6)].map(|(re, im)| c64::new(re, im));
    coupled_poles(&lever, [contact.stiffness_n_per_m, contact.damping_n_s_per_m], &start).expect("four poles")
}

fn fit(events: &[Vec<f64>], start_samples: Option<usize>) -> Result<Ringdown, ModelError> {
    let borrowed: Vec<&[f64]> = events.iter().map(Vec::as_slice).collect();
    fit_ringdowns(&borrowed, &[], 1.0 / RATE_HZ, &RingdownOptions { start_samples, ..RingdownOptions::default() })
}

/// One catch through the whole microscope, as [`real_event`] makes a release; the samples from the first one after it
/// on.
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
