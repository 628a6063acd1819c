//! Relocation of the poles: relaxed vector fitting.

use crate::linear_algebra::eigenvalues;
use faer::c64;

use super::VectorFitting;
use super::basis::Poles;
use super::linear::{Points, solved};
use crate::model::ModelError;

/// Least d~ that is divided by (Gustavsen 2006, section VI): smaller ones send poles to infinity.
const LEAST: f64 = 1e-8;
/// Largest move of a pole, in the z plane, that counts as none: a thousandth of a 1-ppm frequency error at an angle of
/// one.
const SETTLED: f64 = 1e-9;

/// Poles after at most the wanted relocations, and how many it took. Errors: no finite solution.
pub(super) fn relocated(
    points: &Points,
    mut poles: Poles,
    settings: &VectorFitting,
) -> Result<(Poles, usize), ModelError> {
    for step in 1..=settings.iterations {
        let mut next = next_poles(points, &poles)?;
        if settings.stable {
            next = next.reflected();
        }
        let moved = farthest(&next.0, &poles.0);
        poles = next;
        if moved < SETTLED {
            return Ok((poles, step));
        }
    }
    Ok((poles, settings.iterations))
}

/// Largest distance of a pole from the nearest old one.
fn farthest(next: &[c64], old: &[c64]) -> f64 {
    let nearest = |p: &c64| old.iter().map(|q| (p - q).norm()).fold(f64::MAX, f64::min);
    next.iter().map(nearest).fold(0.0, f64::max)
}

/// Zeros of sigma: `sum c phi + d [+ turn (sum t phi + t0)] - G (sum c~ phi + d~) = 0`, with the sum of sigma over the
/// points fixed (Eq. 9 of 2006).
fn next_poles(points: &Points, poles: &Poles) -> Result<Poles, ModelError> {
    let (count, n) = (points.len(), poles.all().len());
    let numerators = if points.turn.is_some() { 2 } else { 1 };
    let first = numerators * (n + 1);
    let columns = first + n + 1;
    let mut sums = vec![0.0; n + 1];
    let values: Vec<Vec<c64>> = points
        .z
        .iter()
        .map(|&z| {
            let mut row = poles.values(z);
            row.push(c64::new(1.0, 0.0));
            sums.iter_mut().zip(&row).for_each(|(sum, value)| *sum += value.re);
            row
        })
        .collect();
    let mut stacked = points.rows(columns + 1, 1, |k| {
        let mut row = values[k].clone();
        if let Some(turn) = &points.turn {
            row.extend(values[k].iter().map(|value| value * turn[k]));
        }
        row.extend(values[k].iter().map(|value| -value * points.g[k]));
        row
    });
    // the constraint weighs as much as the response does (Gustavsen 2006, Eq. 8)
    let level =
        points.g.iter().zip(&points.weight).map(|(g, w)| w * w * g.norm_sqr()).sum::<f64>().sqrt() / count as f64;
    sums.iter().enumerate().for_each(|(j, sum)| stacked[(2 * count, first + j)] = level * sum);
    stacked[(2 * count, columns)] = level * count as f64;
    let x = solved(stacked)?;
    let d = x[columns - 1];
    let d = if d.abs() < LEAST { LEAST.copysign(d) } else { d };
    Ok(Poles::new(&eigenvalues(&poles.zero_matrix(&x[first..columns - 1], d))?))
}
