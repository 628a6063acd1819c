//! The force balance of filtered signals, linear in mass, frictions and offset.

use std::ops::Range;

/// Columns of the balance, in this order.
pub(super) const MASS: usize = 0;
pub(super) const VISCOUS: usize = 1;
pub(super) const COULOMB: usize = 2;
pub(super) const OFFSET: usize = 3;
pub(super) const QUADRATIC: usize = 4;
pub(super) const ASYMMETRY: usize = 5;
pub(super) const EXTRA: usize = 6;
pub(super) const STIFFNESS: usize = 7;
/// How many.
pub(super) const COLUMNS: usize = 8;

/// Half of the samples over which the speed is averaged whose sign counts: 11 samples, a tenth of the noise's slope.
const HALF: usize = 5;
/// Rows for each window length: what lies between two is known from them.
const ROWS: usize = 8;
/// Standard errors of a mean speed below which its direction is unknown.
const UNKNOWN: f64 = 4.0;
/// Share of the rms speed below which the axis creeps: presliding, not friction of constant size.
const CREEP: f64 = 0.005;

/// A smooth window that vanishes at both ends.
pub(super) struct Window {
    weights: Vec<f64>,
}

impl Window {
    /// `(t (1 - t))^power` at `samples` inner points, of unit sum.
    pub fn new(samples: usize, power: i32) -> Self {
        let t = |j: usize| (j as f64 + 1.0) / (samples as f64 + 1.0);
        let raw: Vec<f64> = (0..samples).map(|j| (4.0 * t(j) * (1.0 - t(j))).powi(power)).collect();
        let sum: f64 = raw.iter().sum();
        Self { weights: raw.into_iter().map(|w| w / sum).collect() }
    }

    pub fn samples(&self) -> usize {
        self.weights.len()
    }

    fn of(&self, x: &[f64], first: usize) -> f64 {
        self.weights.iter().zip(x.get(first..).unwrap_or_default()).map(|(w, x)| w * x).sum()
    }

    fn weight(&self, j: isize) -> f64 {
        usize::try_from(j).ok().and_then(|j| self.weights.get(j)).copied().unwrap_or(0.0)
    }

    /// Variance of a row's residual by white noise of unit variance on the position.
    pub fn noise(&self, mass: f64, viscous: f64, interval_s: f64) -> f64 {
        let w = |j: isize| self.weight(j);
        let one = |j: isize| {
            let second = (w(j + 1) - 2.0 * w(j) + w(j - 1)) / interval_s.powi(2);
            let first = (w(j + 1) - w(j - 1)) / (2.0 * interval_s);
            (mass * second - viscous * first).powi(2)
        };
        (-1..=self.samples() as isize).map(one).sum()
    }
}

/// What the balance is made of, sample by sample.
pub(super) struct Signals {
    /// COLUMNS series, unfiltered.
    series: Vec<Vec<f64>>,
    /// Mean speed around a sample.
    pub speed: Vec<f64>,
}

impl Signals {
    /// From a position and the extra channel.
    pub fn new(y: &[f64], extra: Option<&[f64]>, interval_s: f64) -> Self {
        let n = y.len();
        let inner = |half: usize, f: &dyn Fn(usize) -> f64| -> Vec<f64> {
            (0..n).map(|k| f(k.clamp(half, n.saturating_sub(half + 1)))).collect()
        };
        if n < 2 * HALF + 1 {
            return Self { series: vec![vec![0.0; n]; COLUMNS], speed: vec![0.0; n] };
        }
        let speed = inner(HALF, &|k| (y[k + HALF] - y[k - HALF]) / (2.0 * HALF as f64 * interval_s));
        let mut series = vec![Vec::new(); COLUMNS];
        series[MASS] = inner(1, &|k| (y[k + 1] - 2.0 * y[k] + y[k - 1]) / interval_s.powi(2));
        series[VISCOUS] = inner(1, &|k| (y[k + 1] - y[k - 1]) / (2.0 * interval_s));
        series[COULOMB] = speed.iter().map(|v| if *v == 0.0 { 0.0 } else { v.signum() }).collect();
        series[OFFSET] = vec![1.0; n];
        series[QUADRATIC] = speed.iter().map(|v| v * v.abs()).collect();
        series[ASYMMETRY] = speed.iter().map(|v| v.abs()).collect();
        series[STIFFNESS] = y.to_vec();
        series[EXTRA] = extra.map_or_else(|| vec![0.0; n], |p| held(p, 1.0));
        Self { series, speed }
    }
}

