//! Which curve makes the harmonics: each is fitted to some blocks and judged on others.

use super::blocks::{Blocks, HARMONICS, Mean};
use super::curves::{CURVES, Curve};

/// Folds: interleaved, so that a slow drift is in all of them.
const FOLDS: usize = 4;
/// Groups that are left out in turn for standard errors.
const GROUPS: usize = 10;
/// Rounds in which parameters are corrected for the blocks' different amplitudes: the correction is quadratic in them.
const ROUNDS: usize = 2;
/// Newton steps in a block's amplitude.
const STEPS: usize = 4;

/// Harmonics of the blocks as curves see them.
pub(super) struct Measured {
    /// Real parts of harmonics 1 and up, by blocks; those that can't be had are zero.
    pub rows: Vec<Vec<f64>>,
    /// Whether a harmonic can be had.
    pub had: Vec<bool>,
    /// Variance of a block's harmonic.
    pub variance: Vec<f64>,
    /// Blocks that may choose.
    pub training: Vec<usize>,
}

/// A curve with its numbers.
#[derive(Clone, Copy)]
pub(super) struct Fitted {
    pub curve: Curve,
    pub shared: [f64; 2],
    pub amplitude: f64,
}

/// A curve as the held-out blocks see it.
pub(super) struct Judged {
    pub fitted: Fitted,
    /// Gain of the log likelihood of each training block while it was held out.
    pub gains: Vec<f64>,
    /// Mean square that it left of the blocks' harmonics while they were held out.
    pub left: f64,
    /// Sum of the gains less Schwarz's penalty, half the logarithm of the numbers for each parameter.
    pub score: f64,
}

impl Measured {
    pub fn of(blocks: &Blocks, means: &[Mean], training: Vec<usize>) -> Self {
        let row = |block: &super::blocks::Block| block.harmonics.iter().skip(1).map(|h| h.re).collect();
        Self {
            rows: blocks.blocks.iter().map(row).collect(),
            had: (1..=HARMONICS).map(|k| blocks.kept.contains(&k)).collect(),
            variance: means.iter().skip(1).map(|mean| mean.scatter.max(f64::MIN_POSITIVE)).collect(),
            training,
        }
    }

    fn mean_of(&self, blocks: &[usize], of: impl Fn(usize) -> Vec<f64>) -> Vec<f64> {
        let mut sum = vec![0.0; HARMONICS];
        for &b in blocks {
            sum.iter_mut().zip(of(b)).for_each(|(s, v)| *s += v / blocks.len() as f64);
        }
        sum
    }

    fn row(&self, block: usize) -> &[f64] {
        self.rows.get(block).map_or(&[], Vec::as_slice)
    }

    /// Curve through the means of these blocks, corrected for the spread of their amplitudes.
    pub fn fit(&self, curve: Curve, blocks: &[usize]) -> Option<Fitted> {
        // a curve needs the harmonics that define it
        let needs: &[usize] = match curve {
            Curve::Quadratic | Curve::QuadraticMotion => &[2],
            Curve::Cubic | Curve::CubicMotion => &[3],
            Curve::Straight => &[],
            _ => &[2, 3],
        };
        if !needs.iter().all(|k| self.had.get(k - 1) == Some(&true)) {
            return None;
        }
        let means = self.mean_of(blocks, |b| self.row(b).to_vec());
        let mut target = means.clone();
        let mut fitted = None;
        for _ in 0..ROUNDS {
            let (shared, amplitude) = curve.solve(&target)?;
            let found = Fitted { curve, shared, amplitude };
            let spread = self.mean_of(blocks, |b| self.predicted(&found, b));
            let middle = curve.harmonics(shared, amplitude, HARMONICS);
            target = means.iter().zip(spread.iter().zip(&middle)).map(|(m, (s, c))| m - (s - c)).collect();
            fitted = Some(found);
        }
        fitted
    }

    /// Harmonics of a block by a curve whose amplitude alone is fitted to it.
    pub fn predicted(&self, fitted: &Fitted, block: usize) -> Vec<f64> {
        let row = self.row(block);
        let Fitted { curve, shared, amplitude } = *fitted;
        let mut a = amplitude;
        let mut h = curve.harmonics(shared, a, HARMONICS);
        for _ in 0..STEPS {
            let step = 1e-6 * amplitude;
            let beside = curve.harmonics(shared, a + step, HARMONICS);
            let (mut along, mut curvature) = (0.0, 0.0);
            for (k, (y, (h, beside))) in row.iter().zip(h.iter().zip(&beside)).enumerate() {
                if self.had.get(k) == Some(&true) {
                    let weight = self.variance.get(k).map_or(0.0, |v| 1.0 / v);
                    let slope = (beside - h) / step;
                    along += weight * slope * (y - h);
                    curvature += weight * slope * slope;
                }
            }
            let change = along / curvature;
            if !change.is_finite() {
                break;
            }
            // beyond a tenth the curve is not linear in it, nor is the oscillation steady
            a += change.clamp(-0.1 * amplitude, 0.1 * amplitude);
            h = curve.harmonics(shared, a, HARMONICS);
            if change.abs() < 1e-9 * amplitude {
                break;
            }
        }
        h
    }

