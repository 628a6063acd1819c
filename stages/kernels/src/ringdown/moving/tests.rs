//! Known truth: slow equations simulated, recovered.

use std::f64::consts::TAU;

use super::{Exponential, Follows, Line, Options, Term, follow_moving};
use crate::model::ModelError;

/// Deterministic noise of unit variance: sum of twelve uniform numbers.
fn noise(state: &mut u64) -> f64 {
    let mut next = || {
        *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (*state >> 11) as f64 / (1u64 << 53) as f64
    };
    (0..12).map(|_| next()).sum::<f64>() - 6.0
}

/// `a' = -a g(a)`, `phi' = w(a)`, midpoint rule in steps of a twentieth of a sample.
fn decay(a0: f64, samples: usize, interval_s: f64, g: impl Fn(f64) -> f64, w: impl Fn(f64) -> f64) -> Vec<f64> {
    let (mut a, mut phase) = (a0, 0.4_f64);
    let step = interval_s / 20.0;
    (0..samples)
        .map(|_| {
            let y = a * phase.cos();
            for _ in 0..20 {
                let middle = a * (1.0 - 0.5 * step * g(a));
                phase += step * w(middle);
                a -= step * middle * g(middle);
            }
            y
        })
        .collect()
}

fn line(frequency_hz: f64, rate_per_s: f64) -> Line {
    Line { poles: vec![Exponential { rate_per_s, turn_rad_per_s: TAU * frequency_hz }] }
}

#[test]
fn a_mode_that_moves_is_one_mode_with_its_laws() {
    let mut state = 5;
    let mut y = decay(1.0, 8000, 1e-3, |a| 1.0 + 0.5 * a, |a| TAU * 40.0 * (1.0 - 0.01 * a * a));
    y.iter_mut().for_each(|y| *y += 0.003 * noise(&mut state) + 3.0);
    let found = follow_moving(&[vec![&y]], 1e-3, &[line(39.8, 1.3)], &Options::default()).expect("a fit");
    let mode = &found.lines[0].modes[0];
    assert_eq!(found.lines[0].follows, Follows::Moving);
    assert!(mode.damping_terms.iter().any(|t| t.0 == Term::Linear), "{:?}", mode.damping_terms);
    assert!(mode.frequency_terms.iter().any(|t| t.0 == Term::Square), "{:?}", mode.frequency_terms);
    // five of the stated errors
    let z = (mode.frequency_hz.value - 40.0 * (1.0 - 0.01 * mode.amplitudes.0.powi(2))) / mode.frequency_hz.std;
    assert!(z.abs() < 5.0, "{:?}", mode.frequency_hz);
    let left = found.residuals[0][0].iter().map(|r| r * r).sum::<f64>() / 8000.0;
    assert!((left / 9e-6 - 1.0).abs() < 0.1, "{left}");
}

#[test]
fn two_linear_modes_within_a_line_stay_two() {
    let mut state = 9;
    let first = decay(1.0, 6000, 1e-3, |_| 1.0, |_| TAU * 40.0);
    let second = decay(0.8, 6000, 1e-3, |_| 1.4, |_| TAU * 40.4);
    let y: Vec<f64> = first.iter().zip(&second).map(|(a, b)| a + b + 0.003 * noise(&mut state)).collect();
    let found = follow_moving(&[vec![&y]], 1e-3, &[line(40.1, 1.1)], &Options::default()).expect("a fit");
    assert_eq!(found.lines[0].follows, Follows::Exponentials(2));
}

#[test]
fn amplitudes_are_shared_by_hits_and_shapes_by_channels() {
    let mut state = 3;
    let law = |a: f64| TAU * 40.0 * (1.0 + 0.01 * a * a);
    let hits: Vec<Vec<Vec<f64>>> = [1.0, 0.6]
        .iter()
        .map(|a0| {
            let y = decay(*a0, 5000, 1e-3, |_| 1.0, law);
            [1.0, -0.5].iter().map(|s| y.iter().map(|y| s * y + 0.003 * noise(&mut state)).collect()).collect()
        })
        .collect();
    let events: Vec<Vec<&[f64]>> = hits.iter().map(|h| h.iter().map(Vec::as_slice).collect()).collect();
    let found = follow_moving(&events, 1e-3, &[line(40.1, 1.1)], &Options::default()).expect("a fit");
    let mode = &found.lines[0].modes[0];
    assert_eq!(found.lines[0].follows, Follows::Moving);
    assert!((mode.shape[1].re + 0.5).abs() < 0.002 && mode.shape[1].im.abs() < 0.002, "{:?}", mode.shape);
    assert!((mode.starts[1].0 / mode.starts[0].0 - 0.6).abs() < 0.002, "{:?}", mode.starts);
}

#[test]
fn missing_samples_are_passed_over() {
    let mut y = decay(1.0, 5000, 1e-3, |_| 1.0, |a| TAU * 40.0 * (1.0 + 0.01 * a * a));
    let mut state = 7;
    y.iter_mut().for_each(|y| *y += 0.003 * noise(&mut state));
    y[700..900].fill(f64::NAN);
    let found = follow_moving(&[vec![&y]], 1e-3, &[line(40.1, 1.1)], &Options::default()).expect("a fit");
    assert_eq!(found.lines[0].follows, Follows::Moving);
    assert!((found.lines[0].modes[0].frequency_hz.value / 40.0 - 1.0).abs() < 1e-4);
}

#[test]
fn wrong_input_is_an_error() {
    let y = vec![0.0; 100];
    let wrong = |lines: &[Line]| follow_moving(&[vec![&y]], 1e-3, lines, &Options::default());
    assert!(matches!(wrong(&[]), Err(ModelError::Parameter { name: "lines", .. })));
    assert!(matches!(wrong(&[line(600.0, 1.0)]), Err(ModelError::Parameter { name: "poles", .. })));
    let short = [0.0; 10];
    let found = follow_moving(&[vec![&short]], 1e-3, &[line(40.0, 1.0)], &Options::default());
    assert!(matches!(found, Err(ModelError::TooShort { found: 10, wanted: 16 })));
}
