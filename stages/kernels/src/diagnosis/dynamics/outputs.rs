//! Outputs and states of many runs.

use rayon::prelude::*;

use super::lane::Lane;
use super::motion::{Run, Sink, groups, integrate};
use super::sensed::Sensed;
use crate::effects::pass;

/// Output of each run, channel by channel.
pub(crate) fn outputs(runs: &[Run<'_>]) -> Vec<Vec<f64>> {
    together(runs, |group, samples| {
        let mut seen = Seen::new(group, samples);
        integrate(group, &mut seen);
        group.iter().enumerate().map(|(l, run)| seen.output(l, run)).collect()
    })
}

/// States of each run, by section and sample.
pub(crate) fn motions(runs: &[Run<'_>]) -> Vec<Vec<Vec<[f64; 2]>>> {
    together(runs, |group, samples| {
        let mut states = States(Vec::with_capacity(samples));
        integrate(group, &mut states);
        let of = |l: usize, run: &Run<'_>| -> Vec<Vec<[f64; 2]>> {
            let section = |s: usize| {
                let own = states.0.iter().take(run.span.samples);
                own.map(|states| [states[s][0].0[l], states[s][1].0[l]]).collect()
            };
            (0..run.dynamics.sections.len()).map(section).collect()
        };
        group.iter().enumerate().map(|(l, run)| of(l, run)).collect()
    })
}

/// What `one` makes of each group of runs, in the order of the runs.
fn together<T: Send>(runs: &[Run<'_>], one: impl Fn(&[&Run<'_>], usize) -> Vec<T> + Sync) -> Vec<T> {
    let groups = groups(runs);
    let made = groups.par_iter().map(|group| {
        let group: Vec<&Run<'_>> = group.iter().map(|i| &runs[*i]).collect();
        one(&group, group.iter().map(|run| run.span.samples).max().unwrap_or(0))
    });
    let made: Vec<Vec<T>> = made.collect();
    let mut numbered: Vec<(usize, T)> = groups.into_iter().flatten().zip(made.into_iter().flatten()).collect();
    numbered.sort_by_key(|(i, _)| *i);
    numbered.into_iter().map(|(_, value)| value).collect()
}

struct States(Vec<Vec<[Lane; 2]>>);

impl Sink for States {
    #[inline(always)]
    fn take(&mut self, _: usize, states: &[[Lane; 2]], _: &[Lane]) {
        self.0.push(states.to_vec());
    }
}

/// The sections' weighted sum in each channel.
struct Seen {
    /// By channel and section.
    weights: Vec<Vec<[Lane; 2]>>,
    /// Channels of accelerometers.
    accelerates: Vec<bool>,
    /// By channel and sample.
    sums: Vec<Vec<Lane>>,
}

impl Seen {
    fn new(group: &[&Run<'_>], samples: usize) -> Self {
        let channels = group.first().map_or(0, |run| run.dynamics.weights.len());
        let sections = group.first().map_or(0, |run| run.dynamics.sections.len());
        let of = |l: usize, channel: usize, s: usize, i: usize| {
            let weight = |run: &&Run<'_>| Some(run.dynamics.weights.get(channel)?.get(s)?[i]);
            group.get(l).and_then(weight).unwrap_or(0.0)
        };
        let weight = |channel: usize, s: usize| std::array::from_fn(|i| Lane::of(|l| of(l, channel, s, i)));
        let sensed = |channel: usize| group.first().and_then(|run| run.dynamics.sensed.get(channel));
        Self {
            accelerates: (0..channels).map(|channel| sensed(channel) == Some(&Sensed::Acceleration)).collect(),
            weights: (0..channels).map(|channel| (0..sections).map(|s| weight(channel, s)).collect()).collect(),
            sums: vec![Vec::with_capacity(samples); channels],
        }
    }

    fn output(&self, l: usize, run: &Run<'_>) -> Vec<f64> {
        let Run { dynamics, state, nodes, effects, span } = run;
        let width = 2 * span.steps + 1;
        let mut output = Vec::with_capacity(span.samples * self.sums.len());
        let changed = !(effects.optics.is_empty() && effects.added.is_empty() && effects.lost.is_empty());
        let plain = dynamics.through.is_none() && !changed;
        for (channel, sums) in self.sums.iter().enumerate() {
            let offset = state.offsets.get(channel).copied().unwrap_or(0.0);
            if plain {
                output.extend(sums.iter().take(span.samples).map(|sum| sum.0[l] + offset));
                continue;
            }
            let begin = output.len();
            for (k, sum) in sums.iter().enumerate().take(span.samples) {
                let direct = dynamics.through.zip(nodes.as_deref()).map_or(0.0, |(through, nodes)| {
                    through * nodes.get(k * width).or(nodes.last()).copied().unwrap_or(0.0)
                });
                output.push(sum.0[l] + direct);
            }
            pass(&effects.optics, |k| span.time_s(k), &mut output[begin..]);
            output[begin..].iter_mut().enumerate().for_each(|(k, y)| *y += offset + span.added(k, effects));
            if !effects.lost.is_empty() {
                let taken = output.split_off(begin);
                output.extend((0..span.stored).map(|k| between(&taken, span.taken(k, effects))));
            }
        }
        output
    }
}

/// Samples at a place between them: a cubic through the two beside it that has their slopes, linear at the ends.
fn between(samples: &[f64], place: f64) -> f64 {
    let last = samples.len().saturating_sub(1);
    let k = (place.max(0.0) as usize).min(last);
    let at = |k: usize| samples.get(k.min(last)).copied().unwrap_or(0.0);
    let (share, a, b) = ((place - k as f64).clamp(0.0, 1.0), at(k), at(k + 1));
    let (before, behind) =
        (if k > 0 { at(k - 1) } else { 2.0 * a - b }, if k + 1 < last { at(k + 2) } else { 2.0 * b - a });
    let (rise, fall) = (0.5 * (b - before), 0.5 * (behind - a));
    let square = share * share;
    let cube = square * share;
    a * (2.0 * cube - 3.0 * square + 1.0)
        + b * (3.0 * square - 2.0 * cube)
        + rise * (cube - 2.0 * square + share)
        + fall * (cube - square)
}

impl Sink for Seen {
    #[inline(always)]
    fn take(&mut self, _: usize, states: &[[Lane; 2]], accelerations: &[Lane]) {
        let channels = self.weights.iter().zip(&self.accelerates).zip(&mut self.sums);
        for ((weights, accelerates), sums) in channels {
            let mut sum = Lane::default();
            if *accelerates {
                for ((w, x), a) in weights.iter().zip(states).zip(accelerations) {
                    sum = sum + (w[0] * *a + w[1] * x[1]);
                }
            } else {
                for (w, x) in weights.iter().zip(states) {
                    sum = sum + (w[0] * x[0] + w[1] * x[1]);
                }
            }
            sums.push(sum);
        }
    }

    fn accelerates(&self) -> bool {
        self.accelerates.contains(&true)
    }
}
