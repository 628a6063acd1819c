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

    use super::super::{DecaySearchOptions, Decline, find_decays};
    use super::*;
    use crate::fixture::white_noise;

    /// Sample of the release.
    const RELEASE: usize = 85;

    /// Three periods at 4.6 Hz of the amplitude `before`, then a release of 10, sampled at 50 Hz.
    fn released(seed: u64, before: f64) -> Vec<f64> {
        let noise = white_noise(1500, 0.05, seed);
        let y = |k: usize| {
            let t = k as f64 / 50.0 - 1.0;
            let release = (k as f64 - RELEASE as f64) / 50.0;
            match () {
                () if t < 0.0 => 0.0,
                () if k < RELEASE => before * (TAU * 4.6 * t).sin(),
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
            assert!(found.decays[0].range.start.abs_diff(RELEASE) < 12, "seed {seed}: {:?}", found.decays[0].range);
        }
    }

    #[test]
    fn what_a_far_larger_event_ends_is_dismissed_unless_its_decline_is_known() {
        let known = Decline { rate_per_s: 0.1, std_per_s: 0.01, freedom: 5 };
        let unknown = Decline { rate_per_s: 0.0, std_per_s: f64::INFINITY, freedom: 0 };
        let cases = [(1.0, unknown, DecayEnd::NextEvent, 1), (4.0, unknown, DecayEnd::NextEvent, 2)];
        let kept = [(1.0, known, DecayEnd::NextEvent, 2), (1.0, unknown, DecayEnd::Noise, 2)];
        for (before, decline, end, left) in cases.into_iter().chain(kept) {
            let y = released(1, before);
            let options = DecaySearchOptions::default();
            let record = Record::of(&[&y], 50.0, &options);
            let mut found = find_decays(&[&y], 50.0, &options).unwrap();
            let mut first = found.decays[0].clone();
            (first.onset, first.range, first.end, first.decline) = (50, 50..70, end, decline);
            let mut release = first.clone();
            (release.onset, release.range, release.end) = (RELEASE, RELEASE..1500, DecayEnd::RecordEnd);
            found.decays = vec![first, release];
            record.dismiss_handling(&mut found);
            assert_eq!(found.decays.len(), left, "{before} {decline:?} {end:?}");
            assert_eq!(found.decays[left - 1].onset, RELEASE);
            let ratio = found.dismissed.iter().find_map(|d| match d.reason {
                DismissedReason::Handling { ratio } => Some(ratio),
                _ => None,
            });
            // amplitudes of 1 and 10
            assert_eq!(ratio.is_some_and(|ratio| (50.0..150.0).contains(&ratio)), left == 1, "{ratio:?}");
        }
    }
}
