//! Whether a repeated run gave the same numbers.

use afmid_pipeline::store::Numbers;

use super::diff::{Diff, ResultDiff};

/// The largest difference that still counts as the same, for one number of a document relative to itself, for a dataset
/// relative to its largest magnitude. docs/conventions.md says why.
pub const TOLERANCE: f64 = 1e-9;

/// What a repetition showed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Verdict {
    /// Every bit of every result.
    Identical,
    /// Every number within [`TOLERANCE`].
    Within,
    /// Neither.
    Differs,
}

impl Verdict {
    /// Its name in messages and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Identical => "identical",
            Self::Within => "within",
            Self::Differs => "differs",
        }
    }
}

/// The results that differ, with the stages that they belong to; where files lie does not count.
pub fn results(diff: &Diff) -> Vec<(&str, &ResultDiff)> {
    diff.stages
        .iter()
        .flat_map(|stage| stage.results.iter().map(move |result| (stage.id.as_str(), result)))
        .filter(|(_, result)| !result.place_only)
        .collect()
}

/// How far a dataset is from what it was, as [`TOLERANCE`] measures it; infinite if more than numbers differ.
pub fn distance(result: &ResultDiff) -> f64 {
    result.numbers.as_ref().map_or(f64::INFINITY, |numbers: &Numbers| {
        // a document's numbers have nothing to do with each other
        if numbers.at.starts_with('/') { numbers.relative } else { numbers.relative_to_scale() }
    })
}

/// Judges a repetition.
pub fn judge(diff: &Diff) -> Verdict {
    let results = results(diff);
    if diff.results_equal && results.is_empty() {
        Verdict::Identical
    } else if diff.stages_only_in_a.is_empty()
        && diff.stages_only_in_b.is_empty()
        && results.iter().all(|(_, result)| distance(result) <= TOLERANCE)
    {
        Verdict::Within
    } else {
        Verdict::Differs
    }
}
