//! Whether what rings after an instant goes on from what rang before it.

use std::ops::Range;

use faer::c64;

/// Periods of the strongest oscillation in each of the stretches that are compared.
const STRETCH_PERIODS: f64 = 2.0;
/// Periods after the instant that a contact may last, and before it in which a converter's filter answers.
const CONTACT_PERIODS: (f64, f64) = (1.0, 0.25);
/// Change of the strongest oscillation, over what it was to be, that is another hit's. Why: a mode that moves changes by
/// less within four periods, and a decay of less than that mended by a cut moves no pole by its error.
const LEAST_CHANGE: f64 = 0.15;
/// Change of the amplitude and of the phase, rad, within which the clock may have lost a sample.
const SHIFTED: (f64, f64) = (0.05, 1.0);
/// Growth of the second differences' energy, and that energy over the ringing's, that is another hit's: a mode above the
/// strongest one.
const HIGHER: (f64, f64) = (2.25, 2.5e-3);

/// Whether the ringing of any channel changes at `instant` by more than it does by itself.
///
/// # Method
/// The strongest oscillation, `frequency` in cycles per sample, by its complex amplitude in two stretches before, which
/// foretell it by their ratio, and one after; where the ringing, which begins at `since`, has one stretch before alone,
/// by its growth. Or the energy of the second differences, which the modes above it have.
pub(super) fn ringing_changes(channels: &[&[f64]], since: usize, instant: usize, frequency: f64) -> bool {
    let length = (STRETCH_PERIODS / frequency.max(1e-12)).round() as usize;
    let period = length as f64 / STRETCH_PERIODS;
    let (after, before) = ((CONTACT_PERIODS.0 * period) as usize, (CONTACT_PERIODS.1 * period).ceil() as usize);
    let Some(second) = instant.checked_sub(before + length).filter(|second| *second >= since) else { return true };
    let (first, third) = (second.checked_sub(length).filter(|first| *first >= since), instant + after);
    channels.iter().filter(|y| third + length <= y.len()).any(|y| {
        let amplitude = |from: usize| amplitude(y, from..from + length, frequency);
        let (one, two, three) = (first.map(amplitude), amplitude(second), amplitude(third));
        let stretches = (third - second) as f64 / length as f64;
        let foretold = one.map(|one| two * ((two / one).ln() * stretches).exp());
        let energy = |from: usize| energy(&y[from..from + length]);
        let ((_, higher_before), (all, higher)) = (energy(second), energy(third));
        let change = three / foretold.unwrap_or(two);
        let shifted = (change.norm() - 1.0).abs() < SHIFTED.0 && change.arg().abs() < SHIFTED.1;
        let changes = match foretold {
            Some(_) => (change - 1.0).norm() > LEAST_CHANGE && !shifted,
            None => change.norm() > 1.0 + LEAST_CHANGE,
        };
        changes || (higher > HIGHER.0 * higher_before && higher > HIGHER.1 * all)
    })
}

/// Complex amplitude at a frequency, phases counted from the record's first sample; the mean is left out.
fn amplitude(y: &[f64], range: Range<usize>, frequency: f64) -> c64 {
    let n = range.len() as f64;
    let mean = y[range.clone()].iter().sum::<f64>() / n;
    let turned = |k: usize| (y[k] - mean) * c64::cis(-std::f64::consts::TAU * (frequency * k as f64).fract());
    range.map(turned).sum::<c64>() * (2.0 / n)
}

/// Energies of a stretch without its mean and of its second differences.
fn energy(y: &[f64]) -> (f64, f64) {
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    let higher = y.windows(3).map(|w| (w[2] - 2.0 * w[1] + w[0]).powi(2)).sum();
    (y.iter().map(|v| (v - mean).powi(2)).sum(), higher)
}
