//! Known truth with prior knowledge: fixed, bounded and penalised parameters.

use super::tests::INTERVAL_S;
use super::{Knowledge, Known, NoiseSource, Quantity, Ringdown, RingdownOptions, fit_ringdowns};
use crate::fixture::{Lever, white_noise};
use crate::model::ModelError;

const Q2: Quantity = Quantity::QualityFactor(1);
const F2: Quantity = Quantity::Frequency(1);

fn known(quantity: Quantity, knowledge: Knowledge) -> Vec<Known> {
    vec![Known { quantity, knowledge }]
}

fn fitted(seed: u64, known: Vec<Known>) -> Ringdown {
    let lever = Lever::paper();
    let events: Vec<Vec<f64>> = (0..2u64)
        .map(|e| {
            let noise = white_noise(2049, 1.2e-3, 2 * seed + e);
            lever.release(2049, 0.3 * e as f64, -0.8)[1..].iter().zip(noise).map(|(y, n)| y + n).collect()
        })
        .collect();
    let borrowed: Vec<&[f64]> = events.iter().map(Vec::as_slice).collect();
    let options = RingdownOptions { noise: NoiseSource::White, known, ..RingdownOptions::default() };
    fit_ringdowns(&borrowed, &[], INTERVAL_S, &options).unwrap()
}

/// Frequencies and quality factors in turn: values and standard errors.
pub(super) fn numbers(fit: &Ringdown) -> Vec<(f64, f64)> {
    fit.modes().iter().flat_map(|m| [m.frequency_hz, m.quality_factor]).map(|e| (e.value, e.std)).collect()
}

fn truth() -> Vec<f64> {
    let lever = Lever::paper();
    lever.frequency_hz.iter().zip(&lever.quality_factor).flat_map(|(f, q)| [*f, *q]).collect()
}

/// Largest difference of two fits in standard errors of the first, numbers `skip` left out.
fn apart(a: &Ringdown, b: &Ringdown, skip: usize) -> f64 {
    let both = numbers(a).into_iter().zip(numbers(b)).enumerate().filter(|(i, _)| *i != skip);
    both.map(|(_, (a, b))| ((a.0 - b.0) / a.1).abs()).fold(0.0, f64::max)
}

#[test]
fn a_fixed_quality_factor_stays_and_the_errors_of_the_rest_hold() {
    let truth = truth();
    let mut z = 0.0;
    for seed in 0..50 {
        let plain = fitted(seed, Vec::new());
        let fixed = fitted(seed, known(Q2, Knowledge::Fixed(truth[3])));
        assert!(fixed.verdict.converged, "{:?}", fixed.verdict);
        for (i, ((_, before), (value, std))) in numbers(&plain).into_iter().zip(numbers(&fixed)).enumerate() {
            if i == 3 {
                assert!((value / truth[3] - 1.0).abs() < 1e-12 && std == 0.0, "{value} {std}");
                continue;
            }
            // modes are nearly orthogonal and so are f and Q; the curvature is that at the estimate, where real poles
            // move it by half a per cent
            assert!((0.97..1.02).contains(&(std / before)), "{i}: {std} {before}");
            z += ((value - truth[i]) / std).powi(2) / 350.0;
        }
    }
    // 350 squares of unit normal numbers: sqrt(2 / 350) = 7.6 %; four of these
    assert!((0.7..1.3).contains(&z), "{z}");
}

#[test]
fn other_coordinates_end_in_the_same_minimum_with_the_same_errors() {
    let plain = fitted(3, Vec::new());
    for quantity in [Q2, F2] {
        let turned = fitted(3, known(quantity, Knowledge::Free));
        // both stop within a thousandth of a standard error
        assert!(apart(&plain, &turned, 8) < 5e-3);
        for ((_, a), (_, b)) in numbers(&plain).iter().zip(numbers(&turned)) {
            assert!((a / b - 1.0).abs() < 1e-3, "{a} {b}");
        }
    }
}

#[test]
fn bounds_that_are_wide_change_nothing_and_tight_ones_hold() {
    let truth = truth();
    for seed in 0..10 {
        let plain = fitted(seed, Vec::new());
        let (f2, q2) = (numbers(&plain)[2], numbers(&plain)[3]);
        let wide = fitted(seed, known(Q2, Knowledge::Between(0.5 * truth[3], 2.0 * truth[3])));
        assert!(wide.on_bound.is_empty() && apart(&plain, &wide, 8) < 5e-3);
        let low = fitted(seed, known(Q2, Knowledge::Between(q2.0 + 2.0 * q2.1, q2.0 + 9.0 * q2.1)));
        assert_eq!(low.on_bound, [Q2]);
        assert!(low.verdict.converged, "{:?}", low.verdict);
        assert!((numbers(&low)[3].0 / (q2.0 + 2.0 * q2.1) - 1.0).abs() < 1e-9 && numbers(&low)[3].1.is_nan());
        // two standard errors off in one of two nearly orthogonal numbers
        assert!((numbers(&low)[2].0 - truth[2]).abs() < 5.0 * f2.1 && numbers(&low)[2].1 < 1.05 * f2.1);
        let high = fitted(seed, known(F2, Knowledge::Between(f2.0 - 9.0 * f2.1, f2.0 - 2.0 * f2.1)));
        assert_eq!(high.on_bound, [F2]);
        assert!(numbers(&high)[2].1.is_nan() && numbers(&high)[3].1.is_finite());
    }
}

#[test]
fn a_prior_weighs_as_its_variance_says() {
    let plain = fitted(5, Vec::new());
    let (value, std) = numbers(&plain)[3];
    let with_prior = fitted(5, known(Q2, Knowledge::About(value + 2.0 * std, std)));
    let (found, error) = numbers(&with_prior)[3];
    // equal weights: half way, and the error falls by the root of two; the likelihood's curvature changes by some per
    // cent over two errors
    assert!(((found - value) / std - 1.0).abs() < 0.05, "{value} {std} {found}");
    assert!((error * 2f64.sqrt() / std - 1.0).abs() < 0.03, "{error} {std}");
}

#[test]
fn a_fixed_real_pole_is_kept() {
    let fit = fitted(1, known(Quantity::RealPole(0), Knowledge::Fixed(1.3e6)));
    let pole = fit.exponentials[4].pole;
    assert!((pole.re / (-std::f64::consts::TAU * 1.3e6) - 1.0).abs() < 1e-12 && pole.im == 0.0);
    for ((value, std), truth) in numbers(&fit).iter().zip(truth()) {
        assert!((value - truth).abs() < 5.0 * std);
    }
}

#[test]
fn impossible_knowledge_is_refused() {
    let y = white_noise(400, 1.0, 1);
    let refused = |quantity, knowledge| {
        let options = RingdownOptions { known: known(quantity, knowledge), ..RingdownOptions::default() };
        fit_ringdowns(&[&y], &[], INTERVAL_S, &options).err()
    };
    for (quantity, knowledge) in [
        (Q2, Knowledge::Fixed(0.4)),
        (Q2, Knowledge::Between(3.0, 2.0)),
        (F2, Knowledge::About(1e5, 0.0)),
        (F2, Knowledge::Fixed(f64::NAN)),
        (Quantity::Frequency(4), Knowledge::Fixed(1e5)),
        (Quantity::RealPole(3), Knowledge::Fixed(1e5)),
    ] {
        let error = refused(quantity, knowledge);
        assert!(matches!(error, Some(ModelError::Parameter { .. })), "{quantity:?} {knowledge:?} {error:?}");
    }
}
