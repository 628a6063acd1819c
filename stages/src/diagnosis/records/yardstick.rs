//! How far the ratio of a power to its neighbours strays where nothing is: taken from all the other frequencies.

use crate::calibration::gamma_tail;
use crate::events::median_and_scale;

/// The law of a ratio of powers: a gamma variable of mean `mean` and shape `shape`.
///
/// # Method
/// Averages of periodograms over their neighbours' are nearly gamma variables. Median and robust scale of the logarithm over all frequencies give
/// mean and shape; lines and resonances among them don't count.
/// `ln` of a gamma variable of shape `v` has variance `1 / (v - 1/2)` and a median `ln(1 - 1/(3 v))` times its mean (to a per cent for v >= 1.5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Yardstick {
    pub mean: f64,
    pub shape: f64,
}

/// Fewest frequencies that make a yardstick: their scale is good to 15 %.
const FEWEST: usize = 24;

impl Yardstick {
    /// From the ratios at all frequencies, sought ones among them.
    pub fn new(ratios: &[f64]) -> Option<Self> {
        let mut logarithms: Vec<f64> = ratios.iter().map(|ratio| ratio.ln()).filter(|log| log.is_finite()).collect();
        if logarithms.len() < FEWEST {
            return None;
        }
        // a finite sample's scale may come out small: one standard error of it, 1.17 / sqrt(2 n) (P. J. Rousseeuw, C. Croux, 1993), on the safe side
        let safety = 1.0 + 1.17 / (logarithms.len() as f64).sqrt();
        let (middle, scale) = median_and_scale(&mut logarithms);
        let spread = (safety * scale).max(1e-6);
        let shape = (1.0 / (spread * spread) + 0.5).clamp(0.5, 1e6);
        Some(Self { mean: middle.exp() / (1.0 - 1.0 / (3.0 * shape)).max(0.2), shape })
    }

    /// Probability of so large a ratio where nothing is.
    pub fn tail(&self, ratio: f64) -> f64 {
        gamma_tail(self.shape, self.shape * ratio / self.mean)
    }

    /// Standard deviation of a ratio, in units of its mean.
    pub fn spread(&self) -> f64 {
        1.0 / self.shape.sqrt()
    }
}

/// One test of several: the probability that any of `tries` would look so.
pub(super) fn of_many(p: f64, tries: usize) -> f64 {
    // 1 - (1 - p)^tries without loss of digits
    if p >= 1.0 { 1.0 } else { -((tries as f64) * (-p).ln_1p()).exp_m1() }
}
