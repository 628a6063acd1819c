//! Amplitudes solved for: what is left of the records, and how it depends on the poles.

use faer::Mat;
use rayon::prelude::*;

use super::basis::{Poles, columns, own_count};
use super::records::{Group, Records};
use super::recursion::Recursion;
use crate::linear_algebra::{TallQr, product};

/// One record at some poles.
pub(super) struct Solved {
    /// Own amplitudes: Re and Im of each residue, offset, slope, in the channel's unit.
    pub own: Vec<f64>,
    /// Inverse of the triangle of their columns: own x own; its product with its transpose is their covariance at given
    /// poles.
    pub root: Mat<f64>,
    /// Change of the own amplitudes with the poles: own x shared.
    pub coupling: Mat<f64>,
    /// Information on the poles: shared x shared.
    pub information: Mat<f64>,
    /// Half the falling gradient.
    pub gradient: Vec<f64>,
    /// Whitened energy that is left.
    pub energy: f64,
}

/// All records at some poles, in their order.
pub(super) struct Projection {
    pub solved: Vec<Solved>,
}

impl Projection {
    /// # Method
    /// Variable projection: one orthogonal triangle of the whitened columns of amplitudes and poles with the records
    /// beside them, per group. Its first rows give the amplitudes, the next ones the derivative of what is left
    /// (Kaufman's), the rest its energy.
    /// # Source
    /// G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413; L. Kaufman, BIT 15 (1975) 49.
    pub fn of(records: &Records<'_>, groups: &[Group], poles: &Poles, unit_s: f64) -> Self {
        let parts: Vec<Vec<Solved>> =
            groups.par_iter().map(|group| solve_group(group, records, poles, unit_s)).collect();
        let mut all: Vec<Option<Solved>> = (0..records.all.len()).map(|_| None).collect();
        for (group, part) in groups.iter().zip(parts) {
            group.members.iter().zip(part).for_each(|(&member, solved)| all[member] = Some(solved));
        }
        Self { solved: all.into_iter().flatten().collect() }
    }

    /// Whitened energy that all records leave.
    pub fn energy(&self) -> f64 {
        self.solved.iter().map(|record| record.energy).sum()
    }

    /// Square of a mode's residues over their variance at given poles, of all records.
    pub fn strength(&self, mode: usize) -> f64 {
        let (i, j) = (2 * mode, 2 * mode + 1);
        self.solved
            .iter()
            .map(|record| {
                let of = |a: usize, b: usize| {
                    (0..record.own.len()).map(|k| record.root[(a, k)] * record.root[(b, k)]).sum::<f64>()
                };
                let (rr, ri, ii) = (of(i, i), of(i, j), of(j, j));
                let (re, im) = (record.own[i], record.own[j]);
                let square = (ii * re * re - 2.0 * ri * re * im + rr * im * im) / (rr * ii - ri * ri);
                if square.is_finite() { square.max(0.0) } else { 0.0 }
            })
            .sum()
    }

    /// Information on the poles and half the falling gradient, of all records.
    pub fn normal(&self) -> (Mat<f64>, Vec<f64>) {
        let shared = self.solved.first().map_or(0, |record| record.gradient.len());
        let mut information = Mat::<f64>::zeros(shared, shared);
        let mut gradient = vec![0.0; shared];
        for record in &self.solved {
            information += &record.information;
            gradient.iter_mut().zip(&record.gradient).for_each(|(g, own)| *g += own);
        }
        (information, gradient)
    }
}

fn solve_group(group: &Group, records: &Records<'_>, poles: &Poles, unit_s: f64) -> Vec<Solved> {
    let (modes, count) = (poles.0.len(), group.members.len());
    let own = own_count(modes, records.drift);
    let shared = 2 * modes;
    let quick = group.is_plain() && Recursion::pays(group.samples);
    let quick = if quick { by_recursion(group, records, poles, unit_s) } else { None };
    let r = quick.unwrap_or_else(|| of_all_rows(group, records, poles, unit_s));
    let root = inverse_of_upper(&r, own);
    let columns: Vec<usize> = (0..count).collect();
    let solve = |m: &usize| solve_record(&r, &root, own, own + shared + m, modes, group.scale[*m]);
    columns.par_iter().map(solve).collect()
}

