//! The decline of an oscillation that beats: two close modes, whose amplitude falls and rises while both die away.

use faer::Mat;

use super::found::Decline;
use crate::linear_algebra::solve;

/// Segments at least. Why: five parameters and as many degrees of freedom.
const LEAST_SEGMENTS: usize = 10;
/// Segments of a beat at least.
const SEGMENTS_OF_A_BEAT: f64 = 3.0;
/// Beats of the stretch at least, and the step of the trials. Why: a quarter of a beat is a slope.
const STEP: f64 = 0.25;
/// Falls of the amplitude over the stretch that are tried, nepers; refined from there.
const FALLS: std::ops::RangeInclusive<i32> = -4..=12;
const FALL_STEP: f64 = 0.5;
/// Depth of the beat, over the mean energy. Why: below it the slope's own scatter holds it.
const DEPTH: f64 = 0.3;
/// Weighted squares that an exponential without a beat leaves over those that a beat leaves, at least. Why: three
/// parameters of ten segments of noise gain less in all but rare cases.
const GAIN: f64 = 4.0;
/// Share of the weighted squares that may be left.
const LEFT: f64 = 0.05;
/// Mean energies that are added to each segment's own: what its error has at least.
const FLOOR: f64 = 0.03;
/// Halvings of the trials' steps.
const HALVINGS: usize = 24;

/// Decline of energies `interval_s` apart that beat; none where they do not, or where they do not follow the model.
///
/// # Model
/// `E(t) = exp(-2 r t) (A + B cos(w t) + C sin(w t))`: two tones that die away alike, in any number of channels; `r` is
/// zero for two steady tones.
/// # Method
/// Least squares, each segment weighted by its energy's error; `A`, `B`, `C` are linear, `w` and `r` are tried on a grid
/// and refined. Error of `r` from the residuals.
pub(super) fn beating(energies: &[f64], interval_s: f64) -> Option<Decline> {
    let count = energies.len();
    if count < LEAST_SEGMENTS {
        return None;
    }
    let mean = energies.iter().sum::<f64>() / count as f64;
    let weights: Vec<f64> = energies.iter().map(|e| 1.0 / (e + FLOOR * mean)).collect();
    let fit = Fit { energies, weights };
    let most = (count as f64 / SEGMENTS_OF_A_BEAT / STEP) as usize;
    let falls = || FALLS.map(|k| FALL_STEP * f64::from(k));
    let beats = (2..=most).flat_map(|k| falls().map(move |fall| [STEP * k as f64, fall]));
    let (left, at) = fit.best(beats, [STEP, FALL_STEP])?;
    let (plain, _) = fit.best(falls().map(|fall| [0.0, fall]), [0.0, FALL_STEP])?;
    let linear = fit.linear(at);
    let all: f64 = energies.iter().zip(&fit.weights).map(|(e, w)| w * e * e).sum();
    if linear[1].hypot(linear[2]) < DEPTH * linear[0] || plain < GAIN * left || left > LEFT * all {
        return None;
    }
    let freedom = count - 5;
    let std = (fit.variance_of_fall(at, linear)? * left / freedom as f64).sqrt();
    let per_s = 1.0 / (count as f64 * interval_s);
    Some(Decline { rate_per_s: at[1] * per_s, std_per_s: std.max(f64::EPSILON) * per_s, freedom })
}

/// Energies with their weights; trials are beats and fall over the stretch.
struct Fit<'a> {
    energies: &'a [f64],
    weights: Vec<f64>,
}

