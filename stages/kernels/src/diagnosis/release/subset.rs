//! Some of an archive's events by themselves.

use super::joint::JointFit;
use super::problem::Problem;
use super::state::State;
use super::window::{Cut, EventWindow};
use crate::ringdown::EventParameters;

/// Some of an archive's events by themselves.
pub(super) struct Subset<'a> {
    whole: &'a Problem<'a>,
    chosen: Vec<usize>,
    windows: Vec<EventWindow>,
    cut: Cut,
}

impl<'a> Subset<'a> {
    pub fn of(whole: &'a Problem<'a>, chosen: Vec<usize>) -> Self {
        let windows = chosen.iter().map(|&i| whole.windows[i].clone()).collect();
        Self { whole, chosen, windows, cut: whole.cut }
    }

    /// At most `count` of them, the first, the last, and between these evenly: what drifts shows from one to the next;
    /// cut to `samples` at most.
    pub fn spread(whole: &'a Problem<'a>, count: usize, samples: usize) -> Self {
        let last = whole.windows.len().saturating_sub(1);
        let mut chosen: Vec<usize> = (0..count).map(|i| (i * last + (count - 1) / 2) / (count - 1).max(1)).collect();
        chosen.dedup();
        let subset = Self::of(whole, chosen);
        Self { cut: Cut { samples: samples.min(whole.cut.samples), ..whole.cut }, ..subset }
    }

    pub fn is_empty(&self) -> bool {
        self.chosen.is_empty()
    }

    /// Their number.
    pub fn count(&self) -> usize {
        self.chosen.len()
    }

    pub fn problem(&self) -> Problem<'_> {
        Problem { cut: self.cut, ..self.whole.with_windows(&self.windows) }
    }

    /// A state of all events, of these alone.
    pub fn state(&self, all: &State, starts: &[usize]) -> (State, Vec<usize>) {
        let centre = |samples: usize| 0.5 * (samples.max(2) - 1) as f64;
        let (long, short) = (centre(self.whole.cut.samples), centre(self.cut.samples));
        let own = |&i: &usize| {
            let own = all.events[i];
            let offset = own.offset + own.slope * (short - long) / long;
            EventParameters { offset, slope: own.slope * short / long, ..own }
        };
        let events = self.chosen.iter().map(own).collect();
        let state = State { lever: all.lever.clone(), hypotheses: all.hypotheses.clone(), events };
        (state, self.chosen.iter().map(|&i| starts[i]).collect())
    }

    /// What was found with these events, for all of them: the others' instants and amplitudes, as they are in `base`,
    /// change by these events' median.
    pub fn carried(&self, found: &JointFit, base: &JointFit) -> (State, Vec<usize>) {
        let interval_s = self.whole.cut.interval_s;
        let pairs = || self.chosen.iter().zip(found.state.events.iter().zip(&found.starts));
        let later = median(
            pairs().map(|(&i, (own, start))| {
                own.onset_s - base.state.events[i].onset_s + (*start as f64 - base.starts[i] as f64) * interval_s
            }),
            0.0,
        );
        let larger = median(pairs().map(|(&i, (own, _))| own.amplitude / base.state.events[i].amplitude), 1.0);
        let (mut events, mut starts) = (base.state.events.clone(), base.starts.clone());
        events.iter_mut().for_each(|own| {
            own.onset_s += later;
            own.amplitude *= larger;
        });
        // offset and slope are those of the whole window
        for (&i, (own, start)) in pairs() {
            (events[i].amplitude, events[i].onset_s, starts[i]) = (own.amplitude, own.onset_s, *start);
        }
        (State { lever: found.state.lever.clone(), hypotheses: found.state.hypotheses.clone(), events }, starts)
    }
}

fn median(values: impl Iterator<Item = f64>, without: f64) -> f64 {
    let mut values: Vec<f64> = values.filter(|v| v.is_finite()).collect();
    values.sort_by(f64::total_cmp);
    values.get(values.len() / 2).copied().unwrap_or(without)
}

#[cfg(test)]
mod tests {
    use faer::Mat;

    use super::*;
    use crate::diagnosis::release::{Lever, LeverMode, Prepared};
    use crate::effects::Instant;
    use crate::ringdown::RingdownNoise;

    const INTERVAL_S: f64 = 2e-7;

    fn windows(count: usize) -> Vec<EventWindow> {
        let first = Instant { record: 0, place: 0.0, time_s: 0.0, piezo_m: 0.0 };
        vec![EventWindow { values: vec![0.0; 500], onset: 40.0, first }; count]
    }

