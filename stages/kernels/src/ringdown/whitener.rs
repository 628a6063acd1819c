//! Whitening of records under ringdown noise: the exact one-step prediction errors.

use super::noise::RingdownNoise;

/// Signals that pass the filter side by side.
pub const LANES: usize = 8;

/// A filter that turns noise of a [`RingdownNoise`] into white noise of unit variance.
///
/// # Method
/// The Kalman filter of the noise's state space, started in the stationary state: `e(k) = (v(k) - H x(k|k-1)) /
/// sqrt(S(k))` is linear in `v` and multiplies `v` by the inverse of the Cholesky factor of its covariance. Gains are
/// computed once, for every record. Over a missing sample the state is predicted and not corrected; the filtered record
/// is zero there, so that its energy is that of the samples that are there.
/// # Shapes
/// States: two per thermal mode, one per wander; about `10 states` operations per sample and record.
/// # Accuracy
/// Exact. Gains are held once they change by less than `1e-12` of themselves.
/// # Source
/// B. D. O. Anderson and J. B. Moore, Optimal Filtering, 1979, chapter 9.
#[derive(Debug, Clone)]
pub struct Whitener {
    rotations: Vec<[f64; 4]>,
    decays: Vec<f64>,
    /// `A K` and `1 / sqrt(S)` of each sample; the last entry serves all later ones.
    gains: Vec<(Vec<f64>, f64)>,
    /// Where samples are missing: which of the gains is each sample's, none for a missing one. Empty where every sample
    /// is there.
    order: Vec<Option<usize>>,
}

/// Relative change below which the gain counts as constant.
const SETTLED: f64 = 1e-12;

impl Whitener {
    /// The filter for records of at most `samples` samples `interval_s` apart, some of which are `missing` (empty:
    /// none).
    pub fn new(noise: &RingdownNoise, interval_s: f64, samples: usize, missing: &[bool]) -> Self {
        let thermal: Vec<_> = noise.thermal.iter().filter(|mode| mode.variance > 0.0).collect();
        let wander: Vec<_> = noise.wander.iter().filter(|part| part.variance > 0.0).collect();
        let rotations: Vec<[f64; 4]> = thermal.iter().map(|mode| rotation(mode.pole, interval_s)).collect();
        let decays: Vec<f64> = wander.iter().map(|part| (-part.rate_per_s * interval_s).exp()).collect();
        let stationary: Vec<f64> =
            thermal.iter().flat_map(|mode| [mode.variance; 2]).chain(wander.iter().map(|part| part.variance)).collect();
        let mut filter = Self { rotations, decays, gains: Vec::new(), order: Vec::new() };
        filter.riccati(&stationary, noise.white, samples, missing);
        filter
    }

    /// The factor that whitens white noise, where that is all; none where the filter has states.
    pub fn constant(&self) -> Option<f64> {
        if self.states() > 0 || !self.order.is_empty() { None } else { self.gains.first().map(|gain| gain.1) }
    }

    /// Sum of the logarithms of the prediction errors' variances over a record: of the determinant of its noise's
    /// covariance.
    pub fn log_variance(&self, samples: usize) -> f64 {
        let Some(last) = self.gains.len().checked_sub(1) else { return 0.0 };
        let of = |gain: usize| -2.0 * self.gains[gain.min(last)].1.ln();
        match self.order.is_empty() {
            true => (0..samples).map(of).sum(),
            false => self.order.iter().take(samples).flatten().map(|&gain| of(gain)).sum(),
        }
    }

    fn states(&self) -> usize {
        2 * self.rotations.len() + self.decays.len()
    }

    /// Weights of the states in the signal: a mode's position, all of a wander.
    fn observed(&self, state: usize) -> bool {
        state >= 2 * self.rotations.len() || state.is_multiple_of(2)
    }

    /// `x <- A x`.
    fn advance(&self, x: &mut [f64]) {
        for (pair, [a, b, c, d]) in x.chunks_exact_mut(2).zip(&self.rotations) {
            (pair[0], pair[1]) = (a * pair[0] + b * pair[1], c * pair[0] + d * pair[1]);
        }
        x[2 * self.rotations.len()..].iter_mut().zip(&self.decays).for_each(|(x, decay)| *x *= decay);
    }