/// Mean of a held signal over the two intervals around each sample, which the second difference of the position sees.
pub(super) fn held(u: &[f64], scale: f64) -> Vec<f64> {
    (0..u.len()).map(|k| 0.5 * scale * (u[k] + u[k.saturating_sub(1)])).collect()
}

/// Rows of the balance: where their windows begin, and in which block.
pub(super) struct Rows {
    first: Vec<usize>,
    /// Block of each row.
    pub block: Vec<usize>,
}

impl Rows {
    /// Windows within the training part in which the axis moves in a known direction most of the time.
    pub fn new(
        signals: &Signals,
        noise: f64,
        interval_s: f64,
        samples: usize,
        part: &Range<usize>,
        blocks: usize,
    ) -> Self {
        let limit = creep(&signals.speed[part.clone()], noise, interval_s);
        let (low, high) = (part.start + HALF + 1, part.end.saturating_sub(samples + HALF));
        let rest = |k: usize| signals.speed[k..k + samples].iter().filter(|v| v.abs() < limit).count();
        let first: Vec<usize> =
            (low..high.max(low)).step_by((samples / ROWS).max(1)).filter(|&k| 2 * rest(k) <= samples).collect();
        let block = first.iter().map(|k| (k - part.start) * blocks / part.len().max(1)).collect();
        Self { first, block }
    }

    /// Filtered columns at the rows, COLUMNS of them.
    pub fn columns(&self, signals: &Signals, window: &Window) -> Vec<Vec<f64>> {
        signals.series.iter().map(|x| self.filtered(x, window)).collect()
    }

    /// One filtered signal at the rows.
    pub fn filtered(&self, x: &[f64], window: &Window) -> Vec<f64> {
        self.first.iter().map(|&k| window.of(x, k)).collect()
    }

    /// How many.
    pub fn len(&self) -> usize {
        self.first.len()
    }
}

/// Speed below which the direction is unknown or the axis creeps.
fn creep(speed: &[f64], noise: f64, interval_s: f64) -> f64 {
    let rms = (speed.iter().map(|v| v * v).sum::<f64>() / speed.len().max(1) as f64).sqrt();
    let unknown = UNKNOWN * noise * std::f64::consts::SQRT_2 / (2.0 * HALF as f64 * interval_s);
    // noise that hides even the rms speed leaves no better choice than all rows
    if unknown < 0.5 * rms { unknown.max(CREEP * rms) } else { CREEP * rms }
}

/// Standard deviation of white noise on a smooth position, from its fourth differences: the median over parts, which
/// events in a few do not move.
pub(super) fn white_noise(y: &[f64]) -> f64 {
    const PARTS: usize = 50;
    let part = (y.len() / PARTS).max(16);
    let rms = |y: &[f64]| {
        let squares = y.windows(5).map(|w| (w[0] - 4.0 * w[1] + 6.0 * w[2] - 4.0 * w[3] + w[4]).powi(2));
        // 1 + 16 + 36 + 16 + 1
        (squares.sum::<f64>() / (70 * y.len().saturating_sub(4).max(1)) as f64).sqrt()
    };
    let mut all: Vec<f64> = y.chunks_exact(part).map(rms).collect();
    let median = crate::statistics::median(&mut all);
    if median.is_finite() { median } else { 0.0 }
}
