//! Noise of a colour of its own: an autoregressive filter that whitens what the simulation leaves.

use crate::linear_algebra::{dot_in_lanes, eigenvalues};
use faer::{Mat, c64};

use super::jacobian::{Noise, Point, residual};
use super::levenberg_marquardt::{Limits, minimise};
use super::predictor::Problem;
use super::state::State;
use super::whitening::Whitened;
use crate::model::{ModelError, coordinates, sections};

/// Rounds of noise, then poles.
const ROUNDS: usize = 3;
/// Largest order of the noise filter, and least samples for each of its coefficients.
const LARGEST: usize = 24;
const SAMPLES_EACH: usize = 20;

/// Largest order of a noise filter for so many samples.
pub(crate) fn largest_order(samples: usize) -> usize {
    LARGEST.min(samples / SAMPLES_EACH).max(1)
}

/// Refits an output error with its residual whitened: generalised least squares for Box and Jenkins' model with noise
/// `1 / A_e`.
///
/// Method: Levinson's recursion on the autocovariance of the simulation's error, order by BIC; then poles under that
/// filter, in turn.
/// Source: L. Ljung, System Identification (1999), section 10.4; G. Box and G. Jenkins, Time Series Analysis (1970).
pub(crate) fn whitened(problem: &Problem, mut state: State, limits: Limits) -> Result<State, ModelError> {
    let plain = Whitened::new(&problem.experiments, (Vec::new(), Vec::new()));
    for _ in 0..ROUNDS {
        let errors = match state.point.noise {
            Noise::White => state.residual(),
            _ => residual(&problem.regressors(&state.point.a(), &plain).slices(), &state.projection.theta),
        };
        let filter = autoregression(problem, &errors)?;
        let rest = vec![[0.0; 2]; filter.len()];
        let point = Point { poles: state.point.poles.clone(), noise: Noise::Frozen(filter, rest) };
        let next = State { iterations: state.iterations, ..State::new(problem, point)? };
        state = minimise(problem, next, limits)?;
    }
    Ok(state)
}

/// Sections of the polynomial that whitens `e` (rows of all experiments). Errors: no convergence of its roots.
fn autoregression(problem: &Problem, e: &[f64]) -> Result<Vec<[f64; 2]>, ModelError> {
    let samples = problem.measured().iter().map(|(_, y)| y.len()).sum();
    let most = largest_order(samples);
    let polynomial = least_bic(levinson(&autocovariance(problem, e, most)), samples).coefficients;
    let order = polynomial.len();
    if order == 0 {
        return Ok(Vec::new());
    }
    let companion =
        Mat::from_fn(order, order, |i, j| if i == 0 { -polynomial[j] } else { f64::from(u8::from(i == j + 1)) });
    let roots: Vec<c64> = eigenvalues(&companion)?;
    Ok(sections(&coordinates(&roots)))
}

/// At lags 0 to `most`, within experiments, over all samples: a positive definite sequence.
fn autocovariance(problem: &Problem, e: &[f64], most: usize) -> Vec<f64> {
    let mut sums = vec![0.0; most + 1];
    let mut rest = e;
    for (_, y) in problem.measured() {
        let (own, more) = rest.split_at(y.len());
        rest = more;
        for (lag, sum) in sums.iter_mut().enumerate() {
            *sum += dot_in_lanes(&own[..own.len().saturating_sub(lag)], own.get(lag..).unwrap_or_default());
        }
    }
    sums
}

/// A one-step predictor of a stationary process.
#[derive(Debug, Clone, Default)]
pub(crate) struct Autoregression {
    /// `1 + a1 q^-1 + ...` without the leading one: stable.
    pub coefficients: Vec<f64>,
    /// Variance of its errors, in units of the autocovariance.
    pub variance: f64,
}

/// Predictors of ascending order, from none on, up to where nothing but rounding is left to predict; empty for a
/// process that is zero.
pub(crate) fn levinson(covariance: &[f64]) -> Vec<Autoregression> {
    let Some((&zero, _)) = covariance.split_first().filter(|(zero, _)| **zero > 0.0) else { return Vec::new() };
    let (mut a, mut error): (Vec<f64>, f64) = (Vec::new(), zero);
    let mut all = vec![Autoregression { coefficients: Vec::new(), variance: zero }];
    for order in 1..covariance.len() {
        let reach: f64 = a.iter().enumerate().map(|(j, a)| a * covariance[order - 1 - j]).sum();
        let reflection = -(covariance[order] + reach) / error;
        let turned: Vec<f64> = a.iter().rev().map(|a| reflection * a).collect();
        a.iter_mut().zip(&turned).for_each(|(a, t)| *a += t);
        a.push(reflection);
        error *= 1.0 - reflection * reflection;
        if error.is_nan() || error <= 1e-14 * zero {
            break;
        }
        all.push(Autoregression { coefficients: a.clone(), variance: error });
    }
    all
}

/// The predictor with the least BIC.
pub(crate) fn least_bic(predictors: Vec<Autoregression>, samples: usize) -> Autoregression {
    let n = samples as f64;
    let score = |order: usize, variance: f64| n * variance.ln() + order as f64 * n.ln();
    let scored = predictors.into_iter().enumerate().map(|(order, own)| (score(order, own.variance), own));
    scored.min_by(|x, y| x.0.total_cmp(&y.0)).map(|(_, own)| own).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;
    use crate::pem::columns::BufferPool;

    #[test]
    fn an_autoregression_is_found_with_its_order() {
        for seed in 0..10 {
            let e = white_noise(4000, 1.0, seed);
            let mut y = vec![0.0; 4000];
            for t in 2..4000 {
                y[t] = 1.6 * y[t - 1] - 0.8 * y[t - 2] + e[t];
            }
            let u = vec![0.0; 4000];
            let problem = Problem {
                experiments: vec![(&u, &y)],
                inputs: 1,
                order: 2,
                offset: false,
                slope: false,
                missing: Vec::new(),
                priors: 0,
                buffers: BufferPool::default(),
                watch: crate::Watch::default(),
            };
            let found = least_bic(levinson(&autocovariance(&problem, &y, 12)), 4000).coefficients;
            // standard error sqrt((1 - 0.8^2) / 4000) = 0.0095: four of them; BIC errs upwards in one of hundreds
            assert!((found[0] + 1.6).abs() < 0.038 && (found[1] - 0.8).abs() < 0.038, "{found:?}");
            assert!(found.len() <= 4, "{found:?}");
        }
        assert!(least_bic(levinson(&[0.0, 0.0]), 10).coefficients.is_empty());
    }
}
