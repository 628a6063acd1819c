//! N4SID, MOESP and CVA weights: against their definitions, and what they change.

use crate::linear_algebra::{Svd, least_squares, product};
use faer::{Mat, c64};
use rayon::prelude::*;

use super::past_future::{Subspace, shift_invariant_poles};
use super::weight::Weight;
use crate::fixture::white_noise;
use crate::model::{InnovationsModel, Section};

const WEIGHTS: [Weight; 3] = [Weight::N4sid, Weight::Moesp, Weight::Cva];

/// Two close resonances, weak noise dynamics of their own.
fn truth() -> InnovationsModel {
    let pair = |radius: f64, angle: f64, b: [f64; 2], k: [f64; 2]| Section {
        order: 2,
        a: [-2.0 * radius * angle.cos(), radius * radius],
        b,
        k,
    };
    let sections = vec![pair(0.97, 0.4, [0.3, 0.1], [0.5, -0.4]), pair(0.95, 0.6, [0.2, -0.1], [0.4, -0.1])];
    InnovationsModel { sections, feedthrough: 0.2, sample_time_s: 1.0 }
}

/// Input coloured by a pole at `colour`, and the response to it, both with a peak of one; e of standard deviation
/// `sigma`.
fn record(samples: usize, colour: f64, sigma: f64, seed: u64) -> (Vec<f64>, Vec<f64>) {
    let mut state = 0.0;
    let white = white_noise(samples, 1.0, seed);
    let u: Vec<f64> = white
        .iter()
        .map(|w| {
            state = colour * state + (1.0 - colour * colour).sqrt() * w;
            state
        })
        .collect();
    let model = truth();
    let sections = model.sections.iter().map(|section| Section { b: section.k, ..*section }).collect();
    let noise = InnovationsModel { sections, feedthrough: 1.0, sample_time_s: 1.0 };
    let e = noise.simulate(&white_noise(samples, sigma, 5000 + seed), &[0.0; 4]).unwrap();
    let y: Vec<f64> = model.simulate(&u, &[0.0; 4]).unwrap().iter().zip(e).map(|(y, e)| y + e).collect();
    let scaled = |x: &[f64]| {
        let peak = x.iter().fold(0.0_f64, |peak, x| peak.max(x.abs()));
        x.iter().map(|x| x / peak).collect::<Vec<f64>>()
    };
    (scaled(&u), scaled(&y))
}

/// Singular values and poles by the definitions, window by window: `O = W_p L` with L from the regression of `Y_f` on
/// `W_p` beside `[1; U_f]`, weighted as in Van Overschee and De Moor, Table 4.1.
fn by_definition(u: &[f64], y: &[f64], s: usize, weight: Weight) -> (Vec<f64>, Vec<c64>) {
    let windows = y.len() - 2 * s + 1;
    let hankel = |x: &[f64], from: usize| Mat::from_fn(windows, s, |t, j| x[from + t + j]);
    let beside = |x: &Mat<f64>, y: &Mat<f64>| {
        let own = x.ncols();
        Mat::from_fn(windows, own + y.ncols(), |t, j| if j < own { x[(t, j)] } else { y[(t, j - own)] })
    };
    let future_input = beside(&Mat::from_fn(windows, 1, |_, _| 1.0), &hankel(u, s));
    let past = beside(&hankel(u, 0), &hankel(y, 0));
    let without =
        |x: &Mat<f64>| x - product(future_input.as_ref(), least_squares(&future_input, x, 1e-13).unwrap().as_ref());
    let (past_only, future_only) = (without(&past), without(&hankel(y, s)));
    let l = least_squares(&past_only, &future_only, 1e-13).unwrap();
    let (weighted, back) = match weight {
        Weight::N4sid => (product(past.as_ref(), l.as_ref()), None),
        Weight::Moesp => (product(past_only.as_ref(), l.as_ref()), None),
        Weight::Release => unreachable!("without instruments"),
        Weight::Cva => {
            let root = Svd::new(&future_only).unwrap();
            let power = |p: i32| {
                let half = Mat::from_fn(s, s, |i, k| root.v[(i, k)] * root.s[k].powi(p));
                product(half.as_ref(), root.v.transpose())
            };
            let o = product(past_only.as_ref(), l.as_ref());
            (product(o.as_ref(), power(-1).as_ref()), Some(power(1)))
        }
    };
    let svd = Svd::new(&weighted).unwrap();
    let left = back.map_or(svd.v.clone(), |back| product(back.as_ref(), svd.v.as_ref()));
    (svd.s, shift_invariant_poles(&left, 4).unwrap())
}

