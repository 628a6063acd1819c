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
    let row = |transfer: &Vec<c64>, share: f64| {
        let difference = |k: usize| -> f64 {
            let first = k.saturating_sub(1).min(transfer.len() - 4);
            let [a, b, c, d] = [0, 1, 2, 3].map(|i| transfer[first + i]);
            // the weights' squares add up to 20
            (d - c * 3.0 + b * 3.0 - a).norm_sqr() / 20.0
        };
        by_bands(lines.len(), |band| {
            let size = transfer[band.clone()].iter().map(c64::norm_sqr).sum::<f64>() / band.len() as f64;
            MEAN * median(&mut band.map(difference).collect::<Vec<f64>>()) + share * share * size
        })
    };
    let of = |share: f64| kept(lines, lines.transfer.iter().map(|transfer| row(transfer, share)).collect());
    (of(0.0), of(LEAST))
}

/// Weights from what a fit leaves, its parameters counted in the bands where its modes are.
pub(super) fn from_residual(lines: &Lines, at: &Projection, left: &[Vec<c64>]) -> Vec<Vec<f64>> {
    let responses = lines.responses() as f64;
    let modal = |band: &Range<usize>| {
        let inside = |s: &&c64| {
            let f = s.im / std::f64::consts::TAU;
            f >= lines.frequency_hz[band.start] && f < lines.frequency_hz[band.end - 1]
        };
        // two numbers for its residue, and the response's share of the pole's two
        (2.0 + 2.0 / responses) * at.poles.iter().filter(inside).count() as f64
    };
    let row = |left: &Vec<c64>| {
        let variance = |band: Range<usize>| {
            // at least half of the numbers are the noise's
            let degrees = (2.0 * band.len() as f64 - modal(&band)).max(band.len() as f64);
            let size = 2.0 / degrees;
            power_law(lines, left, band).into_iter().map(|v| size * v).collect::<Vec<f64>>()
        };
        bands(lines.len()).into_iter().flat_map(variance).collect()
    };
    kept(lines, left.iter().map(row).collect())
}

/// Sum of squares of a band spread over its lines as a power of the frequency: of white noise, or of noise that was
/// integrated once or twice, the likeliest.
fn power_law(lines: &Lines, left: &[c64], band: Range<usize>) -> Vec<f64> {
    let frequency = &lines.frequency_hz[band.clone()];
    let logarithms: f64 = frequency.iter().map(|f| f.ln()).sum();
    let fitted = |power: i32| {
        let own = left[band.clone()].iter().zip(&lines.merged[band.clone()]).zip(frequency);
        let size: f64 = own.map(|((e, merged), f)| merged * e.norm_sqr() * f.powi(power)).sum();
        // twice the negative log-likelihood but for a constant: sum of ln v
        let cost = band.len() as f64 * size.max(f64::MIN_POSITIVE).ln() - f64::from(power) * logarithms;
        (cost, power, size)
    };
    let best = [0, 2, 4].map(fitted).into_iter().min_by(|x, y| x.0.total_cmp(&y.0));
    let (_, power, size) = best.unwrap_or((0.0, 0, 0.0));
    frequency.iter().map(|f| size * f.powi(-power)).collect()
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
