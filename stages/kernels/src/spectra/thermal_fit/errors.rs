//! Standard errors: Fisher information with correlated bins, and the sandwich.

use faer::Mat;

use super::likelihood::{Likelihood, Parameters, Slopes, information};
use crate::linear_algebra::definite_inverse;

/// Bins from whose scatter an error can be had. Why: of thirty squares the sum is known to a quarter.
const FEW_BINS: f64 = 30.0;

pub(super) struct Covariances {
    /// Relative standard errors if the model holds.
    pub model: [f64; 5],
    /// Relative standard errors from the scatter that is seen.
    pub robust: [f64; 5],
    pub bin_correlation: f64,
    pub dispersion: f64,
}

/// `H^-1 V H^-1`: V from the bins' known correlation (model), or from the misfits themselves (robust); of few bins the
/// larger.
pub(super) fn covariances(likelihood: &Likelihood<'_>, parameters: &Parameters, used: &[bool]) -> Covariances {
    let slopes = likelihood.slopes(parameters, used);
    let (square, _) = information(&slopes, parameters.active);
    let averages = likelihood.data.averages;
    let known = likelihood.through.bin_correlation();
    let reach = if known[1] > 0.0 { 2 } else { 0 };
    let unknown = [f64::NAN; 5];
    let count = slopes.misfit.len() as f64;
    let lagged = |lag: usize| pairs(&slopes, lag).map(|(k, l)| slopes.misfit[k] * slopes.misfit[l]).sum::<f64>();
    let power = lagged(0);
    let (model, robust) = match definite_inverse(&square) {
        None => (unknown, unknown),
        Some(inverse) => {
            let expected = scores(&slopes, 2, |_, _, lag| known[lag] / averages);
            // HC3: a bin that pulls the fit to itself has a misfit too small by one minus its leverage
            let full: Vec<f64> = (0..slopes.misfit.len())
                .map(|k| slopes.misfit[k] / (1.0 - leverage(&inverse, &slopes.row[k], parameters.active)).max(0.05))
                .collect();
            let seen = scores(&slopes, reach, |k, l, _| full[k] * full[l]);
            let model = spread(&inverse, &expected, parameters.active);
            let seen = spread(&inverse, &seen, parameters.active);
            let bearing = bearing_bins(&inverse, &slopes, parameters.active);
            let known = |i: usize| if bearing[i] < FEW_BINS && seen[i] < model[i] { model[i] } else { seen[i] };
            (model, std::array::from_fn(known))
        }
    };
    Covariances { model, robust, bin_correlation: lagged(1) / power, dispersion: averages * power / count }
}

/// How many bins bear each value: of weights w, `(sum w)^2 / sum w^2`.
fn bearing_bins(inverse: &Mat<f64>, slopes: &Slopes, active: [bool; 5]) -> [f64; 5] {
    std::array::from_fn(|i| {
        let weight =
            |row: &[f64; 5]| (0..5).filter(|&j| active[j]).map(|j| inverse[(i, j)] * row[j]).sum::<f64>().powi(2);
        let (sum, squares) = slopes.row.iter().map(weight).fold((0.0, 0.0), |(s, q), w| (s + w, q + w * w));
        sum * sum / squares
    })
}

/// Share of a bin in its own fitted value.
fn leverage(inverse: &Mat<f64>, row: &[f64; 5], active: [bool; 5]) -> f64 {
    let on = |i: usize| if active[i] { row[i] } else { 0.0 };
    (0..5).map(|i| (0..5).map(|j| on(i) * inverse[(i, j)] * on(j)).sum::<f64>()).sum()
}

/// Used bins that lie `lag` apart.
fn pairs(slopes: &Slopes, lag: usize) -> impl Iterator<Item = (usize, usize)> + '_ {
    (0..slopes.bin.len()).filter_map(move |k| {
        (k..(k + lag + 1).min(slopes.bin.len())).find(|&l| slopes.bin[l] == slopes.bin[k] + lag).map(|l| (k, l))
    })
}

/// Covariance of the gradient: `sum w(k, l) d_k d_l'` over bins up to `reach` apart.
fn scores(slopes: &Slopes, reach: usize, weight: impl Fn(usize, usize, usize) -> f64) -> [[f64; 5]; 5] {
    let mut sum = [[0.0; 5]; 5];
    for lag in 0..=reach {
        for (k, l) in pairs(slopes, lag) {
            let w = weight(k, l, lag);
            let (a, b) = (&slopes.row[k], &slopes.row[l]);
            for i in 0..5 {
                for j in 0..5 {
                    sum[i][j] += if lag == 0 { w * a[i] * a[j] } else { w * (a[i] * b[j] + b[i] * a[j]) };
                }
            }
        }
    }
    sum
}

fn spread(inverse: &Mat<f64>, middle: &[[f64; 5]; 5], active: [bool; 5]) -> [f64; 5] {
    std::array::from_fn(|i| {
        if !active[i] {
            return f64::NAN;
        }
        let row: [f64; 5] = std::array::from_fn(|j| if active[j] { inverse[(i, j)] } else { 0.0 });
        let variance: f64 = (0..5).map(|j| (0..5).map(|l| row[j] * middle[j][l] * row[l]).sum::<f64>()).sum();
        // a sum with correlated misfits can fall below zero by chance: nothing is known then
        if variance > 0.0 { variance.sqrt() } else { f64::NAN }
    })
}
