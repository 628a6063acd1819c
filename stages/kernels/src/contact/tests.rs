//! Known truth: the simulator's own attached system, random errors of every kind, simulated snap-ins.

use crate::linear_algebra::eigenvalues;
use faer::{Mat, c64};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;

use super::{
    CoupledPoles, FreeLever, JointOptions, LOADED_BEAM_SHARES, LawChoice, Ringing, contact_stiffness, coupled_poles,
    joint_contact,
};
use crate::model::ModelError;
use crate::ringdown::{Estimate, ModeEstimate, RingdownOptions, fit_ringdowns};
use crate::simulate::{
    AfmSystem, Contact, Detector, Drive, EventKind, ModalLever, Mode, Sampling, TriangleRamp, simulate_motion,
};

const FREQUENCY_HZ: [f64; 4] = [46.3e3, 247.4e3, 580.8e3, 1051.2e3];
const QUALITY_FACTOR: [f64; 4] = [40.8, 193.2, 358.0, 503.8];
const DETECTOR_SHARE: [f64; 4] = [0.8979, 0.0794, 0.0166, 0.0061];
pub(super) const DETECTOR_POLE_HZ: [f64; 3] = [1.3e6, 1.9e6, 2.4e6];
pub(super) const TRUTH: [f64; 2] = [60.0, 8e-6];

pub(super) fn simulated(contact: [f64; 2], temperature_k: f64) -> (AfmSystem, ModalLever, Contact) {
    let modes = (0..4).map(|i| Mode {
        frequency_hz: FREQUENCY_HZ[i],
        quality_factor: QUALITY_FACTOR[i],
        tip_share: LOADED_BEAM_SHARES[i],
        detector_share: DETECTOR_SHARE[i],
    });
    let lever = ModalLever { stiffness_n_per_m: 3.8, modes: modes.collect() };
    let contact = Contact {
        stiffness_n_per_m: contact[0],
        damping_n_s_per_m: contact[1],
        snap_in_gap_m: 4e-9,
        adhesion_n: 330e-9,
        adhesion_scatter: 0.0,
    };
    let detector = Detector { sensitivity_v_per_m: 1e7, pole_hz: DETECTOR_POLE_HZ.to_vec(), delay_s: 0.0 };
    (AfmSystem::new(&lever, &contact, &detector, temperature_k), lever, contact)
}

/// Upper poles of the simulator's attached system, ascending: another code than the kernel's.
pub(super) fn poles_of_the_simulator(contact: [f64; 2]) -> Vec<c64> {
    let (system, _, _) = simulated(contact, 0.0);
    let n = system.size();
    let matrix = Mat::from_fn(n, n, |i, j| system.attached.dynamics[(i, j)]);
    let mut poles: Vec<c64> = eigenvalues(&matrix).unwrap().into_iter().filter(|s| s.im > 0.0).collect();
    poles.sort_by(|a, b| a.im.total_cmp(&b.im));
    poles
}

/// The lever with relative errors of stiffness and shares, and of its modes.
fn lever(errors: [f64; 4], deviate: &mut dyn FnMut() -> f64) -> FreeLever {
    let mut around =
        |value: f64, relative: f64| Estimate { value: value * (1.0 + relative * deviate()), std: value * relative };
    let stiffness = around(3.8, errors[0]);
    let modes = (0..4)
        .map(|i| ModeEstimate {
            frequency_hz: around(FREQUENCY_HZ[i], errors[1]),
            quality_factor: around(QUALITY_FACTOR[i], errors[2]),
        })
        .collect();
    let mut shares = LOADED_BEAM_SHARES.map(|share| around(share, errors[3]).value).to_vec();
    // the sum is known: the first makes up for the others
    shares[0] = 1.0 - shares[1..].iter().sum::<f64>();
    FreeLever::new(stiffness, modes, shares, errors[3]).unwrap()
}

pub(super) fn exact_lever(shares: [f64; 4]) -> FreeLever {
    let exact = |value| Estimate { value, std: 0.0 };
    let modes = FREQUENCY_HZ.iter().zip(QUALITY_FACTOR);
    let modes = modes.map(|(&f, q)| ModeEstimate { frequency_hz: exact(f), quality_factor: exact(q) }).collect();
    FreeLever::new(exact(3.8), modes, shares.to_vec(), 0.0).unwrap()
}

