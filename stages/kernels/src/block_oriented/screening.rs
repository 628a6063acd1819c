//! The cheap score of a division: only the curve is fitted.

use faer::Mat;

use super::curve::Curve;
use super::model::{BlockModel, Structure};
use super::rational::Rational;
use super::splits::Split;
use crate::linear_algebra::{gram_of, symmetric_inverse};

/// A stretch of the record, of which the first samples are not scored.
#[derive(Debug, Clone, Copy)]
pub(super) struct Stretch<'a> {
    pub u: &'a [f64],
    pub y: &'a [f64],
    pub skipped: usize,
}

impl Stretch<'_> {
    /// Samples that are scored.
    pub fn scored(&self) -> usize {
        self.y.len().saturating_sub(self.skipped)
    }
}

/// A model with the mean square that it leaves.
#[derive(Debug, Clone)]
pub(super) struct Candidate {
    pub structure: Structure,
    pub model: BlockModel,
    pub mean_square: f64,
}

impl Candidate {
    /// Its linear parts with the curve on so many knots that leaves least; none without a finite one.
    pub fn with_knots(&self, knots: usize, stretch: Stretch<'_>) -> Option<Self> {
        with_best_curve(self.structure, &self.model.first, &self.model.second, stretch, knots)
    }

    /// Schwarz's criterion: the lower of two models is the better one by its residual and its number of parameters.
    pub fn criterion(&self, stretch: Stretch<'_>) -> f64 {
        let n = stretch.scored() as f64;
        n * self.mean_square.ln() + self.model.vector().len() as f64 * n.ln()
    }
}

/// The model of this division whose curve leaves least; none without a finite one.
pub(super) fn screened(split: &Split, stretch: Stretch<'_>, knots: usize) -> Option<Candidate> {
    let first = Rational::from_roots(&split.first.0, &split.first.1)?;
    let second = Rational::from_roots(&split.second.0, &split.second.1)?;
    with_best_curve(split.structure, &first, &second, stretch, knots)
}

/// These linear parts with the curve that leaves least on the stretch, by linear least squares: on so many knots over
/// the range of its abscissa. None without a finite one.
fn with_best_curve(
    structure: Structure,
    first: &Rational,
    second: &Rational,
    stretch: Stretch<'_>,
    knots: usize,
) -> Option<Candidate> {
    let before = first.filter(stretch.u);
    let curve = Curve::over(&before, knots);
    let columns: Vec<Vec<f64>> = curve.basis(&before).iter().map(|column| second.filter(column)).collect();
    let mut slices: Vec<&[f64]> = columns.iter().map(|column| &column[stretch.skipped..]).collect();
    slices.push(&stretch.y[stretch.skipped..]);
    let products = gram_of(&slices);
    let inverse = symmetric_inverse(&Mat::from_fn(knots, knots, |i, j| products[(i, j)]));
    let value = |i: usize| (0..knots).map(|j| inverse[(i, j)] * products[(j, knots)]).sum::<f64>();
    let values: Vec<f64> = (0..knots).map(value).collect();
    let explained: f64 = values.iter().enumerate().map(|(i, value)| value * products[(i, knots)]).sum();
    let mean_square = (products[(knots, knots)] - explained) / stretch.scored() as f64;
    if !mean_square.is_finite() {
        return None;
    }
    let (first, second) = (first.clone(), second.clone());
    let model = BlockModel { first, curve: curve.at(&values), second }.normalised(stretch.u);
    Some(Candidate { structure, model, mean_square })
}
