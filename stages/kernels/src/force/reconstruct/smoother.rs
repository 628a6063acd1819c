//! The fixed-interval smoother, backwards over the filter's factors.

use super::filter::{Filtered, Strengths, add_noise};
use super::system::Augmented;
use super::triangle::Rows;

/// Smoothed force and its standard deviation in units of the measurement noise, per sample.
///
/// # Method
/// Rauch, Tung and Striebel in factors: `[F S, G; S, 0]` made triangular gives `[X, 0; Y, Z]` with the gain `J = Y
/// X^-1` and the part `Z Z'` of the filtered covariance that the future cannot tell; the smoothed factor is `[Z, J S+]`
/// made triangular. A sum of squares throughout.
///
/// # Source
/// H. Rauch, F. Tung, C. Striebel, AIAA J. 3 (1965) 1445; P. Park, T. Kailath, IEEE Trans. Autom. Control 40 (1995)
/// 727.
pub(super) fn smooth(
    system: &Augmented,
    y: &[f64],
    strengths: &Strengths,
    filtered: &Filtered,
) -> (Vec<f64>, Vec<f64>) {
    let (m, n) = (system.size, y.len());
    let (mut mean, mut std) = (vec![0.0; n], vec![0.0; n]);
    let (Some(last), Some(factor)) = (filtered.mean.last(), filtered.factor.last()) else { return (mean, std) };
    let (mut z, mut s) = (last.clone(), factor.clone());
    let norm = |row: &[f64]| row.iter().map(|x| x * x).sum::<f64>().sqrt();
    (mean[n - 1], std[n - 1]) = (z[system.order], norm(s.row(system.order)));
    let (mut stacked, mut joined) = (Rows::zeros(2 * m, m + 2), Rows::zeros(m, m + 2));
    for t in (0..n - 1).rev() {
        let own = &filtered.factor[t];
        system.propagate(own, &mut stacked);
        add_noise(&mut stacked, system, strengths, t);
        for i in 0..m {
            stacked.row_mut(m + i)[..m].copy_from_slice(own.row(i));
        }
        stacked.triangularise(m);
        let predicted = system.advance(&filtered.mean[t], y[t]);
        let ahead: Vec<f64> = z.iter().zip(&predicted).map(|(z, p)| z - p).collect();
        z.clone_from(&filtered.mean[t]);
        for (i, z) in z.iter_mut().enumerate() {
            let gain = gain_row(&stacked, i, m);
            *z += gain.iter().zip(&ahead).map(|(j, d)| j * d).sum::<f64>();
            let row = joined.row_mut(i);
            row[..m].fill(0.0);
            for (k, j) in gain.iter().enumerate() {
                row[..=k].iter_mut().zip(&s.row(k)[..=k]).for_each(|(x, s)| *x += j * s);
            }
            row[m..].copy_from_slice(&stacked.row(m + i)[m..]);
        }
        joined.triangularise(m);
        (0..m).for_each(|i| s.row_mut(i)[..=i].copy_from_slice(&joined.row(i)[..=i]));
        (mean[t], std[t]) = (z[system.order], norm(&s.row(system.order)[..=system.order]));
    }
    (mean, std)
}

/// Row `i` of `J = Y X^-1`, X lower triangular: from the last column on. A direction that nothing moves has no gain.
fn gain_row(stacked: &Rows, i: usize, m: usize) -> Vec<f64> {
    let mut gain = stacked.row(m + i)[..m].to_vec();
    for j in (0..m).rev() {
        let pivot = stacked.row(j)[j];
        gain[j] = if pivot == 0.0 { 0.0 } else { gain[j] / pivot };
        let g = gain[j];
        gain[..j].iter_mut().zip(&stacked.row(j)[..j]).for_each(|(x, l)| *x -= g * l);
    }
    gain
}
