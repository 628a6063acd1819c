//! Responses that disagree on a pole: a structure that changed from one to the next.

use std::ops::Range;

use faer::Mat;

use super::projection::Projection;
use crate::statistics::gamma_tail;

/// Degrees of freedom from which on a scatter counts: those of four responses that know a pole alike, with a rest of
/// information in others.
const DEGREES: f64 = 2.5;
/// Probability of a scatter by chance above which responses agree.
const AGREE: f64 = 0.005;

/// How far the responses' own scores move each parameter of the poles.
pub(super) struct Scatter {
    /// By parameter.
    all: Vec<Spread>,
}

/// Scatter of one parameter over what its variance promises, and the degrees of freedom of that.
#[derive(Debug, Clone, Copy)]
struct Spread {
    ratio: f64,
    degrees: f64,
}

impl Scatter {
    /// Of a fit with this covariance of the poles.
    pub fn new(at: &Projection, covariance: &Mat<f64>) -> Self {
        let n = covariance.nrows();
        let spread = |i: usize| {
            let along = |score: &[f64]| (0..n).map(|j| covariance[(i, j)] * score[j]).sum::<f64>();
            let moved: Vec<f64> = at.solved.iter().map(|own| along(&own.eliminated.score)).collect();
            let information = |own: &Mat<f64>| -> f64 {
                let row = |j: usize| (0..n).map(|k| own[(j, k)] * covariance[(i, k)]).sum::<f64>();
                (0..n).map(|j| covariance[(i, j)] * row(j)).sum()
            };
            let variance = covariance[(i, i)].max(f64::MIN_POSITIVE);
            let shares: Vec<f64> = at.solved.iter().map(|own| information(&own.information) / variance).collect();
            Spread::of(&moved, &shares, variance)
        };
        Self { all: (0..n).map(spread).collect() }
    }

    /// Factor on variances of a pole's parameters: that of the residual, and more where the responses disagree on the
    /// pole by more than chance.
    pub fn factor(&self, own: Range<usize>, factor: f64) -> f64 {
        let beyond = self.all[own].iter().filter(|spread| spread.tail(factor) < AGREE);
        beyond.map(|spread| spread.ratio).fold(factor, f64::max)
    }
}

impl Spread {
    /// `moved`: by how much each response's score moves the parameter; `shares`: of the information that each holds.
    ///
    /// Scores that sum to zero have the covariance `diag(s) - s s^T`, in units of the variance: of the sum of squares
    /// the mean is its trace, and the degrees of freedom (Satterthwaite) are the trace's square over that of its square.
    /// As sums of products of shares: what one response alone knows is zero, not a rounding.
    fn of(moved: &[f64], shares: &[f64], variance: f64) -> Self {
        let total: f64 = shares.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let share = |i: usize| shares[i] / total;
        let others =
            |i: usize, power: i32| (0..shares.len()).filter(|j| *j != i).map(|j| share(j).powi(power)).sum::<f64>();
        let mean: f64 = (0..shares.len()).map(|i| share(i) * others(i, 1)).sum();
        let row = |i: usize| share(i).powi(2) * (others(i, 1).powi(2) + others(i, 2));
        let square: f64 = (0..shares.len()).map(row).sum();
        let size: f64 = moved.iter().map(|m| m * m).sum();
        Self {
            ratio: size / (variance * mean).max(f64::MIN_POSITIVE),
            degrees: mean * mean / square.max(f64::MIN_POSITIVE),
        }
    }

    /// Probability of as large a scatter by chance, variances being `factor` times as large; one where too few know.
    fn tail(&self, factor: f64) -> f64 {
        if self.degrees < DEGREES {
            return 1.0;
        }
        gamma_tail(0.5 * self.degrees, 0.5 * self.degrees * self.ratio / factor)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    /// Share of draws in which responses of these shares of the information seem to disagree.
    fn alarms(shares: &[f64], wide: f64) -> f64 {
        let draws = 20_000;
        let noise = white_noise(draws * shares.len(), wide, 3);
        let seen = noise.chunks(shares.len()).filter(|own| {
            let x: Vec<f64> = own.iter().zip(shares).map(|(e, s)| e / s.sqrt()).collect();
            let mean: f64 = x.iter().zip(shares).map(|(x, s)| s * x).sum();
            let moved: Vec<f64> = x.iter().zip(shares).map(|(x, s)| s * (x - mean)).collect();
            Spread::of(&moved, shares, 1.0).tail(1.0) < AGREE
        });
        seen.count() as f64 / draws as f64
    }

    #[test]
    fn responses_that_agree_are_said_to_disagree_as_seldom_as_stated_however_the_information_is_shared() {
        // 20,000 draws of a probability of 0.5 %: a standard error of 0.05 %; Satterthwaite's tail is right to a half
        for shares in
            [vec![1.0 / 6.0; 6], vec![0.5, 0.2, 0.1, 0.1, 0.05, 0.05], vec![0.75, 0.05, 0.05, 0.05, 0.05, 0.05]]
        {
            let found = alarms(&shares, 1.0);
            assert!((0.002..0.01).contains(&found), "{shares:?}: {found}");
        }
    }

    #[test]
    fn what_one_response_alone_knows_does_not_scatter() {
        for shares in [vec![1.0], vec![1.0 - 1e-16], vec![0.3], vec![1.0 - 1e-9, 1e-9], vec![1.0, 1e-17, 1e-18]] {
            let moved: Vec<f64> = shares.iter().map(|s| 1e-3 * s).collect();
            let spread = Spread::of(&moved, &shares, 1.0);
            assert_eq!(spread.tail(1.0), 1.0, "{shares:?}: {spread:?}");
        }
    }

    #[test]
    fn a_scatter_of_ten_times_the_variance_is_seen_in_most_draws() {
        // of five degrees of freedom 16.7 is beyond 0.5 %: a tenth of it is exceeded in 89 %; of 3.3 degrees in 77 %
        assert!(alarms(&[1.0 / 6.0; 6], 10f64.sqrt()) > 0.85);
        assert!(alarms(&[0.5, 0.2, 0.1, 0.1, 0.05, 0.05], 10f64.sqrt()) > 0.7);
    }
}
