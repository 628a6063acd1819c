//! Whether a record is one oscillation.

use super::{HarmonicFit, HarmonicOptions, fit_harmonics};

/// Whether one oscillation has most of the power, of the record or of its differences, in which drift has next to none.
///
/// The narrow band of a resonance in noise is none: its phase wanders, and over a record that is longer than its decay
/// time one frequency has little of its power.
pub fn is_tone(y: &[f64]) -> bool {
    let differences: Vec<f64> = y.windows(2).map(|pair| pair[1] - pair[0]).collect();
    [y, &differences]
        .into_iter()
        .any(|y| fit_harmonics(y, 1.0, &HarmonicOptions::default()).is_ok_and(|fit| dominates(&fit)))
}

/// Whether the fundamental has more power than what is left.
fn dominates(fit: &HarmonicFit) -> bool {
    let amplitude = fit.harmonics.first().map_or(0.0, |first| first.amplitude);
    0.5 * amplitude.powi(2) > fit.residual_rms.powi(2)
}
