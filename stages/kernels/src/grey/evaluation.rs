//! Variable projection: all that enters linearly is solved for at every trial of modes, poles and delay.
//!
//! G. H. Golub and V. Pereyra, Inverse Problems 19 (2003) R1, with L. Kaufman's Jacobian (BIT 15 (1975) 49), on
//! triangles that stand for the samples.

use crate::linear_algebra::{Qr, product};
use faer::{Mat, MatRef};
use rayon::prelude::*;

use super::columns::{Series, triangle};
use super::fractions::Fractions;
use super::layout::{Layout, Linear, Weights, slopes};
use super::point::Point;
use super::rules::Rules;
use crate::effects::Intersample;
use crate::model::ModelError;
use crate::ringdown::Knowledge;

/// Everything but the parameters.
pub(super) struct Problem<'a> {
    pub series: Vec<Series<'a>>,
    pub layout: Layout,
    pub linear: Linear,
    pub between: Intersample,
    pub rules: Rules,
}

/// A trial with its linear parameters.
#[derive(Clone)]
pub(super) struct Evaluation {
    pub point: Point,
    pub shared: Vec<f64>,
    /// Which shared linear parameters are held: at their fixed value, or on a bound (-1, 1).
    pub held: Vec<Option<i8>>,
    /// Per experiment.
    pub own: Vec<Vec<f64>>,
    /// Sum of squares, and what all expectations add to it, times the noise's variance.
    pub cost: f64,
    pub triangles: Vec<Mat<f64>>,
}

/// The linearised problem at a trial: `R` of `[shared | point | residual]` over all experiments, each's own parameters
/// eliminated.
pub(super) struct Normal {
    /// Per experiment, before the expectations are added.
    pub parts: Vec<Mat<f64>>,
    /// All, expectations included.
    pub all: Mat<f64>,
    /// Shared linear parameters that are estimated.
    pub shared: Vec<usize>,
}

/// A diagonal below this share of its column is no information: some hundred roundings.
const NOTHING: f64 = 1e-12;

/// Solves `r x = right` for the leading columns; a direction without information gets nothing.
pub(super) fn solved(r: MatRef<'_, f64>, columns: usize, right: usize) -> Vec<f64> {
    let mut x = vec![0.0; columns];
    for i in (0..columns.min(r.nrows())).rev() {
        let norm = (0..=i).map(|k| r[(k, i)].powi(2)).sum::<f64>().sqrt();
        let known: f64 = (i + 1..columns).map(|k| r[(i, k)] * x[k]).sum();
        x[i] = if r[(i, i)].abs() > NOTHING * norm { (r[(i, right)] - known) / r[(i, i)] } else { 0.0 };
    }
    x
}

/// `R` of these combinations of a triangle's columns.
pub(super) fn combined(triangle: &Mat<f64>, columns: &[Vec<f64>]) -> Mat<f64> {
    let weights = Mat::from_fn(triangle.ncols(), columns.len(), |i, j| columns[j].get(i).copied().unwrap_or(0.0));
    let values = product(triangle.as_ref(), weights.as_ref());
    // at least as many rows as columns
    let rows = values.nrows().max(columns.len());
    Qr::new(Mat::from_fn(rows, columns.len(), |i, j| if i < values.nrows() { values[(i, j)] } else { 0.0 })).r()
}

/// The part of `r` from row and column `first` on.
fn below(r: &Mat<f64>, first: usize) -> Mat<f64> {
    Mat::from_fn(r.nrows() - first, r.ncols() - first, |i, j| r[(first + i, first + j)])
}

/// `R` of all of them, one above the other, and further rows.
fn stacked(parts: &[Mat<f64>], rows: &[Vec<f64>]) -> Mat<f64> {
    let width = parts.first().map_or(0, Mat::ncols);
    let mut all = Vec::new();
    for part in parts {
        all.extend((0..part.nrows()).map(|i| (0..width).map(|j| part[(i, j)]).collect::<Vec<f64>>()));
    }
    all.extend(rows.iter().cloned());
    all.resize(all.len().max(width), vec![0.0; width]);
    Qr::new(Mat::from_fn(all.len(), width, |i, j| all[i][j])).r()
}

