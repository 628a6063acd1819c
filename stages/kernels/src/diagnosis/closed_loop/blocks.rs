//! Least squares on blocks of rows: one factorisation serves every subset of columns and every block left out.

use crate::Mat;
use crate::linear_algebra::{Qr, TallQr};

/// Share of a column's length below which it is a combination of those before it: rounding.
const DEPENDENT: f64 = 1e-12;

/// Triangles of `[columns | target]`, block by block.
pub(super) struct BlockedRegression {
    /// Columns, then the target; all scaled to at most 1.
    triangles: Vec<Mat<f64>>,
    scale: Vec<f64>,
}

/// Coefficients and the length of what they leave.
pub(super) struct Solved {
    /// In the order of the columns that were asked for.
    pub coefficients: Vec<f64>,
    /// Sum of squares that is left.
    pub squares: f64,
}

impl BlockedRegression {
    /// Rows in consecutive blocks of about equal size; `keep` says which rows count.
    pub fn new(columns: &[Vec<f64>], target: &[f64], keep: &[bool], blocks: usize) -> Self {
        let all: Vec<&[f64]> = columns.iter().map(Vec::as_slice).chain([target]).collect();
        let most = |x: &&[f64]| x.iter().fold(0.0_f64, |most, x| most.max(x.abs()));
        let scale: Vec<f64> = all.iter().map(most).map(|most| if most > 0.0 { most } else { 1.0 }).collect();
        let triangle = |b: usize| {
            let range = b * target.len() / blocks..(b + 1) * target.len() / blocks;
            let rows: Vec<usize> = range.filter(|&k| keep.get(k).copied().unwrap_or(false)).collect();
            let entry = |i: usize, j: usize| all[j].get(rows[i]).copied().unwrap_or(0.0) / scale[j];
            TallQr::triangle(Mat::from_fn(rows.len(), all.len(), entry).as_ref())
        };
        let triangles = (0..blocks).map(triangle).collect();
        Self { triangles, scale }
    }

    /// How many blocks.
    pub fn blocks(&self) -> usize {
        self.triangles.len()
    }

    /// Coefficients of the columns `which`, one block left out or none; a dependent column gets 0.
    pub fn solve(&self, which: &[usize], without: Option<usize>) -> Solved {
        let size = self.scale.len();
        let target = size - 1;
        let used: Vec<&Mat<f64>> =
            self.triangles.iter().enumerate().filter(|(b, _)| Some(*b) != without).map(|(_, r)| r).collect();
        let places: Vec<usize> = which.iter().copied().chain([target]).collect();
        let stacked = Mat::from_fn(used.len() * size, places.len(), |i, j| used[i / size][(i % size, places[j])]);
        let length = |j: usize| stacked.col(j).iter().map(|x| x * x).sum::<f64>().sqrt();
        let lengths: Vec<f64> = (0..places.len()).map(length).collect();
        let r = Qr::new(stacked).r();
        let n = which.len();
        let mut coefficients = vec![0.0; n];
        for i in (0..n).rev() {
            if r[(i, i)].abs() > DEPENDENT * lengths[i] {
                let known: f64 = (i + 1..n).map(|j| r[(i, j)] * coefficients[j]).sum();
                coefficients[i] = (r[(i, n)] - known) / r[(i, i)];
            }
        }
        for (value, &j) in coefficients.iter_mut().zip(which) {
            *value *= self.scale[target] / self.scale[j];
        }
        let squares = used.iter().map(|block| self.left(block, which, &coefficients)).sum();
        Solved { coefficients, squares }
    }

    /// Sum of squares that given coefficients leave in one block.
    pub fn squares(&self, block: usize, which: &[usize], coefficients: &[f64]) -> f64 {
        self.triangles.get(block).map_or(0.0, |triangle| self.left(triangle, which, coefficients))
    }

    /// Sum of squares of all blocks, each left by coefficients from the others.
    pub fn held_out(&self, which: &[usize]) -> f64 {
        let one = |b: usize| self.squares(b, which, &self.solve(which, Some(b)).coefficients);
        (0..self.blocks()).map(one).sum()
    }

    fn left(&self, triangle: &Mat<f64>, which: &[usize], coefficients: &[f64]) -> f64 {
        let target = self.scale.len() - 1;
        let row = |i: usize| {
            let sum: f64 = which.iter().zip(coefficients).map(|(&j, c)| triangle[(i, j)] * c * self.scale[j]).sum();
            (triangle[(i, target)] * self.scale[target] - sum).powi(2)
        };
        (0..triangle.nrows()).map(row).sum()
    }
}

/// Standard errors of a jackknife: values with each block left out in turn.
pub(super) fn jackknife(left_out: &[Vec<f64>]) -> Vec<f64> {
    let count = left_out.len() as f64;
    let unknowns = left_out.iter().map(Vec::len).min().unwrap_or(0);
    let std = |i: usize| {
        let mean = left_out.iter().map(|x| x[i]).sum::<f64>() / count;
        ((count - 1.0) / count * left_out.iter().map(|x| (x[i] - mean).powi(2)).sum::<f64>()).sqrt()
    };
    (0..unknowns).map(std).collect()
}
