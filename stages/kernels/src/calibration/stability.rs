//! Does a quantity change over the archive?

use crate::statistics::{chi_square_tail, normal_two_sided};

/// Two tests of constancy of a series with known errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stability {
    /// Weighted mean.
    pub mean: f64,
    /// Its standard error from the given errors.
    pub mean_std: f64,
    /// Weighted sum of squared residuals about the mean.
    pub chi_square: f64,
    /// Degrees of freedom: number of records less one.
    pub degrees: usize,
    /// Probability of a larger sum if nothing changes (any kind of scatter).
    pub scatter_p_value: f64,
    /// Change from the first to the last record by a weighted line.
    pub drift: f64,
    /// Its standard error.
    pub drift_std: f64,
    /// Probability of a larger drift if nothing changes (sensitive to a steady change).
    pub drift_p_value: f64,
}

/// Tests `values` with standard errors `stds` for scatter beyond the errors and for a steady drift with the record's
/// index.
///
/// # Model
/// Independent normal errors of known size. Values that are not finite, or have no positive error, are left out.
///
/// # Errors
/// `None` with fewer than three values.
pub fn stability(values: &[f64], stds: &[f64]) -> Option<Stability> {
    let points: Vec<(f64, f64, f64)> = values
        .iter()
        .zip(stds)
        .enumerate()
        .filter(|(_, (v, s))| v.is_finite() && s.is_finite() && **s > 0.0)
        .map(|(i, (v, s))| (i as f64, *v, 1.0 / (s * s)))
        .collect();
    if points.len() < 3 {
        return None;
    }
    let sum = |f: &dyn Fn(&(f64, f64, f64)) -> f64| points.iter().map(f).sum::<f64>();
    let weight = sum(&|p| p.2);
    let mean = sum(&|p| p.2 * p.1) / weight;
    let centre = sum(&|p| p.2 * p.0) / weight;
    let spread = sum(&|p| p.2 * (p.0 - centre).powi(2));
    let slope = sum(&|p| p.2 * (p.0 - centre) * (p.1 - mean)) / spread;
    let chi_square = sum(&|p| p.2 * (p.1 - mean).powi(2));
    let length = values.len().saturating_sub(1) as f64;
    let drift_std = length / spread.sqrt();
    Some(Stability {
        mean,
        mean_std: weight.sqrt().recip(),
        chi_square,
        degrees: points.len() - 1,
        scatter_p_value: chi_square_tail(chi_square, points.len() - 1),
        drift: slope * length,
        drift_std,
        drift_p_value: normal_two_sided(slope * length / drift_std),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn constant_series_pass_and_a_drift_is_seen() {
        let mut small = [0, 0];
        for seed in 0..200 {
            let values: Vec<f64> = white_noise(24, 2.0, seed).iter().map(|v| 100.0 + v).collect();
            let test = stability(&values, &[2.0; 24]).unwrap();
            small[0] += usize::from(test.scatter_p_value < 0.05);
            small[1] += usize::from(test.drift_p_value < 0.05);
            let drifting: Vec<f64> = values.iter().zip(0..).map(|(v, i)| v + 0.5 * f64::from(i)).collect();
            let test = stability(&drifting, &[2.0; 24]).unwrap();
            // 11.5 over the archive at an error of 1.36: 8 sigma
            assert!(test.drift_p_value < 1e-4 && (test.drift - 11.5).abs() < 5.0 * test.drift_std);
        }
        // 5 % of 200: 10 +- 3.1
        assert!(small.iter().all(|n| (1..=20).contains(n)), "{small:?}");
        assert!(stability(&[1.0, 2.0], &[1.0, 1.0]).is_none());
    }
}
