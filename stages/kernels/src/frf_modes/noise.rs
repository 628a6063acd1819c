//! Variance of the responses where none is known: by bands, first from neighbouring lines, then from what a fit leaves.

use std::ops::Range;

use faer::c64;

use super::data::Lines;
use super::projection::Projection;
use crate::statistics::median;

/// Least lines of a band: eighty numbers know a variance to 16 %, which costs a weighted mean 1 % of its efficiency.
const BAND: usize = 40;
/// Bands at most. Why: noise varies smoothly; narrower bands would follow single peaks.
pub(super) const BANDS: usize = 30;
/// Mean of an exponential variable over its median.
const MEAN: f64 = std::f64::consts::LOG2_E;
/// Weights relative to the largest of a response below which a band counts as not measured.
const FAINT: f64 = 1e-12;

/// Bands of lines.
pub(super) fn bands(lines: usize) -> Vec<Range<usize>> {
    let count = (lines / BAND).clamp(1, BANDS);
    (0..count).map(|i| i * lines / count..(i + 1) * lines / count).collect()
}

/// Share of a band's root mean square that starting weights take for noise at least: correlated noise is smooth, and
/// neighbours do not show it.
const LEAST: f64 = 0.02;

/// Weights of the noise that third differences of neighbouring lines show, and weights for the start.
///
/// A smooth response leaves no third differences, and of the lines of a band the median counts, which peaks do not
/// move.
pub(super) fn from_neighbours(lines: &Lines) -> (Vec<Vec<f64>>, Vec<Vec<f64>>) {
    let row = |r: usize, share: f64| {
        let there: Vec<usize> = (0..lines.len()).filter(|k| lines.weight[r][*k] > 0.0).collect();
        by_bands(lines.len(), |band| {
            let own = there.partition_point(|k| *k < band.start)..there.partition_point(|k| *k < band.end);
            let count = own.len().max(1) as f64;
            let size = there[own.clone()].iter().map(|k| lines.transfer[r][*k].norm_sqr()).sum::<f64>() / count;
            let mut differences: Vec<f64> = own.filter_map(|i| difference(lines, r, &there, i)).collect();
            let noise = if differences.is_empty() { 0.0 } else { MEAN * median(&mut differences) };
            noise + share * share * size
        })
    };
    let of = |share: f64| kept(lines, (0..lines.responses()).map(|r| row(r, share)).collect());
    (of(0.0), of(LEAST))
}

/// Square of the third divided difference about place `i` of those where a response has values, of unit weight: lines
/// need not be evenly spaced. None of fewer than four.
fn difference(lines: &Lines, response: usize, there: &[usize], i: usize) -> Option<f64> {
    let first = i.saturating_sub(1).min(there.len().checked_sub(4)?);
    let own = there.get(first..first + 4)?;
    let f = |a: usize| lines.frequency_hz[own[a]];
    let weight = |a: usize| (0..4).filter(|b| *b != a).map(|b| (f(a) - f(b)).recip()).product::<f64>();
    let weights = [0, 1, 2, 3].map(weight);
    let sum: c64 = weights.iter().zip(own).map(|(w, k)| lines.transfer[response][*k] * *w).sum();
    Some(sum.norm_sqr() / weights.iter().map(|w| w * w).sum::<f64>())
}

/// Weights from what a fit leaves, its parameters counted in the bands where its modes are, and what has no place in the
/// band (residual terms, poles beyond it, real ones) in all bands alike.
pub(super) fn from_residual(lines: &Lines, at: &Projection, left: &[Vec<c64>]) -> Vec<Vec<f64>> {
    let responses = lines.responses() as f64;
    let bands = bands(lines.len());
    let inside = |band: &Range<usize>| {
        let place = |s: &&c64| lines.frequency_hz.partition_point(|f| *f < s.im / std::f64::consts::TAU);
        let own = at.poles.iter().filter(|s| s.im > 0.0 && band.contains(&place(s))).count();
        // two numbers for its residue, and the response's share of the pole's two
        (2.0 + 2.0 / responses) * own as f64
    };
    let parameters: Vec<f64> = bands.iter().map(inside).collect();
    let elsewhere = at.parameters() as f64 / responses - parameters.iter().sum::<f64>();
    let row = |(left, weight): (&Vec<c64>, &Vec<f64>)| {
        let all = weight.iter().filter(|w| **w > 0.0).count() as f64;
        let variance = |(band, inside): (&Range<usize>, &f64)| {
            let there = weight[band.clone()].iter().filter(|w| **w > 0.0).count() as f64;
            let taken = inside + elsewhere * there / all.max(1.0);
            // at least half of the numbers are the noise's
            let degrees = (2.0 * there - taken).max(there).max(1.0);
            let size = 2.0 / degrees;
            power_law(lines, left, weight, band.clone()).into_iter().map(|v| size * v).collect::<Vec<f64>>()
        };
        bands.iter().zip(&parameters).flat_map(variance).collect()
    };
    kept(lines, left.iter().zip(&lines.weight).map(row).collect())
}

/// Sum of squares of a band, where there are values, spread over its lines as a power of the frequency: of white noise,
/// or of noise that was integrated once or twice, the likeliest.
fn power_law(lines: &Lines, left: &[c64], weight: &[f64], band: Range<usize>) -> Vec<f64> {
    let there: Vec<usize> = band.clone().filter(|k| weight[*k] > 0.0).collect();
    let logarithms: f64 = there.iter().map(|k| lines.frequency_hz[*k].ln()).sum();
    let fitted = |power: i32| {
        let square = |k: &usize| lines.merged[*k] * left[*k].norm_sqr() * lines.frequency_hz[*k].powi(power);
        let size: f64 = there.iter().map(square).sum();
        // twice the negative log-likelihood but for a constant: sum of ln v
        let cost = there.len() as f64 * size.max(f64::MIN_POSITIVE).ln() - f64::from(power) * logarithms;
        (cost, power, size)
    };
    let best = [0, 2, 4].map(fitted).into_iter().min_by(|x, y| x.0.total_cmp(&y.0));
    let (_, power, size) = best.unwrap_or((0.0, 0, 0.0));
    lines.frequency_hz[band].iter().map(|f| size * f.powi(-power)).collect()
}

fn by_bands(lines: usize, variance: impl Fn(Range<usize>) -> f64) -> Vec<f64> {
    bands(lines).into_iter().flat_map(|band| vec![variance(band.clone()); band.len()]).collect()
}

/// Weights of these variances where values are; of a band without noise (copied or rounded lines) the least variance of
/// the others.
fn kept(lines: &Lines, variance: Vec<Vec<f64>>) -> Vec<Vec<f64>> {
    let row = |(variance, old): (Vec<f64>, &Vec<f64>)| -> Vec<f64> {
        let most = variance.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max);
        let least = variance.iter().copied().filter(|v| *v > FAINT * most).fold(most, f64::min);
        let least = if least > 0.0 { least } else { 1.0 };
        let own = variance.into_iter().zip(&lines.merged).zip(old);
        own.map(|((v, merged), w)| if *w > 0.0 { 2.0 * merged / v.max(least) } else { 0.0 }).collect()
    };
    variance.into_iter().zip(&lines.weight).map(row).collect()
}
