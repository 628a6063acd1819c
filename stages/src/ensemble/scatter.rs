//! What is left of each event when amplitude, offset and loading slopes are taken out: the noise.

use afmid_kernels::linear_algebra::dot;
use afmid_pipeline::rows::{RowSource, in_blocks};
use rayon::prelude::*;

use super::EnsembleError;
use super::rows::check_chosen;

/// How each event differs from the mean, and the noise that remains.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scatter {
    /// Amplitude relative to the mean, per event; their mean is one.
    pub amplitude: Vec<f64>,
    /// Offset against the mean, per event, in the rows' unit.
    pub offset: Vec<f64>,
    /// How much later than the mean, per event, in samples: what alignment has left.
    pub lag: Vec<f64>,
    /// Root mean square of the remainder, per event.
    pub rms: Vec<f64>,
    /// Variance of the noise of one event, per sample.
    pub noise_variance: Vec<f64>,
}

impl Scatter {
    /// Standard error of the mean per sample: the noise alone, adhesion scatter left out.
    pub fn standard_error(&self) -> Vec<f64> {
        let n = self.amplitude.len() as f64;
        self.noise_variance.iter().map(|v| (v / n).sqrt()).collect()
    }
}

/// Regresses each chosen event on the mean, its slope, a constant, and a ramp on either side of the event.
///
/// # Model
/// `y_i(t) = a_i (m(t) - l_i m'(t)) + b_i + c_i min(t, 0) + d_i max(t, 0) + e_i(t)`, `t = 0` at sample `zero`. A
/// stronger adhesion makes the whole ringing larger (`a_i`), but not the slope at which the piezo loads the lever
/// (`c_i`, `d_i`); records wander by an offset (`b_i`), and alignment leaves a fraction of a sample (`l_i`). None of
/// this is noise.
///
/// # Method
/// Least squares by twice repeated Gram-Schmidt on the five columns (a ramp with less than eight samples is left out,
/// and so is a slope that vanishes); `m'` by central differences. Noise variance: sum of squares over `n - 1`, since
/// the mean holds a share of each event, times `T / (T - p)` for the `p` coefficients per event.
///
/// # Shapes
/// `rows` `[event, time]`, `mean` `[time]`; results per chosen event or `[time]`.
///
/// # Units
/// Those of the rows; amplitude is a ratio.
///
/// # Accuracy
/// The variance of one sample has a relative standard error of `sqrt(2 / (n - 1))`. Noise slower than the window is
/// partly taken for an offset or a ramp.
///
/// # Errors
/// Fewer than two events, fewer than sixteen samples, an index outside, or a constant mean.
pub fn scatter(rows: impl RowSource, chosen: &[usize], mean: &[f64], zero: usize) -> Result<Scatter, EnsembleError> {
    check_chosen(&rows, chosen)?;
    if chosen.len() < 2 {
        return Err(EnsembleError::TooFewEvents { got: chosen.len(), wanted: 2, purpose: "a noise variance" });
    }
    let samples = rows.row_length();
    let basis = Basis::new(mean, zero, samples)?;
    let n = chosen.len() as f64;
    let freedom = samples as f64 / (samples - basis.columns.len()) as f64 / (n - 1.0);
    let mut found = Scatter { noise_variance: vec![0.0; samples], ..Scatter::default() };
    in_blocks(&rows, chosen, |_, block| -> Result<(), EnsembleError> {
        let fits: Vec<Fit> = block.par_iter().map(|row| basis.project(row)).collect();
        for fit in fits {
            for (v, e) in found.noise_variance.iter_mut().zip(&fit.residual) {
                *v += e * e * freedom;
            }
            found.amplitude.push(fit.amplitude);
            found.offset.push(fit.offset);
            found.lag.push(fit.lag);
            found.rms.push((dot(&fit.residual, &fit.residual) / samples as f64).sqrt());
        }
        Ok(())
    })?;
    Ok(found)
}

/// What [`scatter`] leaves of rows.
pub(super) struct Remainders<'a>(Basis<'a>);

impl<'a> Remainders<'a> {
    /// Against this mean of rows of so many samples. Errors: as [`scatter`].
    pub(super) fn new(mean: &'a [f64], zero: usize, samples: usize) -> Result<Self, EnsembleError> {
        Basis::new(mean, zero, samples).map(Self)
    }

