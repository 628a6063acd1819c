//! Noise of a response over its bins: a few blocks say little of each bin, neighbouring bins say it together.

use num_complex::Complex64;

use super::blocks::BlockKind;

/// Degrees of freedom of a variance. Why: of v numbers the variance that a weighted fit has is `v / (v - 4)` times the
/// one it states, an error of 1.3 %.
const POOLED: f64 = 160.0;
/// Bins for the share of the input's noise, over those for one level: of a resonance's bins only the few at its peak tell
/// of it.
const WIDER: usize = 4;
/// Turns of weights and levels: the variance of a mean square goes with the square of what is expected.
const TURNS: usize = 6;
/// Variance of the gain over its mean square that is rounding.
const EVEN: f64 = 1e-9;

/// Bins that have the degrees of freedom of a variance together.
pub(super) fn width(kind: BlockKind, freedom: f64) -> usize {
    // a Hann window makes neighbours alike
    let alike = match kind {
        BlockKind::Segments => 2.0,
        BlockKind::Hits { .. } | BlockKind::Periods => 1.0,
    };
    (alike * POOLED / (2.0 * freedom)).ceil() as usize
}

/// Means of the finite values over so many bins about each, as many at the ends. Zero hertz, where the offset was, is no
/// part of any.
pub(super) fn pooled(values: &[f64], width: usize) -> Vec<f64> {
    let mean = |k: usize| {
        let own = around(k, values.len(), width);
        let own = values.get(own).unwrap_or_default().iter().filter(|value| value.is_finite());
        own.clone().sum::<f64>() / own.count() as f64
    };
    (0..values.len()).map(mean).collect()
}

/// What the output's and the input's noise leave of an output: `a + b |H|^2`, both smooth over frequency.
///
/// # Method
/// Of squares that are left, over neighbouring bins, the non-negative least squares of both, weighted by the inverse
/// square of what is expected, repeated.
pub(super) fn of_both(left: &[f64], gain: &[f64], width: usize) -> Vec<f64> {
    (0..left.len())
        .map(|k| {
            let own = around(k, left.len(), WIDER * width);
            let pairs: Vec<(f64, f64)> = left[own.clone()]
                .iter()
                .zip(&gain[own])
                .filter(|(left, gain)| left.is_finite() && gain.is_finite())
                .map(|(left, gain)| (*left, *gain))
                .collect();
            let (a, b) = levels(&pairs);
            a + b * gain[k]
        })
        .collect()
}

/// Share `c` of the products of two outputs' responses that their errors have in common: what the input's noise leaves of
/// `Y_o Y_p*` is `c H_o H_p*`, over neighbouring bins and all pairs of outputs, each weighted by the noise of both.
pub(super) fn shared(pairs: &[Pair<'_>], width: usize) -> Vec<f64> {
    let bins = pairs.first().map_or(0, |pair| pair.left.len());
    let sums: Vec<[f64; 2]> = (0..bins)
        .map(|bin| pairs.iter().filter_map(|pair| pair.along(bin)).fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]))
        .collect();
    (0..bins)
        .map(|bin| {
            let own = sums.get(around(bin, bins, WIDER * width)).unwrap_or_default();
            let [left, gain] = own.iter().fold([0.0; 2], |a, b| [a[0] + b[0], a[1] + b[1]]);
            if gain > 0.0 { (left / gain).max(0.0) } else { 0.0 }
        })
        .collect()
}

/// What is left of the cross spectrum of two outputs.
pub(super) struct Pair<'a> {
    pub left: Vec<Complex64>,
    pub responses: [&'a [Complex64]; 2],
    /// Noise of each output.
    pub noise: [&'a [f64]; 2],
}

impl Pair<'_> {
    /// Products of the responses' with what is left and with themselves, each over the noise of both.
    fn along(&self, bin: usize) -> Option<[f64; 2]> {
        let gain = self.responses[0][bin] * self.responses[1][bin].conj();
        let noise = self.noise[0][bin] * self.noise[1][bin];
        let sums = [(self.left[bin] * gain.conj()).re / noise, gain.norm_sqr() / noise];
        sums.iter().all(|sum| sum.is_finite()).then_some(sums)
    }
}