    fn problem(windows: &[EventWindow]) -> Problem<'_> {
        Problem {
            windows,
            cut: Cut { before: 16, samples: 400, interval_s: INTERVAL_S },
            noise: RingdownNoise::white(1e-6),
            nominal_poles: Vec::new(),
            pole_std: 0.15,
            seen: Vec::new(),
            confined: false,
            prepared: Prepared::default(),
        }
    }

    fn state(events: usize) -> (State, Vec<usize>) {
        let mode = LeverMode { omega: 3e5, quality_factor: 50.0, share: 1.0 };
        let own = |i: usize| EventParameters {
            amplitude: 0.5 + 0.1 * i as f64,
            onset_s: -1e-8 * i as f64,
            offset: 0.01 * i as f64,
            slope: 0.002,
        };
        let lever = Lever { modes: vec![mode], poles: vec![8e6] };
        (State { lever, hypotheses: Vec::new(), events: (0..events).map(own).collect() }, (10..10 + events).collect())
    }

    #[test]
    fn a_subset_spans_the_archive_and_is_no_larger_than_it() {
        let ten = windows(10);
        let whole = problem(&ten);
        assert_eq!(Subset::spread(&whole, 4, 150).chosen, [0, 3, 6, 9]);
        let two = windows(2);
        assert_eq!(Subset::spread(&problem(&two), 4, 150).chosen, [0, 1]);
        // no longer than the windows are
        assert_eq!(Subset::spread(&whole, 4, 10_000).problem().cut.samples, 400);
    }

    #[test]
    fn offset_and_slope_are_one_line_however_long_the_window() {
        let (ten, (all, starts)) = (windows(10), state(10));
        let whole = problem(&ten);
        let few = Subset::spread(&whole, 4, 150);
        let (part, part_starts) = few.state(&all, &starts);
        assert_eq!(part_starts, [10, 13, 16, 19]);
        let line = |own: &EventParameters, samples: usize, k: f64| {
            let centre = 0.5 * (samples - 1) as f64;
            own.offset + own.slope * (k - centre) / centre
        };
        for (own, &i) in part.events.iter().zip(&few.chosen) {
            for k in [0.0, 77.0, 149.0] {
                let (short, long) = (line(own, 150, k), line(&all.events[i], 400, k));
                assert!((short - long).abs() < 1e-15, "{short} {long}");
            }
        }
    }

    #[test]
    fn a_start_beyond_an_events_samples_is_an_error() {
        // few events' windows are shorter, and may lie later than a whole one can
        let (ten, (mut all, mut starts)) = (windows(10), state(10));
        assert_eq!(problem(&ten).starts(&mut all, &mut starts), Ok(()));
        starts[3] = 101;
        assert!(problem(&ten).starts(&mut all, &mut starts).is_err());
    }

    #[test]
    fn what_few_found_moves_the_others_by_the_median() {
        let (ten, (all, starts)) = (windows(10), state(10));
        let whole = problem(&ten);
        let fit = |state: State, starts: Vec<usize>| JointFit {
            covariance: Mat::zeros(0, 0),
            state,
            starts,
            costs: Vec::new(),
            cost: 0.0,
            converged: true,
            evaluations: 0,
            damping: 0.0,
            at_limit: Vec::new(),
        };
        let few = Subset::spread(&whole, 4, 150);
        let (mut found, mut found_starts) = few.state(&all, &starts);
        // three quarters of a sample later: of one event in the next window's first quarter
        found.events.iter_mut().for_each(|own| {
            own.onset_s += 0.75 * INTERVAL_S;
            own.amplitude *= 1.5;
        });
        found.events[2].onset_s -= INTERVAL_S;
        found_starts[2] += 1;
        let base = fit(all.clone(), starts.clone());
        let (carried, carried_starts) = few.carried(&fit(found.clone(), found_starts.clone()), &base);
        for (i, (now, old)) in carried.events.iter().zip(&all.events).enumerate() {
            let instant = |own: &EventParameters, start: usize| own.onset_s + start as f64 * INTERVAL_S;
            let later = instant(now, carried_starts[i]) - instant(old, starts[i]);
            assert!((later - 0.75 * INTERVAL_S).abs() < 1e-15, "{i}: {later:e}");
            assert!((now.amplitude / old.amplitude - 1.5).abs() < 1e-12, "{i}");
            assert_eq!((now.offset, now.slope), (old.offset, old.slope), "the whole window's");
        }
        assert_eq!(carried_starts[6], starts[6] + 1);
    }
}
