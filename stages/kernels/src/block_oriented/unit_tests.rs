//! The parts against their definitions, and what is wrong with data.

use faer::c64;

use super::*;
use crate::fixture::white_noise;
use crate::model::ModelError;
use crate::monitor::{Monitor, Unwatched};

fn roots() -> (Vec<c64>, Vec<c64>) {
    let z = |re, im| c64::new(re, im);
    let poles = vec![z(0.7, 0.4), z(0.7, -0.4), z(0.5, 0.0), z(0.5, 0.0), z(-0.2, 0.0)];
    (poles, vec![z(-0.5, 0.8), z(-0.5, -0.8), z(1.3, 0.0)])
}

#[test]
fn a_part_has_the_roots_that_it_is_made_of_and_the_response_of_its_difference_equation() {
    let (poles, zeros) = roots();
    let part = Rational::from_roots(&poles, &zeros).unwrap();
    for (found, wanted) in [(part.poles(), &poles), (part.zeros(), &zeros)] {
        assert_eq!(found.len(), wanted.len());
        // a double pole splits by the root of the rounding
        assert!(wanted.iter().all(|w| found.iter().any(|f| (f - w).norm() < 1e-6)), "{found:?} {wanted:?}");
    }
    let (b, a) = (part.numerator(), part.denominator());
    let u = white_noise(300, 1.0, 1);
    let mut y = vec![0.0; u.len()];
    for t in 0..u.len() {
        let past = |signal: &[f64], c: &[f64]| -> f64 { (0..c.len().min(t + 1)).map(|k| c[k] * signal[t - k]).sum() };
        y[t] = past(&u, &b) - (past(&y, &a) - y[t]);
    }
    let found = part.filter(&u);
    // rounding of recursions of fifth order
    assert!(y.iter().zip(&found).all(|(y, f)| (y - f).abs() < 1e-9));
    let z = c64::cis(0.3);
    let product = |roots: &[c64]| roots.iter().fold(c64::new(1.0, 0.0), |p, r| p * (1.0 - r / z));
    let wanted = product(&zeros) / product(&poles) / (z * z);
    assert!((part.transfer(z) - wanted).norm() < 1e-10 * wanted.norm());
    assert!(Rational::from_roots(&poles[..2], &zeros).is_none());
}

#[test]
fn a_curve_passes_through_its_values_and_goes_on_straight() {
    let curve = Curve::new(-1.0, 0.5, vec![0.3, -0.2, 0.4, 1.0, 0.1]);
    let knots = curve.knots();
    assert!(curve.of(&knots).iter().zip(curve.values()).all(|(f, v)| (f - v).abs() < 1e-14));
    for x in [-1.7, -0.83, 0.1, 0.99, 1.4] {
        let h = 1e-6;
        let slope = (curve.of(&[x + h])[0] - curve.of(&[x - h])[0]) / (2.0 * h);
        assert!((curve.slope_of(&[x])[0] - slope).abs() < 1e-7, "{x}");
        let basis: f64 = curve.basis(&[x]).iter().zip(curve.values()).map(|(column, v)| column[0] * v).sum();
        assert!((basis - curve.of(&[x])[0]).abs() < 1e-13);
        assert!((curve.stretched(-2.0).of(&[-2.0 * x])[0] - curve.of(&[x])[0]).abs() < 1e-13);
    }
    for end in [[1.0, 1.5, 2.0], [-1.0, -1.5, -2.0]] {
        let f = curve.of(&end);
        assert!((f[0] - 2.0 * f[1] + f[2]).abs() < 1e-13);
    }
}

fn model() -> BlockModel {
    let (poles, zeros) = roots();
    let first = Rational::from_roots(&poles[..3], &zeros[..2]).unwrap();
    let second = Rational::from_roots(&poles[2..], &zeros[2..]).unwrap();
    let curve = Curve::new(-6.0, 3.0, vec![-3.0, -1.0, 0.2, 1.0, 1.4]);
    BlockModel { first, curve, second }
}

