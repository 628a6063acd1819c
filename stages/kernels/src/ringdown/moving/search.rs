//! Least squares by Levenberg and Marquardt.

use std::cell::Cell;

use crate::ringdown::moving::blocks::Compressed;
use crate::ringdown::moving::dense::{Factor, Square};
use crate::ringdown::moving::model::{Mode, Normal, moved, normal};

/// What modes are fitted to.
pub trait Problem {
    /// Normal equations at these modes; none where they are out of the question.
    fn normal(&self, modes: &[Mode]) -> Option<Normal>;

    /// Whether no more models should be tried.
    fn is_spent(&self) -> bool {
        false
    }
}

/// Columns whose products take as long as the paths and the envelopes.
const OVERHEAD_COLUMNS: f64 = 10.0;
/// Multiplications of a path for each node.
pub const PATH_COST: f64 = 2000.0;
/// Trials of a fit when no more models should be tried.
const LAST_TRIALS: usize = 8;

/// Compressed records under white noise.
#[derive(Debug, Clone, Copy)]
pub struct Weighted<'a> {
    /// The records.
    pub data: &'a Compressed,
    /// Inverse variance of each channel.
    pub weights: &'a [f64],
    /// Multiplications that are left for the trial of further models.
    pub budget: &'a Cell<f64>,
}

impl Problem for Weighted<'_> {
    fn normal(&self, modes: &[Mode]) -> Option<Normal> {
        let columns = modes.iter().map(Mode::count).sum::<usize>() as f64;
        let rows: usize = self.data.records.iter().map(|r| r.rows).sum();
        let nodes: usize = self.data.hits.iter().map(|hit| hit.times_s.len()).sum();
        let cost = rows as f64 * (columns + OVERHEAD_COLUMNS).powi(2) + PATH_COST * (nodes * modes.len()) as f64;
        self.budget.set(self.budget.get() - cost);
        normal(self.data, modes, self.weights)
    }

    fn is_spent(&self) -> bool {
        self.budget.get() <= 0.0
    }
}

/// Expected gain of chi square below which a step is the last.
const ARRIVED: f64 = 1e-3;
/// The same as a share of chi square: where far more than noise is left, no digit of it counts.
const ARRIVED_SHARE: f64 = 1e-9;
/// Most trials.
pub const TRIALS: usize = 60;
/// Damping of the first step, and bounds.
const DAMPING: (f64, f64, f64) = (1e-4, 1e-12, 1e8);

/// Modes at the least chi square.
#[derive(Debug, Clone)]
pub struct Fit {
    /// The modes.
    pub modes: Vec<Mode>,
    /// Normal equations there.
    pub normal: Normal,
    /// Whether the last step is expected to gain less than a thousandth.
    pub converged: bool,
}

impl Fit {
    /// Number of parameters.
    pub fn parameters(&self) -> usize {
        self.normal.score.len()
    }

    /// Covariance of the parameters under noise alone; none where they are not all determined.
    pub fn covariance(&self) -> Option<Square> {
        Some(Factor::of(&self.normal.information, 0.0)?.inverse())
    }

    /// Place of a mode's first parameter.
    pub fn base(&self, mode: usize) -> usize {
        self.modes[..mode].iter().map(Mode::count).sum()
    }
}

/// Fits from a start; none where the start itself has no finite chi square.
pub fn fit(problem: &dyn Problem, start: Vec<Mode>) -> Option<Fit> {
    fit_within(problem, start, TRIALS)
}

/// The same in at most so many trials.
pub fn fit_within(problem: &dyn Problem, start: Vec<Mode>, trials: usize) -> Option<Fit> {
    let mut now = problem.normal(&start)?;
    let mut modes = start;
    let mut damping = DAMPING.0;
    for trial in 0..trials {
        if trial >= LAST_TRIALS && problem.is_spent() {
            break;
        }
        let Some(factor) = Factor::of(&now.information, damping) else {
            damping = (damping * 10.0).max(1e-10);
            if damping > DAMPING.2 {
                break;
            }
            continue;
        };
        let step = factor.solve(&now.score);
        let expected: f64 = step.iter().zip(&now.score).map(|(s, b)| s * b).sum();
        let promises = expected > ARRIVED + ARRIVED_SHARE * now.chi_square;
        if !promises && damping <= 0.1 {
            return Some(Fit { modes, normal: now, converged: true });
        }
        let trial = moved(&modes, &step);
        match problem.normal(&trial) {
            Some(next) if next.chi_square <= now.chi_square => {
                let gain = now.chi_square - next.chi_square;
                damping = (damping * if gain > 0.7 * expected { 0.05 } else { 0.5 }).max(DAMPING.1);
                (modes, now) = (trial, next);
            }
            _ => damping *= 8.0,
        }
        if damping > DAMPING.2 {
            break;
        }
    }
    Some(Fit { modes, normal: now, converged: false })
}
