//! Starting poles: least squares of a common denominator over all responses, order by order.

use faer::{Mat, c64};
use rayon::prelude::*;

use super::FrfModesOptions;
use super::data::Lines;
use crate::linear_algebra::{NoConvergence, eigenvalues, product, symmetric_inverse};
use crate::model::ModelError;
use crate::stabilisation::{Stabilisation, stabilisation};

/// Square roots of weights are kept within this of the largest: the normal equations then keep eight digits.
const SPAN: f64 = 1e-3;

/// Poles of every order, s plane, and what is stable among them.
pub(super) struct Diagram {
    pub found: Stabilisation,
    /// The same poles, with the order of each.
    pub poles: Vec<(usize, c64)>,
}

/// The diagram of orders up to the largest. Errors: no convergence.
///
/// The band lies on the upper half of the unit circle, `z = exp(i pi (f - f_1) / (f_K - f_1))`, and coefficients are
/// real. With the lowest coefficient held at one, poles that only noise needs lie outside the circle.
pub(super) fn diagram(lines: &Lines, options: &FrfModesOptions) -> Result<Diagram, ModelError> {
    let (first, last) = (lines.frequency_hz[0], lines.frequency_hz[lines.len() - 1]);
    let largest = options.max_order.min(lines.len() / 3).max(4);
    let normal = denominator_equations(lines, largest, first, last - first);
    let interval = 0.5 / (last - first);
    let orders: Vec<usize> = (2..=largest).step_by(2).collect();
    let by_order: Result<Vec<Vec<c64>>, NoConvergence> = orders
        .par_iter()
        .map(|&order| {
            let upper = roots(&normal, order)?.into_iter().filter(|z| z.im > 0.0 && z.norm() > 0.0);
            let s = |z: c64| {
                let turned = z.ln() / interval;
                // the window's decay is off the poles, as it is off `p`
                turned + c64::new(options.added_decay_per_s, std::f64::consts::TAU * first)
            };
            Ok(upper.map(s).collect())
        })
        .collect();
    let by_order = by_order?;
    // an interval at which no pole of the band is aliased, for a diagram of sampled models
    let slower = 0.49 / last;
    let sampled = |s: &c64| (s * slower).exp();
    let candidates: Vec<(usize, Vec<c64>)> =
        orders.iter().zip(&by_order).map(|(order, poles)| (*order, poles.iter().map(sampled).collect())).collect();
    let found = stabilisation(&candidates, slower, &options.criteria())?;
    let mut poles: Vec<(usize, c64)> =
        orders.iter().zip(by_order).flat_map(|(order, own)| own.into_iter().map(|s| (*order, s))).collect();
    // as the diagram lists them: by order, then by magnitude
    poles.sort_by(|x, y| x.0.cmp(&y.0).then(x.1.norm().total_cmp(&y.1.norm())));
    Ok(Diagram { found, poles })
}

/// Normal equations of the denominator, numerators of the largest order eliminated: sum of `T - S^T R^-1 S`.
fn denominator_equations(lines: &Lines, order: usize, from_hz: f64, band_hz: f64) -> Mat<f64> {
    let angle: Vec<f64> = lines.frequency_hz.iter().map(|f| std::f64::consts::PI * (f - from_hz) / band_hz).collect();
    let of = |r: usize| {
        let transfer = &lines.transfer[r];
        let most = lines.weight[r].iter().copied().fold(0.0, f64::max);
        let floor = SPAN * SPAN * most;
        let weight: Vec<f64> = lines.weight[r].iter().map(|w| if *w > 0.0 { w.max(floor) } else { 0.0 }).collect();
        // sums over the lines by lag: w cos, w |H|^2 cos, and w Re(H exp(i lag angle)) for both signs of the lag
        let mut sums = vec![[0.0; 4]; order + 1];
        for ((w, h), angle) in weight.iter().zip(transfer).zip(&angle) {
            let turn = c64::cis(*angle);
            let mut z = c64::new(1.0, 0.0);
            for sum in &mut sums {
                sum[0] += w * z.re;
                sum[1] += w * h.norm_sqr() * z.re;
                sum[2] += w * (h * z).re;
                sum[3] += w * (h * z.conj()).re;
                z *= turn;
            }
        }
        let n = order + 1;
        let r = Mat::from_fn(n, n, |i, j| sums[i.abs_diff(j)][0]);
        let t = Mat::from_fn(n, n, |i, j| sums[i.abs_diff(j)][1]);
        let s = Mat::from_fn(n, n, |i, j| -sums[i.abs_diff(j)][if j >= i { 2 } else { 3 }]);
        let taken = product(symmetric_inverse(&r).as_ref(), s.as_ref());
        t - product(s.transpose(), taken.as_ref())
    };
    let parts: Vec<Mat<f64>> = (0..lines.responses()).into_par_iter().map(of).collect();
    parts.into_iter().fold(Mat::zeros(order + 1, order + 1), |sum, part| sum + part)
}

/// Roots of the denominator of an order, its lowest coefficient one.
fn roots(normal: &Mat<f64>, order: usize) -> Result<Vec<c64>, NoConvergence> {
    let inverse = symmetric_inverse(&Mat::from_fn(order, order, |i, j| normal[(i + 1, j + 1)]));
    let coefficient = |i: usize| -(0..order).map(|j| inverse[(i, j)] * normal[(j + 1, 0)]).sum::<f64>();
    let all: Vec<f64> = std::iter::once(1.0).chain((0..order).map(coefficient)).collect();
    // companion matrix of 1 + a_1 x + .. in one over the root, which keeps a vanishing highest coefficient harmless
    let matrix = Mat::from_fn(order, order, |i, j| match i {
        0 => -all[j + 1],
        _ if i == j + 1 => 1.0,
        _ => 0.0,
    });
    Ok(eigenvalues(&matrix)?.into_iter().filter(|x| x.norm() > f64::MIN_POSITIVE).map(|x| x.inv()).collect())
}
