//! Errors that responses have in common: noise of the input that they are all over.

use faer::{Mat, c64};

use super::FrfModesOptions;
use super::data::Lines;
use super::projection::Projection;

/// What errors that responses share add to covariances of scores and residues.
///
/// # Model
/// Of responses r and s of one run `E e_r conj(e_s) = c H_r conj(H_s)`. Whatever is linear in the errors, with the factors
/// g, is `sum_r sum_k Re(conj(g_rk) e_rk)`; two such have, beyond what independent errors give them, the covariance
/// `sum_k c/2 (Re(B conj(B')) - sum_r Re(b_r conj(b_r')))` with `b_r = conj(g_r) H_r` and `B = sum_r b_r`. The poles'
/// scores have the factors `w_r J_r`, of the changes J of a response with the parameters; a residue at given poles those
/// that solve for it, in its response alone.
pub(super) struct InCommon {
    /// Parameters of the poles.
    count: usize,
    runs: Vec<Run>,
}

/// Responses that were measured at once.
struct Run {
    responses: Vec<usize>,
    /// c/2 over the lines.
    half: Vec<f64>,
    /// `b_r` of the poles' scores: responses x parameters x lines.
    scores: Vec<Vec<Vec<c64>>>,
    /// `b_r` of the residues' parts: responses x parts x lines.
    residues: Vec<Vec<Vec<c64>>>,
}

impl InCommon {
    /// Of a fit that leaves `left`.
    pub fn new(lines: &Lines, at: &Projection, left: &[Vec<c64>], options: &FrfModesOptions) -> Self {
        let count = at.normal().1.len();
        if lines.in_common.is_empty() {
            return Self { count, runs: Vec::new() };
        }
        let changes = at.changes(lines, options);
        let along = |r: usize, factors: &Vec<Vec<c64>>| -> Vec<Vec<c64>> {
            let line = |(k, g): (usize, &c64)| g.conj() * (lines.transfer[r][k] - left[r][k]) * lines.weight[r][k];
            factors.iter().map(|row| row.iter().enumerate().map(line).collect()).collect()
        };
        let mut numbers = lines.run.clone();
        numbers.sort_unstable();
        numbers.dedup();
        let run = |number: usize| -> Option<Run> {
            let responses: Vec<usize> = (0..lines.responses()).filter(|r| lines.run[*r] == number).collect();
            let half: Vec<f64> = lines.in_common[*responses.first()?].iter().map(|c| 0.5 * c).collect();
            (responses.len() > 1 && half.iter().any(|c| *c > 0.0)).then(|| Run {
                scores: responses.iter().map(|r| along(*r, &changes[*r].poles)).collect(),
                residues: responses.iter().map(|r| along(*r, &changes[*r].residues)).collect(),
                responses,
                half,
            })
        };
        Self { count, runs: numbers.into_iter().filter_map(run).collect() }
    }

    /// Of the scores: parameters x parameters.
    pub fn scores(&self) -> Mat<f64> {
        let mut all = Mat::zeros(self.count, self.count);
        for run in &self.runs {
            let others = run.others_of_each();
            for (own, others) in run.scores.iter().zip(&others) {
                all += Mat::from_fn(self.count, self.count, |i, j| run.sum(&own[i], &others[j]));
            }
        }
        all
    }

    /// Of the parts of the residue of pole `j` in a response with the scores: 2 x parameters.
    pub fn with_scores(&self, response: usize, j: usize) -> Mat<f64> {
        let none = || Mat::zeros(2, self.count);
        let Some((run, place)) = self.place(response) else { return none() };
        let others = run.others(place);
        Mat::from_fn(2, self.count, |a, i| run.sum(&run.residues[place][2 * j + a], &others[i]))
    }

    /// Of the parts of the residue of pole `j` in two different responses: 2 x 2.
    pub fn residues(&self, response: usize, other: usize, j: usize) -> Mat<f64> {
        match (self.place(response), self.place(other)) {
            (Some((run, first)), Some((same, second))) if run.responses == same.responses && first != second => {
                let part = |place: usize, a: usize| &run.residues[place][2 * j + a];
                Mat::from_fn(2, 2, |a, b| run.sum(part(first, a), part(second, b)))
            }
            _ => Mat::zeros(2, 2),
        }
    }

    fn place(&self, response: usize) -> Option<(&Run, usize)> {
        self.runs.iter().find_map(|run| Some((run, run.responses.iter().position(|r| *r == response)?)))
    }
}

impl Run {
    /// `sum_k c/2 Re(b conj(b'))`.
    fn sum(&self, b: &[c64], other: &[c64]) -> f64 {
        self.half.iter().zip(b).zip(other).map(|((half, b), other)| half * (b * other.conj()).re).sum()
    }

    /// `b_r` of the poles' scores, summed over all responses but one.
    fn others(&self, place: usize) -> Vec<Vec<c64>> {
        let rest = || self.scores.iter().enumerate().filter(|(r, _)| *r != place).map(|(_, own)| own);
        let sum = |i: usize, k: usize| rest().map(|own| own[i][k]).sum();
        let parameters = self.scores.first().map_or(0, Vec::len);
        (0..parameters).map(|i| (0..self.half.len()).map(|k| sum(i, k)).collect()).collect()
    }

    fn others_of_each(&self) -> Vec<Vec<Vec<c64>>> {
        (0..self.scores.len()).map(|place| self.others(place)).collect()
    }
}
