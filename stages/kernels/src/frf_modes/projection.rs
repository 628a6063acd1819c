//! Residues solved for at given poles, and the normal equations of the poles.

use faer::{Mat, c64};
use rayon::prelude::*;

use super::FrfModesOptions;
use super::data::Lines;
use super::model::{functions, turned, width};
use crate::linear_algebra::{Eliminated, cross_of, gram_of, symmetric_inverse};

/// Columns over the lines, before weighting.
pub(super) struct Columns {
    /// Derivatives by the poles but for the residues, then the residues' own columns, then the residual terms'.
    all: Vec<Vec<c64>>,
    /// How many are derivatives.
    slopes: usize,
}

impl Columns {
    pub fn new(lines: &Lines, poles: &[c64], options: &FrfModesOptions) -> Self {
        let of = |s: c64, power: i32| -> Vec<Vec<c64>> {
            let mut columns = vec![Vec::with_capacity(lines.len()); width(s)];
            for (p, factor) in lines.p.iter().zip(&lines.factor) {
                columns.iter_mut().zip(functions(s, *p, power)).for_each(|(column, f)| column.push(factor * f));
            }
            columns
        };
        let mut all: Vec<Vec<c64>> = poles.iter().flat_map(|s| of(*s, 2)).collect();
        let slopes = all.len();
        all.extend(poles.iter().flat_map(|s| of(*s, 1)));
        let each = || lines.p.iter().zip(&lines.factor);
        if options.lower_residual {
            all.push(each().map(|(p, factor)| factor / (p * p)).collect());
        }
        if options.upper_residual {
            all.push(lines.factor.clone());
        }
        Self { all, slopes }
    }

    fn weighted(column: &[c64], root: &[f64]) -> Vec<f64> {
        let part = |value: fn(&c64) -> f64| column.iter().zip(root).map(move |(c, w)| w * value(c));
        part(|c| c.re).chain(part(|c| c.im)).collect()
    }
}

/// One response at given poles.
#[derive(Debug, Clone)]
pub(super) struct Solved {
    /// Residues (two numbers for a pair), then the residual terms.
    pub linear: Vec<f64>,
    /// Weighted squares that are left.
    pub energy: f64,
    /// Normal equations of the poles, with those of `linear` eliminated.
    pub eliminated: Eliminated,
    /// Information of the poles.
    pub information: Mat<f64>,
}

/// Factors of a response's weighted errors.
pub(super) struct Changes {
    /// In the scores of the poles' parameters, everything linear following: parameters x lines.
    pub poles: Vec<Vec<c64>>,
    /// In the parts of the residues at given poles: parts x lines.
    pub residues: Vec<Vec<c64>>,
}

/// Share of the information of a pole beyond the band that is added to it. Why: four decades above rounding.
const RIDGE: f64 = 1e-8;

/// All responses at given poles.
#[derive(Debug, Clone)]
pub(super) struct Projection {
    pub poles: Vec<c64>,
    /// Whether each lies beyond the band.
    pub beyond: Vec<bool>,
    pub solved: Vec<Solved>,
}

impl Projection {
    /// Solves for everything linear (Eq. 3 of the module).
    pub fn new(lines: &Lines, poles: &[c64], options: &FrfModesOptions) -> Self {
        let columns = Columns::new(lines, poles, options);
        let solved = (0..lines.responses()).into_par_iter().map(|r| solve(lines, &columns, poles, r)).collect();
        let (first, last) = (lines.p[0].norm(), lines.p[lines.len() - 1].norm());
        let beyond = poles.iter().map(|s| s.norm() < first || s.norm() > last).collect();
        Self { poles: poles.to_vec(), beyond, solved }
    }

    /// Weighted squares that are left in all responses.
    pub fn energy(&self) -> f64 {
        self.solved.iter().map(|solved| solved.energy).sum()
    }

    /// Information of the poles and half the falling gradient; of poles beyond the band a little more, since of several
    /// the band may know only a sum.
    pub fn normal(&self) -> (Mat<f64>, Vec<f64>) {
        let count: usize = self.poles.iter().map(|s| width(*s)).sum();
        let mut information = Mat::zeros(count, count);
        let mut gradient = vec![0.0; count];
        for solved in &self.solved {
            information += &solved.information;
            gradient.iter_mut().zip(&solved.eliminated.score).for_each(|(sum, own)| *sum += own);
        }
        let beyond = self.poles.iter().zip(&self.beyond).flat_map(|(s, beyond)| vec![*beyond; width(*s)]);
        beyond.enumerate().filter(|(_, beyond)| *beyond).for_each(|(i, _)| information[(i, i)] *= 1.0 + RIDGE);
        (information, gradient)
    }

