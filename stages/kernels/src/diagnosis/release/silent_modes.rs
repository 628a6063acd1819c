//! Modes that do not ring after the releases, though they are in thermal motion.

use super::lever::LeverMode;
use super::lever_modes::highest;
use super::thermal_peaks::{APART, ThermalPeak};

/// A mode that only its thermal motion shows.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct SilentMode {
    /// Frequency measured; quality factor and share by the law of the others.
    pub mode: LeverMode,
    /// Of its thermal motion, V^2.
    pub variance: f64,
}

/// Relative distance within which a peak is a mode's own.
const SAME: f64 = 0.02;
/// How much larger a peak may be than that of the mode under it: variances of peaks are right to a factor of two.
const LARGER: f64 = 2.0;
/// Powers of the frequency by which shares and quality factors go where a single mode rings: as a beam's seen by its
/// slope, and the paper's.
const POWERS: [f64; 2] = [-1.5, 0.85];

/// The modes of a lever that ring too weakly to be seen, between or above those that do (ascending): a rupture as long
/// as a period leaves nothing of a mode.
///
/// A peak counts unless something rings there after all (`heard`, rad/s), which is no mode then, and if the motion
/// falls from mode to mode up to it: what moves more than the mode under it is another part's.
pub(super) fn silent_modes(
    peaks: &[ThermalPeak],
    ringing: &[LeverMode],
    heard: &[f64],
    interval_s: f64,
) -> Vec<SilentMode> {
    let apart = |a: f64, b: f64| (a / b).max(b / a);
    let mut all: Vec<(LeverMode, Option<f64>)> = ringing
        .iter()
        .map(|mode| {
            let own = peaks.iter().find(|peak| apart(peak.omega, mode.omega) < 1.0 + SAME);
            (*mode, own.map(|peak| peak.variance))
        })
        .collect();
    let mut out = Vec::new();
    let silent = |peak: &&ThermalPeak| heard.iter().all(|omega| apart(peak.omega, *omega) > 1.0 + SAME);
    for peak in peaks.iter().filter(|peak| peak.omega < highest(interval_s)).filter(silent) {
        let place = all.partition_point(|(mode, _)| mode.omega < peak.omega);
        let Some((under, Some(motion))) = place.checked_sub(1).map(|below| all[below]) else { continue };
        let over = all.get(place).map(|(mode, _)| *mode);
        let alone = apart(peak.omega, under.omega) > APART && over.is_none_or(|m| apart(peak.omega, m.omega) > APART);
        if !alone || peak.variance > LARGER * motion {
            continue;
        }
        let law = |size: fn(&LeverMode) -> f64, power: f64| {
            // between two modes along the line through both, above the last one along that through first and last
            let other = over.or_else(|| all.first().map(|(first, _)| *first).filter(|first| *first != under));
            let power = other.map_or(power, |o| (size(&o) / size(&under)).ln() / (o.omega / under.omega).ln());
            size(&under) * (peak.omega / under.omega).powf(power)
        };
        let mode = LeverMode {
            omega: peak.omega,
            quality_factor: law(|m| m.quality_factor, POWERS[1]),
            share: law(|m| m.share.abs(), POWERS[0]),
        };
        all.insert(place, (mode, Some(peak.variance)));
        out.push(SilentMode { mode, variance: peak.variance });
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mode(kilohertz: f64, share: f64) -> LeverMode {
        LeverMode { omega: std::f64::consts::TAU * 1e3 * kilohertz, quality_factor: kilohertz, share }
    }

    fn peak(kilohertz: f64, variance: f64) -> ThermalPeak {
        ThermalPeak { omega: std::f64::consts::TAU * 1e3 * kilohertz, variance }
    }

    #[test]
    fn a_silent_mode_is_found_with_the_law_of_the_others() {
        let ringing = [mode(46.0, 1.0), mode(247.0, 0.1), mode(580.0, 0.02)];
        let motion = [peak(46.01, 1e-7), peak(246.9, 2e-8), peak(580.2, 8e-9), peak(1050.0, 4e-9)];
        let found = silent_modes(&motion, &ringing, &[], 2e-7);
        assert_eq!(found.len(), 1);
        // shares from 1 at 46 to 0.02 at 580: to the power of -1.544
        assert!((found[0].mode.share / 0.02 - (1050.0f64 / 580.0).powf(-1.5437)).abs() < 1e-3, "{found:?}");
        assert!((found[0].mode.quality_factor - 1050.0).abs() < 1e-6, "{found:?}");
        // the same between two that ring
        let gone = [ringing[0], ringing[2]];
        let found = silent_modes(&motion[..3], &gone, &[], 2e-7);
        assert!(found.len() == 1 && (0.02..1.0).contains(&found[0].mode.share), "{found:?}");
    }

    #[test]
    fn what_moves_more_than_the_mode_under_it_or_stands_beside_one_is_not_the_levers() {
        let ringing = [mode(46.0, 1.0), mode(247.0, 0.1)];
        let own = [peak(46.0, 1e-7), peak(247.0, 1e-8)];
        for other in [peak(20.0, 1e-7), peak(700.0, 5e-8), peak(260.0, 5e-9), peak(2400.0, 1e-9)] {
            let mut peaks = [own.as_slice(), &[other]].concat();
            peaks.sort_by(|a, b| a.omega.total_cmp(&b.omega));
            assert!(silent_modes(&peaks, &ringing, &[], 2e-7).is_empty(), "{other:?}");
        }
        // nor what rings but was not taken for a mode
        let seen = [own[0], own[1], peak(700.0, 5e-9)];
        assert!(silent_modes(&seen, &ringing, &[seen[2].omega], 2e-7).is_empty());
        assert_eq!(silent_modes(&seen, &ringing, &[], 2e-7).len(), 1);
        // a mode without motion of its own says nothing of those above it
        assert!(silent_modes(&[own[0], peak(700.0, 1e-9)], &ringing, &[], 2e-7).is_empty());
    }
}
