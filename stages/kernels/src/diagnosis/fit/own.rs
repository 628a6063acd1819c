//! What belongs to single stretches, their states and offsets, taken out of everything that is shared.

use rayon::prelude::*;

use super::products::dot;
use crate::diagnosis::data::Layout;

/// Orthonormal directions that each stretch's own numbers can move its samples in.
#[derive(Debug, Clone, Default)]
pub(crate) struct Own {
    /// By stretch: the directions over its samples, and their upper triangular factor.
    of: Vec<Directions>,
}

/// How much of each direction a column has, by stretch.
pub(crate) type Along = Vec<Vec<f64>>;

#[derive(Debug, Clone)]
struct Directions {
    basis: Vec<Vec<f64>>,
    /// `column_j = sum_i factor[i][j] basis_i`.
    factor: Vec<Vec<f64>>,
}

/// What is left of a column after those before it, squared over its own square, that counts as rounding.
const VANISHING: f64 = 1e-20;

impl Own {
    /// From the sensitivities to each stretch's own numbers, all stretches' number i side by side in column i.
    ///
    /// # Method
    /// Gram-Schmidt, each column twice.
    /// # Source
    /// L. Giraud, J. Langou, M. Rozloznik, Comput. Math. Appl. 50 (2005) 1069.
    pub fn new(columns: &[Vec<f64>], layout: &Layout) -> Self {
        let of = (0..layout.stretches())
            .into_par_iter()
            .map(|e| {
                let range = layout.stretch(e);
                let mut own = Directions { basis: Vec::new(), factor: vec![vec![0.0; columns.len()]; columns.len()] };
                for (j, column) in columns.iter().enumerate() {
                    let mut left = column[range.clone()].to_vec();
                    let whole = dot(&left, &left);
                    for _ in 0..2 {
                        for (i, direction) in own.basis.iter().enumerate() {
                            let along = dot(direction, &left);
                            own.factor[i][j] += along;
                            left.iter_mut().zip(direction).for_each(|(l, d)| *l -= along * d);
                        }
                    }
                    let length = dot(&left, &left);
                    let found = length > VANISHING * whole && length.is_finite() && length > 0.0;
                    let root = length.sqrt();
                    own.factor[j][j] = if found { root } else { 0.0 };
                    left.iter_mut().for_each(|l| *l = if found { *l / root } else { 0.0 });
                    own.basis.push(left);
                }
                own
            })
            .collect();
        Self { of }
    }

    /// Takes what the stretches' own numbers can make out of a column; gives how much of each direction that was.
    pub fn take_out(&self, column: &mut [f64], layout: &Layout) -> Along {
        let one = |(e, own): (usize, &Directions)| {
            let part = &mut column[layout.stretch(e)];
            let out = |direction: &Vec<f64>| {
                let along = dot(direction, part);
                part.iter_mut().zip(direction).for_each(|(p, d)| *p -= along * d);
                along
            };
            own.basis.iter().map(out).collect()
        };
        self.of.iter().enumerate().map(one).collect()
    }

    /// The own numbers of stretch `e` that make most of `column`, by least squares; what no sample shows is 0.
    pub fn solve(&self, e: usize, column: &[f64], layout: &Layout) -> Vec<f64> {
        let Some(own) = self.of.get(e) else { return Vec::new() };
        let part = &column[layout.stretch(e)];
        self.numbers(e, &own.basis.iter().map(|direction| dot(direction, part)).collect::<Vec<f64>>())
    }

    /// The own numbers of stretch `e` that move its samples by so much of each direction.
    pub fn numbers(&self, e: usize, along: &[f64]) -> Vec<f64> {
        let Some(own) = self.of.get(e) else { return Vec::new() };
        let mut x = vec![0.0; along.len()];
        for i in (0..along.len()).rev() {
            let known: f64 = (i + 1..along.len()).map(|j| own.factor[i][j] * x[j]).sum();
            x[i] = if own.factor[i][i] > 0.0 { (along[i] - known) / own.factor[i][i] } else { 0.0 };
        }
        x
    }
}
