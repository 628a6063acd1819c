//! How far the ratio of a power to its neighbours strays where nothing is: taken from all the other frequencies.

use crate::statistics::{incomplete_beta, median_and_scale};

/// The law of a ratio of powers: a gamma variable of mean `mean` and shape `shape`, over an independent one of
/// `neighbours` times that shape.
///
/// # Method
/// Averages of periodograms are gamma variables, and so are those of their neighbours: the ratio follows Fisher's law,
/// whose upper tail is heavier than a gamma variable's of the same spread. Median and robust scale of the logarithm
/// over all frequencies give mean and shape; lines and resonances among them don't count. `ln` of a gamma variable of
/// shape `v` has variance `1 / (v - 1/2)` and a median `ln(1 - 1/(3 v))` times its mean (to a per cent for v >= 1.5).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Yardstick {
    pub mean: f64,
    pub shape: f64,
    neighbours: f64,
}

/// Fewest frequencies that make a yardstick: their scale is good to 15 %.
const FEWEST: usize = 24;

impl Yardstick {
    /// From the ratios at all frequencies, sought ones among them. `neighbours`: how many times as much power the
    /// neighbours average.
    pub fn new(ratios: &[f64], neighbours: f64) -> Option<Self> {
        let mut logarithms: Vec<f64> = ratios.iter().map(|ratio| ratio.ln()).filter(|log| log.is_finite()).collect();
        if logarithms.len() < FEWEST {
            return None;
        }
        // a finite sample's scale may come out small: one standard error of it, 1.17 / sqrt(2 n) (P. J. Rousseeuw, C.
        // Croux, 1993), on the safe side
        let safety = 1.0 + 1.17 / (logarithms.len() as f64).sqrt();
        let (middle, scale) = median_and_scale(&mut logarithms);
        let spread = (safety * scale).max(1e-6);
        let shape = shape_of(spread * spread, neighbours);
        let median = median_over_mean(shape) / median_over_mean(neighbours * shape);
        Some(Self { mean: middle.exp() / median, shape, neighbours })
    }

    /// Probability of so large a ratio where nothing is.
    pub fn tail(&self, ratio: f64) -> f64 {
        let (own, x) = (self.shape, self.shape * ratio / self.mean);
        let others = own * self.neighbours;
        // DLMF 8.17: the tail of Fisher's law
        incomplete_beta(others, own, others / (others + x))
    }

    /// Standard deviation of a ratio, in units of its mean.
    pub fn spread(&self) -> f64 {
        (1.0 / self.shape + 1.0 / (self.neighbours * self.shape)).sqrt()
    }
}

/// Shape at which `1 / (v - 1/2) + 1 / (c v - 1/2)` is that variance.
fn shape_of(variance: f64, neighbours: f64) -> f64 {
    let mut shape = 1.0 / variance + 0.5;
    // a contraction by about 1 / neighbours a step
    for _ in 0..30 {
        let others = 1.0 / (neighbours * shape - 0.5).max(0.5);
        shape = 1.0 / (variance - others).max(0.1 * variance) + 0.5;
    }
    shape.clamp(0.5, 1e6)
}

fn median_over_mean(shape: f64) -> f64 {
    (1.0 - 1.0 / (3.0 * shape)).max(0.2)
}

/// One test of several: the probability that any of `tries` would look so.
pub(super) fn of_many(p: f64, tries: usize) -> f64 {
    // 1 - (1 - p)^tries without loss of digits
    if p >= 1.0 { 1.0 } else { -((tries as f64) * (-p).ln_1p()).exp_m1() }
}
