//! The thermal peak of a mode: simple harmonic oscillator, white and 1/f noise, by Whittle's likelihood.

use super::error::CalibrationError;
use super::welch::AveragedPeriodogram;
use std::f64::consts::PI;

/// Where a peak is sought and how much of the spectrum round it is fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PeakSearch {
    /// The peak lies above this, Hz.
    pub lowest_hz: f64,
    /// The peak lies below this, Hz.
    pub highest_hz: f64,
    /// The fit reaches from `f1 / band` to `f1 * band`.
    pub band: f64,
}

/// A fitted peak. Standard errors allow for the correlation of bins and segments.
#[derive(Debug, Clone, PartialEq)]
pub struct ThermalPeak {
    /// Undamped natural frequency, Hz.
    pub frequency_hz: f64,
    /// Its standard error, Hz.
    pub frequency_std_hz: f64,
    /// Quality factor.
    pub quality_factor: f64,
    /// Its standard error.
    pub quality_factor_std: f64,
    /// Variance of the signal in the peak, V^2.
    pub variance_v2: f64,
    /// Its standard error, V^2.
    pub variance_std_v2: f64,
    /// White noise, V^2/Hz.
    pub white_v2_per_hz: f64,
    /// Its standard error, V^2/Hz.
    pub white_std_v2_per_hz: f64,
    /// 1/f noise at 1 Hz, V^2: density `flicker / f`.
    pub flicker_v2: f64,
    /// Bins left out because a line stands in them, Hz.
    pub lines_hz: Vec<f64>,
    /// Mean of (data/model - 1)^2 times the number of effective segments: near 1 where the model holds.
    pub dispersion: f64,
}

impl ThermalPeak {
    /// The fitted density at `frequency_hz`, V^2/Hz (without the window's width).
    pub fn density_v2_per_hz(&self, frequency_hz: f64) -> f64 {
        let damping = self.frequency_hz / self.quality_factor;
        let (f, f1) = (frequency_hz, self.frequency_hz);
        let peak =
            self.variance_v2 * 2.0 / PI * f1 * f1 * damping / ((f1 * f1 - f * f).powi(2) + (f * damping).powi(2));
        peak + self.white_v2_per_hz + self.flicker_v2 / f.max(f64::MIN_POSITIVE)
    }
}

/// ln of: peak variance, frequency, quality factor, white density, flicker.
type Parameters = [f64; 5];

/// Variance inflation of smooth parameters: bins `1 + 2 (4/9 + 1/36)`, segments `1 + 2/36`.
const INFLATION: f64 = (1.0 + 2.0 * (4.0 / 9.0 + 1.0 / 36.0)) * (1.0 + 2.0 / 36.0);
const ITERATIONS: usize = 200;