fn farthest(found: &[c64], wanted: &[c64]) -> f64 {
    let nearest = |p: &c64| found.iter().map(|z| (z - p).norm()).fold(f64::MAX, f64::min);
    wanted.iter().map(nearest).fold(0.0, f64::max)
}

#[test]
fn every_weight_is_what_its_definition_says() {
    let (u, y) = record(400, 0.8, 0.5, 3);
    for weight in WEIGHTS {
        let estimate = Subspace::with_instruments(&u, &y, 8, weight).unwrap();
        let (singular_values, poles) = by_definition(&u, &y, 8, weight);
        for (fast, slow) in estimate.singular_values().iter().zip(&singular_values) {
            // rounding over the conditioning of a coloured input's 8 rows, 1e3
            assert!((fast - slow).abs() < 1e-10 * singular_values[0], "{weight:?}: {fast} {slow}");
        }
        assert!(farthest(&estimate.poles(4).unwrap(), &poles) < 1e-9, "{weight:?}");
        // each is another decomposition than the other two
        for other in WEIGHTS.into_iter().filter(|other| *other != weight) {
            let (values, others) = by_definition(&u, &y, 8, other);
            assert!((values[0] / singular_values[0] - 1.0).abs() > 0.01, "{weight:?} {other:?}");
            assert!(farthest(&others, &poles) > 1e-4, "{weight:?} {other:?}");
        }
    }
    // canonical correlations
    let estimate = Subspace::with_instruments(&u, &y, 8, Weight::Cva).unwrap();
    assert!(estimate.singular_values().iter().all(|s| (0.0..=1.0 + 1e-12).contains(s)));
}

#[test]
fn the_weights_agree_for_white_inputs_and_part_for_coloured_ones() {
    let true_poles: Vec<c64> = truth().sections.iter().flat_map(Section::poles).collect();
    let rms = |colour: f64, rows: usize| -> Vec<f64> {
        let seeds: Vec<u64> = (0..60).collect();
        let errors: Vec<Vec<f64>> = seeds
            .par_iter()
            .map(|&seed| {
                let (u, y) = record(800, colour, 0.5, seed);
                let error = |weight| {
                    let estimate = Subspace::with_instruments(&u, &y, rows, weight).unwrap();
                    farthest(&estimate.poles(4).unwrap(), &true_poles)
                };
                WEIGHTS.into_iter().map(error).collect()
            })
            .collect();
        let of = |i: usize| (errors.iter().map(|e| e[i] * e[i]).sum::<f64>() / errors.len() as f64).sqrt();
        (0..3).map(of).collect()
    };
    let (white, coloured) = (rms(0.0, 25), rms(0.95, 25));
    println!("weights: white {white:.5?}, coloured {coloured:.5?}");
    // a white input's future is orthogonal to the past but for 1 / sqrt(800): removing it or not is the same; one
    // record each, so that no scatter of seeds is in the ratio
    assert!((white[1] / white[0] - 1.0).abs() < 0.01, "{white:?}");
    // a coloured one's is not: what N4SID keeps of it is noise to the others
    assert!(coloured[1] < 0.98 * coloured[0], "{coloured:?}");
    // canonical variates gain where the noise is coloured, whatever the input
    assert!(white[2] < 0.96 * white[1] && coloured[2] < 0.96 * coloured[1], "{white:?} {coloured:?}");
}