    fn riccati(&mut self, stationary: &[f64], white: f64, samples: usize, missing: &[bool]) {
        let n = self.states();
        // deviation from the stationary covariance: P = diag(stationary) - D, D <- A (D + S^-1 (P h)(P h)^T) A^T
        let mut deficit = vec![0.0; n * n];
        let mut gains: Vec<(Vec<f64>, f64)> = Vec::new();
        let mut order = Vec::new();
        let (mut held, mut follows) = (false, false);
        for k in 0..samples.max(1) {
            if missing.get(k).copied().unwrap_or(false) {
                order.push(None);
                self.predict(&mut deficit);
                (held, follows) = (false, false);
                continue;
            }
            if held {
                order.push(gains.len().checked_sub(1));
                continue;
            }
            let (ph, s) = self.innovation(stationary, white, &deficit);
            let mut gain: Vec<f64> = ph.iter().map(|p| p / s).collect();
            self.advance(&mut gain);
            let entry = (gain, 1.0 / s.sqrt());
            held = follows && gains.last().is_some_and(|last| settled(last, &entry));
            follows = true;
            order.push(Some(gains.len()));
            gains.push(entry);
            if held {
                if missing.is_empty() {
                    break;
                }
                continue;
            }
            for i in 0..n {
                for j in 0..n {
                    deficit[i * n + j] += ph[i] * ph[j] / s;
                }
            }
            self.predict(&mut deficit);
        }
        self.gains = gains;
        self.order = if missing.is_empty() { Vec::new() } else { order };
    }

    /// `P h` and the variance of the next sample's prediction error.
    fn innovation(&self, stationary: &[f64], white: f64, deficit: &[f64]) -> (Vec<f64>, f64) {
        let n = self.states();
        let ph: Vec<f64> = (0..n)
            .map(|i| {
                let own = if self.observed(i) { stationary[i] } else { 0.0 };
                own - (0..n).filter(|&j| self.observed(j)).map(|j| deficit[i * n + j]).sum::<f64>()
            })
            .collect();
        let s = white + (0..n).filter(|&i| self.observed(i)).map(|i| ph[i]).sum::<f64>();
        (ph, s)
    }

    /// `D <- A D A^T`.
    fn predict(&self, deficit: &mut [f64]) {
        let n = self.states();
        for row in deficit.chunks_exact_mut(n.max(1)) {
            self.advance(row);
        }
        let mut column = vec![0.0; n];
        for j in 0..n {
            (0..n).for_each(|i| column[i] = deficit[i * n + j]);
            self.advance(&mut column);
            (0..n).for_each(|i| deficit[i * n + j] = column[i]);
        }
    }

    /// Whitens up to 8 signals of one length in place.
    pub fn apply(&self, signals: &mut [&mut [f64]]) {
        pulp::Arch::new().dispatch(|| self.filter(signals));
    }

    #[inline(always)]
    fn filter(&self, signals: &mut [&mut [f64]]) {
        let samples = signals.first().map_or(0, |signal| signal.len());
        let modes = self.rotations.len();
        let mut state = vec![[0.0; LANES]; self.states()];
        let Some(last) = self.gains.len().checked_sub(1) else { return };
        for k in 0..samples {
            let mut error = [0.0; LANES];
            // where every sample is there they take the gains in turn; over a missing one the error is zero: nothing is
            // corrected
            let chosen = if self.order.is_empty() { Some(k) } else { self.order.get(k).copied().flatten() };
            let (gain, scale) = &self.gains[chosen.unwrap_or(last).min(last)];
            if chosen.is_some() {
                error.iter_mut().zip(signals.iter()).for_each(|(e, signal)| *e = signal[k]);
                let observed = state[..2 * modes].iter().step_by(2).chain(&state[2 * modes..]);
                for x in observed {
                    (0..LANES).for_each(|l| error[l] -= x[l]);
                }
            }
            for ((pair, [a, b, c, d]), g) in
                state[..2 * modes].chunks_exact_mut(2).zip(&self.rotations).zip(gain.chunks_exact(2))
            {
                for l in 0..LANES {
                    let (q, p) = (pair[0][l], pair[1][l]);
                    pair[0][l] = a * q + b * p + g[0] * error[l];
                    pair[1][l] = c * q + d * p + g[1] * error[l];
                }
            }
            for ((x, decay), g) in state[2 * modes..].iter_mut().zip(&self.decays).zip(&gain[2 * modes..]) {
                (0..LANES).for_each(|l| x[l] = decay * x[l] + g * error[l]);
            }
            signals.iter_mut().zip(error).for_each(|(signal, e)| signal[k] = scale * e);
        }
    }
}

fn settled(last: &(Vec<f64>, f64), next: &(Vec<f64>, f64)) -> bool {
    let close = |a: f64, b: f64| (a - b).abs() <= SETTLED * b.abs();
    close(last.1, next.1) && last.0.iter().zip(&next.0).all(|(a, b)| close(*a, *b))
}

/// Exact step of an oscillator over `interval_s` in the states q and q'/w: row-major.
fn rotation(pole: faer::c64, interval_s: f64) -> [f64; 4] {
    let (a, b, w) = (-pole.re, pole.im, pole.norm());
    let decay = (-a * interval_s).exp();
    let (sin, cos) = (b * interval_s).sin_cos();
    let (s, t) = (decay * sin * w / b, decay * sin * a / b);
    [decay * cos + t, s, -s, decay * cos - t]
}