    /// Real parameters: of the poles, and of all responses.
    pub fn parameters(&self) -> usize {
        let own: usize = self.solved.iter().map(|solved| solved.linear.len()).sum();
        own + self.poles.iter().map(|s| width(*s)).sum::<usize>()
    }

    /// Degrees of freedom; at least one, which the search for modes sees to.
    pub fn freedom(&self, lines: &Lines) -> f64 {
        lines.values().saturating_sub(self.parameters()).max(1) as f64
    }

    /// Residue of each pole in a response.
    pub fn residues(&self, response: usize) -> Vec<c64> {
        let mut first = 0;
        self.poles
            .iter()
            .map(|s| {
                let own = &self.solved[response].linear[first..];
                first += width(*s);
                if s.im > 0.0 { c64::new(own[0], own[1]) } else { c64::new(own[0], 0.0) }
            })
            .collect()
    }

    /// Rise of the weighted squares if pole number `j` were left out, the others held.
    pub fn share(&self, j: usize) -> f64 {
        let (first, wide) = (self.poles[..j].iter().map(|s| width(*s)).sum::<usize>(), width(self.poles[j]));
        let own = |solved: &Solved| -> f64 {
            let a = &solved.linear[first..first + wide];
            let block = Mat::from_fn(wide, wide, |x, y| solved.eliminated.own_inverse[(first + x, first + y)]);
            let inverse = symmetric_inverse(&block);
            let product = |x: usize| (0..wide).map(|y| inverse[(x, y)] * a[y]).sum::<f64>() * a[x];
            (0..wide).map(product).sum()
        };
        self.solved.iter().map(own).sum()
    }

    /// The model's values, and with them what is left: responses x lines.
    pub fn left(&self, lines: &Lines, options: &FrfModesOptions) -> Vec<Vec<c64>> {
        let columns = Columns::new(lines, &self.poles, options);
        let linear = &columns.all[columns.slopes..];
        let row = |(solved, transfer): (&Solved, &Vec<c64>)| {
            let mut left = transfer.clone();
            for (column, value) in linear.iter().zip(&solved.linear) {
                left.iter_mut().zip(column).for_each(|(left, c)| *left -= c * *value);
            }
            left
        };
        self.solved.iter().zip(&lines.transfer).map(row).collect()
    }

    /// By what factors on the weighted errors each response moves scores and residues.
    pub fn changes(&self, lines: &Lines, options: &FrfModesOptions) -> Vec<Changes> {
        let columns = Columns::new(lines, &self.poles, options);
        let linear = &columns.all[columns.slopes..];
        let sum = |parts: &mut dyn Iterator<Item = (&Vec<c64>, f64)>| -> Vec<c64> {
            let mut all = vec![c64::new(0.0, 0.0); lines.len()];
            parts.for_each(|(part, x)| all.iter_mut().zip(part).for_each(|(all, c)| *all += c * x));
            all
        };
        let of = |solved: &Solved| {
            let (coupling, inverse) = (&solved.eliminated.coupling, &solved.eliminated.own_inverse);
            let pole = |(i, own): (usize, Vec<(usize, f64)>)| {
                let moved = own.iter().map(|(column, x)| (&columns.all[*column], *x));
                sum(&mut moved.chain(linear.iter().enumerate().map(|(k, column)| (column, -coupling[(k, i)]))))
            };
            let residue = |i: usize| sum(&mut linear.iter().enumerate().map(|(k, column)| (column, inverse[(i, k)])));
            Changes {
                poles: turns(&self.poles, &solved.linear).into_iter().enumerate().map(pole).collect(),
                residues: (0..columns.slopes).map(residue).collect(),
            }
        };
        self.solved.iter().map(of).collect()
    }

    /// Fall of the weighted squares that each further pole promises, the others held (Eq. 4 of the module).
    pub fn gains(&self, lines: &Lines, options: &FrfModesOptions, further: &[c64]) -> Vec<f64> {
        let columns = Columns::new(lines, &self.poles, options);
        let own: Vec<Vec<Vec<c64>>> = further
            .iter()
            .map(|s| {
                let new = Columns::new(lines, &[*s], options);
                new.all[new.slopes..new.slopes + width(*s)].to_vec()
            })
            .collect();
        let left = self.left(lines, options);
        let by_response: Vec<Vec<f64>> = (0..lines.responses())
            .into_par_iter()
            .map(|r| {
                let root: Vec<f64> = lines.weight[r].iter().map(|w| w.sqrt()).collect();
                let linear: Vec<Vec<f64>> =
                    columns.all[columns.slopes..].iter().map(|c| Columns::weighted(c, &root)).collect();
                let rest = Columns::weighted(&left[r], &root);
                let inverse = &self.solved[r].eliminated.own_inverse;
                own.iter().map(|own| gain(own, &linear, &rest, inverse, &root)).collect()
            })
            .collect();
        (0..further.len()).map(|j| by_response.iter().map(|gains| gains[j]).sum()).collect()
    }
}