/// Triangle of the whitened columns with the records beside them.
fn of_all_rows(group: &Group, records: &Records<'_>, poles: &Poles, unit_s: f64) -> Mat<f64> {
    let mut all = columns(poles, records.interval_s, unit_s, group.samples, records.drift);
    group.whiten(&mut all);
    let mut matrix = Mat::<f64>::zeros(group.samples, all.len() + group.members.len());
    for (j, column) in all.iter().chain(&group.signals).enumerate() {
        matrix.col_mut(j).iter_mut().zip(column).for_each(|(m, v)| *m = *v);
    }
    TallQr::triangle(matrix.as_ref())
}

/// The same of white noise: each record's energy outside the columns stands at its own row. None where columns are too
/// much alike for it.
fn by_recursion(group: &Group, records: &Records<'_>, poles: &Poles, unit_s: f64) -> Option<Mat<f64>> {
    let basis = Recursion::of(poles, records.interval_s, unit_s, group.samples, records.drift);
    let along: Option<Vec<(Vec<f64>, f64)>> = group.signals.par_iter().map(|signal| basis.along(signal)).collect();
    let along = along?;
    let width = basis.triangle().ncols();
    Some(Mat::from_fn(width + along.len(), width + along.len(), |i, j| match j.checked_sub(width) {
        None if i <= j => basis.triangle()[(i, j)],
        Some(record) if i < width => along[record].0[i],
        Some(record) if i == j => along[record].1,
        _ => 0.0,
    }))
}

/// One record's column of the triangle solved; its amplitudes times `scale` are in its unit.
fn solve_record(r: &Mat<f64>, root: &Mat<f64>, own: usize, column: usize, modes: usize, scale: f64) -> Solved {
    let shared = 2 * modes;
    let amplitudes: Vec<f64> = (0..own).map(|i| (i..own).map(|k| root[(i, k)] * r[(k, column)]).sum()).collect();
    // columns of the poles' changes for this record's residues: d/dRe s = (re, im), d/dIm s = (-im, re)
    let turned = |row: usize, parameter: usize| {
        let (j, imaginary) = (parameter / 2, parameter % 2 == 1);
        let (re, im) = (amplitudes[2 * j], amplitudes[2 * j + 1]);
        let (a, b) = if imaginary { (-im, re) } else { (re, im) };
        a * r[(row, own + 2 * j)] + b * r[(row, own + 2 * j + 1)]
    };
    let head = Mat::from_fn(own, shared, turned);
    let jacobian = Mat::from_fn(shared, shared, |i, j| turned(own + i, j));
    let left: Vec<f64> = (0..shared).map(|i| r[(own + i, column)]).collect();
    let information = product(jacobian.transpose(), jacobian.as_ref());
    let gradient = (0..shared).map(|j| (0..shared).map(|i| jacobian[(i, j)] * left[i]).sum()).collect();
    let coupling =
        Mat::from_fn(own, shared, |i, j| -scale * (i..own).map(|k| root[(i, k)] * head[(k, j)]).sum::<f64>());
    let energy = (own..=column).map(|i| r[(i, column)] * r[(i, column)]).sum();
    let own = amplitudes.iter().map(|a| scale * a).collect();
    let root = Mat::from_fn(root.nrows(), root.ncols(), |i, j| scale * root[(i, j)]);
    Solved { own, root, coupling, information, gradient, energy }
}

/// Inverse of the leading upper triangle; a column of rounding alone is held.
fn inverse_of_upper(r: &Mat<f64>, n: usize) -> Mat<f64> {
    let mut inverse = Mat::<f64>::zeros(n, n);
    for j in 0..n {
        let length = (0..=j).map(|i| r[(i, j)] * r[(i, j)]).sum::<f64>().sqrt();
        if r[(j, j)].abs() <= 1e-13 * length {
            continue;
        }
        inverse[(j, j)] = 1.0 / r[(j, j)];
        for i in (0..j).rev() {
            let sum: f64 = (i + 1..=j).map(|k| r[(i, k)] * inverse[(k, j)]).sum();
            inverse[(i, j)] = if r[(i, i)] == 0.0 { 0.0 } else { -sum / r[(i, i)] };
        }
    }
    inverse
}
