//! Sensitivities of the prediction errors to poles and predictor poles, by filters of second order.
//!
//! `de/da_ij = q^-j / a_i (H^-1 x_i + e)` with `x_i` section i's deterministic output: its filtered form is the
//! regressors of section i times their parameters, already at hand. `de/dc_ij = -q^-j / c_i e`.

use super::columns::{Columns, Part, Place, SIDE_BY_SIDE};
use super::predictor::Problem;
use crate::linear_algebra::combined;
use crate::model::{Coefficients, coordinates, roots, section_order, sections, slopes};

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

/// Prediction errors from the unscaled, filtered regressors (the last of `columns` is the output) and their parameters.
pub(crate) fn residual(columns: &[&[f64]], theta: &[f64]) -> Vec<f64> {
    combined(columns, theta.iter().map(|theta| -theta).chain([1.0]))
}

/// Derivatives of e to the coefficients: a1, a2 of each section, then c1, c2 if these are free; rows x n or 2n.
///
/// Unless the whitening is free, it does not move with the poles.
pub(crate) fn coefficient_jacobian(
    problem: &Problem,
    point: &Point,
    regressors: &Columns,
    theta: &[f64],
    e: &[f64],
) -> Columns {
    let n = problem.order;
    let a = point.a();
    let c = if let Noise::Free(c) = &point.noise { Some(sections(c)) } else { None };
    let count = if c.is_some() { 2 * n } else { n };
    let mut jacobian = Columns::new(problem.rows(), &[Part::Single(count)], 1, &problem.buffers);
    let mut top = 0;
    for (index, (_, y)) in problem.experiments.iter().enumerate() {
        let e = &e[top..top + y.len()];
        let own = problem.nuisance_column(index);
        let place = Place { top, length: y.len(), column: 0, width: n, delay: 1 };
        for (group, sections) in a.chunks(SIDE_BY_SIDE).enumerate() {
            let first = group * SIDE_BY_SIDE;
            // the columns of each section's deterministic output, with their weights
            let mut parts: Vec<(usize, f64, &[f64])> = Vec::new();
            for section in first..first + sections.len() {
                for j in 0..section_order(n, section) {
                    let inputs = (0..problem.inputs).map(|input| problem.input_column(input) + 2 * section + j);
                    for column in inputs.chain([own + 2 * section + j]) {
                        parts.push((section - first, theta[column], &regressors.column(column)[top..top + y.len()]));
                    }
                }
            }
            jacobian.respond(place.group(group), sections, |start, chunk| {
                match c {
                    Some(_) => chunk.iter_mut().zip(&e[start..]).for_each(|(x, e)| *x = [*e; SIDE_BY_SIDE]),
                    None => chunk.fill([0.0; SIDE_BY_SIDE]),
                }
                for (i, weight, filtered) in &parts {
                    chunk.iter_mut().zip(&filtered[start..]).for_each(|(x, r)| x[*i] += weight * r);
                }
            });
        }
        for (group, sections) in c.as_deref().unwrap_or_default().chunks(SIDE_BY_SIDE).enumerate() {
            let place = Place { column: n, ..place }.group(group);
            jacobian.respond(place, sections, |start, chunk| {
                chunk.iter_mut().zip(&e[start..]).for_each(|(x, e)| *x = [-e; SIDE_BY_SIDE]);
            });
        }
        top += y.len();
    }
    jacobian.clear_rows(&problem.missing);
    jacobian
}

/// Chain rule from coefficients to coordinates, in place.
pub(crate) fn to_coordinates(jacobian: &mut Columns, point: &Point) {
    let mut column = 0;
    for coordinates in [point.poles.as_slice(), point.free()] {
        for p in coordinates.chunks(2) {
            let [d11, d12, d22] = slopes(p);
            if p.len() == 2 {
                let (first, second) = jacobian.two_mut(column);
                first.iter_mut().zip(second).for_each(|(x, y)| (*x, *y) = (d11 * *x, d12 * *x + d22 * *y));
            } else {
                jacobian.single_mut(column).iter_mut().for_each(|x| *x *= d11);
            }
            column += p.len();
        }
    }
}
