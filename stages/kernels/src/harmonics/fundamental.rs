//! Where the fundamental lies, to a fraction of a bin.

use num_complex::Complex64;

use crate::signal::{RealTransform, hann};
use crate::statistics::median;

/// Periods of a record at least.
const LEAST_PERIODS: usize = 3;
/// Power of a line over the median around it: noise alone, whose median of 54 bins scatters, exceeds it in less
/// than one of a million bins.
const LINE: f64 = 40.0;
/// Bins to either side that the median is of.
const AROUND: usize = 30;

/// Frequency of the fundamental, cycles per sample; none where there is no line.
///
/// Method: periodogram under a Hann window; the strongest line, then half and a third of it where lines stand there,
/// too; the frequency within the bin by the ratio of the largest bins (exact for one line under this window).
pub(super) fn fundamental(y: &[f64], near: Option<f64>) -> Option<f64> {
    let plan = RealTransform::new(y.len());
    let taper = hann(y.len(), 0.5);
    let mean = y.iter().sum::<f64>() / y.len() as f64;
    let bins = plan.forward(y.iter().zip(&taper).map(|(y, w)| w * (y - mean)));
    let power: Vec<f64> = bins.iter().map(Complex64::norm_sqr).collect();
    let last = power.len().saturating_sub(2);
    let strongest = |from: usize, to: usize| {
        (from.max(LEAST_PERIODS)..=to.min(last)).max_by(|&a, &b| power[a].total_cmp(&power[b]))
    };
    let peak = match near {
        None => strongest(LEAST_PERIODS, last)?,
        Some(near) => {
            let bin = near * y.len() as f64;
            strongest((0.9 * bin) as usize, (1.1 * bin).ceil() as usize)?
        }
    };
    if power[peak] <= 0.0 {
        return None;
    }
    let exact = |k: usize| interpolated(&power, k) / y.len() as f64;
    let below = |divisor: usize| {
        let bin = exact(peak) * y.len() as f64 / divisor as f64;
        let k = strongest((bin - 1.0).floor() as usize, (bin + 1.0).ceil() as usize)?;
        // a line of its own, not the skirt of the strongest
        (is_line(&power, k, last) && (exact(k) * y.len() as f64 - bin).abs() < 0.5).then_some(k)
    };
    let chosen = match near {
        Some(_) => peak,
        None => below(3).or_else(|| below(2)).unwrap_or(peak),
    };
    Some(exact(chosen))
}

/// Whether bin `k` is a line above what is around it.
fn is_line(power: &[f64], k: usize, last: usize) -> bool {
    let around: Vec<usize> =
        (k.saturating_sub(AROUND)..=(k + AROUND).min(last)).filter(|j| j.abs_diff(k) > 3).collect();
    let level = median(&mut around.iter().map(|&j| power[j]).collect::<Vec<f64>>());
    let local = (k.saturating_sub(3)..=(k + 3).min(last)).all(|j| power[j] <= power[k]);
    local && power[k] > LINE * level
}

/// Frequency of a line in bins, by its two largest bins: under a Hann window the ratio r of their amplitudes gives the
/// distance (2 r - 1) / (r + 1).
fn interpolated(power: &[f64], k: usize) -> f64 {
    let at = |j: usize| power.get(j).copied().unwrap_or(0.0).sqrt();
    let (below, above) = (at(k.saturating_sub(1)), at(k + 1));
    let ratio = |side: f64| if at(k) > 0.0 { side / at(k) } else { 0.0 };
    let distance = |r: f64| ((2.0 * r - 1.0) / (r + 1.0)).clamp(0.0, 0.5);
    if above >= below { k as f64 + distance(ratio(above)) } else { k as f64 - distance(ratio(below)) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn noise_is_hardly_ever_a_line() {
        let (mut lines, mut bins) = (0, 0);
        for seed in 0..800 {
            let n = 4000;
            let plan = RealTransform::new(n);
            let taper = hann(n, 0.5);
            let power = plan.power(white_noise(n, 1.0, seed).iter().zip(&taper).map(|(y, w)| w * y));
            let last = power.len() - 2;
            bins += last - LEAST_PERIODS + 1;
            lines += (LEAST_PERIODS..=last).filter(|&k| is_line(&power, k, last)).count();
        }
        println!("{lines} of {bins} bins");
        // 1.6 million bins, less than 1.6 expected
        assert!(lines <= 5, "{lines}");
    }
}
