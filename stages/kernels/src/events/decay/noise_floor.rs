//! The noise of a channel, from its quietest stretches.

use crate::signal::{RealTransform, hann};
use crate::statistics::median;

/// Share of a window's power in lines from which on it still rings.
const RINGS: f64 = 0.5;
/// Bins beside a line's largest that belong to it: the taper's.
const BESIDE: usize = 2;
/// Bins beside a line from which on, and up to which, what is around it is seen.
const AROUND: std::ops::RangeInclusive<usize> = 3..=8;
/// Power of a line's largest bin over the lower quartile around it. Why: within three bins the taper has a line down to
/// a 500th; noise of a resonance some bins wide reaches a hundred times that quartile in one of fifty windows.
const LINE: f64 = 100.0;
/// Windows per record.
const WINDOWS: usize = 64;
/// Samples of a window at least: five bins of noise have a tenth of its power.
const LEAST_WINDOW: usize = 128;

/// Standard deviation of the noise of a channel without its drift.
///
/// # Method
/// Mean squares of windows of a 64th of the record, eight periods at least. Windows within six of their own standard
/// deviations of the least belong to the noise; their median is its variance. Where the quietest window still rings
/// (lines hold half of its power: the strongest one, or all that stand out of what is around them) the variance is the
/// median of its periodogram over ln 2: that of white noise beneath the lines. Floor: rounding of the codes, `1e-9` of
/// the channel's rms.
pub(super) fn noise_std(swing: &[f64], period: usize, step: f64) -> f64 {
    let samples = swing.len();
    let length = (samples / WINDOWS).max(8 * period).max(LEAST_WINDOW).min(samples);
    let energy = |first: usize| swing[first..first + length].iter().map(|y| y * y).sum::<f64>() / length as f64;
    let starts: Vec<usize> = (0..=samples - length).step_by((length / 2).max(1)).chain([samples - length]).collect();
    let energies: Vec<f64> = starts.iter().map(|&first| energy(first)).collect();
    let quietest = (0..starts.len()).min_by(|&a, &b| energies[a].total_cmp(&energies[b])).unwrap_or(0);
    let limit = energies[quietest] * (1.0 + 6.0 * (2.0 / length as f64).sqrt());
    let mut quiet: Vec<f64> = energies.iter().copied().filter(|e| *e <= limit).collect();
    let mut variance = median(&mut quiet);
    let (share, white) = spectrum(&swing[starts[quietest]..starts[quietest] + length]);
    if share > RINGS {
        variance = white;
    }
    let mean = swing.iter().map(|y| y * y).sum::<f64>() / samples as f64;
    variance.max(step * step / 12.0).max(1e-18 * mean).max(f64::MIN_POSITIVE).sqrt()
}

/// Share of the power in lines, and the variance of white noise with the same median bin.
fn spectrum(values: &[f64]) -> (f64, f64) {
    let n = values.len();
    let mean = values.iter().sum::<f64>() / n as f64;
    let taper = hann(n, 0.5);
    let mut power = RealTransform::new(n).power(values.iter().zip(&taper).map(|(y, w)| w * (y - mean)));
    let share = in_lines(&power) / power.iter().sum::<f64>().max(f64::MIN_POSITIVE);
    let gain = taper.iter().map(|w| w * w).sum::<f64>();
    // the median of an exponential variable is ln 2 of its mean
    (share, median(&mut power[1..]) / (std::f64::consts::LN_2 * gain))
}

/// Power of the strongest line or of all lines, whichever is more.
fn in_lines(power: &[f64]) -> f64 {
    let own = |k: usize| k.saturating_sub(BESIDE)..(k + BESIDE + 1).min(power.len());
    let largest = (0..power.len()).max_by(|&a, &b| power[a].total_cmp(&power[b])).unwrap_or(0);
    let mut lines = vec![false; power.len()];
    for k in (0..power.len()).filter(|&k| own(k).all(|j| power[j] <= power[k])) {
        let beside = AROUND.flat_map(|d| [k.checked_sub(d), Some(k + d)]).flatten();
        let mut around: Vec<f64> = beside.filter_map(|j| power.get(j).copied()).collect();
        around.sort_by(f64::total_cmp);
        if around.get(around.len() / 4).is_some_and(|level| power[k] > LINE * level) {
            lines[own(k)].fill(true);
        }
    }
    let all: f64 = power.iter().zip(lines).filter(|(_, line)| *line).map(|(p, _)| p).sum();
    all.max(power[own(largest)].iter().sum())
}
