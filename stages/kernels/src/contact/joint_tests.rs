//! Known truth: poles and residues of the simulator's own matrices, random errors, laws and ringings that do not fit.

use faer::{Mat, c64};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::tests::{DETECTOR_POLE_HZ, TRUTH, exact_lever, poles_of_the_simulator, simulated};
use super::{
    ContactLaw, JointContact, JointOptions, LOADED_BEAM_SHARES, LawChoice, Ringing, coupled_poles, joint_contact,
};
use crate::model::ModelError;
use crate::ringdown::Estimate;
use crate::simulate::LinearSystem;

/// Shares that are not the simulator's.
const WRONG_SHARES: [f64; 4] = [0.9664, 0.03, 0.0026, 0.001];
const UNKNOWN: JointOptions = JointOptions { law: LawChoice::Auto, tip_share_error: None };

/// `weights (s - A)^-1 input` by Gaussian elimination.
fn transfer(system: &LinearSystem, input: &[f64], weights: &[f64], s: c64) -> c64 {
    let n = weights.len();
    let mut rows: Vec<Vec<c64>> = (0..n)
        .map(|i| {
            let entry =
                |j: usize| c64::new(-system.dynamics[(i, j)], 0.0) + if i == j { s } else { c64::new(0.0, 0.0) };
            (0..n).map(entry).chain([c64::new(input[i], 0.0)]).collect()
        })
        .collect();
    for k in 0..n {
        let pivot = (k..n).max_by(|&a, &b| rows[a][k].norm().total_cmp(&rows[b][k].norm())).unwrap();
        rows.swap(k, pivot);
        let top = rows[k].clone();
        for row in rows.iter_mut().skip(k + 1) {
            let factor = row[k] / top[k];
            row.iter_mut().zip(&top).for_each(|(v, t)| *v -= factor * t);
        }
    }
    let mut x = vec![c64::new(0.0, 0.0); n];
    for k in (0..n).rev() {
        let known = (k + 1..n).fold(rows[k][n], |sum, j| sum - rows[k][j] * x[j]);
        x[k] = known / rows[k][k];
    }
    x.iter().zip(weights).fold(c64::new(0.0, 0.0), |sum, (x, w)| sum + x * w)
}

/// Residues of a step's response at the poles, pairs as one: integrals round them.
fn residues(system: &LinearSystem, input: &[f64], weights: &[f64], poles: &[c64]) -> Vec<c64> {
    poles
        .iter()
        .map(|&p| {
            let radius = 0.2 * p.re.abs();
            let points = 48;
            (0..points).fold(c64::new(0.0, 0.0), |sum, k| {
                let d = c64::cis(std::f64::consts::TAU * (f64::from(k) + 0.5) / f64::from(points)) * radius;
                sum + transfer(system, input, weights, p + d) / (p + d) * d * (2.0 / f64::from(points))
            })
        })
        .collect()
}

/// A ringing of some amplitude and onset, its largest residue the reference; errors are shares of each pole's decay
/// rate and of the largest residue.
fn ringing(poles: Vec<c64>, residues: &[c64], amplitude: f64, onset_s: f64, errors: [f64; 2]) -> Ringing {
    let largest = |all: &[c64]| (0..all.len()).max_by(|&a, &b| all[a].norm().total_cmp(&all[b].norm())).unwrap();
    let residues: Vec<c64> = poles.iter().zip(residues).map(|(p, r)| r * (-p * onset_s).exp() * amplitude).collect();
    let reference = largest(&residues);
    let scale = residues[reference].norm();
    let std = |i: usize| match (i % 4 < 2, i / 4 == reference) {
        (true, _) => errors[0] * poles[i / 4].re.abs(),
        (false, false) => errors[1] * scale,
        (false, true) => 0.0,
    };
    // real and imaginary part of a pole correlated by a third
    let covariance = Mat::from_fn(4 * poles.len(), 4 * poles.len(), |i, j| {
        let together = if i == j {
            1.0
        } else if i / 4 == j / 4 && i % 4 < 2 && j % 4 < 2 {
            1.0 / 3.0
        } else {
            0.0
        };
        together * std(i) * std(j)
    });
    Ringing { poles, residues: Some(residues), covariance, real_poles: DETECTOR_POLE_HZ.len() }
}

/// Both ringings of the simulator's matrices, exact.
fn ringings(contact: [f64; 2], errors: [f64; 2]) -> [Ringing; 2] {
    let (system, _, _) = simulated(contact, 0.0);
    let free: Vec<c64> = Ringing::of_modes(&exact_lever(LOADED_BEAM_SHARES)).poles;
    let coupled = poles_of_the_simulator(contact);
    let released = residues(&system.free, &system.loaded.height_input, &system.signal_weights, &free);
    let caught = residues(&system.attached, &system.attached.height_input, &system.signal_weights, &coupled);
    [ringing(free, &released, -3e6, 0.13e-6, errors), ringing(coupled, &caught, 5e4, -0.08e-6, errors)]
}

