//! Parameters of the force balance by instruments that noise does not enter, with the scatter of blocks.

use crate::Mat;
use crate::linear_algebra::definite_inverse;
use crate::linear_algebra::solve;

use super::balance::COLUMNS;
use super::blocks::jackknife;
use super::motion::Plant;

/// Blocks of the jackknife: a standard error is then known to a fifth, and each block holds several reversals of a
/// record of some fifty.
pub(super) const BLOCKS: usize = 16;

/// Sums of products of a block's rows.
#[derive(Clone)]
struct Block {
    /// Instruments by columns.
    zx: Mat<f64>,
    /// Instruments by force.
    zf: Vec<f64>,
    /// Columns by columns.
    xx: Mat<f64>,
    /// Columns by force.
    xf: Vec<f64>,
    /// Force by force.
    ff: f64,
    rows: usize,
}

/// The balance's sums, block by block.
pub(super) struct Moments {
    blocks: Vec<Block>,
    /// Rms of each column, to which both sides are scaled.
    scale: Vec<f64>,
}

/// Parameters of a set of columns.
#[derive(Debug, Clone)]
pub(super) struct Estimate {
    /// The columns.
    pub set: Vec<usize>,
    /// Their parameters.
    pub values: Vec<f64>,
    /// Standard errors.
    pub stds: Vec<f64>,
    /// The parameters with each block left out, and that block's number.
    pub left_out: Vec<(usize, Vec<f64>)>,
    /// Squares of the residual, all rows.
    pub squares: f64,
    /// Held-out squares of each block, in the order of `left_out`.
    pub held_out: Vec<f64>,
}

impl Moments {
    /// Sums over rows; `x`, `z`: columns and instruments, COLUMNS each; `block`: the block of each row.
    pub fn new(x: &[Vec<f64>], z: &[Vec<f64>], force: &[f64], block: &[usize]) -> Self {
        let count = force.len().max(1) as f64;
        let rms = |x: &Vec<f64>| (x.iter().map(|x| x * x).sum::<f64>() / count).sqrt();
        let scale: Vec<f64> = x.iter().map(rms).map(|rms| if rms > 0.0 { rms } else { 1.0 }).collect();
        let empty = Block {
            zx: Mat::zeros(COLUMNS, COLUMNS),
            zf: vec![0.0; COLUMNS],
            xx: Mat::zeros(COLUMNS, COLUMNS),
            xf: vec![0.0; COLUMNS],
            ff: 0.0,
            rows: 0,
        };
        let mut blocks = vec![empty; BLOCKS];
        for (k, (&b, &f)) in block.iter().zip(force).enumerate() {
            let Some(sums) = blocks.get_mut(b) else { continue };
            for i in 0..COLUMNS {
                let (zi, xi) = (z[i][k] / scale[i], x[i][k] / scale[i]);
                sums.zf[i] += zi * f;
                sums.xf[i] += xi * f;
                for j in 0..COLUMNS {
                    let xj = x[j][k] / scale[j];
                    sums.zx[(i, j)] += zi * xj;
                    sums.xx[(i, j)] += xi * xj;
                }
            }
            sums.ff += f * f;
            sums.rows += 1;
        }
        Self { blocks, scale }
    }

    /// Rows of all blocks.
    pub fn rows(&self) -> usize {
        self.blocks.iter().map(|block| block.rows).sum()
    }

    /// Squares of the force.
    pub fn force_squares(&self) -> f64 {
        self.blocks.iter().map(|block| block.ff).sum()
    }

    /// Estimates the parameters of a set of columns; none where they can't be separated.
    pub fn estimate(&self, set: &[usize]) -> Option<Estimate> {
        let values = self.solved(set, None)?;
        let used = self.blocks.iter().enumerate().filter(|(_, block)| block.rows > 0).map(|(b, _)| b);
        let left_out: Vec<(usize, Vec<f64>)> =
            used.map(|b| Some((b, self.solved(set, Some(b))?))).collect::<Option<_>>()?;
        if left_out.len() < 4 {
            return None;
        }
        let stds = jackknife(&left_out.iter().map(|(_, values)| values.clone()).collect::<Vec<_>>());
        let squares = self.blocks.iter().map(|block| self.left(block, set, &values)).sum();
        let held_out = left_out.iter().map(|(b, values)| self.left(&self.blocks[*b], set, values)).collect();
        Some(Estimate { set: set.to_vec(), values, stds, left_out, squares, held_out })
    }

    fn solved(&self, set: &[usize], without: Option<usize>) -> Option<Vec<f64>> {
        let used = || self.blocks.iter().enumerate().filter(|(b, _)| Some(*b) != without).map(|(_, block)| block);
        let n = set.len();
        let sum = |f: &dyn Fn(&Block) -> f64| used().map(f).sum::<f64>();
        // columns that are combinations of each other have no estimate
        definite_inverse(&Mat::from_fn(n, n, |i, j| sum(&|block| block.xx[(set[i], set[j])])))?;
        let a = Mat::from_fn(n, n, |i, j| sum(&|block| block.zx[(set[i], set[j])]));
        let b = Mat::from_fn(n, 1, |i, _| sum(&|block| block.zf[set[i]]));
        let x = solve(a, &b);
        let values: Vec<f64> = (0..n).map(|i| x[(i, 0)] / self.scale[set[i]]).collect();
        values.iter().all(|value| value.is_finite()).then_some(values)
    }

    fn left(&self, block: &Block, set: &[usize], values: &[f64]) -> f64 {
        let scaled: Vec<f64> = set.iter().zip(values).map(|(&i, value)| value * self.scale[i]).collect();
        let linear: f64 = set.iter().zip(&scaled).map(|(&i, c)| c * block.xf[i]).sum();
        let square = |i: usize| -> f64 { set.iter().zip(&scaled).map(|(&j, c)| c * block.xx[(set[i], j)]).sum() };
        let quadratic: f64 = (0..set.len()).map(|i| scaled[i] * square(i)).sum();
        (block.ff - 2.0 * linear + quadratic).max(0.0)
    }
}

impl Estimate {
    /// Value and standard error of a column.
    pub fn of(&self, column: usize) -> Option<(f64, f64)> {
        let place = self.set.iter().position(|&c| c == column)?;
        Some((*self.values.get(place)?, *self.stds.get(place)?))
    }

    /// The plant of the estimate.
    pub fn plant(&self, drive_scale: f64) -> Plant {
        plant(&self.set, &self.values, drive_scale)
    }
}

/// The plant that values of a set of columns make.
pub(super) fn plant(set: &[usize], values: &[f64], drive_scale: f64) -> Plant {
    use super::balance::{ASYMMETRY, COULOMB, EXTRA, MASS, OFFSET, QUADRATIC, STIFFNESS, VISCOUS};
    let of = |column: usize| set.iter().zip(values).find(|(c, _)| **c == column).map_or(0.0, |(_, value)| *value);
    Plant {
        mass: of(MASS),
        viscous: of(VISCOUS),
        coulomb: of(COULOMB),
        offset: of(OFFSET),
        quadratic: of(QUADRATIC),
        asymmetry: of(ASYMMETRY),
        // on the right-hand side
        extra: -of(EXTRA),
        drive_scale,
        stiffness: of(STIFFNESS),
    }
}