/// Fits the thermal peak.
///
/// # Model
/// `S(f) = A (2/pi) (f1^3/Q) / ((f1^2 - f^2)^2 + (f f1/Q)^2) + W + B/f`, one-sided; the integral of the first term is `A`. The expected
/// periodogram is `S` seen through the Hann window, by quadrature over its main lobe and first side lobes.
///
/// # Method
/// Whittle: minimise `sum ln M + P/M` by Fisher scoring with Levenberg's damping on the logarithms of the parameters. Bins that stand out
/// by more than a chance of 1e-6 each (lines) are left out and the fit repeated.
///
/// # Accuracy
/// Unbiased by the window's width; errors from the Fisher information times 2.05 for overlapping Hann segments.
///
/// # Errors
/// Too few bins in the band, no peak, no convergence.
///
/// # Source
/// P. Whittle, Ark. Mat. 2 (1953) 423; A. M. Sykulski et al., The debiased Whittle likelihood, Biometrika 106 (2019) 251.
pub fn thermal_peak(spectrum: &AveragedPeriodogram, search: PeakSearch) -> Result<ThermalPeak, CalibrationError> {
    let near_hz = strongest(spectrum, search)?;
    let mut band = Band::cut(spectrum, near_hz / search.band, near_hz * search.band)?;
    let mut parameters = band.start(near_hz);
    let mut lines_hz = Vec::new();
    let mut fisher = band.fit(&mut parameters, near_hz)?;
    for _ in 0..3 {
        let found = band.drop_lines(&parameters, spectrum.segments);
        if found.is_empty() {
            break;
        }
        lines_hz.extend(found);
        fisher = band.fit(&mut parameters, near_hz)?;
    }
    let failed = |reason| CalibrationError::Fit { near_hz, reason };
    let inverse = inverse(fisher).ok_or_else(|| failed("its information matrix is singular"))?;
    let values = parameters.map(f64::exp);
    let scale = INFLATION / spectrum.segments as f64;
    let std = |i: usize| values[i] * (scale * inverse[i][i]).sqrt();
    if !(values[1] > search.lowest_hz && values[1] < search.highest_hz && values[2] > 0.5) {
        return Err(failed("the peak left the range of the search"));
    }
    let effective = spectrum.segments as f64 / (1.0 + 2.0 / 36.0);
    lines_hz.sort_by(f64::total_cmp);
    Ok(ThermalPeak {
        frequency_hz: values[1],
        frequency_std_hz: std(1),
        quality_factor: values[2],
        quality_factor_std: std(2),
        variance_v2: values[0],
        variance_std_v2: std(0),
        white_v2_per_hz: values[3],
        white_std_v2_per_hz: std(3),
        flicker_v2: values[4],
        lines_hz,
        dispersion: effective * band.square_misfit(&parameters),
    })
}

/// The bin with the largest `f P(f)` (level against 1/f), after a running mean of 5 bins.
fn strongest(spectrum: &AveragedPeriodogram, search: PeakSearch) -> Result<f64, CalibrationError> {
    let density = &spectrum.density_v2_per_hz;
    let smooth = |k: usize| density.get(k.saturating_sub(2)..k + 3).map_or(0.0, |five| five.iter().sum());
    (1..density.len())
        .map(|k| (k as f64 * spectrum.bin_hz, k))
        .filter(|(f, _)| *f > search.lowest_hz && *f < search.highest_hz)
        .max_by(|a, b| (a.0 * smooth(a.1)).total_cmp(&(b.0 * smooth(b.1))))
        .map(|(f, _)| f)
        .ok_or(CalibrationError::TooLittle {
            what: "bins in the range of the search",
            found: 0,
            wanted: 1,
            hint: "widen search_lowest_hz .. search_highest_hz",
        })
}

struct Band {
    bin_hz: f64,
    frequency_hz: Vec<f64>,
    density: Vec<f64>,
    /// Offsets in bins and weights of the Hann window's power response.
    kernel: Vec<(f64, f64)>,
}

impl Band {
    fn cut(spectrum: &AveragedPeriodogram, from_hz: f64, to_hz: f64) -> Result<Self, CalibrationError> {
        const FEWEST: usize = 24;
        // the first bins hold the removed mean and its leakage
        let first = ((from_hz / spectrum.bin_hz).ceil() as usize).max(4);
        let last = ((to_hz / spectrum.bin_hz).floor() as usize).min(spectrum.density_v2_per_hz.len().saturating_sub(4));
        if last < first + FEWEST {
            return Err(CalibrationError::TooLittle {
                what: "bins round the peak",
                found: last.saturating_sub(first),
                wanted: FEWEST,
                hint: "raise segment_samples",
            });
        }
        Ok(Self {
            bin_hz: spectrum.bin_hz,
            frequency_hz: (first..last).map(|k| k as f64 * spectrum.bin_hz).collect(),
            density: spectrum.density_v2_per_hz.get(first..last).unwrap_or_default().to_vec(),
            kernel: hann_kernel(),
        })
    }