    /// The remainders of some rows.
    pub(super) fn of(&self, rows: &[&[f64]]) -> Vec<Vec<f64>> {
        rows.par_iter().map(|row| self.0.project(row).residual).collect()
    }
}

/// One event against the mean.
struct Fit {
    amplitude: f64,
    offset: f64,
    lag: f64,
    residual: Vec<f64>,
}

/// Orthonormal columns: constant, ramps, the mean, and its slope last.
struct Basis<'a> {
    mean: &'a [f64],
    columns: Vec<Vec<f64>>,
    /// Number of the mean's column; the slope's, if any, follows.
    shape: usize,
    /// Norm of what each of the two adds to the columns before, and the slope's share along the mean's column.
    shape_norm: f64,
    slope_norm: f64,
    slope_share: f64,
}

impl<'a> Basis<'a> {
    fn new(mean: &'a [f64], zero: usize, samples: usize) -> Result<Self, EnsembleError> {
        if samples < 16 || mean.len() != samples {
            let got = samples.min(mean.len());
            return Err(EnsembleError::TooFewSamples { got, wanted: 16, purpose: "a regression" });
        }
        let time = |k: usize| (k as f64 - zero as f64) / samples as f64;
        let mut columns = Vec::new();
        orthogonalise(&mut columns, vec![1.0; samples]);
        if zero >= 8 {
            orthogonalise(&mut columns, (0..samples).map(|k| time(k).min(0.0)).collect());
        }
        if zero + 8 < samples {
            orthogonalise(&mut columns, (0..samples).map(|k| time(k).max(0.0)).collect());
        }
        let shape = columns.len();
        let shape_norm = orthogonalise(&mut columns, mean.to_vec());
        // rounding of the projections leaves eps * size * a few
        if columns.len() == shape {
            return Err(EnsembleError::NoShape);
        }
        let at = |k: usize| mean[k.min(samples - 1)];
        let slope: Vec<f64> = (0..samples).map(|k| 0.5 * (at(k + 1) - at(k.saturating_sub(1)))).collect();
        let slope_share = dot(&columns[shape], &slope);
        let slope_norm = orthogonalise(&mut columns, slope);
        Ok(Self { mean, columns, shape, shape_norm, slope_norm, slope_share })
    }

    fn project(&self, row: &[f64]) -> Fit {
        let mut residual = row.to_vec();
        let mut share = [0.0; 2];
        for (number, q) in self.columns.iter().enumerate() {
            let c = dot(q, &residual);
            residual.iter_mut().zip(q).for_each(|(v, q)| *v -= c * q);
            if number >= self.shape {
                share[number - self.shape] = c;
            }
        }
        // back-substitution through the last two columns
        let along_slope = if self.slope_norm > 0.0 { share[1] / self.slope_norm } else { 0.0 };
        let amplitude = (share[0] - along_slope * self.slope_share) / self.shape_norm;
        let lag = if amplitude == 0.0 { 0.0 } else { -along_slope / amplitude };
        let offset = row.iter().zip(self.mean).map(|(y, m)| y - amplitude * m).sum::<f64>() / row.len() as f64;
        Fit { amplitude, offset, lag, residual }
    }
}