/// The same with errors as their covariances say.
fn drawn(exact: &Ringing, rng: &mut ChaCha8Rng) -> Ringing {
    let mut deviate = || -> f64 { StandardNormal.sample(rng) };
    let std = |i: usize| exact.covariance[(i, i)].sqrt();
    let mut numbers = exact.numbers();
    for j in 0..exact.poles.len() {
        let common = (1.0_f64 / 3.0).sqrt() * deviate();
        for part in 0..2 {
            numbers[4 * j + part] += std(4 * j + part) * (common + (2.0_f64 / 3.0).sqrt() * deviate());
            numbers[4 * j + 2 + part] += std(4 * j + 2 + part) * deviate();
        }
    }
    let at = |i: usize| c64::new(numbers[i], numbers[i + 1]);
    Ringing {
        poles: (0..exact.poles.len()).map(|j| at(4 * j)).collect(),
        residues: Some((0..exact.poles.len()).map(|j| at(4 * j + 2)).collect()),
        ..exact.clone()
    }
}

fn joint(ringings: &[Ringing; 2], options: &JointOptions) -> Result<JointContact, ModelError> {
    joint_contact(&exact_lever(WRONG_SHARES), &ringings[0], &ringings[1], options)
}

#[test]
fn exact_ringings_give_contact_and_shares_back_from_wrong_shares() {
    for truth in [[20.0, 2e-6], TRUTH, [150.0, 1e-5]] {
        let both = ringings(truth, [1e-4, 1e-5]);
        let found = joint(&both, &UNKNOWN).unwrap();
        // the hold on the detector's corners, which are a third off at the start, pulls a little
        let near =
            |found: Estimate, truth: f64| assert!((found.value - truth).abs() < 0.5 * found.std, "{found:?} {truth}");
        near(found.stiffness_n_per_m, truth[0]);
        near(found.damping_n_s_per_m, truth[1]);
        found.tip_shares.iter().zip(LOADED_BEAM_SHARES).for_each(|(share, truth)| near(*share, truth));
        // decay rates to 1e-4 and quality factors of ten: frequencies to 1e-5, shares to some times that
        assert!(found.stiffness_n_per_m.std < 1e-3 * truth[0] && found.tip_shares[1].std < 1e-3 * 0.0247, "{found:?}");
        // nothing but the corners' way from their start, at most two of their errors each
        assert!(found.chi_square < 12.0 && found.inertia_kg.is_none(), "{found:?}");
        assert!(found.residues.unwrap().used);
        let sum =
            |weight: fn(&super::PoleContact) -> f64| found.resonances.iter().map(|r| weight(&r.alone)).sum::<f64>();
        // each weight is a product of differences that are right to 1e-6
        assert!((sum(|p| p.stiffness_weight) - 1.0).abs() < 1e-4, "{found:?}");
        assert!((sum(|p| p.damping_weight) - 1.0).abs() < 1e-4, "{found:?}");
    }
}

#[test]
fn standard_errors_hold_with_and_without_residues() {
    // errors as of 24 events on contact; the free lever's are smaller
    let exact = [ringings(TRUTH, [2e-4, 5e-5])[0].clone(), ringings(TRUTH, [6e-3, 3e-3])[1].clone()];
    let seeds = 150;
    let (mut sums, mut small, mut better) = ([[0.0; 6]; 2], [0; 2], 0);
    for seed in 0..seeds {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let full = [drawn(&exact[0], &mut rng), drawn(&exact[1], &mut rng)];
        let bare = [full[0].poles_only(), full[1].poles_only()];
        let options = JointOptions { law: LawChoice::SpringDamper, tip_share_error: None };
        let found = [joint(&bare, &options).unwrap(), joint(&full, &options).unwrap()];
        for (way, contact) in found.iter().enumerate() {
            let shares = contact.tip_shares.iter().zip(LOADED_BEAM_SHARES).map(|(s, t)| (s.value - t) / s.std);
            let k = (contact.stiffness_n_per_m.value - TRUTH[0]) / contact.stiffness_n_per_m.std;
            let eta = (contact.damping_n_s_per_m.value - TRUTH[1]) / contact.damping_n_s_per_m.std;
            for (sum, z) in sums[way].iter_mut().zip([k, eta].into_iter().chain(shares)) {
                *sum += z * z;
            }
            small[way] += usize::from(contact.p_value < 0.1);
            let budget = contact.budget;
            let parts = [budget.coupled, budget.free, budget.given, budget.stiffness];
            let whole = parts.iter().map(|part| part * part).sum::<f64>().sqrt();
            assert!((whole / contact.stiffness_n_per_m.std - 1.0).abs() < 1e-4, "{contact:?}");
            for resonance in &contact.resonances {
                let (own, all) = (resonance.measured, resonance.estimated);
                // never larger, but for rounding of differences
                assert!(all.frequency_hz.std < 1.0001 * own.frequency_hz.std, "{contact:?}");
                assert!(all.quality_factor.std < 1.0001 * own.quality_factor.std, "{contact:?}");
            }
        }
        if found[1].residues.unwrap().used {
            better += usize::from(found[1].stiffness_n_per_m.std < found[0].stiffness_n_per_m.std);
            better += usize::from(found[1].tip_shares[3].std < found[0].tip_shares[3].std);
        }
    }
    for sum in sums.iter().flatten() {
        // mean of 150 squares of unit normal numbers: 1 +- 0.115; four of these
        assert!((sum / seeds as f64 - 1.0).abs() < 0.46, "{sums:?}");
    }
    for small in small {
        // a tenth of 150: 15 +- 3.7; four of these
        assert!((1..=30).contains(&small), "{small:?}");
    }
    // refused once in a hundred: all but 12 of 150 (four standard deviations round 1.5 is 6.4)
    assert!(better >= 2 * (150 - 12), "{better}");
}

