//! The square-root Kalman filter.

use super::system::Augmented;
use super::triangle::Rows;

/// Standard deviations of what moves the force, and of the start; all in units of the measurement noise.
#[derive(Debug, Clone)]
pub(super) struct Strengths {
    /// Step of the walk per sample (its last state): up to the transition, and after it.
    pub walk: [f64; 2],
    /// Additional step of the force itself within the transition.
    pub jump: f64,
    /// Samples after which the force may jump.
    pub transition: std::ops::Range<usize>,
    /// Of every state at the first sample.
    pub start: f64,
}

/// What the filter leaves for likelihood and smoother.
pub(super) struct Filtered {
    /// Mean after each measurement, `[sample][state]`; empty for the likelihood alone.
    pub mean: Vec<Vec<f64>>,
    /// Lower triangular factors of the covariances after each measurement.
    pub factor: Vec<Rows>,
    /// `sum v^2 / s` and `sum ln s` over the samples that count, and their number.
    pub squares: f64,
    pub logarithms: f64,
    pub count: usize,
    /// Normalised innovations.
    pub innovations: Vec<f64>,
}

/// Filters `y`. The first `2 size` samples settle the start and are not counted.
///
/// # Method
/// Measurement update of the triangular factor by Carlson's recursion, time update by Householder reflections of `[F S,
/// G]`: covariances are never formed and cannot lose their sign. For the likelihood alone a gain that has settled is
/// kept until the next transition.
///
/// # Source
/// N. A. Carlson, AIAA J. 11 (1973) 1259; T. Kailath, A. Sayed, B. Hassibi, Linear Estimation (2000), ch. 12.
pub(super) fn filter(system: &Augmented, y: &[f64], strengths: &Strengths, keep: bool) -> Filtered {
    let m = system.size;
    let mut z = vec![0.0; m];
    let mut s = Rows::zeros(m, m);
    (0..m).for_each(|i| s.row_mut(i)[i] = strengths.start);
    let mut wide = Rows::zeros(m, m + 2);
    let mut done = Filtered {
        mean: Vec::new(),
        factor: Vec::new(),
        squares: 0.0,
        logarithms: 0.0,
        count: 0,
        innovations: Vec::with_capacity(if keep { y.len() } else { 0 }),
    };
    let (mut steady, mut before) = (false, (0.0, vec![0.0; m]));
    for (t, &y) in y.iter().enumerate() {
        let innovation = y - system.out(&z);
        steady &= !strengths.transition.contains(&t) && !strengths.transition.contains(&(t.wrapping_sub(1)));
        let (variance, gain) = if steady { before.clone() } else { measure(&mut s, &system.output) };
        z.iter_mut().zip(&gain).for_each(|(z, k)| *z += k * innovation);
        if t >= 2 * m {
            done.squares += innovation * innovation / variance;
            done.logarithms += variance.ln();
            done.count += 1;
        }
        if keep {
            done.innovations.push(innovation / variance.sqrt());
            done.mean.push(z.clone());
            done.factor.push(s.clone());
        }
        z = system.advance(&z, y);
        if steady {
            continue;
        }
        steady = !keep && settled(&before, variance, &gain);
        before = (variance, gain);
        system.propagate(&s, &mut wide);
        add_noise(&mut wide, system, strengths, t);
        wide.triangularise(m);
        (0..m).for_each(|i| s.row_mut(i)[..=i].copy_from_slice(&wide.row(i)[..=i]));
    }
    done
}

/// Whether variance and gain have stopped changing, as far as a likelihood can tell: 1e-8 per step leaves 1e-5 even
/// where 1000 steps are correlated.
fn settled(before: &(f64, Vec<f64>), variance: f64, gain: &[f64]) -> bool {
    const STILL: f64 = 1e-8;
    let largest = gain.iter().fold(0.0_f64, |a, g| a.max(g.abs()));
    (variance - before.0).abs() <= STILL * variance
        && gain.iter().zip(&before.1).all(|(a, b)| (a - b).abs() <= STILL * largest)
}

/// The last two columns: steps of walk and force after sample `t`.
pub(super) fn add_noise(wide: &mut Rows, system: &Augmented, strengths: &Strengths, t: usize) {
    let m = system.size;
    (0..wide.values.len() / wide.width).for_each(|i| wide.row_mut(i)[m..].fill(0.0));
    wide.row_mut(m - 1)[m] = strengths.walk[usize::from(t >= strengths.transition.start)];
    if strengths.transition.contains(&t) {
        wide.row_mut(system.order)[m + 1] = strengths.jump;
    }
}

/// Updates a lower triangular factor with a measurement of unit noise; returns the innovation's variance and the gain.
fn measure(s: &mut Rows, h: &[f64]) -> (f64, Vec<f64>) {
    let m = h.len();
    // f = S' h
    let mut f = vec![0.0; m];
    for (i, h) in h.iter().enumerate().filter(|(_, h)| **h != 0.0) {
        f.iter_mut().zip(&s.row(i)[..=i]).for_each(|(f, s)| *f += h * s);
    }
    let mut gain = vec![0.0; m];
    let mut a = 1.0;
    // from the last column on, a lower triangular factor stays one
    for j in (0..m).rev() {
        let next = a + f[j] * f[j];
        let (keep, mix) = ((a / next).sqrt(), f[j] / (a * next).sqrt());
        for (i, gain) in gain.iter_mut().enumerate().skip(j) {
            let value = &mut s.values[i * m + j];
            let old = *value;
            *value = old * keep - *gain * mix;
            *gain += old * f[j];
        }
        a = next;
    }
    gain.iter_mut().for_each(|k| *k /= a);
    (a, gain)
}