    /// A start: background from the ends of the band, width and area from the peak above it.
    fn start(&self, near_hz: f64) -> Parameters {
        let n = self.density.len();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len().max(1) as f64;
        let low = mean(self.density.get(..n / 12).unwrap_or_default());
        let white = 0.8 * mean(self.density.get(n - n / 8..).unwrap_or_default()).min(low);
        let excess: f64 = self.density.iter().map(|p| (p - white).max(0.0)).sum::<f64>() * self.bin_hz;
        let top = self.density.iter().copied().fold(0.0, f64::max) - white;
        // a Lorentzian's area is pi/2 times height times full width
        let width = (2.0 / PI * excess / top.max(f64::MIN_POSITIVE)).max(self.bin_hz);
        let flicker = (low - white).max(0.05 * white) * self.frequency_hz.first().copied().unwrap_or(1.0);
        [excess, near_hz, (near_hz / width).max(1.0), white, flicker].map(|v| v.max(f64::MIN_POSITIVE).ln())
    }

    fn model(&self, parameters: &Parameters) -> Vec<f64> {
        let [area, f1, quality, white, flicker] = parameters.map(f64::exp);
        let damping = f1 / quality;
        let numerator = area * 2.0 / PI * f1 * f1 * damping;
        let peak = |f: f64| numerator / ((f1 * f1 - f * f).powi(2) + (f * damping).powi(2));
        self.frequency_hz
            .iter()
            .map(|&f| {
                let seen: f64 =
                    self.kernel.iter().map(|(offset, weight)| weight * peak(f + offset * self.bin_hz)).sum();
                seen + white + flicker / f
            })
            .collect()
    }

    /// Relative derivatives `d ln M / d parameter`, by central differences.
    fn derivatives(&self, parameters: &Parameters, model: &[f64]) -> [Vec<f64>; 5] {
        const STEP: f64 = 1e-5;
        std::array::from_fn(|i| {
            let shifted = |sign: f64| {
                let mut moved = *parameters;
                // frequency is known far better than the rest: a step of its own
                moved[i] += sign * if i == 1 { 0.01 * STEP } else { STEP };
                self.model(&moved)
            };
            let step = if i == 1 { 0.01 * STEP } else { STEP };
            shifted(1.0).iter().zip(&shifted(-1.0)).zip(model).map(|((a, b), m)| (a - b) / (2.0 * step * m)).collect()
        })
    }

    fn objective(&self, parameters: &Parameters) -> f64 {
        self.model(parameters).iter().zip(&self.density).map(|(m, p)| m.ln() + p / m).sum()
    }

    /// Fisher scoring; returns the information per segment at the optimum.
    fn fit(&self, parameters: &mut Parameters, near_hz: f64) -> Result<[[f64; 5]; 5], CalibrationError> {
        let failed = |reason| CalibrationError::Fit { near_hz, reason };
        let (mut damping, mut value) = (1e-3, self.objective(parameters));
        if !value.is_finite() {
            return Err(failed("the spectrum is empty or not finite"));
        }
        for _ in 0..ITERATIONS {
            let model = self.model(parameters);
            let derivatives = self.derivatives(parameters, &model);
            let (fisher, gradient) = normal_equations(&derivatives, &model, &self.density);
            let mut damped = fisher;
            for (i, row) in damped.iter_mut().enumerate() {
                row[i] *= 1.0 + damping;
                row[i] += 1e-9;
            }
            let step = inverse(damped).map(|inv| product(&inv, &gradient)).ok_or_else(|| failed("singular step"))?;
            // the logarithms move by at most one at a time
            let limit = step.iter().fold(1.0f64, |limit, s| limit.max(s.abs()));
            let moved: Parameters = std::array::from_fn(|i| parameters[i] + step[i] / limit);
            let there = self.objective(&moved);
            if there <= value {
                let gain = value - there;
                (*parameters, value, damping) = (moved, there, (damping * 0.2).max(1e-9));
                if gain < 1e-9 {
                    return Ok(fisher);
                }
            } else {
                damping *= 8.0;
                if damping > 1e9 {
                    // no step improves: at the optimum to rounding
                    return Ok(fisher);
                }
            }
        }
        Err(failed("200 iterations were not enough"))
    }