#[test]
fn a_force_that_comes_late_is_found_by_the_law_and_by_nothing_else() {
    let lever = exact_lever(LOADED_BEAM_SHARES);
    let late_s = 25e-9;
    // 1 + (k + eta s) exp(-s tau) G(s) = 0 by secants from the poles without delay: another equation than the kernel's
    let function = |s: c64| (s * TRUTH[1] + TRUTH[0]) * (-s * late_s).exp() * lever.compliance(s).value + 1.0;
    let poles = poles_of_the_simulator(TRUTH).into_iter().map(|first| {
        let (mut a, mut b) = (first, first * c64::new(1.0, 1e-3));
        for _ in 0..50 {
            let (fa, fb) = (function(a), function(b));
            if (b - a).norm() < 1e-12 * b.norm() || fa == fb {
                break;
            }
            (a, b) = (b, b - fb * (b - a) / (fb - fa));
        }
        b
    });
    let poles: Vec<c64> = poles.collect();
    let covariance = Mat::from_fn(8, 8, |i, j| if i == j { (1e-3 * poles[i / 2].re).powi(2) } else { 0.0 });
    let coupled = Ringing { poles, residues: None, covariance, real_poles: 0 };
    let free = Ringing::of_modes(&lever);
    let options = |law| JointOptions { law, tip_share_error: Some(0.0) };
    let plain = joint_contact(&lever, &free, &coupled, &options(LawChoice::SpringDamper)).unwrap();
    assert!(plain.p_value < 1e-6, "{plain:?}");
    let found = joint_contact(&lever, &free, &coupled, &options(LawChoice::Auto)).unwrap();
    let inertia = found.inertia_kg.unwrap();
    // k (1 - s tau + s^2 tau^2 / 2) + eta s (1 - s tau): to second order, the third is a hundredth of it below 1 MHz
    let expected = 0.5 * TRUTH[0] * late_s * late_s - TRUTH[1] * late_s;
    assert!((inertia.value / expected - 1.0).abs() < 0.1, "{inertia:?} {expected}");
    assert!((found.stiffness_n_per_m.value / TRUTH[0] - 1.0).abs() < 1e-3, "{found:?}");
    let apparent = TRUTH[1] - TRUTH[0] * late_s;
    assert!((found.damping_n_s_per_m.value / apparent - 1.0).abs() < 0.01, "{found:?}");
    assert!(found.law_gain.unwrap() > 9.0);
    // shares cannot make up for it
    let unknown = JointOptions { law: LawChoice::SpringDamper, tip_share_error: None };
    assert!(joint_contact(&lever, &free, &coupled, &unknown).unwrap().p_value < 1e-6);
}

#[test]
fn a_mass_on_the_tip_is_a_second_order_term() {
    let lever = exact_lever(LOADED_BEAM_SHARES);
    let law = ContactLaw { stiffness_n_per_m: 60.0, damping_n_s_per_m: 8e-6, inertia_kg: 4e-13 };
    let poles = coupled_poles(&lever, law, &poles_of_the_simulator(TRUTH)).unwrap();
    for s in &poles {
        assert!((law.at(*s) * lever.compliance(*s).value + 1.0).norm() < 1e-9);
    }
    let covariance = Mat::from_fn(8, 8, |i, j| if i == j { 1e2 } else { 0.0 });
    let coupled = Ringing { poles, residues: None, covariance, real_poles: 0 };
    let lever = exact_lever(WRONG_SHARES);
    let found = joint_contact(&lever, &Ringing::of_modes(&lever), &coupled, &UNKNOWN).unwrap();
    // exact poles: where the search ends, a thousandth of standard errors that are below a hundredth
    assert!((found.inertia_kg.unwrap().value / 4e-13 - 1.0).abs() < 1e-3, "{found:?}");
    assert!((found.stiffness_n_per_m.value / 60.0 - 1.0).abs() < 1e-4, "{found:?}");
}

