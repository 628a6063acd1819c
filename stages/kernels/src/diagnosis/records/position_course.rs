//! The free level against the piezo's position, as one looks at it: no shape assumed.

use crate::linear_algebra::product;
use faer::Mat;

use super::basis::span;
use super::free_level::{FreeLevel, FreeRecord};
use crate::linear_algebra::symmetric_inverse;

/// The free level where the piezo stood at one place.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PositionCourse {
    /// Middle of the bin, m.
    pub position_m: f64,
    /// Level against the mean of all places, V, and its standard error: before causes are taken out.
    pub before: [f64; 2],
    /// The same after the named causes are taken out.
    pub after: [f64; 2],
}

/// Bins of the piezo's travel.
const BINS: usize = 48;
/// Of the information's mean diagonal: what the nuisances leave nothing of stays zero.
const RIDGE: f64 = 1e-6;

/// The course before and after; nothing where no record has positions.
///
/// # Method
/// Least squares of one step function of the position for all records, each record's nuisances (offsets of stretches,
/// drift, slow lines) taken out; errors from the records' scores, so that no noise model is needed.
/// # Source
/// H. White, Econometrica 48 (1980) 817, by clusters.
pub(super) fn position_course(before: &FreeLevel, after: &FreeLevel) -> Vec<PositionCourse> {
    let spans = before.records.iter().map(|record| span(&record.position_m));
    let (low, high) = spans.fold((f64::INFINITY, f64::NEG_INFINITY), |a, b| (a.0.min(b.0), a.1.max(b.1)));
    let width = (high - low) / BINS as f64;
    if !(width > 0.0 && width.is_finite()) {
        return Vec::new();
    }
    let bin = |z: f64| (((z - low) / width) as usize).min(BINS - 1);
    let [before, after] = [before, after].map(|level| course(&level.records, bin));
    let one =
        |i: usize| PositionCourse { position_m: low + (i as f64 + 0.5) * width, before: before[i], after: after[i] };
    (0..BINS).map(one).collect()
}

/// Level and standard error by bin.
fn course(records: &[FreeRecord], bin: impl Fn(f64) -> usize) -> Vec<[f64; 2]> {
    let parts: Vec<(Mat<f64>, Mat<f64>)> = records.iter().map(|record| normal(record, &bin)).collect();
    let mut information = Mat::<f64>::zeros(BINS, BINS);
    let mut score = Mat::<f64>::zeros(BINS, 1);
    for (own, right) in &parts {
        information += own;
        score += right;
    }
    let scale = (0..BINS).map(|i| information[(i, i)]).sum::<f64>() / BINS as f64;
    // only differences show: the mean is held at zero
    let held = Mat::from_fn(BINS, BINS, |i, j| {
        information[(i, j)] + scale / BINS as f64 + if i == j { RIDGE * scale } else { 0.0 }
    });
    let inverse = symmetric_inverse(&held);
    let level = product(inverse.as_ref(), score.as_ref());
    let mut meat = Mat::<f64>::zeros(BINS, BINS);
    for (own, right) in &parts {
        let rest = right - product(own.as_ref(), level.as_ref());
        meat += product(rest.as_ref(), rest.transpose());
    }
    let covariance = product(product(inverse.as_ref(), meat.as_ref()).as_ref(), inverse.as_ref());
    (0..BINS).map(|i| [level[(i, 0)], covariance[(i, i)].max(0.0).sqrt()]).collect()
}

/// One record's information on the bins, and its score.
fn normal(record: &FreeRecord, bin: impl Fn(f64) -> usize) -> (Mat<f64>, Mat<f64>) {
    let places: Vec<usize> = record.position_m.iter().map(|z| bin(*z)).collect();
    let columns: Vec<Vec<f64>> = (0..BINS)
        .map(|i| {
            let inside = places.iter().map(|place| f64::from(u8::from(*place == i))).collect::<Vec<f64>>();
            record.nuisance.residual(&inside)
        })
        .collect();
    let samples = places.len();
    let shapes = Mat::from_fn(samples, BINS, |k, i| columns[i][k]);
    let left = Mat::from_fn(samples, 1, |k, _| record.left_v[k]);
    (product(shapes.transpose(), shapes.as_ref()), product(shapes.transpose(), left.as_ref()))
}

#[cfg(test)]
mod tests {
    use super::super::archive::Archive;
    use super::super::position::judge_position;

    #[test]
    fn a_slope_is_seen_before_and_gone_after() {
        let kappa = 3e4;
        let records = Archive { crosstalk: kappa, ..Archive::CLEAN }.summaries(4);
        let judged = judge_position(&records, &[], 0.01);
        assert_eq!(judged.signs.first().map(|sign| sign.id), Some("piezo-crosstalk"));
        let middle = |pick: fn(&super::PositionCourse) -> f64| {
            let (mut xy, mut xx) = (0.0, 0.0);
            let mean = judged.course.iter().map(|c| c.position_m).sum::<f64>() / judged.course.len() as f64;
            for one in &judged.course {
                xy += (one.position_m - mean) * pick(one);
                xx += (one.position_m - mean).powi(2);
            }
            xy / xx
        };
        // the free travel is a part of the whole: what lies beyond is not seen and held at zero by the ridge, so that
        // the slope is bounded, not exact
        let (before, after) = (middle(|c| c.before[0]), middle(|c| c.after[0]));
        assert!(before > 0.3 * kappa && before < 1.5 * kappa, "{before:e}");
        // the slope is fitted to some 2 %
        assert!(after.abs() < 0.05 * kappa, "{after:e}");
        assert!(judged.course.iter().all(|c| c.before[1].is_finite() && c.after[1].is_finite()));
    }

    #[test]
    fn without_positions_there_is_no_course() {
        assert!(judge_position(&[], &[], 0.01).course.is_empty());
    }
}
