use rayon::prelude::*;

use super::*;
use crate::fixture::{Lever, white_noise};
use crate::pem::Experiment;
use crate::subspace::Subspace;

const SAMPLES: usize = 8192;
const T0: usize = 1024;

/// The paper's lever with its lowest `modes`, and the detector; static shares sum to one.
fn lever(modes: usize) -> Lever {
    let mut lever = Lever::paper();
    lever.frequency_hz.truncate(modes);
    lever.quality_factor.truncate(modes);
    lever.static_share.truncate(modes);
    let sum: f64 = lever.static_share.iter().sum();
    lever.static_share.iter_mut().for_each(|share| *share /= sum);
    lever
}

fn diagram(modes: usize, seed: u64, era: bool) -> Stabilisation {
    // the mean of 24 events of 1.2 mV
    let noise = white_noise(SAMPLES, 2.5e-4, seed);
    let y: Vec<f64> = lever(modes).release(SAMPLES, T0 as f64, -0.8).iter().zip(noise).map(|(y, e)| y + e).collect();
    let u: Vec<f64> = (0..SAMPLES).map(|k| if k < T0 { -0.8 } else { 0.0 }).collect();
    let candidates: Vec<(usize, Vec<c64>)> = if era {
        let era = Subspace::of_decay(&y[T0..], 300).unwrap();
        (2..=40).map(|order| (order, era.poles(order).unwrap())).collect()
    } else {
        let subspace = Subspace::new(&u, &y, 300).unwrap();
        (2..=40).map(|order| (order, subspace.poles(order).unwrap())).collect()
    };
    let found = stabilisation(&candidates, 2e-7, &StabilisationCriteria::default()).unwrap();
    found.established(Experiment { input: &u, output: &y }, 2e-7, 6.0).unwrap()
}

#[test]
fn the_levers_modes_are_found_and_no_others() {
    let cases: Vec<(usize, u64, bool)> = (0..48).map(|i| (3 + (i / 12) % 2, 1 + (i % 12) as u64, i < 24)).collect();
    let wrong: Vec<String> = cases
        .par_iter()
        .filter_map(|&(modes, seed, era)| {
            let found = diagram(modes, seed, era);
            let truth = lever(modes);
            let right = found.modes.len() == modes
                && found.modes.iter().zip(&truth.frequency_hz).all(|(m, f)| (m.frequency_hz / f - 1.0).abs() < 1e-3)
                // the fourth mode's quality factor is known to some per cent by these methods
                && found.modes.iter().zip(&truth.quality_factor).all(|(m, q)| (m.quality_factor() / q - 1.0).abs() < 0.2)
                && found.order.is_some_and(|order| (2 * modes..=20).contains(&order));
            (!right).then(|| format!("{modes} {seed} {era}: {:?} {:?}", found.order, found.modes))
        })
        .collect();
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn modes_of_a_decay_that_nothing_drives_are_established_by_what_rings() {
    let noise = white_noise(SAMPLES - T0, 2.5e-4, 3);
    let release = lever(3).release(SAMPLES, T0 as f64, -0.8);
    let y: Vec<f64> = release[T0..].iter().zip(noise).map(|(y, e)| y + e).collect();
    let u = vec![0.0; y.len()];
    let era = Subspace::of_decay(&y, 300).unwrap();
    let candidates: Vec<(usize, Vec<c64>)> = (2..=40).map(|order| (order, era.poles(order).unwrap())).collect();
    let found = stabilisation(&candidates, 2e-7, &StabilisationCriteria::default()).unwrap();
    let found = found.established(Experiment { input: &u, output: &y }, 2e-7, 6.0).unwrap();
    let near = |(mode, f): (&PhysicalMode, &f64)| (mode.frequency_hz / f - 1.0).abs() < 1e-3;
    assert!(found.modes.len() == 3 && found.modes.iter().zip(&lever(3).frequency_hz).all(near), "{:?}", found.modes);
}

#[test]
fn marks_and_clusters_are_what_the_criteria_say() {
    let pole = |f: f64, q: f64| {
        let w = std::f64::consts::TAU * f;
        (c64::new(-w / (2.0 * q), w * (1.0 - 0.25 / (q * q)).sqrt()) * 1e-3).exp()
    };
    let pair = |f: f64, q: f64| [pole(f, q), pole(f, q).conj()];
    // one mode that stays, one that moves by 2 %, one whose damping moves by 10 %
    let at = |k: i32| {
        let roots =
            [pair(20.0, 50.0), pair(50.0 * 1.02_f64.powi(k), 50.0), pair(90.0, 40.0 * 1.1_f64.powi(k))].concat();
        (6 + k as usize, roots)
    };
    let candidates: Vec<(usize, Vec<c64>)> = (0..6).map(at).collect();
    let found = stabilisation(&candidates, 1e-3, &StabilisationCriteria::default()).unwrap();
    assert_eq!((found.poles.len(), found.modes.len(), found.order), (18, 1, Some(7)));
    let mode = found.modes[0];
    assert_eq!((mode.count, mode.first_order), (5, 7)); // the lowest order has none below it
    assert!((mode.frequency_hz - 20.0).abs() < 1e-9 && (mode.quality_factor() - 50.0).abs() < 1e-6);
    for k in 0..6 {
        let marks = |i: usize| (found.poles[3 * k + i].frequency_stable, found.poles[3 * k + i].damping_stable);
        let later = k > 0;
        assert_eq!((marks(0), marks(1), marks(2)), ((later, later), (false, false), (later, false)));
    }
}

#[test]
fn unusable_orders_and_criteria_are_refused() {
    let two = [(2, vec![]), (3, vec![])];
    let refused = |candidates: &[(usize, Vec<c64>)], criteria: StabilisationCriteria| {
        stabilisation(candidates, 1.0, &criteria).is_err()
    };
    let usual = StabilisationCriteria::default;
    assert!(refused(&two[..1], usual()) && refused(&[two[1].clone(), two[0].clone()], usual()));
    assert!(refused(&two, StabilisationCriteria { frequency: 0.0, ..usual() }));
    assert!(refused(&two, StabilisationCriteria { damping: f64::NAN, ..usual() }));
    assert!(refused(&two, StabilisationCriteria { min_share: 1.5, ..usual() }));
    assert!(refused(&two, StabilisationCriteria { min_count: 0, ..usual() }));
    let nothing = stabilisation(&two, 1.0, &usual()).unwrap();
    assert!(nothing.modes.is_empty() && nothing.order.is_none());
}
