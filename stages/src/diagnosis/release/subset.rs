//! Some of an archive's events by themselves.

use super::joint::JointFit;
use super::problem::Problem;
use super::state::State;
use super::window::{Cut, EventWindow};
use crate::model::ringdown::EventParameters;

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

    /// At most `count` of them, the first, the last, and between these evenly: what drifts shows from one to the next; cut to `samples` at most.
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

    /// What was found with these events, for all of them: the others' instants and amplitudes, as they are in `base`, change by these events' median.
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
