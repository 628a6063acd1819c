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
/// Means event by event and bin by bin, then over events: their scatter is the standard error, whatever the colour of the noise.
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