/// The likeliest `a` and `b`, neither negative.
fn levels(pairs: &[(f64, f64)]) -> (f64, f64) {
    let count = pairs.len().max(1) as f64;
    let mean = pairs.iter().map(|pair| pair.0).sum::<f64>() / count;
    let gain = pairs.iter().map(|pair| pair.1).sum::<f64>() / count;
    let (mut a, mut b) = (mean, 0.0);
    if !(gain > 0.0 && mean > 0.0) {
        return (a, b);
    }
    (a, b) = (0.5 * mean, 0.5 * mean / gain);
    for _ in 0..TURNS {
        let [mut w, mut wg, mut wgg, mut wl, mut wgl] = [0.0; 5];
        for &(left, gain) in pairs {
            let weight = (a + b * gain).powi(-2);
            w += weight;
            wg += weight * gain;
            wgg += weight * gain * gain;
            wl += weight * left;
            wgl += weight * gain * left;
        }
        let determinant = w * wgg - wg * wg;
        let both = ((wl * wgg - wgl * wg) / determinant, (w * wgl - wg * wl) / determinant);
        (a, b) = match both {
            // where the gain is the same throughout nothing parts them
            _ if determinant <= EVEN * w * wgg => (wl / w, 0.0),
            (a, b) if a > 0.0 && b > 0.0 => (a, b),
            (_, b) if b > 0.0 => (0.0, wgl / wgg),
            _ => (wl / w, 0.0),
        };
    }
    (a, b)
}

/// So many bins about one, as many at the ends, without zero hertz.
fn around(k: usize, bins: usize, width: usize) -> std::ops::Range<usize> {
    let width = (width | 1).min(bins.saturating_sub(1)).max(1);
    let first = k.saturating_sub(width / 2).max(1).min(bins.saturating_sub(width));
    first..(first + width).min(bins)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn the_noise_of_input_and_output_are_parted() {
        // mean squares of eight numbers about a + b g, g of a resonance six bins wide
        let gain: Vec<f64> = (0..400).map(|k| 100.0 / (1.0 + ((k as f64 - 200.0) / 3.0).powi(2)) + 0.1).collect();
        let (a, b) = (2.0, 0.5);
        let (mut peak, mut rest) = (Vec::new(), Vec::new());
        for seed in 0..60 {
            let noise = white_noise(8 * 400, 1.0, seed);
            let left: Vec<f64> = gain
                .iter()
                .zip(noise.chunks_exact(8))
                .map(|(g, own)| (a + b * g) * own.iter().map(|x| x * x).sum::<f64>() / 8.0)
                .collect();
            let found = of_both(&left, &gain, 20);
            peak.push(found[200] / (a + b * gain[200]));
            rest.push(found[100] / (a + b * gain[100]));
            // one level alone is far too low at the peak
            assert!(pooled(&left, 20)[200] < 0.7 * (a + b * gain[200]));
        }
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        let spread = |all: &[f64]| (all.iter().map(|x| (x - 1.0).powi(2)).sum::<f64>() / all.len() as f64).sqrt();
        // the peak is known by some fifteen bins of eight numbers, 13 %; elsewhere by eighty, 6 %: means of 60 to an eighth
        // of that, times four
        assert!((mean(&peak) - 1.0).abs() < 0.07 && spread(&peak) < 0.25, "{} {}", mean(&peak), spread(&peak));
        assert!((mean(&rest) - 1.0).abs() < 0.04 && spread(&rest) < 0.12, "{} {}", mean(&rest), spread(&rest));
    }

    #[test]
    fn what_two_outputs_have_in_common_is_the_input_s_noise() {
        // one value of each of four blocks: noise of the input in both, of each output in one
        let responses = [Complex64::new(3.0, 1.0), Complex64::new(-1.0, 2.0)];
        let mut mean = 0.0;
        for seed in 0..60 {
            let draws = white_noise(4 * 6 * 200, 0.5f64.sqrt(), seed);
            let left: Vec<Complex64> = draws
                .chunks_exact(24)
                .map(|bin| {
                    let block = |own: &[f64]| {
                        let of = |k: usize| Complex64::new(own[2 * k], own[2 * k + 1]);
                        (responses[0] * of(0) + of(1)) * (responses[1] * of(0) + of(2)).conj()
                    };
                    bin.chunks_exact(6).map(block).sum()
                })
                .collect();
            let (first, second) = ([responses[0]; 200], [responses[1]; 200]);
            let pair = Pair { left, responses: [&first, &second], noise: [&[44.0; 200], &[24.0; 200]] };
            mean += shared(&[pair], 20)[100] / 60.0;
        }
        // four blocks of one; a product of two scatters by 1.6 of it, over 80 bins of 4 and 60 seeds 1.2 %: times four
        assert!((mean / 4.0 - 1.0).abs() < 0.05, "{mean}");
        assert!(shared(&[], 20).is_empty());
    }

    #[test]
    fn where_nothing_tells_them_apart_it_is_the_mean() {
        let left: Vec<f64> = white_noise(200, 1.0, 1).iter().map(|x| x * x).collect();
        let (both, one) = (of_both(&left, &[3.0; 200], 20), pooled(&left, 80));
        assert!(both.iter().zip(&one).all(|(a, b)| (a / b - 1.0).abs() < 1e-6));
        assert!(of_both(&left, &[0.0; 200], 20).iter().all(|v| v.is_finite()));
        assert!(of_both(&[0.0; 200], &[1.0; 200], 20).iter().all(|v| *v == 0.0));
    }
}