/// Appends what `column` adds to the others, normalised, and returns its norm; zero, and nothing appended, if it adds
/// nothing.
fn orthogonalise(columns: &mut Vec<Vec<f64>>, mut column: Vec<f64>) -> f64 {
    let size = dot(&column, &column).sqrt();
    // twice is enough (Giraud, Langou, Rozloznik 2005)
    for _ in 0..2 {
        for q in columns.iter() {
            let c = dot(q, &column);
            column.iter_mut().zip(q).for_each(|(v, q)| *v -= c * q);
        }
    }
    let norm = dot(&column, &column).sqrt();
    if norm > 1e-12 * size {
        column.iter_mut().for_each(|v| *v /= norm);
        columns.push(column);
        norm
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::{Rows, moments};
    use crate::fixture::{Lever, white_noise};

    /// Events of the paper's lever: adhesion scatters by 20 %, offsets by 4 mV, loading slopes stay.
    fn events(count: usize, seed: u64, noise: f64) -> (Vec<f64>, Vec<f64>, usize) {
        let samples = 4096;
        let shape = Lever::paper().release(samples, 800.0, -0.9);
        let amplitude: Vec<f64> = white_noise(count, 0.2, seed).iter().map(|a| 1.0 + a).collect();
        let offset = white_noise(count, 4e-3, seed + 100);
        let mut values = Vec::new();
        for i in 0..count {
            let e = white_noise(samples, noise, seed * 1000 + i as u64);
            values.extend((0..samples).map(|k| {
                let load = 4.5e-6 * (800.0 - k as f64).max(0.0);
                amplitude[i] * shape[k] + load + offset[i] + e[k]
            }));
        }
        (values, amplitude, samples)
    }

    #[test]
    fn adhesion_scatter_is_not_noise() {
        for seed in 1..4 {
            let (values, truth, samples) = events(24, seed, 1.2e-3);
            let rows = Rows::new(&values, samples).unwrap();
            let mean = moments(rows, &rows.all()).unwrap();
            let got = scatter(rows, &rows.all(), &mean.mean, 800).unwrap();
            let variance = got.noise_variance.iter().sum::<f64>() / samples as f64;
            // 24 * 4096 independent squares: 4 sigma = 4 * sqrt(2 / 98304)
            assert!((variance / 1.44e-6 - 1.0).abs() < 0.018, "seed {seed}: {variance:e}");
            let average = truth.iter().sum::<f64>() / 24.0;
            for (a, t) in got.amplitude.iter().zip(&truth) {
                // noise 1.2e-3 against a shape of norm 0.3 sqrt(4096) = 19: sigma 6e-5, 5 sigma of 24
                assert!((a - t / average).abs() < 4e-4);
            }
            // the plain variance is dominated by the amplitudes: 0.2^2 * 0.9^2 before the release
            assert!(mean.variance[10] > 5000.0 * 1.44e-6);
            let error = got.standard_error();
            assert!((error[3000] - (got.noise_variance[3000] / 24.0).sqrt()).abs() < 1e-18);
        }
    }

    #[test]
    fn without_noise_nothing_is_left() {
        let (values, _, samples) = events(6, 3, 0.0);
        let rows = Rows::new(&values, samples).unwrap();
        let mean = moments(rows, &rows.all()).unwrap();
        let events: Vec<&[f64]> = rows.all().iter().map(|&event| rows.row(event)).collect();
        let rest = Remainders::new(&mean.mean, 800, samples).unwrap().of(&events);
        // rounding of values of order one
        assert!(rest.iter().flatten().all(|e| e.abs() < 1e-13));
    }

    #[test]
    fn a_fraction_of_a_sample_is_not_noise() {
        let samples = 4096;
        let jitter = white_noise(16, 0.2, 5);
        let values: Vec<f64> = jitter.iter().flat_map(|j| Lever::paper().release(samples, 800.5 + j, -0.9)).collect();
        let rows = Rows::new(&values, samples).unwrap();
        let mean = moments(rows, &rows.all()).unwrap();
        let got = scatter(rows, &rows.all(), &mean.mean, 800).unwrap();
        let centre = jitter.iter().sum::<f64>() / 16.0;
        for (lag, j) in got.lag.iter().zip(&jitter) {
            // second order: half a squared lag times the curvature, and central differences at the fourth mode
            assert!((lag - (j - centre)).abs() < 0.1, "{lag} {}", j - centre);
        }
        let noise = (got.noise_variance.iter().sum::<f64>() / samples as f64).sqrt();
        let plain = (mean.variance.iter().sum::<f64>() / samples as f64).sqrt();
        assert!(noise < 0.15 * plain, "{noise:e} {plain:e}");
    }

    #[test]
    fn a_constant_mean_has_no_shape() {
        let values = vec![1.0; 64];
        let rows = Rows::new(&values, 32).unwrap();
        assert_eq!(scatter(rows, &[0, 1], &[1.0; 32], 16).unwrap_err(), EnsembleError::NoShape);
        assert!(matches!(scatter(rows, &[0], &[1.0; 32], 16), Err(EnsembleError::TooFewEvents { .. })));
    }
}
