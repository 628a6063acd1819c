//! Sensitivities of the prediction errors to poles and predictor poles, by filters of second order.
//!
//! `de/da_ij = q^-j / a_i (H^-1 x_i + e)` with `x_i` section i's deterministic output: its filtered form is the regressors of section i
//! times their parameters, already at hand. `de/dc_ij = -q^-j / c_i e`.

use faer::Mat;

use super::parametrisation::{Coefficients, coordinates, roots, section_order, sections, slopes};
use super::predictor::{Problem, all_pole, delayed};

/// How the errors are whitened.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Noise {
    /// Not at all: K = 0, output error.
    White,
    /// By `prod a / c` of these coefficients, whatever the poles at hand.
    Frozen(Vec<Coefficients>, Vec<Coefficients>),
    /// By `prod a / c`, a at hand and c from these coordinates, which are estimated along.
    Free(Vec<f64>),
}

/// What enters the predictor nonlinearly, in unbounded coordinates.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Point {
    /// Coordinates of the poles (a).
    pub poles: Vec<f64>,
    /// How the errors are whitened.
    pub noise: Noise,
}

impl Point {
    /// How many coordinates.
    pub fn len(&self) -> usize {
        self.poles.len() + self.free().len()
    }

    /// All coordinates, poles first.
    pub fn coordinates(&self) -> Vec<f64> {
        self.poles.iter().chain(self.free()).copied().collect()
    }

    fn free(&self) -> &[f64] {
        if let Noise::Free(c) = &self.noise { c } else { &[] }
    }

    /// Coordinates of the predictor's poles, of a model of order `order`.
    pub fn predictor_coordinates(&self, order: usize) -> Vec<f64> {
        match &self.noise {
            Noise::White => self.poles.clone(),
            Noise::Frozen(_, c) => {
                let all = c.iter().enumerate().flat_map(|(i, &c)| roots(c, section_order(order, i)));
                coordinates(&all.collect::<Vec<_>>())
            }
            Noise::Free(c) => c.clone(),
        }
    }

    /// Coefficients of the poles.
    pub fn a(&self) -> Vec<Coefficients> {
        sections(&self.poles)
    }

    /// Numerator and denominator of the whitening filter at this point.
    pub fn whitening(&self) -> (Vec<Coefficients>, Vec<Coefficients>) {
        match &self.noise {
            Noise::White => (Vec::new(), Vec::new()),
            Noise::Frozen(a, c) => (a.clone(), c.clone()),
            Noise::Free(c) => (self.a(), sections(c)),
        }
    }

    /// The point with other coordinates, in the same order.
    pub fn at(&self, coordinates: &[f64]) -> Self {
        let (poles, rest) = coordinates.split_at(self.poles.len());
        let noise = if let Noise::Free(_) = self.noise { Noise::Free(rest.to_vec()) } else { self.noise.clone() };
        Self { poles: poles.to_vec(), noise }
    }
}

/// Prediction errors from the unscaled, filtered regressors and their parameters.
pub(crate) fn residual(regressors: &Mat<f64>, theta: &[f64]) -> Vec<f64> {
    let last = regressors.ncols() - 1;
    let mut e: Vec<f64> = regressors.col(last).iter().copied().collect();
    for (j, &value) in theta.iter().enumerate() {
        e.iter_mut().zip(regressors.col(j).iter()).for_each(|(e, x)| *e -= value * x);
    }
    e
}

/// Derivatives of e to the coefficients: a1, a2 of each section, then c1, c2 if these are free; rows x n or 2n.
///
/// Unless the whitening is free, it does not move with the poles.
pub(crate) fn coefficient_jacobian(
    problem: &Problem,
    point: &Point,
    regressors: &Mat<f64>,
    theta: &[f64],
    e: &[f64],
) -> Mat<f64> {
    let n = problem.order;
    let a = point.a();
    let c = if let Noise::Free(c) = &point.noise { Some(sections(c)) } else { None };
    let mut jacobian = Mat::zeros(problem.rows(), if c.is_some() { 2 * n } else { n });
    let mut top = 0;
    for (index, (_, y)) in problem.experiments.iter().enumerate() {
        let rows = top..top + y.len();
        let own = problem.nuisance_column(index);
        for (i, &section) in a.iter().enumerate() {
            let order = section_order(n, i);
            let mut x = if c.is_some() { e[rows.clone()].to_vec() } else { vec![0.0; y.len()] };
            for j in 0..order {
                let inputs = (0..problem.inputs).map(|input| problem.input_column(input) + 2 * i + j);
                for column in inputs.chain([own + 2 * i + j]) {
                    let filtered = regressors.col(column).iter().skip(top);
                    x.iter_mut().zip(filtered).for_each(|(x, r)| *x += theta[column] * r);
                }
            }
            let sensitivity = all_pole(section, x.into_iter());
            for j in 0..order {
                delayed(&mut jacobian, top, 2 * i + j, &sensitivity, j + 1);
            }
        }
        for (i, &section) in c.iter().flatten().enumerate() {
            let sensitivity = all_pole(section, e[rows.clone()].iter().map(|e| -e));
            for j in 0..section_order(n, i) {
                delayed(&mut jacobian, top, n + 2 * i + j, &sensitivity, j + 1);
            }
        }
        top = rows.end;
    }
    problem.mask(&mut jacobian);
    jacobian
}

/// Chain rule from coefficients to coordinates, in place.
pub(crate) fn to_coordinates(jacobian: &mut Mat<f64>, point: &Point) {
    let mut column = 0;
    for coordinates in [point.poles.as_slice(), point.free()] {
        for p in coordinates.chunks(2) {
            let [d11, d12, d22] = slopes(p);
            let (first, second) = jacobian.as_mut().get_mut(.., column..column + p.len()).split_at_col_mut(1);
            let first = first.col_mut(0).iter_mut();
            if p.len() == 2 {
                first.zip(second.col_mut(0).iter_mut()).for_each(|(x, y)| (*x, *y) = (d11 * *x, d12 * *x + d22 * *y));
            } else {
                first.for_each(|x| *x *= d11);
            }
            column += p.len();
        }
    }
}
