//! Does the shape of the events change slowly over the archive?

use afmid_kernels::linear_algebra::dot;
use afmid_pipeline::rows::RowSource;
use rand::SeedableRng;
use rand::seq::SliceRandom;
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::gram::gram;
use super::rows::all;
use super::scatter::Remainders;
use super::{EnsembleError, moments};

/// How drift is looked for.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(default)]
pub struct DriftSettings {
    /// Sub-ensembles of either kind. Why: some twenty events each in an archive like the paper's.
    #[schemars(range(min = 2, max = 1000))]
    pub groups: usize,
    /// Random orders that the ordered one is compared with. Why: a p-value of one per cent then has a standard error of
    /// a third of itself.
    #[schemars(range(min = 99, max = 100_000))]
    pub permutations: usize,
    /// Seed of the random orders.
    #[serde(skip)]
    pub seed: u64,
}

impl Default for DriftSettings {
    fn default() -> Self {
        Self { groups: 4, permutations: 999, seed: 0 }
    }
}

/// One sub-ensemble.
#[derive(Debug, Clone, PartialEq)]
pub struct SubEnsemble {
    /// True for consecutive events, false for a random draw.
    pub ordered: bool,
    /// Number of the group within its kind.
    pub group: usize,
    /// Events in it.
    pub count: usize,
    /// Correlation coefficient of its mean with the mean of all other events.
    pub correlation: f64,
}

/// The answer.
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeDrift {
    /// Ordered sub-ensembles, then randomised ones.
    pub groups: Vec<SubEnsemble>,
    /// Statistic of the events in their order, in units of its value's spread over random orders.
    pub z_score: f64,
    /// Share of random orders at least as far out.
    pub p_value: f64,
}

/// Random orders that are judged in parallel.
const ORDERS_AT_ONCE: usize = 64;

/// Slow trends that the statistic looks for: linear, quadratic and cubic in the event index.
const TREND_ORDERS: usize = 3;

/// Tests whether neighbouring events resemble each other more than events drawn at random.
///
/// # Model
/// Each event is amplitude times a common shape, plus offset, loading ramps and noise (see
/// [`scatter`](super::scatter())). Under the null hypothesis the remainders may be put in any order.
///
/// # Method
/// With the remainders' Gram matrix `K` and orthonormal polynomials `c_p` of order 1 to 3 in the event index, the
/// statistic is `sum_p sum_(i != j) c_pi c_pj K_ij`: the squared norm of the remainder's trend over the archive, less
/// each event's own noise power. Amplitude scatter has been regressed out and cannot enter. The p-value is `(1 +
/// exceedances) / (1 + permutations)`, exact for exchangeable events. Beside it: consecutive and randomised groups,
/// each correlated with the mean of all other events.
///
/// # Shapes
/// `rows` `[event, time]` in the order of the archive.
///
/// # Units
/// Correlation, z-score and p-value are numbers.
///
/// # Accuracy
/// The p-value is no smaller than `1 / (1 + permutations)` and has a standard error of `sqrt(p (1 - p) /
/// permutations)`.
///
/// # Errors
/// Fewer than two groups, fewer than two events per group, fewer than eight events, no permutations, a constant mean.
///
/// # Source
/// Stark et al. 2005, "subensembles (ordered as well as randomized) were created and compared"; permutation tests:
/// Phipson and Smyth, Stat. Appl. Genet. Mol. Biol. 9 (2010) 39.
pub fn shape_drift(rows: impl RowSource, zero: usize, settings: DriftSettings) -> Result<ShapeDrift, EnsembleError> {
    let count = rows.rows();
    let wanted = (2 * settings.groups).max(8);
    if settings.groups < 2 {
        return Err(EnsembleError::Setting { name: "groups", got: settings.groups.to_string(), wanted: "at least 2" });
    }
    if settings.permutations == 0 {
        return Err(EnsembleError::Setting { name: "permutations", got: "0".into(), wanted: "at least 1" });
    }
    if count < wanted {
        return Err(EnsembleError::TooFewEvents { got: count, wanted, purpose: "a test for drift" });
    }
    let all = all(&rows);
    let mean = moments(&rows, &all)?.mean;
    let gram = gram(&rows, &Remainders::new(&mean, zero, rows.row_length())?)?;
    let trends = trends(count);

    let mut rng = ChaCha8Rng::seed_from_u64(settings.seed);
    let mut random = all.clone();
    random.shuffle(&mut rng);
    let mut groups = compare_groups(&rows, &all, settings.groups, true)?;
    groups.extend(compare_groups(&rows, &random, settings.groups, false)?);

    let observed = statistic(&gram, &trends, &all);
    let mut null = Vec::with_capacity(settings.permutations);
    while null.len() < settings.permutations {
        // orders are drawn one after the other, some at a time: they need not all be in memory
        let orders: Vec<Vec<usize>> = (null.len()..settings.permutations.min(null.len() + ORDERS_AT_ONCE))
            .map(|_| {
                random.shuffle(&mut rng);
                random.clone()
            })
            .collect();
        null.par_extend(orders.par_iter().map(|order| statistic(&gram, &trends, order)));
    }
    let exceed = null.iter().filter(|&&s| s >= observed).count();
    let p_value = (1 + exceed) as f64 / (1 + settings.permutations) as f64;
    let centre = null.iter().sum::<f64>() / null.len() as f64;
    let spread = (null.iter().map(|s| (s - centre).powi(2)).sum::<f64>() / null.len() as f64).sqrt();
    let z_score = if spread > 0.0 { (observed - centre) / spread } else { 0.0 };
    Ok(ShapeDrift { groups, z_score, p_value })
}