fn gain(own: &[Vec<c64>], linear: &[Vec<f64>], rest: &[f64], inverse: &Mat<f64>, root: &[f64]) -> f64 {
    let own: Vec<Vec<f64>> = own.iter().map(|column| Columns::weighted(column, root)).collect();
    let own: Vec<&[f64]> = own.iter().map(Vec::as_slice).collect();
    let mut right: Vec<&[f64]> = linear.iter().map(Vec::as_slice).collect();
    right.push(rest);
    let cross = cross_of(&own, &right);
    let n = linear.len();
    let along = |i: usize| (0..n).map(|k| (0..n).map(|l| inverse[(k, l)] * cross[(i, l)]).sum()).collect::<Vec<f64>>();
    let taken: Vec<Vec<f64>> = (0..own.len()).map(along).collect();
    let products = gram_of(&own);
    let schur = Mat::from_fn(own.len(), own.len(), |i, j| {
        products[(i, j)] - (0..n).map(|k| cross[(i, k)] * taken[j][k]).sum::<f64>()
    });
    let inverse = symmetric_inverse(&schur);
    let t = |i: usize| cross[(i, n)];
    (0..own.len()).flat_map(|i| (0..own.len()).map(move |j| (i, j))).map(|(i, j)| t(i) * inverse[(i, j)] * t(j)).sum()
}

fn solve(lines: &Lines, columns: &Columns, poles: &[c64], response: usize) -> Solved {
    let root: Vec<f64> = lines.weight[response].iter().map(|w| w.sqrt()).collect();
    let mut all: Vec<Vec<f64>> = columns.all.iter().map(|column| Columns::weighted(column, &root)).collect();
    all.push(Columns::weighted(&lines.transfer[response], &root));
    let products = gram_of(&all.iter().map(Vec::as_slice).collect::<Vec<_>>());
    let (slopes, data) = (columns.slopes, all.len() - 1);
    let own = data - slopes;
    let inverse = symmetric_inverse(&Mat::from_fn(own, own, |i, j| products[(slopes + i, slopes + j)]));
    let linear: Vec<f64> =
        (0..own).map(|i| (0..own).map(|j| inverse[(i, j)] * products[(slopes + j, data)]).sum()).collect();
    let explained: f64 = linear.iter().enumerate().map(|(i, a)| a * products[(slopes + i, data)]).sum();
    let turn = turns(poles, &linear);
    let shared = turn.len();
    // a column of the whole problem as a combination of the columns at hand
    let parts =
        |i: usize| -> Vec<(usize, f64)> { if i < shared { turn[i].clone() } else { vec![(slopes + i - shared, 1.0)] } };
    let parts: Vec<Vec<(usize, f64)>> = (0..shared + own).map(parts).collect();
    let between = |i: usize, j: usize| {
        parts[i].iter().map(|(a, x)| parts[j].iter().map(|(b, y)| x * y * products[(*a, *b)]).sum::<f64>()).sum::<f64>()
    };
    let gram = Mat::from_fn(shared + own, shared + own, between);
    let against = |column: usize| {
        let model: f64 = linear.iter().enumerate().map(|(k, a)| a * products[(column, slopes + k)]).sum();
        products[(column, data)] - model
    };
    let gradient: Vec<f64> = (0..shared + own)
        .map(|i| if i < shared { parts[i].iter().map(|(a, x)| x * against(*a)).sum() } else { 0.0 })
        .collect();
    let eliminated = Eliminated::of(&gram, &gradient, shared, 0.0);
    let information = eliminated.information(&gram);
    Solved { linear, energy: (products[(data, data)] - explained).max(0.0), eliminated, information }
}

/// For each real parameter of the poles the columns that its derivative is made of.
fn turns(poles: &[c64], linear: &[f64]) -> Vec<Vec<(usize, f64)>> {
    let mut first = 0;
    let mut all = Vec::new();
    for s in poles {
        let wide = width(*s);
        let rows = turned(*s, &linear[first..first + wide]);
        all.extend(rows.into_iter().map(|row| row.into_iter().enumerate().map(|(j, x)| (first + j, x)).collect()));
        first += wide;
    }
    all
}
