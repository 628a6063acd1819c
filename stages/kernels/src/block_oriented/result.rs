//! A fitted model with its errors.

use faer::{Mat, c64};

use super::model::{BlockModel, Structure};
use crate::linear_algebra::{cross_of, gram_of};

/// One structure and division of the poles that was tried.
#[derive(Debug, Clone, PartialEq)]
pub struct Tried {
    /// Its structure.
    pub structure: Structure,
    /// Its poles: those of the first part, then those of the second.
    pub description: String,
    /// Root mean square that it left of the output, on the part of the record where it was given up or on all of it.
    pub rms: f64,
    /// Whether it was refined on all of the record.
    pub on_all: bool,
}

/// A pole with its standard error.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct BlockPole {
    /// Whether it is the first part's.
    pub of_first: bool,
    /// In the z plane.
    pub z: c64,
    /// Root of the expected squared distance of the estimate.
    pub std: f64,
}

/// How far the curve bends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CurveStrength {
    /// Root mean square distance of the curve from its best straight line, over its own about its mean.
    pub relative: f64,
    /// What noise alone would make of it were the curve straight.
    pub std: f64,
}

/// The best model with what its estimate yields.
#[derive(Debug, Clone)]
pub struct BlockFit {
    /// The model.
    pub model: BlockModel,
    /// Its structure.
    pub structure: Structure,
    /// Root mean square of the output less the simulation, over what is scored.
    pub training_rms: f64,
    /// The same of the best linear model.
    pub linear_rms: f64,
    /// Covariance of [`BlockModel::vector`], for a residual of any colour.
    pub covariance: Mat<f64>,
    /// Every division that was refined, the best ones first.
    pub tried: Vec<Tried>,
    /// Covariance of the curve's values where both parts have a fixed gain: with a numerator coefficient held instead,
    /// errors of the scales would count as errors of the curve.
    pub(super) curve_covariance: Mat<f64>,
    /// Abscissas of the curve that the training input reaches, evenly over its samples.
    pub(super) used: Vec<f64>,
}

impl BlockFit {
    /// Standard errors of [`BlockModel::vector`].
    pub fn standard_errors(&self) -> Vec<f64> {
        (0..self.covariance.nrows()).map(|i| self.covariance[(i, i)].max(0.0).sqrt()).collect()
    }

    /// The poles of both parts with their standard errors.
    pub fn poles(&self) -> Vec<BlockPole> {
        let behind = self.model.first.parameters().len() + self.model.curve.values().len();
        let parts = [(true, &self.model.first, 0), (false, &self.model.second, behind)];
        let own = |(of_first, part, at): (bool, &super::Rational, usize)| {
            let error = |(place, slopes): (usize, Vec<c64>)| {
                let entry = |i: usize, j: usize| self.covariance[(at + place + i, at + place + j)];
                let sum = |i: usize| (0..slopes.len()).map(|j| (slopes[i] * slopes[j].conj()).re * entry(i, j)).sum();
                (0..slopes.len()).map(|i| -> f64 { sum(i) }).sum::<f64>().max(0.0).sqrt()
            };
            let errors: Vec<f64> = part.pole_slopes().into_iter().map(error).collect();
            let poles = part.poles().into_iter().zip(errors);
            poles.map(|(z, std)| BlockPole { of_first, z, std }).collect::<Vec<_>>()
        };
        parts.into_iter().flat_map(own).collect()
    }

    /// How far the curve bends from its best straight line, both over what the training input uses of it.
    ///
    /// Of a straight curve `relative` is near `std`; beyond some three of them it is a bend.
    pub fn curve_strength(&self) -> CurveStrength {
        let columns = self.model.curve.basis(&self.used);
        let values = self.model.curve.values();
        let n = self.used.len() as f64;
        let mean = |v: &[f64]| v.iter().sum::<f64>() / n;
        let about = |v: &[f64]| {
            let centre = mean(v);
            v.iter().map(|v| v - centre).collect::<Vec<_>>()
        };
        let line = about(&self.used);
        let power = line.iter().map(|x| x * x).sum::<f64>().max(f64::MIN_POSITIVE);
        let level: Vec<Vec<f64>> = columns.iter().map(|column| about(column)).collect();
        let slices: Vec<&[f64]> = level.iter().map(Vec::as_slice).collect();
        let (all, along) = (gram_of(&slices), cross_of(&slices, &[&line]));
        let bend = |i: usize, j: usize| all[(i, j)] - along[(i, 0)] * along[(j, 0)] / power;
        let quadratic = |of: &dyn Fn(usize, usize) -> f64| -> f64 {
            let count = values.len();
            (0..count).map(|i| (0..count).map(|j| values[i] * of(i, j) * values[j]).sum::<f64>()).sum()
        };
        let whole = quadratic(&|i, j| all[(i, j)]).max(f64::MIN_POSITIVE);
        let count = values.len();
        let noise: f64 =
            (0..count).map(|i| (0..count).map(|j| bend(i, j) * self.curve_covariance[(i, j)]).sum::<f64>()).sum();
        let share = |square: f64| (square.max(0.0) / whole).sqrt();
        CurveStrength { relative: share(quadratic(&bend)), std: share(noise) }
    }
}
