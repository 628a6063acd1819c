//! Monte Carlo check of the contact stiffness from snap-ins and snap-offs; the figures of docs/accuracy.md.
//!
//! `cargo run -p afmid-stages --example contact -- 50`: seeds 1 to 50, 24 snap-ins and 24 snap-offs each.

#[allow(dead_code)]
#[path = "accuracy/world.rs"]
mod world;

use afmid_stages::model::contact::{ContactEstimate, CoupledPoles, FreeLever, LOADED_BEAM_SHARES, contact_stiffness};
use afmid_stages::model::ringdown::{Estimate, Ringdown, RingdownOptions, fit_ringdowns};
use afmid_stages::simulate::{
    Adc, Drive, EventKind, ReadoutNoise, Sampling, TriangleRamp, simulate_motion,
};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use world::{LSB_V, PINK_V, RATE_HZ, SAMPLES, SENSITIVITY_V_PER_M, WHITE_V, lever, real_event, system};

/// Events of either kind per seed.
const EVENTS: usize = 24;
/// Random streams of the snap-ins begin here, beyond those of the snap-offs.
const SNAP_IN_STREAM: u64 = 1 << 32;

fn main() {
    let Some(seeds) = std::env::args().nth(1).and_then(|word| word.parse::<u64>().ok()) else {
        eprintln!("usage: contact SEEDS");
        std::process::exit(2);
    };
    let (_, contact) = system(295.0);
    let truth = [contact.stiffness_n_per_m, contact.damping_n_s_per_m];
    let results: Vec<(ContactEstimate, Ringdown)> = (1..=seeds).into_par_iter().map(estimate).collect();
    for (seed, (c, fit)) in results.iter().enumerate() {
        println!("seed {} chi2 {:.3} conv {} steps {}: k {:.4} +- {:.4} eta {:.4e} +- {:.1e} p {:.3}", seed + 1, fit.reduced_chi_square, fit.verdict.converged, fit.verdict.steps, c.stiffness_n_per_m.value, c.stiffness_n_per_m.std, c.damping_n_s_per_m.value, c.damping_n_s_per_m.std, c.p_value);
        if seed < 2 {
            for m in fit.modes() { println!("   {:?}", m); }
            for p in &c.poles { println!("   {:.3?}", p); }
            println!("{:?}", c.budget);
            for e in &fit.exponentials { println!("     {:.4e} {:.4e}", e.pole, e.residue); }
        }
    }
    let z = |pick: fn(&ContactEstimate) -> Estimate, truth: f64| -> Vec<f64> { results.iter().map(|(c, _)| (pick(c).value - truth) / pick(c).std).collect() };
    for (name, z) in [("k", z(|c| c.stiffness_n_per_m, truth[0])), ("eta", z(|c| c.damping_n_s_per_m, truth[1]))] {
        let n = z.len() as f64;
        println!("{name}: within 2: {} rms z {:.3} mean z {:.3}", z.iter().filter(|z| z.abs() <= 2.0).count(), (z.iter().map(|z| z * z).sum::<f64>() / n).sqrt(), z.iter().sum::<f64>() / n);
    }
}

fn estimate(seed: u64) -> (ContactEstimate, Ringdown) {
    let snap_offs: Vec<Vec<f64>> = (0..EVENTS).map(|e| real_event(seed, e, 0.06, SAMPLES)).collect();
    let snap_ins: Vec<Vec<f64>> = (0..EVENTS).map(|e| snap_in(seed, e, SAMPLES)).collect();
    let free = fit(&snap_offs);
    let coupled = fit(&snap_ins);
    let stiffness = Estimate { value: lever().stiffness_n_per_m, std: 0.0 };
    let lever = FreeLever::new(stiffness, free.modes(), LOADED_BEAM_SHARES.to_vec(), 0.0);
    let contact = lever.and_then(|lever| contact_stiffness(&lever, &CoupledPoles::of(&coupled, &coupled.covariance)));
    (contact.unwrap_or_else(|error| panic!("no contact: {error}")), coupled)
}

fn fit(events: &[Vec<f64>]) -> Ringdown {
    let lent: Vec<&[f64]> = events.iter().map(Vec::as_slice).collect();
    fit_ringdowns(&lent, &[], 1.0 / RATE_HZ, &RingdownOptions::default())
        .unwrap_or_else(|error| panic!("the fit failed: {error}"))
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
