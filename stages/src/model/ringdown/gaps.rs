//! Which samples of the ensemble are missing.

use std::ops::Range;

/// Per event, runs of samples that are NaN, beyond `limits`, or in `ranges` (samples from the first one used, the end
/// not included).
pub(super) fn gaps(events: &[&[f64]], ranges: &[[i64; 2]], limits: Option<[f64; 2]>) -> Vec<Vec<Range<usize>>> {
    let beyond = |value: f64| limits.is_some_and(|[least, most]| value <= least || value >= most);
    let listed = |k: usize| ranges.iter().any(|[from, to]| (*from..*to).contains(&(k as i64)));
    let of = |event: &&[f64]| {
        let mut runs: Vec<Range<usize>> = Vec::new();
        for (k, &value) in event.iter().enumerate() {
            if !(value.is_nan() || beyond(value) || listed(k)) {
                continue;
            }
            match runs.last_mut() {
                Some(run) if run.end == k => run.end = k + 1,
                _ => runs.push(k..k + 1),
            }
        }
        runs
    };
    let all: Vec<Vec<Range<usize>>> = events.iter().map(of).collect();
    if all.iter().all(Vec::is_empty) { Vec::new() } else { all }
}

/// Missing samples of all events.
pub(super) fn total(gaps: &[Vec<Range<usize>>]) -> usize {
    gaps.iter().flatten().map(Range::len).sum()
}