/// Orthonormal polynomials of order 1 to 3 on the event index.
fn trends(count: usize) -> Vec<Vec<f64>> {
    let x: Vec<f64> = (0..count).map(|i| 2.0 * i as f64 / (count - 1) as f64 - 1.0).collect();
    let mut basis = vec![vec![1.0 / (count as f64).sqrt(); count]];
    for order in 1..=TREND_ORDERS {
        let mut column: Vec<f64> = x.iter().map(|x| x.powi(order as i32)).collect();
        for _ in 0..2 {
            for q in &basis {
                let c = dot(q, &column);
                column.iter_mut().zip(q).for_each(|(v, q)| *v -= c * q);
            }
        }
        let norm = dot(&column, &column).sqrt();
        column.iter_mut().for_each(|v| *v /= norm);
        basis.push(column);
    }
    basis.split_off(1)
}

/// Trend power of the events in the given order, own noise power left out.
fn statistic(gram: &[Vec<f64>], trends: &[Vec<f64>], order: &[usize]) -> f64 {
    let mut sum = 0.0;
    for c in trends {
        for (i, &a) in order.iter().enumerate() {
            for (j, &b) in order.iter().enumerate().take(i) {
                sum += 2.0 * c[i] * c[j] * gram[a][b];
            }
        }
    }
    sum
}

fn compare_groups(
    rows: &dyn RowSource,
    order: &[usize],
    groups: usize,
    ordered: bool,
) -> Result<Vec<SubEnsemble>, EnsembleError> {
    let count = order.len();
    (0..groups)
        .map(|group| {
            let (from, to) = (group * count / groups, (group + 1) * count / groups);
            let rest = [&order[..from], &order[to..]].concat();
            let own = moments(rows, &order[from..to])?.mean;
            let other = moments(rows, &rest)?.mean;
            Ok(SubEnsemble { ordered, group, count: to - from, correlation: correlation(&own, &other) })
        })
        .collect()
}

/// Pearson's coefficient; zero when one of the two is constant.
fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let (ma, mb) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let (mut aa, mut bb, mut ab) = (0.0, 0.0, 0.0);
    for (x, y) in a.iter().zip(b) {
        let (x, y) = (x - ma, y - mb);
        aa += x * x;
        bb += y * y;
        ab += x * y;
    }
    if aa > 0.0 && bb > 0.0 { ab / (aa * bb).sqrt() } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::Rows;
    use crate::fixture::{Lever, white_noise};

    const SETTINGS: DriftSettings = DriftSettings { groups: 4, permutations: 199, seed: 7 };

    /// `drift` is the relative frequency shift from the first to the last event; amplitudes scatter and trend.
    fn archive(count: usize, drift: f64, seed: u64) -> (Vec<f64>, usize) {
        let samples = 2048;
        let mut values = Vec::new();
        let scatter = white_noise(count, 0.1, seed);
        for (i, own) in scatter.iter().enumerate() {
            let mut lever = Lever::paper();
            let at = i as f64 / (count - 1) as f64;
            lever.frequency_hz.iter_mut().for_each(|f| *f *= 1.0 + drift * (at - 0.5));
            let shape = lever.release(samples, 300.0, -0.9 * (1.0 + own + 0.2 * at));
            let noise = white_noise(samples, 1.2e-3, seed * 977 + i as u64);
            values.extend(shape.iter().zip(noise).map(|(y, e)| y + e + 4e-3 * own));
        }
        (values, samples)
    }

    #[test]
    fn amplitude_scatter_and_trend_raise_no_alarm() {
        let p: Vec<f64> = (1..9)
            .map(|seed| {
                let (values, samples) = archive(16, 0.0, seed);
                shape_drift(Rows::new(&values, samples).unwrap(), 300, SETTINGS).unwrap().p_value
            })
            .collect();
        // uniform under the null: at most one of eight below 0.05 with probability 0.94, and none below 1/100
        assert!(p.iter().filter(|p| **p < 0.05).count() <= 1, "{p:?}");
        assert!(p.iter().any(|p| *p > 0.3), "{p:?}");
    }

    #[test]
    fn a_frequency_drift_of_a_thousandth_is_found() {
        for seed in 1..4 {
            let (values, samples) = archive(16, 1e-3, seed);
            let got = shape_drift(Rows::new(&values, samples).unwrap(), 300, SETTINGS).unwrap();
            // the smallest value that 199 permutations allow
            assert!(got.p_value <= 0.005, "seed {seed}: {got:?}");
            assert_eq!(got.groups.len(), 8);
            assert!(got.groups.iter().all(|g| g.count == 4 && g.correlation > 0.99));
        }
    }

    #[test]
    fn too_little_is_refused() {
        let values = white_noise(6 * 64, 1.0, 1);
        let rows = Rows::new(&values, 64).unwrap();
        assert!(matches!(shape_drift(rows, 8, SETTINGS), Err(EnsembleError::TooFewEvents { wanted: 8, .. })));
        assert!(shape_drift(rows, 8, DriftSettings { groups: 1, ..SETTINGS }).is_err());
        assert!(shape_drift(rows, 8, DriftSettings { permutations: 0, ..SETTINGS }).is_err());
    }
}
