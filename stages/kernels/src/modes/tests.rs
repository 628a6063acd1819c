use faer::{Mat, c64};

use super::*;
use crate::model::{InnovationsModel, Section};

fn model() -> InnovationsModel {
    let section = |a: [f64; 2], b: [f64; 2]| Section { order: 2, a, b, k: [0.0; 2] };
    let sections = vec![
        section([-1.98, 0.99], [0.002, 0.001]),
        // two real poles, then one more
        section([-0.7, 0.1], [0.05, 0.02]),
        Section { order: 1, a: [0.4, 0.0], b: [0.01, 0.0], k: [0.0; 2] },
    ];
    InnovationsModel { sections, feedthrough: 0.03, sample_time_s: 2e-7 }
}

/// A model whose parameters are moved by `h` in direction `j`.
fn moved(j: usize, h: f64) -> InnovationsModel {
    let (mut model, n) = (model(), 5);
    let place = |j: usize| (j / 2, j % 2);
    if j < n {
        let (section, entry) = place(j);
        model.sections[section].a[entry] += h;
    } else if j < 2 * n {
        let (section, entry) = place(j - n);
        model.sections[section].b[entry] += h;
    } else {
        model.feedthrough += h;
    }
    model
}

/// Standard error by central differences: the delta method's slow twin.
fn deviation(covariance: &Mat<f64>, value: impl Fn(&InnovationsModel) -> f64) -> f64 {
    let h = 1e-7;
    let g: Vec<f64> = (0..11).map(|j| (value(&moved(j, h)) - value(&moved(j, -h))) / (2.0 * h)).collect();
    (0..11).map(|i| (0..11).map(|j| g[i] * covariance[(i, j)] * g[j]).sum::<f64>()).sum::<f64>().sqrt()
}

fn covariance() -> Mat<f64> {
    // positive definite, correlated
    Mat::from_fn(11, 11, |i, j| 1e-10 * if i == j { 1.0 } else { 0.5_f64.powi((i as i32 - j as i32).abs()) })
}

#[test]
fn standard_errors_agree_with_differences() {
    let (covariance, criteria) = (covariance(), ModeCriteria::default());
    let find = |model: &InnovationsModel| poles(model, &covariance, &criteria).unwrap();
    let found = find(&model());
    assert_eq!(found.len(), 4);
    for (i, pole) in found.iter().enumerate() {
        let expected = [
            (pole.root.frequency_std_hz, deviation(&covariance, |m| find(m)[i].root.frequency_hz)),
            (pole.static_share_std, deviation(&covariance, |m| find(m)[i].static_share)),
        ];
        for (fast, slow) in expected {
            assert!((fast / slow - 1.0).abs() < 1e-5, "{i}: {fast} {slow}"); // h^2 and rounding over h
        }
    }
    let pair = found.iter().position(|pole| pole.root.is_complex()).unwrap();
    let slow = deviation(&covariance, |m| find(m)[pair].root.quality_factor);
    assert!((found[pair].root.quality_factor_std / slow - 1.0).abs() < 1e-5);
    let all = zeros(&model(), &covariance).unwrap();
    for (i, zero) in all.iter().enumerate() {
        let slow = deviation(&covariance, |m| zeros(m, &covariance).unwrap()[i].frequency_hz);
        assert!((zero.frequency_std_hz / slow - 1.0).abs() < 1e-4, "{i}: {} {slow}", zero.frequency_std_hz);
    }
    let point = response(&model(), &covariance, &[100e3]).unwrap()[0];
    let at = |m: &InnovationsModel| m.transfer(c64::cis(std::f64::consts::TAU * 100e3 * 2e-7));
    assert!((point.magnitude_std() / deviation(&covariance, |m| at(m).norm()) - 1.0).abs() < 1e-5);
    assert!((point.phase_std_rad() / deviation(&covariance, |m| at(m).arg()) - 1.0).abs() < 1e-5);
}

#[test]
fn poles_are_mapped_and_classified() {
    let criteria = ModeCriteria { min_significance: 0.0, ..ModeCriteria::default() };
    let found = poles(&model(), &covariance(), &criteria).unwrap();
    let kinds: Vec<PoleClass> = found.iter().map(|pole| pole.kind).collect();
    assert_eq!(kinds, [PoleClass::Mechanical, PoleClass::Detector, PoleClass::Detector, PoleClass::Nyquist]);
    // z = 0.5 and 0.2
    for (pole, z) in found[1..3].iter().zip([0.5_f64, 0.2]) {
        assert!((pole.root.frequency_hz / (-z.ln() / 2e-7 / std::f64::consts::TAU) - 1.0).abs() < 1e-12);
        assert!((pole.root.quality_factor - 0.5).abs() < 1e-12);
    }
    // z = -0.4: principal logarithm
    let s = c64::new(0.4_f64.ln(), std::f64::consts::PI) / 2e-7;
    assert!((found[3].root.s - s).norm() < 1e-6 * s.norm());
    // shares of all sections and the feedthrough sum to one; the section of two real poles is listed twice
    let sum = found[0].static_share + found[1].static_share + found[3].static_share;
    let gain = model().transfer(c64::new(1.0, 0.0)).re;
    assert!((sum + 0.03 / gain - 1.0).abs() < 1e-12);
}

#[test]
fn a_negative_real_root_has_its_principal_logarithm_whatever_the_sign_of_zero() {
    let [above, below] = [0.0, -0.0].map(|im| Root::without_errors(c64::new(-0.4, im), 2e-7).s);
    assert_eq!((below.re, below.im), (above.re, above.im));
    assert!((above.im * 2e-7 - std::f64::consts::PI).abs() < 1e-15);
}

#[test]
fn doubtful_pairs_are_no_modes() {
    // a hundred times the errors: the pair's amplitude no longer stands out
    let vague = Mat::from_fn(11, 11, |i, j| 1e8 * covariance()[(i, j)]);
    let found = poles(&model(), &vague, &ModeCriteria::default()).unwrap();
    assert_eq!(found[0].kind, PoleClass::Doubtful);
    assert!(poles(&model(), &Mat::zeros(3, 3), &ModeCriteria::default()).is_err());
    assert!(zeros(&model(), &Mat::zeros(3, 3)).is_err() && response(&model(), &Mat::zeros(3, 3), &[1e3]).is_err());
}
