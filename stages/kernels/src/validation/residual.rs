//! Residual tests: is anything left that the model should have explained?

use crate::linear_algebra::{Svd, TallQr, clear_factor, gram_of};
use faer::Mat;

use crate::model::{ModelError, finite};
use crate::statistics::chi_square_tail;

/// A test statistic with its tail probability.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TestResult {
    /// Chi-square distributed if the hypothesis holds.
    pub statistic: f64,
    /// Degrees of freedom.
    pub freedom: usize,
    /// Probability of a larger statistic if the hypothesis holds.
    pub p_value: f64,
}

impl TestResult {
    fn new(statistic: f64, freedom: usize) -> Self {
        Self { statistic, freedom, p_value: chi_square_tail(statistic, freedom) }
    }
}

/// Ljung-Box test of whiteness over `lags` lags, `fitted` noise parameters taken off the degrees of freedom.
///
/// # Model
/// e white: `N (N + 2) sum_l r_l^2 / (N - l)` is chi-square with `lags - fitted` degrees of freedom.
/// # Method
/// Autocorrelations of e, its mean removed. Noise parameters are those that whiten the errors: none of output error, the
/// coefficients of an autoregressive filter. Of the missing samples' pairs there is none: `N - l` is how many pairs there
/// are, N how many samples.
/// # Shapes
/// e: N samples, more than `lags`, NaN where missing; `lags` more than `fitted`.
/// # Units
/// None.
/// # Accuracy
/// Asymptotic in N. With a rich record it rejects models that are good enough: a plain number, not a verdict.
/// # Errors
/// Too few samples or lags, a constant e, values that are not finite.
/// # Source
/// G. Ljung and G. Box, Biometrika 65 (1978) 297.
pub fn whiteness(e: &[f64], lags: usize, fitted: usize) -> Result<TestResult, ModelError> {
    let present: Vec<f64> = e.iter().copied().filter(|e| !e.is_nan()).collect();
    finite("residual", &present)?;
    if lags <= fitted {
        return Err(ModelError::Parameter {
            name: "lags",
            found: lags as f64,
            wanted: "more than the fitted noise parameters",
        });
    }
    if present.len() <= lags {
        return Err(ModelError::TooShort { found: present.len(), wanted: lags + 1 });
    }
    let n = present.len() as f64;
    let mean = present.iter().sum::<f64>() / n;
    let power: f64 = present.iter().map(|e| (e - mean).powi(2)).sum();
    if power <= 0.0 {
        return Err(ModelError::ConstantOutput);
    }
    let statistic: f64 = (1..=lags)
        .map(|lag| {
            let products = e.iter().zip(&e[lag..]).map(|(x, y)| (x - mean) * (y - mean)).filter(|p| !p.is_nan());
            let (sum, pairs) = products.fold((0.0, 0.0), |(sum, pairs), product| (sum + product, pairs + 1.0));
            let r = sum / power;
            if pairs > 0.0 { r * r / pairs } else { 0.0 }
        })
        .sum();
    Ok(TestResult::new(n * (n + 2.0) * statistic, lags - fitted))
}

/// Whether e still depends on the input: its projection on u and `lags` delays of u.
///
/// # Model
/// e white and independent of u: the energy of the projection over the variance of e is chi-square with as many degrees
/// of freedom as the delays of u span.
/// # Method
/// Products of the delayed inputs, their means removed, where these keep enough digits; QR and rank elsewhere: a step
/// spans few directions, and only those are counted.
/// Samples whose residual is missing are left out.
/// # Shapes
/// u, e: N samples, more than twice `lags` of them present; e is NaN where missing.
/// # Units
/// None.
/// # Accuracy
/// Conservative: directions that the model's own fit has emptied are counted. Blind to what poles and gains absorb.
/// # Errors
/// Lengths, values that are not finite, too few samples, a constant e.
/// # Source
/// L. Ljung, System Identification (1999), section 16.6.
pub fn input_dependence(u: &[f64], e: &[f64], lags: usize) -> Result<TestResult, ModelError> {
    if u.len() != e.len() {
        return Err(ModelError::Length { what: "input", found: u.len(), wanted: e.len() });
    }
    finite("input", u)?;
    let kept: Vec<usize> = (lags.min(e.len())..e.len()).filter(|&k| !e[k].is_nan()).collect();
    let rows = kept.len();
    if rows < lags + 2 {
        return Err(ModelError::TooShort { found: rows, wanted: lags + 2 });
    }
    let centred = |values: &[f64], delay: usize| {
        let mean = kept.iter().map(|k| values[k - delay]).sum::<f64>() / rows as f64;
        kept.iter().map(|k| values[k - delay] - mean).collect::<Vec<f64>>()
    };
    let target = centred(e, 0);
    finite("residual", &target)?;
    let variance = target.iter().map(|e| e * e).sum::<f64>() / rows as f64;
    if variance <= 0.0 {
        return Err(ModelError::ConstantOutput);
    }
    let mut columns: Vec<Vec<f64>> = (0..=lags).map(|lag| centred(u, lag)).collect();
    columns.push(target);
    let (energy, rank) = match explained(&columns) {
        Some(energy) => (energy, lags + 1),
        None => explained_by_rotation(&columns)?,
    };
    Ok(TestResult::new(energy / variance, rank))
}