impl Problem<'_> {
    /// Samples that count, all experiments together.
    pub fn present(&self) -> usize {
        self.series.iter().map(Series::present).sum()
    }

    /// Own parameters of an experiment.
    pub fn own_count(&self) -> usize {
        let initial = if self.layout.initial { 2 * self.layout.modes + self.layout.poles } else { 0 };
        initial + usize::from(self.linear.offset) + usize::from(self.linear.slope)
    }

    /// Parameters that are estimated, held ones not counted.
    pub fn estimated(&self, evaluation: &Evaluation) -> usize {
        let shared = evaluation.held.iter().filter(|h| h.is_none()).count();
        self.rules.free.len() + shared + self.series.len() * self.own_count()
    }

    /// Variance of what is left.
    pub fn variance(&self, evaluation: &Evaluation) -> f64 {
        let freedom = self.present().saturating_sub(self.estimated(evaluation)).max(1);
        (evaluation.cost / freedom as f64).max(f64::MIN_POSITIVE)
    }

    /// What the linear parameters of an experiment have in its raw columns.
    pub fn weights(&self, fractions: &Fractions, series: &Series<'_>) -> Weights {
        Weights::of(self.layout, fractions, self.linear, &series.levels)
    }

    /// The output less what is held.
    fn target(&self, weights: &Weights, shared: &[f64], held: &[Option<i8>]) -> Vec<f64> {
        let mut target = vec![0.0; self.layout.width() + 1];
        for ((w, value), _) in weights.shared.iter().zip(shared).zip(held).filter(|(_, h)| h.is_some()) {
            target.iter_mut().zip(w).for_each(|(t, w)| *t -= value * w);
        }
        target[self.layout.width()] = 1.0;
        target
    }

    /// Solves for the linear parameters. Errors: nothing finite.
    pub fn evaluate(&self, point: &Point, variance: f64) -> Result<Evaluation, ModelError> {
        let fractions = Fractions::of(point);
        let triangles: Vec<Mat<f64>> = self
            .series
            .par_iter()
            .map(|series| triangle(series, self.layout, &fractions, point.delay, self.between))
            .collect();
        let count = self.rules.linear.len();
        let (mut shared, mut held) = (vec![0.0; count], vec![None; count]);
        for (i, known) in self.rules.linear.iter().enumerate() {
            if let Knowledge::Fixed(value) = known {
                (shared[i], held[i]) = (*value, Some(0));
            }
        }
        let weights: Vec<Weights> = self.series.iter().map(|s| self.weights(&fractions, s)).collect();
        // one more round for each bound that is met
        loop {
            let free: Vec<usize> = (0..count).filter(|&i| held[i].is_none()).collect();
            let solution = self.solve(&triangles, &weights, &free, &shared, &held, variance);
            free.iter().zip(&solution.shared).for_each(|(&i, value)| shared[i] = *value);
            let beyond = free.iter().filter_map(|&i| match self.rules.linear[i] {
                Knowledge::Between(least, _) if shared[i] < least => Some((i, least, -1, least - shared[i])),
                Knowledge::Between(_, most) if shared[i] > most => Some((i, most, 1, shared[i] - most)),
                _ => None,
            });
            if let Some((i, bound, side, _)) = beyond.max_by(|a, b| a.3.total_cmp(&b.3)) {
                (shared[i], held[i]) = (bound, Some(side));
                continue;
            }
            let cost = solution.cost + variance * self.rules.distance(&point.values());
            let finite = cost.is_finite() && shared.iter().chain(solution.own.iter().flatten()).all(|v| v.is_finite());
            if !finite {
                return Err(ModelError::Degenerate("the linear parameters are not finite"));
            }
            return Ok(Evaluation { point: point.clone(), shared, held, own: solution.own, cost, triangles });
        }
    }

    fn solve(
        &self,
        triangles: &[Mat<f64>],
        weights: &[Weights],
        free: &[usize],
        shared: &[f64],
        held: &[Option<i8>],
        variance: f64,
    ) -> Solution {
        let own = self.own_count();
        let parts: Vec<Mat<f64>> = triangles
            .iter()
            .zip(weights)
            .map(|(triangle, w)| {
                let mut columns = w.own.clone();
                columns.extend(free.iter().map(|&i| w.shared[i].clone()));
                columns.push(self.target(w, shared, held));
                combined(triangle, &columns)
            })
            .collect();
        let rest: Vec<Mat<f64>> = parts.iter().map(|r| below(r, own)).collect();
        let all = stacked(&rest, &self.expected_gains(free, 0, shared, variance));
        let found = solved(all.as_ref(), free.len(), free.len());
        let left = |i: usize| {
            let fitted: f64 = (i..free.len()).map(|j| all[(i, j)] * found[j]).sum();
            (all[(i, free.len())] - fitted).powi(2)
        };
        let cost = (0..all.nrows()).map(left).sum();
        let own = parts
            .iter()
            .map(|r| {
                let moved = Mat::from_fn(own, own + 1, |i, j| match j < own {
                    true => r[(i, j)],
                    false => r[(i, r.ncols() - 1)] - (0..free.len()).map(|k| r[(i, own + k)] * found[k]).sum::<f64>(),
                });
                solved(moved.as_ref(), own, own)
            })
            .collect();
        Solution { shared: found, own, cost }
    }

    /// Rows for what is expected of gains, `further` columns behind them.
    fn expected_gains(&self, free: &[usize], further: usize, at: &[f64], variance: f64) -> Vec<Vec<f64>> {
        let row = |(column, &i): (usize, &usize)| match self.rules.linear[i] {
            Knowledge::About(mean, std) => {
                let mut row = vec![0.0; free.len() + further + 1];
                let weight = variance.sqrt() / std;
                row[column] = weight;
                // a linearised problem is one in steps from `at`; here zero steps belong to `at` = 0
                let here = if further == 0 { 0.0 } else { at[i] };
                row[free.len() + further] = weight * (mean - here);
                Some(row)
            }
            _ => None,
        };
        free.iter().enumerate().filter_map(row).collect()
    }

    /// The linearised problem at a trial, in steps from it.
    pub fn normal(&self, at: &Evaluation, variance: f64) -> Normal {
        let fractions = Fractions::of(&at.point);
        let free: Vec<usize> = (0..at.shared.len()).filter(|&i| at.held[i].is_none()).collect();
        let parts: Vec<Mat<f64>> = (0..self.series.len())
            .map(|e| {
                let (columns, own) = self.jacobian(at, &fractions, &free, e);
                below(&combined(&at.triangles[e], &columns), own)
            })
            .collect();
        let (first, width) = (free.len(), free.len() + self.rules.free.len() + 1);
        let mut rows = self.expected_gains(&free, self.rules.free.len(), &at.shared, variance);
        let values = at.point.values();
        for (column, &i) in self.rules.free.iter().enumerate() {
            let Some(expected) = self.rules.expected[i] else { continue };
            let weight = variance.sqrt() / expected.std;
            let mut row = vec![0.0; width];
            row[first + column] = weight * self.rules.slope(i, values[i]);
            row[width - 1] = weight * (expected.mean - self.rules.number(i, values[i]));
            rows.push(row);
        }
        let all = stacked(&parts, &rows);
        Normal { parts, all, shared: free }
    }

    /// Raw weights of own, shared and point's columns and of the residual; and how many are own.
    pub fn jacobian(
        &self,
        at: &Evaluation,
        fractions: &Fractions,
        free: &[usize],
        experiment: usize,
    ) -> (Vec<Vec<f64>>, usize) {
        let weights = self.weights(fractions, &self.series[experiment]);
        let by_point = slopes(self.layout, fractions, self.linear.feedthrough, &at.shared, &at.own[experiment]);
        let mut residual = vec![0.0; self.layout.width() + 1];
        let fitted = weights.shared.iter().zip(&at.shared).chain(weights.own.iter().zip(&at.own[experiment]));
        for (w, value) in fitted {
            residual.iter_mut().zip(w).for_each(|(r, w)| *r -= value * w);
        }
        residual[self.layout.width()] = 1.0;
        let own = weights.own.len();
        let mut columns = weights.own;
        columns.extend(free.iter().map(|&i| weights.shared[i].clone()));
        columns.extend(self.rules.free.iter().map(|&i| by_point[i].clone()));
        columns.push(residual);
        (columns, own)
    }
}

struct Solution {
    shared: Vec<f64>,
    own: Vec<Vec<f64>>,
    cost: f64,
}