    /// Half the weighted sum of squares that a prediction leaves of a block.
    fn loss(&self, fitted: &Fitted, block: usize) -> f64 {
        let predicted = self.predicted(fitted, block);
        let terms = self.row(block).iter().zip(&predicted).zip(self.variance.iter().zip(&self.had));
        0.5 * terms.map(|((y, h), (v, had))| if *had { (y - h).powi(2) / v } else { 0.0 }).sum::<f64>()
    }

    /// Mean square of a signal that a prediction leaves of a block's harmonics.
    fn square(&self, fitted: &Fitted, block: usize) -> f64 {
        let predicted = self.predicted(fitted, block);
        0.5 * self.row(block).iter().zip(&predicted).map(|(y, h)| (y - h).powi(2)).sum::<f64>()
    }

    /// Mean square that the fundamental alone leaves of the training blocks' harmonics.
    pub fn straight_left(&self) -> f64 {
        let straight = self.straight();
        self.training.iter().map(|&b| self.square(&straight, b)).sum::<f64>() / self.training.len().max(1) as f64
    }

    fn straight(&self) -> Fitted {
        Fitted { curve: Curve::Straight, shared: [0.0; 2], amplitude: self.amplitude() }
    }

    /// All curves that the harmonics allow, the best first.
    pub fn judge(&self) -> Vec<Judged> {
        let straight = self.straight();
        let base: Vec<f64> = self.training.iter().map(|&b| self.loss(&straight, b)).collect();
        let mut judged: Vec<Judged> = CURVES.into_iter().filter_map(|curve| self.judge_one(curve, &base)).collect();
        judged.sort_by(|a, b| b.score.total_cmp(&a.score));
        judged
    }

    fn amplitude(&self) -> f64 {
        self.mean_of(&self.training, |b| self.row(b).to_vec()).first().copied().unwrap_or(0.0)
    }

    fn judge_one(&self, curve: Curve, base: &[f64]) -> Option<Judged> {
        let mut gains = vec![0.0; self.training.len()];
        let mut left = 0.0;
        for fold in 0..FOLDS {
            let rest: Vec<usize> =
                self.training.iter().enumerate().filter(|(i, _)| i % FOLDS != fold).map(|(_, &b)| b).collect();
            let fitted = self.fit(curve, &rest)?;
            for (i, (gain, (&b, base))) in gains.iter_mut().zip(self.training.iter().zip(base)).enumerate() {
                if i % FOLDS == fold {
                    *gain = base - self.loss(&fitted, b);
                    left += self.square(&fitted, b) / self.training.len() as f64;
                }
            }
        }
        let numbers = self.training.len() * self.had.iter().filter(|had| **had).count();
        let penalty = 0.5 * curve.parameters() as f64 * (numbers as f64).ln();
        let score = gains.iter().sum::<f64>() - penalty;
        score.is_finite().then_some(Judged { fitted: self.fit(curve, &self.training)?, gains, left, score })
    }

    /// Standard errors of numbers that follow from a fit, groups of neighbouring blocks left out in turn.
    pub fn jackknife<const N: usize>(&self, curve: Curve, of: impl Fn(&Fitted) -> [f64; N]) -> [Option<f64>; N] {
        let groups = GROUPS.min(self.training.len());
        let size = self.training.len().div_ceil(groups.max(1)).max(1);
        let without = |g: usize| -> Vec<usize> {
            self.training.iter().enumerate().filter(|(i, _)| i / size != g).map(|(_, &b)| b).collect()
        };
        let groups = self.training.len().div_ceil(size);
        let all: Option<Vec<[f64; N]>> =
            (0..groups).map(|g| self.fit(curve, &without(g)).map(|fitted| of(&fitted))).collect();
        let Some(all) = all.filter(|all| all.len() > 2) else { return [None; N] };
        let n = all.len() as f64;
        std::array::from_fn(|i| {
            let values: Vec<f64> = all.iter().filter_map(|row| row.get(i).copied()).collect();
            let mean = values.iter().sum::<f64>() / n;
            let squares: f64 = values.iter().map(|v| (v - mean).powi(2)).sum();
            Some(((n - 1.0) / n * squares).sqrt()).filter(|std| std.is_finite())
        })
    }
}

/// Whether two curves can't be distinguished: their held-out gains differ by less than three standard errors of
/// the difference over the blocks, or by less than three in all.
pub(super) fn tied(better: &Judged, other: &Judged) -> bool {
    let differences: Vec<f64> = better.gains.iter().zip(&other.gains).map(|(a, b)| a - b).collect();
    let n = differences.len() as f64;
    let mean = differences.iter().sum::<f64>() / n;
    let variance = differences.iter().map(|d| (d - mean).powi(2)).sum::<f64>() / (n - 1.0).max(1.0);
    let std = (n * variance).sqrt();
    better.score - other.score < (3.0 * std).max(3.0)
}