#[test]
fn poles_of_the_simulator_give_its_contact_back_to_rounding() {
    let lever = exact_lever(LOADED_BEAM_SHARES);
    for truth in [[0.5, 1e-7], [60.0, 8e-6], [60.0, 0.0], [800.0, 3e-5]] {
        let poles = poles_of_the_simulator(truth);
        let own = coupled_poles(&lever, truth, &poles).unwrap();
        for (a, b) in own.iter().zip(&poles) {
            // eigenvalues of a matrix whose entries span seven decades
            assert!((a - b).norm() < 1e-10 * b.norm(), "{a} {b}");
        }
        let found = contact_stiffness(&lever, &CoupledPoles::independent(&poles, 100.0)).unwrap();
        // the poles' rounding, 1e-10 rad/s of 1e6, over how little the stiffest contact still moves them
        assert!((found.stiffness_n_per_m.value / truth[0] - 1.0).abs() < 1e-8, "{truth:?} {found:?}");
        assert!((found.damping_n_s_per_m.value - truth[1]).abs() < 1e-8 * 1e-5, "{truth:?} {found:?}");
        assert!(found.chi_square < 1e-8, "{found:?}");
        let sum = |weight: fn(&super::PoleContact) -> f64| found.poles.iter().map(weight).sum::<f64>();
        assert!((sum(|p| p.stiffness_weight) - 1.0).abs() < 1e-9 && (sum(|p| p.damping_weight) - 1.0).abs() < 1e-9);
        for pole in &found.poles {
            // a far-off pole feels a soft contact by a thousandth of its width
            assert!((pole.stiffness_n_per_m.value / truth[0] - 1.0).abs() < 1e-5, "{pole:?}");
        }
    }
}

#[test]
fn standard_errors_count_poles_modes_stiffness_and_shares() {
    // each origin alone, then all
    for errors in [
        [0.0, 0.0, 0.0, 0.0, 300.0],
        [0.02, 0.0, 0.0, 0.0, 1.0],
        [0.0, 2e-3, 2e-2, 0.0, 10.0],
        [0.0, 0.0, 0.0, 1e-3, 10.0],
        [0.02, 2e-3, 2e-2, 1e-3, 300.0],
    ] {
        let seeds = 300;
        let (mut sums, mut small) = ([0.0; 2], 0);
        for seed in 0..seeds {
            let mut rng = ChaCha8Rng::seed_from_u64(seed);
            let mut deviate = || StandardNormal.sample(&mut rng);
            let exact = lever([0.0; 4], &mut || 0.0);
            let truth = coupled_poles(&exact, TRUTH, &poles_of_the_simulator(TRUTH)).unwrap();
            let drawn = lever([errors[0], errors[1], errors[2], errors[3]], &mut deviate);
            // correlated errors of the poles: a common part and each its own
            let (common, std): (f64, f64) = (deviate(), errors[4]);
            let mut part = || std * (0.6 * common + 0.8 * deviate());
            let poles: Vec<c64> = truth.iter().map(|s| s + c64::new(part(), part())).collect();
            let covariance = Mat::from_fn(8, 8, |i, j| std * std * if i == j { 1.0 } else { 0.36 });
            let found = contact_stiffness(&drawn, &CoupledPoles { poles, covariance }).unwrap();
            sums[0] += ((found.stiffness_n_per_m.value - TRUTH[0]) / found.stiffness_n_per_m.std).powi(2);
            sums[1] += ((found.damping_n_s_per_m.value - TRUTH[1]) / found.damping_n_s_per_m.std).powi(2);
            small += usize::from(found.p_value < 0.1);
            let budget = found.budget;
            let whole = [budget.poles, budget.stiffness, budget.free_modes, budget.tip_shares];
            let whole = whole.iter().map(|part| part * part).sum::<f64>().sqrt();
            assert!((whole / found.stiffness_n_per_m.std - 1.0).abs() < 1e-6);
        }
        for sum in sums {
            // mean of 300 squares of unit normal numbers: 8 %; four of these
            assert!((sum / seeds as f64 - 1.0).abs() < 0.33, "{errors:?} {sums:?}");
        }
        // a tenth of 300: 30 +- 5.2; four of these
        assert!((9..=51).contains(&small), "{errors:?} {small}");
    }
}

#[test]
fn wrong_tip_shares_show_as_poles_that_disagree() {
    let poles = CoupledPoles::independent(&poles_of_the_simulator(TRUTH), 100.0);
    // a uniform beam's shares
    let found = contact_stiffness(&exact_lever([0.9707, 0.0247, 0.00315, 0.00082]), &poles).unwrap();
    let wrong = contact_stiffness(&exact_lever([0.9, 0.05, 0.01, 0.002]), &poles).unwrap();
    assert!(wrong.p_value < 1e-6, "{wrong:?}");
    assert!(wrong.chi_square > 10.0 * found.chi_square);
}

