//! Where a response may have resonances.

use faer::c64;

/// Resonances that are looked at, the highest.
const MOST_RESONANCES: usize = 8;
/// Ratio of a peak's height to the valleys beside it, at least.
const LEAST_RATIO: f64 = 2.0;
/// Half of a stretch, in half-power half-widths of its peak.
const HALF_WIDTHS: f64 = 6.0;
/// Fewest points on a side of the peak, where the band has them.
const LEAST_POINTS: usize = 7;
/// Points of a stretch, at most; more are averaged in groups.
const MOST_POINTS: usize = 120;

/// The values around a peak.
pub(super) struct Stretch {
    /// Frequencies, from -1 to 1.
    pub x: Vec<f64>,
    pub values: Vec<c64>,
    /// Half-power half-width of the peak, in x.
    pub half_width: f64,
    /// Where the peak is.
    pub peak: f64,
    /// Its squared height, in median ones of the response.
    pub prominence: f64,
}

/// A peak, and where the response has fallen to half of it on either side.
struct Peak {
    at: usize,
    below: usize,
    above: usize,
}

/// Stretches around the highest peaks.
pub(super) fn resonances(frequency: &[f64], response: &[c64]) -> Vec<Stretch> {
    let (frequency, response): (Vec<f64>, Vec<c64>) =
        frequency.iter().zip(response).filter(|(f, h)| f.is_finite() && h.is_finite()).map(|(f, h)| (*f, *h)).unzip();
    let height: Vec<f64> = response.iter().map(|h| h.norm()).collect();
    let mut found = peaks(&height);
    found.sort_by(|a, b| height[b.at].total_cmp(&height[a.at]));
    found.truncate(MOST_RESONANCES);
    let median = median(&height);
    let found = found.iter().filter_map(|peak| Some((height[peak.at], stretch(peak, &frequency, &response)?)));
    found.map(|(top, stretch)| Stretch { prominence: (top / median).powi(2), ..stretch }).collect()
}

fn median(height: &[f64]) -> f64 {
    let mut sorted = height.to_vec();
    let middle = sorted.len() / 2;
    if sorted.is_empty() { 0.0 } else { *sorted.select_nth_unstable_by(middle, f64::total_cmp).1 }
}

/// The maxima that fall to half on both sides before anything higher, or to the end of the band on one of them.
fn peaks(height: &[f64]) -> Vec<Peak> {
    let mut found = Vec::new();
    for at in 1..height.len().saturating_sub(1) {
        let top = height[at];
        // of equal neighbours the first
        if !(top > height[at - 1] && top >= height[at + 1]) {
            continue;
        }
        let fallen = |h: f64| h * LEAST_RATIO < top;
        let stop = |h: f64| fallen(h) || h > top;
        let below = (0..at).rev().find(|&k| stop(height[k]));
        let above = (at + 1..height.len()).find(|&k| stop(height[k]));
        let falls = |end: Option<usize>| end.is_none_or(|k| fallen(height[k]));
        if falls(below) && falls(above) && (below.is_some() || above.is_some()) {
            found.push(Peak { at, below: below.unwrap_or(0), above: above.unwrap_or(height.len() - 1) });
        }
    }
    found
}

fn stretch(peak: &Peak, frequency: &[f64], response: &[c64]) -> Option<Stretch> {
    let centre = frequency[peak.at];
    let nearest = (centre - frequency[peak.below]).min(frequency[peak.above] - centre);
    // a resonance has fallen to half at the root of three half-widths
    let half_width = nearest / 3.0_f64.sqrt();
    let reach = HALF_WIDTHS * half_width;
    let first = frequency.partition_point(|f| *f < centre - reach).min(peak.at.saturating_sub(LEAST_POINTS));
    let end = frequency.partition_point(|f| *f <= centre + reach).max(peak.at + LEAST_POINTS + 1).min(frequency.len());
    let group = (end - first).div_ceil(MOST_POINTS);
    let (low, high) = (frequency[first], frequency[end - 1]);
    let scaled = |f: f64| (2.0 * f - low - high) / (high - low);
    let mean = |of: &[c64]| of.iter().sum::<c64>() / of.len() as f64;
    let x: Vec<f64> =
        frequency[first..end].chunks(group).map(|f| scaled(f.iter().sum::<f64>() / f.len() as f64)).collect();
    let values = response[first..end].chunks(group).map(mean).collect();
    let peak = scaled(centre);
    (x.len() > 2 * LEAST_POINTS - 2).then(|| Stretch {
        x,
        values,
        half_width: 2.0 * half_width / (high - low),
        peak,
        prominence: 0.0,
    })
}