#[test]
fn residues_of_another_force_are_refused_and_poles_still_tell_the_contact() {
    let [free, mut coupled] = ringings(TRUTH, [2e-3, 2e-3]);
    let reference = coupled.reference().unwrap();
    for (j, residue) in coupled.residues.as_mut().unwrap().iter_mut().enumerate() {
        *residue *= if j == reference { 1.0 } else { 1.5 };
    }
    let found = joint(&[free, coupled], &UNKNOWN).unwrap();
    let test = found.residues.unwrap();
    assert!(!test.used && test.p_value < 1e-6, "{found:?}");
    assert!(found.p_value > 0.5, "exact poles: {found:?}");
    assert!((found.stiffness_n_per_m.value / TRUTH[0] - 1.0).abs() < 1e-4, "{found:?}");
}

#[test]
fn given_shares_count_as_they_are_known() {
    let both = ringings(TRUTH, [2e-3, 2e-3]).map(|ringing| ringing.poles_only());
    let with = |shares, share_error| {
        joint_contact(
            &exact_lever(shares),
            &both[0],
            &both[1],
            &JointOptions { law: LawChoice::SpringDamper, tip_share_error: share_error },
        )
        .unwrap()
    };
    let exact = with(LOADED_BEAM_SHARES, Some(0.0));
    let about = with(LOADED_BEAM_SHARES, Some(1e-3));
    let unknown = with(LOADED_BEAM_SHARES, None);
    let std = |contact: &JointContact| contact.stiffness_n_per_m.std;
    assert!(std(&exact) < std(&about) && std(&about) < std(&unknown));
    assert!(exact.tip_shares.iter().all(|share| share.std == 0.0));
    assert!(about.tip_shares[3].std <= 1.0001e-3 * LOADED_BEAM_SHARES[3], "{about:?}");
    // a relative error of k is the same relative error of the contact
    let mut lever = exact_lever(LOADED_BEAM_SHARES);
    lever.stiffness_n_per_m.std = 0.05 * lever.stiffness_n_per_m.value;
    let options = JointOptions { law: LawChoice::SpringDamper, tip_share_error: Some(0.0) };
    let found = joint_contact(&lever, &both[0], &both[1], &options).unwrap();
    assert!((found.budget.stiffness / (0.05 * found.stiffness_n_per_m.value) - 1.0).abs() < 1e-12);
    assert!(found.stiffness_n_per_m.std > found.budget.stiffness && found.correlation > 0.9, "{found:?}");
}

#[test]
fn too_few_poles_and_broken_ringings_are_refused() {
    let [free, coupled] = ringings(TRUTH, [2e-3, 2e-3]);
    let (free, all) = (free.poles_only(), coupled.poles_only());
    let two = Ringing {
        poles: all.poles[..2].to_vec(),
        covariance: Mat::from_fn(4, 4, |i, j| all.covariance[(i, j)]),
        ..all.clone()
    };
    let refused = |free: &Ringing, coupled: &Ringing, options| joint(&[free.clone(), coupled.clone()], options).err();
    // four numbers for a contact and three shares; with what is known of these it works
    assert!(matches!(refused(&free, &two, &UNKNOWN), Some(ModelError::Degenerate(_))));
    assert_eq!(refused(&free, &two, &JointOptions { tip_share_error: Some(0.3), ..UNKNOWN }), None);
    assert!(matches!(refused(&two, &all, &UNKNOWN), Some(ModelError::Parameter { .. })));
    let wide = Ringing { covariance: Mat::zeros(4, 4), ..all.clone() };
    assert!(matches!(refused(&free, &wide, &UNKNOWN), Some(ModelError::Parameter { .. })));
    let nan = Ringing { poles: vec![c64::new(f64::NAN, 1.0); 4], ..all.clone() };
    assert!(matches!(refused(&free, &nan, &UNKNOWN), Some(ModelError::NotFinite { .. })));
    let growing = Ringing { poles: all.poles.iter().map(|p| c64::new(-p.re, p.im)).collect(), ..all };
    assert!(matches!(refused(&free, &growing, &UNKNOWN), Some(ModelError::Parameter { .. })));
}