#[test]
fn derivatives_are_those_of_differences() {
    let u = white_noise(200, 1.0, 2);
    let model = model().normalised(&u);
    let (output, columns) = model.sensitivities(&u);
    assert!(output.iter().zip(model.simulate(&u)).all(|(a, b)| (a - b).abs() < 1e-12));
    let vector = model.vector();
    assert_eq!(columns.len(), vector.len());
    for (i, column) in columns.iter().enumerate() {
        let h = 1e-6;
        let moved = |by: f64| {
            let mut vector = vector.clone();
            vector[i] += by;
            model.at(&vector).simulate(&u)
        };
        let size = column.iter().fold(0.0_f64, |most, c| most.max(c.abs()));
        for ((up, down), own) in moved(h).iter().zip(moved(-h)).zip(column) {
            // h^2 times a third derivative
            assert!(((up - down) / (2.0 * h) - own).abs() < 1e-6 * size.max(1.0), "{i}");
        }
    }
}

#[test]
fn the_normalised_model_is_the_same_map() {
    let u = white_noise(400, 0.3, 3);
    let (own, other) = (model(), model().normalised(&u));
    assert!(own.simulate(&u).iter().zip(other.simulate(&u)).all(|(a, b)| (a - b).abs() < 1e-10));
    let (before, after) = other.intermediate(&u);
    assert!((model::deviation(&before) / model::deviation(&u) - 1.0).abs() < 1e-12);
    assert!((model::deviation(&other.simulate(&u)) / model::deviation(&after) - 1.0).abs() < 1e-9);
    assert_eq!(other.at(&other.vector()), other);
}

#[test]
fn damaged_data_and_settings_are_errors() {
    let u = white_noise(2000, 1.0, 4);
    let y = model().simulate(&u);
    let options = BlockOptions { order: 2, ..BlockOptions::default() };
    let fit = |u: &[f64], y: &[f64], options: &BlockOptions| fit_block_oriented(u, y, options, &Unwatched).unwrap_err();
    let mut broken = y.clone();
    broken[7] = f64::NAN;
    assert_eq!(fit(&u, &broken, &options), BlockError::Model(ModelError::NotFinite { what: "output", index: 7 }));
    assert_eq!(fit(&broken, &y, &options), BlockError::Model(ModelError::NotFinite { what: "input", index: 7 }));
    assert!(matches!(fit(&u[1..], &y, &options), BlockError::Model(ModelError::Length { found: 1999, .. })));
    assert_eq!(fit(&[1.0; 2000], &y, &options), BlockError::ConstantInput);
    assert_eq!(fit(&u, &[1.0; 2000], &options), BlockError::Model(ModelError::ConstantOutput));
    assert!(matches!(fit(&u[..150], &y[..150], &options), BlockError::TooShort { found: 150, .. }));
    assert!(matches!(fit(&[], &[], &options), BlockError::TooShort { found: 0, .. }));
    let late = BlockOptions { transient: 1990, ..options.clone() };
    assert!(matches!(fit(&u, &y, &late), BlockError::TooShort { found: 10, .. }));
    for wrong in [
        BlockOptions { structures: Vec::new(), ..options.clone() },
        BlockOptions { order: 0, ..options.clone() },
        BlockOptions { knots: 3, ..options.clone() },
        BlockOptions { starts: 0, ..options.clone() },
        BlockOptions { order: 1, structures: vec![Structure::WienerHammerstein], ..options.clone() },
    ] {
        assert!(matches!(fit(&u, &y, &wrong), BlockError::Model(ModelError::Parameter { .. })));
    }
}

#[test]
fn a_monitor_ends_the_search() {
    struct Never;
    impl Monitor for Never {
        fn is_cancelled(&self) -> bool {
            true
        }
    }
    let u = white_noise(2000, 1.0, 5);
    let y = model().simulate(&u);
    let found = fit_block_oriented(&u, &y, &BlockOptions { order: 3, ..BlockOptions::default() }, &Never);
    assert_eq!(found.unwrap_err(), BlockError::Model(ModelError::Cancelled));
}
