//! What either model leaves at each level that the converter saw.

use rayon::prelude::*;

use super::joint::JointFit;
use super::problem::Problem;

/// What is left where the recorded signal stood at one level.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LevelStory {
    /// Middle of the bin, V at the converter.
    pub level_v: f64,
    /// Mean of what the linear model and of what the extended model leave there, V, each with its standard error.
    pub before: [f64; 2],
    /// The same of the extended model.
    pub after: [f64; 2],
    /// Events that were there.
    pub events: usize,
}

/// Bins between the lowest and the highest level.
const BINS: usize = 64;
/// Events that must have been at a level for their scatter to tell its error; all, where there are fewer.
const FEWEST: usize = 4;

/// Mean residuals by level; both lists of residuals are at the samples of `fitted`'s windows.
///
/// # Method
/// Means event by event and bin by bin, then over events: their scatter is the standard error, whatever the colour of
/// the noise.
pub(super) fn level_stories(
    problem: &Problem<'_>,
    fitted: &JointFit,
    before: &[Vec<f64>],
    after: &[Vec<f64>],
) -> Vec<LevelStory> {
    let samples = problem.cut.samples;
    let windows: Vec<&[f64]> = problem
        .windows
        .iter()
        .zip(&fitted.starts)
        .filter_map(|(window, start)| window.values.get(*start..start + samples))
        .collect();
    let all = || windows.iter().flat_map(|window| window.iter().copied());
    let (low, high) = (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    if low >= high || !(high - low).is_finite() {
        return Vec::new();
    }
    let width = (high - low) / BINS as f64;
    let one = |(window, rests): (&&[f64], [&Vec<f64>; 2])| -> Vec<Option<[f64; 2]>> {
        let mut sums = vec![([0.0; 2], 0usize); BINS];
        for (k, level) in window.iter().enumerate() {
            let (sum, count) = &mut sums[(((level - low) / width) as usize).min(BINS - 1)];
            *count += 1;
            sum.iter_mut().zip(rests).for_each(|(sum, rest)| *sum += rest.get(k).copied().unwrap_or(0.0));
        }
        sums.into_iter().map(|(sum, count)| (count > 0).then(|| sum.map(|s| s / count as f64))).collect()
    };
    let rests = before.iter().zip(after).map(|(b, a)| [b, a]);
    let events: Vec<Vec<Option<[f64; 2]>>> =
        windows.iter().zip(rests).collect::<Vec<_>>().into_par_iter().map(one).collect();
    (0..BINS)
        .filter_map(|bin| {
            let seen: Vec<[f64; 2]> = events.iter().filter_map(|event| event[bin]).collect();
            (seen.len() >= FEWEST.min(events.len())).then(|| LevelStory {
                level_v: low + (bin as f64 + 0.5) * width,
                before: mean(seen.iter().map(|s| s[0])),
                after: mean(seen.iter().map(|s| s[1])),
                events: seen.len(),
            })
        })
        .collect()
}

/// Mean and its standard error.
fn mean(values: impl Iterator<Item = f64> + Clone) -> [f64; 2] {
    let count = values.clone().count() as f64;
    let mean = values.clone().sum::<f64>() / count;
    let scatter = values.map(|v| (v - mean).powi(2)).sum::<f64>() / (count - 1.0);
    [mean, (scatter / count).sqrt()]
}

#[cfg(test)]
mod tests {
    use faer::Mat;

    use super::*;
    use crate::diagnosis::release::{Cut, EventWindow, Lever, Prepared, State};
    use crate::effects::Instant;
    use crate::ringdown::RingdownNoise;

    #[test]
    fn what_a_curved_output_leaves_is_seen_level_by_level() {
        let cut = Cut { before: 8, samples: 640, interval_s: 2e-7 };
        let first = Instant { record: 0, place: 0.0, time_s: 0.0, piezo_m: 0.0 };
        // five events that climb from -1 to 1 V; one of them only halfway
        let ramp = |top: f64| (0..640).map(|k| -1.0 + (1.0 + top) * f64::from(k) / 639.0).collect::<Vec<f64>>();
        let windows: Vec<EventWindow> =
            [1.0, 1.0, 1.0, 1.0, 0.0].map(|top| EventWindow { values: ramp(top), onset: 8.0, first }).to_vec();
        let problem = Problem {
            windows: &windows,
            cut,
            noise: RingdownNoise::white(1e-6),
            nominal_poles: Vec::new(),
            pole_std: 0.15,
            seen: Vec::new(),
            confined: false,
            prepared: Prepared::default(),
        };
        let lever = Lever { modes: Vec::new(), poles: Vec::new() };
        let fitted = JointFit {
            state: State { lever, hypotheses: Vec::new(), events: Vec::new() },
            starts: vec![0; windows.len()],
            covariance: Mat::zeros(0, 0),
            costs: Vec::new(),
            cost: 0.0,
            converged: true,
            evaluations: 0,
            damping: 0.0,
            at_limit: Vec::new(),
        };
        // a square in the level, a little more of it in each event
        let rest =
            |i: usize| -> Vec<f64> { windows[i].values.iter().map(|v| (1.0 + 0.1 * i as f64) * v * v).collect() };
        let before: Vec<Vec<f64>> = (0..5).map(rest).collect();
        let after = vec![vec![0.0; 640]; 5];
        let levels = level_stories(&problem, &fitted, &before, &after);
        assert_eq!(levels.len(), BINS);
        for level in &levels {
            // four events reach the upper half, five the lower
            let events = if level.level_v > 0.02 { 4 } else { 5 };
            assert!(level.events == events || level.level_v.abs() < 0.02, "{level:?}");
            let factor = if level.events == 5 { 1.2 } else { 1.15 };
            // a bin is 1/32 V wide
            assert!((level.before[0] - factor * level.level_v.powi(2)).abs() < 0.002 + 0.04 * level.level_v.abs());
            let scatter =
                if level.events == 5 { 0.025_f64.sqrt() / 5f64.sqrt() } else { (0.05_f64 / 3.0).sqrt() / 2.0 };
            assert!((level.before[1] - scatter * level.level_v.powi(2)).abs() < 0.002 + 0.04 * level.level_v.abs());
            assert_eq!(level.after, [0.0, 0.0]);
        }
    }
}
