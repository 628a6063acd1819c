//! Stretches that are none of the free decay's: what was done to make the event after them.

use super::found::{DecayEnd, DecaySearch, DismissedDecay, DismissedReason, FreeDecay};
use super::search::Record;

/// Energy of an event over that of the stretch right before it, from which on the stretch is how the event was made: a
/// seventh of the amplitude. Why: hits by hand into ringing are nearer to each other.
const ENERGY: f64 = 50.0;

impl Record<'_> {
    /// Dismisses stretches of so few periods that their decline has no error, and that a far larger event ends: a hand
    /// that bends and lets go.
    pub(super) fn dismiss_handling(&self, found: &mut DecaySearch) {
        let ratio = |pair: &[FreeDecay]| {
            let [before, after] = pair else { return None };
            let ends = before.end == DecayEnd::NextEvent && !before.decline.std_per_s.is_finite();
            let energy = |decay: &FreeDecay| {
                let first = decay.range.start;
                self.envelope.mean(first, first + before.range.len())
            };
            let ratio = energy(after) / energy(before).max(f64::MIN_POSITIVE);
            (ends && ratio > ENERGY).then_some(ratio)
        };
        let ratios: Vec<Option<f64>> = found.decays.windows(2).map(ratio).chain([None]).collect();
        let mut ratios = ratios.into_iter();
        found.decays.retain(|decay| {
            let Some(Some(ratio)) = ratios.next() else { return true };
            let reason = DismissedReason::Handling { ratio };
            found.dismissed.push(DismissedDecay { onset: decay.onset, reason });
            false
        });
    }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::super::{DecaySearchOptions, DismissedReason, find_decays};
    use crate::fixture::white_noise;

    /// Three periods at 1 Hz of the amplitude `before`, then a release at 4.6 Hz of 10, sampled at 50 Hz.
    fn released(seed: u64, before: f64) -> Vec<f64> {
        let noise = white_noise(1500, 0.05, seed);
        let y = |k: usize| {
            let t = k as f64 / 50.0 - 1.0;
            let release = t - 0.7;
            match () {
                () if t < 0.0 => 0.0,
                () if release < 0.0 => before * (TAU * 4.6 * t).sin(),
                () => 10.0 * (-0.15 * release).exp() * (TAU * 4.6 * release).cos(),
            }
        };
        noise.iter().enumerate().map(|(k, e)| y(k) + e).collect()
    }

    #[test]
    fn a_hand_before_a_release_is_no_decay() {
        for seed in 0..12 {
            let y = released(seed, 1.0);
            let found = find_decays(&[&y], 50.0, &DecaySearchOptions::default()).unwrap();
            assert_eq!(found.decays.len(), 1, "seed {seed}: {found:?}");
            assert!(found.decays[0].range.start.abs_diff(85) < 12, "seed {seed}: {:?}", found.decays[0].range);
            let handling = |d: &super::DismissedDecay| matches!(d.reason, DismissedReason::Handling { .. });
            assert!(found.dismissed.iter().any(handling), "seed {seed}: {:?}", found.dismissed);
        }
    }

    #[test]
    fn two_hits_of_like_size_stay_two() {
        for seed in 0..6 {
            let y = released(seed, 4.0);
            let found = find_decays(&[&y], 50.0, &DecaySearchOptions::default()).unwrap();
            let handling = |d: &super::DismissedDecay| matches!(d.reason, DismissedReason::Handling { .. });
            assert!(!found.dismissed.iter().any(handling), "seed {seed}: {:?}", found.dismissed);
        }
    }
}