impl Fit<'_> {
    fn columns(&self, [beats, fall]: [f64; 2], k: usize) -> [f64; 3] {
        let t = (k as f64 + 0.5) / self.energies.len() as f64;
        let (falls, (sine, cosine)) = ((-2.0 * fall * t).exp(), (std::f64::consts::TAU * beats * t).sin_cos());
        [falls, falls * cosine, falls * sine]
    }

    /// `A`, `B` and `C`; without a beat `A` alone.
    fn linear(&self, trial: [f64; 2]) -> [f64; 3] {
        let size = if trial[0] > 0.0 { 3 } else { 1 };
        let (mut gram, mut right) = (Mat::zeros(size, size), Mat::zeros(size, 1));
        for (k, (e, w)) in self.energies.iter().zip(&self.weights).enumerate() {
            let columns = self.columns(trial, k);
            for i in 0..size {
                (0..size).for_each(|j| gram[(i, j)] += w * columns[i] * columns[j]);
                right[(i, 0)] += w * columns[i] * e;
            }
        }
        let found = solve(gram, &right);
        std::array::from_fn(|i| if i < size { found[(i, 0)] } else { 0.0 })
    }

    fn left(&self, trial: [f64; 2]) -> f64 {
        let linear = self.linear(trial);
        let model = |k: usize| self.columns(trial, k).iter().zip(linear).map(|(c, l)| c * l).sum::<f64>();
        let left = self.energies.iter().zip(&self.weights).enumerate().map(|(k, (e, w))| w * (e - model(k)).powi(2));
        let left = left.sum::<f64>();
        if left.is_finite() { left } else { f64::INFINITY }
    }

    /// The least squares of the trials, refined by ever smaller steps, and where.
    fn best(&self, trials: impl Iterator<Item = [f64; 2]>, step: [f64; 2]) -> Option<(f64, [f64; 2])> {
        let mut best = trials.map(|t| (self.left(t), t)).min_by(|a, b| a.0.total_cmp(&b.0))?;
        let mut size = 0.5;
        for _ in 0..HALVINGS {
            let around = [[1.0, 0.0], [-1.0, 0.0], [0.0, 1.0], [0.0, -1.0], [1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]];
            let near = |[a, b]: [f64; 2]| [best.1[0] + a * size * step[0], best.1[1] + b * size * step[1]];
            let tried = around.map(|d| (self.left(near(d)), near(d)));
            match tried.into_iter().filter(|t| t.1[0] >= 0.0 && t.0 < best.0).min_by(|a, b| a.0.total_cmp(&b.0)) {
                Some(better) => best = better,
                None => size *= 0.5,
            }
        }
        best.0.is_finite().then_some(best)
    }

    /// The variance of the fall for residuals of variance 1.
    fn variance_of_fall(&self, trial: [f64; 2], linear: [f64; 3]) -> Option<f64> {
        let count = self.energies.len();
        let mut gram: Mat<f64> = Mat::zeros(5, 5);
        for (k, w) in self.weights.iter().enumerate() {
            let (t, [a, b, c]) = ((k as f64 + 0.5) / count as f64, self.columns(trial, k));
            let of_fall = -2.0 * t * (linear[0] * a + linear[1] * b + linear[2] * c);
            let of_beats = std::f64::consts::TAU * t * (linear[2] * b - linear[1] * c);
            let row = [a, b, c, of_beats, of_fall];
            for i in 0..5 {
                (0..5).for_each(|j| gram[(i, j)] += w * row[i] * row[j]);
            }
        }
        let found = solve(gram, &Mat::from_fn(5, 1, |i, _| if i == 4 { 1.0 } else { 0.0 }));
        Some(found[(4, 0)]).filter(|variance| variance.is_finite() && *variance >= 0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    fn energies(count: usize, beats: f64, fall: f64, weight: f64, noise: f64, seed: u64) -> Vec<f64> {
        let draws = white_noise(count, noise, seed);
        let energy = |(k, n): (usize, &f64)| {
            let t = (k as f64 + 0.5) / count as f64;
            let beat = 1.0 + weight * weight + 2.0 * weight * (std::f64::consts::TAU * beats * t + seed as f64).cos();
            (-2.0 * fall * t).exp() * beat * (1.0 + n)
        };
        draws.iter().enumerate().map(energy).collect()
    }

    #[test]
    fn the_fall_of_a_beat_is_found_within_its_error() {
        let mut beyond = 0;
        for seed in 0..200 {
            let beats = 1.0 + 0.02 * seed as f64;
            let found = beating(&energies(32, beats, 1.2, 0.9, 0.02, seed), 1.0 / 32.0).expect("beats");
            // three standard errors of 27 degrees of freedom: one in 170
            beyond += usize::from((found.rate_per_s - 1.2).abs() > 3.0 * found.std_per_s);
        }
        // the weights are the model's for another noise: twice as many as by chance, and a margin
        assert!(beyond <= 8, "{beyond}");
    }

    #[test]
    fn steady_tones_have_no_fall_whether_they_beat_or_not() {
        let mut falls = 0;
        for seed in 0..300 {
            let falling = |energies: &[f64]| beating(energies, 1.0).is_some_and(|d| d.rate_per_s > d.limit_per_s(4.0));
            falls += usize::from(falling(&energies(32, 0.6 + 0.02 * seed as f64, 0.0, 0.9, 0.02, seed)));
            for count in [10, 32] {
                falls += usize::from(falling(&energies(count, 1.0, 0.0, 0.0, 0.05, seed)));
            }
        }
        // four standard errors: none of 900; less than one beat leaves fall and beat hardly apart
        assert!(falls <= 1, "{falls}");
    }
}
