//! Clipped stretches of a channel.

use std::ops::Range;

use crate::events::saturation::pile_up;

/// Least samples in a row at an end of the range for a single clipped top.
const RUN: usize = 3;

/// Stretches where a channel sits at an end of its range.
///
/// # Method
/// Values within a millionth of the range of the record's extreme. They are clipped if they pile up there (as in
/// [`saturated_samples`](crate::events::saturated_samples)), or if three in a row are entered and left by more than
/// four codes: a crest turns by one. One more sample at either side belongs to it: the edge lies between samples.
pub(super) fn clipped(values: &[f64], step: f64) -> Vec<Range<usize>> {
    let (least, most) = values.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), y| (a.min(*y), b.max(*y)));
    if most <= least {
        return Vec::new();
    }
    let edge = 1e-6 * (most - least);
    let mut all = runs(values, |y| y >= most - edge, pile_up(values.iter().copied()) > 0, step);
    all.extend(runs(values, |y| y <= least + edge, pile_up(values.iter().map(|y| -y)) > 0, step));
    all.sort_by_key(|run| run.start);
    all.into_iter().map(|run| run.start.saturating_sub(1)..(run.end + 1).min(values.len())).collect()
}

/// Runs of samples at one end, if that end clips.
fn runs(values: &[f64], at: impl Fn(f64) -> bool, piled: bool, step: f64) -> Vec<Range<usize>> {
    let mut runs: Vec<Range<usize>> = Vec::new();
    for k in (0..values.len()).filter(|&k| at(values[k])) {
        match runs.last_mut() {
            Some(run) if run.end == k => run.end = k + 1,
            _ => runs.push(k..k + 1),
        }
    }
    let steep = |run: &Range<usize>| {
        let beside = [run.start.checked_sub(1), Some(run.end)];
        let beside = beside.into_iter().flatten().filter_map(|k| values.get(k));
        run.len() >= RUN && beside.map(|y| (y - values[run.start]).abs()).all(|d| d > 4.0 * step)
    };
    if piled || runs.iter().any(steep) {
        return runs.into_iter().filter(|run| piled || run.len() > 1).collect();
    }
    Vec::new()
}

/// Whether any of the stretches has a sample of `range`.
pub(super) fn touches(stretches: &[Range<usize>], range: Range<usize>) -> bool {
    stretches.iter().any(|stretch| stretch.start < range.end && range.start < stretch.end)
}