/// Least share of its energy that a column keeps beside those before it where products serve.
const LEAST_KEPT: f64 = 1e-8;

/// Energy of the last column along the others, by products. None: too ill-conditioned for these.
fn explained(columns: &[Vec<f64>]) -> Option<f64> {
    let slices: Vec<&[f64]> = columns.iter().map(Vec::as_slice).collect();
    let lower = clear_factor(&gram_of(&slices), LEAST_KEPT)?;
    let last = columns.len() - 1;
    Some((0..last).map(|j| lower[(last, j)].powi(2)).sum())
}

/// The same by rotations, and the rank of the others. Errors: no convergence.
fn explained_by_rotation(columns: &[Vec<f64>]) -> Result<(f64, usize), ModelError> {
    let (rows, last) = (columns.first().map_or(0, Vec::len), columns.len() - 1);
    let matrix = Mat::from_fn(rows, last + 1, |i, j| columns[j][i]);
    let r = TallQr::triangle(matrix.as_ref());
    let svd = Svd::new(&r.as_ref().get(..last, ..last).to_owned())?;
    // directions 1e9 times weaker than the strongest are rounding of the means
    let rank = if svd.s.first().is_some_and(|s| *s > 0.0) { svd.rank(1e-9) } else { 0 };
    let along = (0..rank).map(|k| (0..last).map(|i| svd.u[(i, k)] * r[(i, last)]).sum::<f64>().powi(2));
    Ok((along.sum(), rank))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn p_values_of_white_noise_are_uniform() {
        let u: Vec<f64> = (0..2000).map(|k| if k < 500 { -1.0 } else { 0.0 }).collect();
        let (mut white, mut input) = (Vec::new(), Vec::new());
        for seed in 0..100 {
            let e = white_noise(2000, 1e-3, seed);
            white.push(whiteness(&e, 25, 0).unwrap().p_value);
            input.push(input_dependence(&u, &e, 10).unwrap().p_value);
        }
        for p in [white, input] {
            let mean = p.iter().sum::<f64>() / 100.0;
            // uniform: standard error of the mean 0.029, four of them
            assert!((mean - 0.5).abs() < 0.12, "{mean}");
        }
    }

    #[test]
    fn products_give_what_rotations_give() {
        let (u, e) = (white_noise(500, 1.0, 1), white_noise(500, 1.0, 2));
        let mut columns: Vec<Vec<f64>> = (0..20).map(|lag| u[20 - lag..480 - lag].to_vec()).collect();
        columns.push(e[20..480].to_vec());
        let (slow, rank) = explained_by_rotation(&columns).unwrap();
        // a hundred roundings
        assert!(rank == 20 && (explained(&columns).unwrap() / slow - 1.0).abs() < 1e-13);
        // a step has two directions here, before it and after
        (0..20).for_each(|lag| columns[lag] = (0..460).map(|k| if k < 10 + lag / 10 { 1.0 } else { 0.0 }).collect());
        assert!(explained(&columns).is_none());
        assert_eq!(explained_by_rotation(&columns).unwrap().1, 2);
    }

    #[test]
    fn missing_samples_leave_p_values_uniform() {
        let mut sum = 0.0;
        for seed in 0..100 {
            let mut e = white_noise(2000, 1e-3, seed);
            e[300..500].fill(f64::NAN);
            (0..2000).step_by(7).for_each(|k| e[k] = f64::NAN);
            sum += whiteness(&e, 25, 0).unwrap().p_value;
            let u: Vec<f64> = (0..2000).map(|k| if k < 600 { -1.0 } else { 0.0 }).collect();
            assert!(input_dependence(&u, &e, 10).unwrap().p_value > 1e-4, "seed {seed}");
        }
        // as above
        assert!((sum / 100.0 - 0.5).abs() < 0.12, "{sum}");
    }

    #[test]
    fn colour_and_a_forgotten_response_are_seen() {
        let noise = white_noise(2001, 1e-3, 1);
        let coloured: Vec<f64> = noise.windows(2).map(|w| w[1] + 0.2 * w[0]).collect();
        // correlation 0.19 at lag 1: 8.6 standard errors
        assert!(whiteness(&coloured, 25, 0).unwrap().p_value < 1e-6);
        let u: Vec<f64> = (0..2000).map(|k| if k < 500 { -1.0 } else { 0.0 }).collect();
        let left: Vec<f64> = noise.iter().zip(&u).map(|(e, u)| e + 3e-4 * u).collect();
        // a step of 0.3 standard deviations over 500 of 2000 samples: 5.8 standard errors
        assert!(input_dependence(&u, &left, 10).unwrap().p_value < 1e-2);
    }

    #[test]
    fn unusable_residuals_are_refused() {
        assert!(whiteness(&[0.0; 50], 20, 0).is_err());
        assert!(whiteness(&white_noise(50, 1.0, 1), 20, 20).is_err());
        assert!(whiteness(&white_noise(10, 1.0, 1), 20, 0).is_err());
        assert!(input_dependence(&[0.0; 10], &white_noise(50, 1.0, 1), 5).is_err());
        // an input that never moves has nothing to depend on
        assert_eq!(input_dependence(&[1.0; 50], &white_noise(50, 1.0, 1), 5).unwrap().freedom, 0);
    }
}