#[test]
fn simulated_snap_ins_give_the_contact_within_its_errors() {
    let (mut sum, mut unknown) = (0.0, 0.0);
    let seeds = 4;
    for seed in 0..seeds {
        let events: Vec<Vec<f64>> = (0..8).map(|event| snap_in(seed, event, 3000)).collect();
        let borrowed: Vec<&[f64]> = events.iter().map(Vec::as_slice).collect();
        let options = RingdownOptions { start_samples: Some(1024), ..RingdownOptions::default() };
        let fit = fit_ringdowns(&borrowed, &[], 2e-7, &options).unwrap();
        assert!(fit.verdict.converged);
        let measured = CoupledPoles::of(&fit, &fit.covariance);
        let found = contact_stiffness(&exact_lever(LOADED_BEAM_SHARES), &measured).unwrap();
        // eight events: a quarter of a per cent
        assert!(found.stiffness_n_per_m.std < 0.3, "{found:?}");
        assert!(found.p_value > 1e-4, "{found:?}");
        sum += ((found.stiffness_n_per_m.value - TRUTH[0]) / found.stiffness_n_per_m.std).powi(2);
        // the same with tip shares that are not the lever's to start from
        let lever = exact_lever([0.9664, 0.03, 0.0026, 0.001]);
        let options = JointOptions { law: LawChoice::Auto, tip_share_error: None };
        let found = joint_contact(&lever, &Ringing::of_modes(&lever), &Ringing::of(&fit, &fit.covariance), &options);
        let found = found.unwrap();
        assert!(found.stiffness_n_per_m.std < 0.4 && found.p_value > 1e-4, "{found:?}");
        unknown += ((found.stiffness_n_per_m.value - TRUTH[0]) / found.stiffness_n_per_m.std).powi(2);
    }
    // four squares of unit normal numbers exceed 18.5 once in a thousand
    assert!(sum < 18.5 && unknown < 18.5, "{sum} {unknown}");
}

/// A snap-in with thermal motion and white noise, from its first sample on.
fn snap_in(seed: u64, event: u64, samples: usize) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(event);
    let (system, lever, contact) = simulated(TRUTH, 295.0);
    let ramp = TriangleRamp { frequency_hz: 5.58, range_m: 200e-9, phase: 0.0 };
    let drive = Drive { ramp, surface_m: -22e-9, pull_off_n: &[contact.adhesion_n] };
    let start_s = ramp.passes_s(0, drive.surface_m + contact.snap_in_gap_m) - 0.3e-3 - 2e-7 * rng.random::<f64>();
    let sampling = Sampling { start_s, interval_s: 2e-7, samples: 2000 + samples };
    let motion = simulate_motion(&system, &lever, &contact, &drive, sampling, &mut rng);
    let caught = motion.events.iter().find(|e| e.kind == EventKind::SnapIn).unwrap().time_s;
    let first = ((caught - start_s) / 2e-7).ceil() as usize;
    let mut noisy = |metres: &f64| {
        let deviate: f64 = StandardNormal.sample(&mut rng);
        1e7 * metres + 1.2e-3 * deviate
    };
    motion.signal_m[first..first + samples].iter().map(&mut noisy).collect()
}

#[test]
fn unusable_input_is_refused() {
    let lever = exact_lever(LOADED_BEAM_SHARES);
    let poles = poles_of_the_simulator(TRUTH);
    let refused = |poles: &CoupledPoles| contact_stiffness(&lever, poles).err();
    let parameter = |error| matches!(error, Some(ModelError::Parameter { .. }));
    assert!(parameter(refused(&CoupledPoles::independent(&[], 1.0))));
    assert!(parameter(refused(&CoupledPoles::independent(&poles, 0.0))));
    assert!(parameter(refused(&CoupledPoles::independent(&[poles[0].conj()], 1.0))));
    let nan = [c64::new(f64::NAN, TAU)];
    assert!(matches!(refused(&CoupledPoles::independent(&nan, 1.0)), Some(ModelError::NotFinite { .. })));
    let small = CoupledPoles { poles: poles.clone(), covariance: Mat::zeros(2, 2) };
    assert!(parameter(refused(&small)));
    // five poles of four modes
    let mut many = poles;
    many.push(c64::new(-1e5, 9e6));
    assert!(matches!(refused(&CoupledPoles::independent(&many, 1.0)), Some(ModelError::Degenerate(_))));
    let exact = Estimate { value: 3.8, std: 0.0 };
    assert!(FreeLever::new(exact, vec![], vec![], 0.0).is_err());
    let mode = ModeEstimate { frequency_hz: Estimate { value: 5e4, std: 1.0 }, quality_factor: exact };
    assert!(FreeLever::new(exact, vec![mode], vec![1.2], 0.0).is_err());
    assert!(FreeLever::new(exact, vec![mode], vec![0.5, 0.5], 0.0).is_err());
    assert!(FreeLever::new(exact, vec![mode], vec![1.0], f64::NAN).is_err());
    assert!(FreeLever::new(Estimate { value: 0.0, std: 0.0 }, vec![mode], vec![1.0], 0.0).is_err());
}
