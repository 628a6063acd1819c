//! The worlds that estimates are tested in: the paper's lever, released by the project's simulator or in closed form.

use afmid_kernels::simulate::{
    Adc, AfmSystem, Contact, Detector, Drive, EventKind, ModalLever, Mode, ReadoutNoise, Sampling, TriangleRamp,
    simulate_motion,
};
use faer::c64;
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

pub const RATE_HZ: f64 = 5e6;
pub const SAMPLES: usize = 8192;
pub const FREQUENCY_HZ: [f64; 4] = [46.3e3, 247.4e3, 580.8e3, 1051.2e3];
pub const QUALITY_FACTOR: [f64; 4] = [40.8, 193.2, 358.0, 503.8];
const DETECTOR_SHARE: [f64; 4] = [0.8979, 0.0794, 0.0166, 0.0061];
const TIP_SHARE: [f64; 4] = [0.9713, 0.0247, 0.0032, 0.0008];
pub const DETECTOR_POLE_HZ: [f64; 3] = [1.3e6, 1.9e6, 2.4e6];
pub const SENSITIVITY_V_PER_M: f64 = 1e7;
pub const WHITE_V: f64 = 1.2e-3;
pub const PINK_V: f64 = 3e-4;
pub const LSB_V: f64 = 0.977e-3;
const ADHESION_N: f64 = 330e-9;

/// The lever of Table I.
pub fn lever() -> ModalLever {
    let modes = (0..4)
        .map(|i| Mode {
            frequency_hz: FREQUENCY_HZ[i],
            quality_factor: QUALITY_FACTOR[i],
            tip_share: TIP_SHARE[i],
            detector_share: DETECTOR_SHARE[i],
        })
        .collect();
    ModalLever { stiffness_n_per_m: 3.8, modes }
}

/// Detector, contact and the linear systems they make with the lever.
pub fn system(temperature_k: f64) -> (AfmSystem, Contact) {
    let contact = Contact {
        stiffness_n_per_m: 60.0,
        damping_n_s_per_m: 8e-6,
        snap_in_gap_m: 4e-9,
        adhesion_n: ADHESION_N,
        adhesion_scatter: 0.0,
    };
    let detector =
        Detector { sensitivity_v_per_m: SENSITIVITY_V_PER_M, pole_hz: DETECTOR_POLE_HZ.to_vec(), delay_s: 0.0 };
    (AfmSystem::new(&lever(), &contact, &detector, temperature_k), contact)
}

/// One release through the whole microscope: thermal forces, contact, readout noise, converter.
///
/// Returns the samples from the first one after the release on, and its load over the mean pull-off force.
pub fn real_event(seed: u64, event: usize, scatter: f64, samples: usize) -> (Vec<f64>, f64) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(event as u64);
    let (system, contact) = system(295.0);
    let lever = lever();
    let deviate = loop {
        let d: f64 = StandardNormal.sample(&mut rng);
        if d.abs() <= 3.0 {
            break d;
        }
    };
    let pull_off = [ADHESION_N * (1.0 + scatter * deviate)];
    // wide scatter wants a longer way, at the same speed, for strong contacts to let go, and a nearer catch for weak
    // ones not to come back
    let (range_m, snap_in_gap_m) = if scatter > 0.1 { (500e-9, 1e-9) } else { (200e-9, contact.snap_in_gap_m) };
    let contact = Contact { snap_in_gap_m, ..contact };
    let ramp = TriangleRamp { frequency_hz: 5.58 * 200e-9 / range_m, range_m, phase: 0.0 };
    let drive = Drive { ramp, surface_m: -22e-9, pull_off_n: &pull_off };
    // the base's height above the surface at which the contact lets go, and when it is passed on the way up
    let series = 1.0 / (1.0 / lever.stiffness_n_per_m + 1.0 / contact.stiffness_n_per_m);
    let expected_s = ramp.passes_s(1, drive.surface_m + pull_off[0] / series);
    // thermal peaks release it earlier, by up to a millisecond; a uniform start makes the sub-sample onset uniform
    let start_s = expected_s - 2.5e-3 - rng.random::<f64>() / RATE_HZ;
    let before = (3.0e-3 * RATE_HZ) as usize;
    let sampling = Sampling { start_s, interval_s: 1.0 / RATE_HZ, samples: before + samples + 64 };
    let motion = simulate_motion(&system, &lever, &contact, &drive, sampling, &mut rng);
    let release = motion.events.iter().find(|e| e.kind == EventKind::SnapOff).expect("the contact lets go");
    let first = ((release.time_s - start_s) * RATE_HZ).ceil() as usize;
    let mut volts: Vec<f64> = motion.signal_m[first..first + samples].iter().map(|m| SENSITIVITY_V_PER_M * m).collect();
    let noise = ReadoutNoise { white_v: WHITE_V, pink_v: PINK_V, drift_v: 0.0 };
    noise.add_random(&mut volts, RATE_HZ, &mut rng);
    let (adc, offset) = (Adc { bits: 12, lsb_v: LSB_V }, LSB_V * rng.random::<f64>());
    (volts.iter().map(|v| f64::from(adc.code(v + offset)) * LSB_V).collect(), release.load_n.abs() / ADHESION_N)
}

/// Poles (rad/s, upper ones of pairs) and residues (V) of a unit release of the mean load, exact.
pub fn closed_form() -> (Vec<c64>, Vec<c64>) {
    let level = ADHESION_N / 3.8 * SENSITIVITY_V_PER_M;
    let modes = FREQUENCY_HZ.iter().zip(QUALITY_FACTOR).map(|(f, q)| {
        let w = TAU * f;
        c64::new(-w / (2.0 * q), w * (1.0 - 0.25 / (q * q)).sqrt())
    });
    let poles: Vec<c64> = modes.chain(DETECTOR_POLE_HZ.iter().map(|f| c64::new(-TAU * f, 0.0))).collect();
    // y(t) = -load sum_p Res[H/s] exp(p t); the pair of a mode counts twice
    let residues = poles
        .iter()
        .map(|&p| {
            let radius = 1e-3 * p.re.abs();
            let sum: c64 = (0..16)
                .map(|k| {
                    let d = c64::cis(TAU * (k as f64 + 0.5) / 16.0) * radius;
                    transfer(p + d) * d / 16.0
                })
                .fold(c64::new(0.0, 0.0), |a, b| a + b);
            sum / p * level * if p.im > 0.0 { 2.0 } else { 1.0 }
        })
        .collect();
    (poles, residues)
}

fn transfer(s: c64) -> c64 {
    let mut lever = c64::new(0.0, 0.0);
    for ((f, q), g) in FREQUENCY_HZ.iter().zip(QUALITY_FACTOR).zip(DETECTOR_SHARE) {
        let w = TAU * f;
        lever += c64::new(g * w * w, 0.0) / (s * s + s * (w / q) + w * w);
    }
    DETECTOR_POLE_HZ.iter().fold(lever, |h, f| h * TAU * *f / (s + TAU * *f))
}

/// The mean of `events` releases under white noise alone, the onset between two samples.
pub fn white_mean(seed: u64, events: usize, std: f64, samples: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (poles, residues) = closed_form();
    let onset: f64 = rng.random();
    (0..samples)
        .map(|k| {
            let t = (k as f64 + onset) / RATE_HZ;
            let y: f64 = poles.iter().zip(&residues).map(|(p, r)| (r * (p * t).exp()).re).sum();
            let deviate: f64 = StandardNormal.sample(&mut rng);
            -y + std / (events as f64).sqrt() * deviate
        })
        .collect()
}