    /// Removes bins that no chance explains and returns their frequencies.
    fn drop_lines(&mut self, parameters: &Parameters, segments: usize) -> Vec<f64> {
        let k = segments as f64 / (1.0 + 2.0 / 36.0);
        // upper 1e-6 quantile of a mean of k exponentials (Cornish-Fisher)
        let z = 4.753;
        let limit = 1.0 + z / k.sqrt() + (z * z - 1.0) / (3.0 * k);
        let model = self.model(parameters);
        let keep: Vec<bool> = model.iter().zip(&self.density).map(|(m, p)| *p <= limit * m).collect();
        let lines = self.frequency_hz.iter().zip(&keep).filter(|(_, keep)| !**keep).map(|(f, _)| *f).collect();
        let filter = |values: &[f64]| values.iter().zip(&keep).filter(|(_, keep)| **keep).map(|(v, _)| *v).collect();
        (self.frequency_hz, self.density) = (filter(&self.frequency_hz), filter(&self.density));
        lines
    }

    fn square_misfit(&self, parameters: &Parameters) -> f64 {
        let model = self.model(parameters);
        let sum: f64 = model.iter().zip(&self.density).map(|(m, p)| (p / m - 1.0).powi(2)).sum();
        sum / model.len().max(1) as f64
    }
}

/// Hann power response at offsets in bins, normalised to unit sum.
fn hann_kernel() -> Vec<(f64, f64)> {
    let response = |x: f64| {
        let sinc = if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) };
        // at x = +-1 the limit is 1/2
        if (x.abs() - 1.0).abs() < 1e-9 { 0.25 } else { (sinc / (1.0 - x * x)).powi(2) }
    };
    let offsets: Vec<f64> = (-12..=12).map(|i| 0.25 * f64::from(i)).collect();
    let total: f64 = offsets.iter().map(|&x| response(x)).sum();
    offsets.into_iter().map(|x| (x, response(x) / total)).collect()
}

fn normal_equations(derivatives: &[Vec<f64>; 5], model: &[f64], density: &[f64]) -> ([[f64; 5]; 5], [f64; 5]) {
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let misfit: Vec<f64> = density.iter().zip(model).map(|(p, m)| p / m - 1.0).collect();
    let fisher = std::array::from_fn(|i| std::array::from_fn(|j| dot(&derivatives[i], &derivatives[j])));
    (fisher, std::array::from_fn(|i| dot(&derivatives[i], &misfit)))
}

fn product(matrix: &[[f64; 5]; 5], vector: &[f64; 5]) -> [f64; 5] {
    std::array::from_fn(|i| matrix[i].iter().zip(vector).map(|(m, v)| m * v).sum())
}

/// Inverse of a symmetric positive definite matrix after scaling to unit diagonal (Gauss-Jordan); `None` if it is not.
pub(crate) fn inverse(matrix: [[f64; 5]; 5]) -> Option<[[f64; 5]; 5]> {
    let scale: [f64; 5] = std::array::from_fn(|i| matrix[i][i].sqrt());
    if scale.iter().any(|s| !s.is_finite() || *s <= 0.0) {
        return None;
    }
    let mut left: [[f64; 5]; 5] =
        std::array::from_fn(|i| std::array::from_fn(|j| matrix[i][j] / (scale[i] * scale[j])));
    let mut right: [[f64; 5]; 5] = std::array::from_fn(|i| std::array::from_fn(|j| if i == j { 1.0 } else { 0.0 }));
    for pivot in 0..5 {
        let p = left[pivot][pivot];
        if p.is_nan() || p < 1e-13 {
            return None;
        }
        left[pivot] = left[pivot].map(|v| v / p);
        right[pivot] = right[pivot].map(|v| v / p);
        let (pivot_left, pivot_right) = (left[pivot], right[pivot]);
        for row in (0..5).filter(|&row| row != pivot) {
            let factor = left[row][pivot];
            left[row] = std::array::from_fn(|j| left[row][j] - factor * pivot_left[j]);
            right[row] = std::array::from_fn(|j| right[row][j] - factor * pivot_right[j]);
        }
    }
    Some(std::array::from_fn(|i| std::array::from_fn(|j| right[i][j] / (scale[i] * scale[j]))))
}
