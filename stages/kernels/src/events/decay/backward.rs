//! Whether samples belong to one free decay: whether they obey one linear recurrence.

use std::ops::Range;

use faer::Mat;

use super::clipping;
use crate::linear_algebra::{Qr, solve};
use crate::statistics::median_and_scale;

/// Blocks per period in which the decay is looked at: a contact of a tenth of a period is seen.
const BLOCKS_PER_PERIOD: usize = 16;
/// Most coefficients of the recurrence, an offset among the exponentials.
const MOST_ORDER: usize = 20;
/// Equations per coefficient.
const EQUATIONS: usize = 6;
/// Energy of a block's misses, each over its scale, beyond which it is not part of the free decay: what C channels of
/// noise have, six of its standard deviations and 15 more for its tail.
fn beyond(channels: usize) -> f64 {
    let c = channels as f64;
    c + 6.0 * (2.0 * c).sqrt() + 15.0
}

/// Whether the samples of `stretch` obey one recurrence from the first one on.
///
/// # Model
/// A sum of decaying exponentials and an offset obeys one linear recurrence, forwards and backwards; while a hammer
/// touches, or an amplifier is at its rail, it does not.
/// # Method
/// Means of blocks of a sixteenth of a period, in which a short contact is not hidden by noise. Each channel's backward
/// recurrence by least squares over the stretch, its errors' scale by their median; what does not belong to it stands
/// out in the first blocks, up to `judged`. Blocks with clipped samples are left out.
pub(super) fn obeys(
    channels: &[&[f64]],
    clipped: &[Vec<Range<usize>>],
    stretch: &Range<usize>,
    judged: usize,
    block: usize,
) -> bool {
    let count = judged.saturating_sub(stretch.start) / block;
    let mut misses = vec![(0.0, 0); count];
    for (y, gaps) in channels.iter().zip(clipped) {
        for (k, miss) in missed(y, gaps, stretch, block, count).into_iter().flatten() {
            misses[k].0 += miss * miss;
            misses[k].1 += 1;
        }
    }
    misses.iter().all(|&(energy, channels)| channels == 0 || energy <= beyond(channels))
}

/// Blocks of a contact at most, and of the period that is judged with it.
pub(super) fn block_of(period: usize) -> usize {
    (period / BLOCKS_PER_PERIOD).max(1)
}

/// The first `judged` blocks' misses over their scale; none where there is too little to fit.
fn missed(
    y: &[f64],
    gaps: &[Range<usize>],
    stretch: &Range<usize>,
    block: usize,
    judged: usize,
) -> Option<Vec<(usize, f64)>> {
    let count = stretch.len() / block;
    let sample = |b: usize| stretch.start + b * block..stretch.start + (b + 1) * block;
    let level = y[stretch.end.checked_sub(1)?];
    let means: Vec<f64> =
        (0..count).map(|b| y[sample(b)].iter().map(|v| v - level).sum::<f64>() / block as f64).collect();
    let order = (count / EQUATIONS).min(MOST_ORDER);
    if order < 3 {
        return None;
    }
    let usable = |b: usize| b + order < count && (b..=b + order).all(|k| !clipping::touches(gaps, sample(k)));
    let rows: Vec<usize> = (0..count).filter(|&b| usable(b)).collect();
    if rows.len() < 3 * order {
        return None;
    }
    let scale = means.iter().fold(0.0_f64, |m, v| m.max(v.abs())).max(f64::MIN_POSITIVE);
    let row = |b: usize, j: usize| if j == order { scale } else { means[b + 1 + j] };
    let weights = recurrence(&rows, order, row, &means)?;
    let error = |b: usize| means[b] - (0..=order).map(|j| row(b, j) * weights[j]).sum::<f64>();
    let mut errors: Vec<f64> = rows.iter().map(|&b| error(b)).collect();
    let (centre, spread) = median_and_scale(&mut errors);
    let spread = spread.max(1e-9 * scale);
    Some((0..judged).filter(|&b| usable(b)).map(|b| (b, (error(b) - centre) / spread)).collect())
}

/// Coefficients by least squares, a hair of a ridge: exponentials fewer than coefficients leave them undetermined.
fn recurrence(rows: &[usize], order: usize, row: impl Fn(usize, usize) -> f64, means: &[f64]) -> Option<Vec<f64>> {
    let width = order + 1;
    let matrix = Mat::from_fn(rows.len(), width + 1, |i, j| if j == width { means[rows[i]] } else { row(rows[i], j) });
    let r = Qr::new(matrix).r();
    let top = r.as_ref().get(..width, ..width);
    let mut gram = crate::linear_algebra::product(top.transpose(), top);
    let largest = (0..width).map(|i| gram[(i, i)]).fold(0.0, f64::max);
    (0..width).for_each(|i| gram[(i, i)] += 1e-12 * largest);
    let right = Mat::from_fn(width, 1, |i, _| (0..width).map(|k| r[(k, i)] * r[(k, width)]).sum());
    let solved = solve(gram, &right);
    let weights: Vec<f64> = (0..width).map(|i| solved[(i, 0)]).collect();
    weights.iter().all(|w| w.is_finite()).then_some(weights)
}
