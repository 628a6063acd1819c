//! Levers for an exam.

use rand::Rng;
use rand_chacha::ChaCha8Rng;

/// Frequencies, quality factors and shares, as `simulate.afm` takes them.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct ExamLever {
    pub frequencies_hz: Vec<f64>,
    pub quality_factors: Vec<f64>,
    pub tip_shares: Vec<f64>,
    pub detector_shares: Vec<f64>,
}

/// Ratios of the paper's modes to its first.
const PAPER: [f64; 4] = [1.0, 5.34, 12.54, 22.7];
/// No mode lies higher: a fifth of the sample rate and a little, Hz.
const HIGHEST_HZ: f64 = 1.3e6;

/// Two in three levers are like the paper's, the others have 3 to 6 modes at other ratios.
pub(super) fn lever(rng: &mut ChaCha8Rng) -> ExamLever {
    let mut within = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let first = within(40e3, 56e3);
    let ratios: Vec<f64> = if within(0.0, 1.0) < 2.0 / 3.0 {
        PAPER.iter().map(|ratio| if *ratio > 1.0 { ratio * within(0.97, 1.03) } else { 1.0 }).collect()
    } else {
        let modes = 3 + (4.0 * within(0.0, 1.0)) as usize;
        // the highest mode below HIGHEST_HZ whatever their number: steps of equal ratio, each off by up to a tenth
        let step = (0.8 * HIGHEST_HZ / first).powf(1.0 / (modes - 1) as f64);
        let mut ratios = vec![1.0];
        ratios.extend((1..modes).map(|n| step.powi(n as i32) * within(0.9, 1.1)));
        ratios
    };
    let quality = within(35.0, 60.0);
    let share = |power: f64, spread: f64, within: &mut dyn FnMut(f64, f64) -> f64| {
        let raw: Vec<f64> = ratios.iter().map(|r| r.powf(-power) * within(1.0 - spread, 1.0 + spread)).collect();
        let sum: f64 = raw.iter().sum();
        raw.iter().map(|share| share / sum).collect::<Vec<f64>>()
    };
    // a beam's displacement falls with the square of the frequency, its slope more slowly
    let tip_shares = share(2.2, 0.0, &mut within);
    let detector_shares = share(1.5, 0.15, &mut within);
    ExamLever {
        frequencies_hz: ratios.iter().map(|ratio| first * ratio).collect(),
        // quality factors rise as the frequency to the power 0.85, as the paper's do
        quality_factors: ratios.iter().map(|ratio| quality * ratio.powf(0.85) * within(0.85, 1.15)).collect(),
        tip_shares,
        detector_shares,
    }
}
