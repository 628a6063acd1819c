//! How rough samples are.

/// Roughness and what else tells sense from nonsense, of the samples of one channel in one byte order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Look {
    /// Mean square of the second differences over the variance: 6 for white noise, 16 sin^4(w/2) for a tone of w
    /// radians per sample, so at most 16. None if all samples are the same.
    pub(super) roughness: Option<f64>,
    /// Share of floating point samples that no recorder gives: NaN, infinite, denormal, or off the median by a factor
    /// above 2^40.
    pub(super) wild: f64,
    /// Whether every sample is an integer that would fit into one byte.
    pub(super) fits_a_byte: bool,
    /// Number of different values.
    pub(super) codes: usize,
}

/// Twelve decades each way: more than the dynamic range of any instrument, and nothing against the 77 and 600 decades
/// over which the exponents of swapped numbers spread.
const WILD_EXPONENT: f64 = 40.0;

/// Looks at samples. `tiny` is the smallest magnitude that is no denormal number; 0 for integers, of which none is
/// wild.
pub(super) fn look<'a>(samples: impl IntoIterator<Item = &'a f64>, tiny: f64) -> Look {
    let samples: Vec<f64> = samples.into_iter().copied().collect();
    let fits_a_byte = tiny == 0.0 && samples.iter().all(|value| (-128.0..=255.0).contains(value));
    let sane = sane_range(&samples, tiny);
    let is_sane = |value: f64| value == 0.0 || sane.is_some_and(|(low, high)| (low..=high).contains(&value.abs()));
    let kept: Vec<f64> = samples.iter().copied().filter(|&value| is_sane(value)).collect();
    // Divided by the largest, so that no square overflows.
    let largest = kept.iter().fold(0.0, |most: f64, value| most.max(value.abs()));
    let mean = kept.iter().map(|value| value / largest).fold(Mean::default(), Mean::with).value();
    let spread = kept.iter().map(|value| (value / largest - mean).powi(2)).fold(Mean::default(), Mean::with).value();
    let bend = |three: &[f64]| match *three {
        [a, b, c] if is_sane(a) && is_sane(b) && is_sane(c) => {
            Some((a / largest - 2.0 * (b / largest) + c / largest).powi(2))
        }
        _ => None,
    };
    let bends = samples.windows(3).filter_map(bend).fold(Mean::default(), Mean::with);
    Look {
        roughness: (spread > 0.0 && bends.count > 0).then(|| bends.value() / spread),
        wild: if samples.is_empty() { 0.0 } else { (samples.len() - kept.len()) as f64 / samples.len() as f64 },
        fits_a_byte,
        codes: different(samples),
    }
}

fn different(mut samples: Vec<f64>) -> usize {
    samples.sort_unstable_by(f64::total_cmp);
    samples.dedup_by_key(|value| value.to_bits());
    samples.len()
}

/// Magnitudes within `WILD_EXPONENT` of the median of those that are finite, not zero and not denormal; everything for
/// integers.
fn sane_range(samples: &[f64], tiny: f64) -> Option<(f64, f64)> {
    if tiny == 0.0 {
        return Some((0.0, f64::INFINITY));
    }
    let mut sizes: Vec<f64> =
        samples.iter().map(|value| value.abs()).filter(|size| size.is_finite() && *size >= tiny).collect();
    sizes.sort_by(f64::total_cmp);
    let median = *sizes.get(sizes.len() / 2)?;
    let factor = WILD_EXPONENT.exp2();
    Some(((median / factor).max(tiny), (median * factor).min(f64::MAX)))
}

#[derive(Debug, Clone, Copy, Default)]
struct Mean {
    sum: f64,
    count: usize,
}

impl Mean {
    fn with(self, value: f64) -> Self {
        Self { sum: self.sum + value, count: self.count + 1 }
    }

    fn value(self) -> f64 {
        if self.count == 0 { 0.0 } else { self.sum / self.count as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_tone_is_as_rough_as_its_frequency_says() {
        for step in [0.01_f64, 0.3, 1.0, 2.0, 3.0] {
            let tone: Vec<f64> = (0..20_000).map(|n| 1e3 + (step * n as f64).sin()).collect();
            let found = look(&tone, 0.0).roughness.unwrap();
            let wanted = 16.0 * (step / 2.0).sin().powi(4);
            // The ends of a stretch that is no whole number of periods give about 1/(20000 step), 0.5 percent at the
            // slowest.
            assert!((found / wanted - 1.0).abs() < 0.02, "{step}: {found} {wanted}");
        }
    }

    #[test]
    fn a_constant_has_no_roughness_and_zeros_are_not_wild() {
        assert_eq!(look(&[5.0; 100], 0.0).roughness, None);
        let zeros = look(&[0.0; 100], f64::MIN_POSITIVE);
        assert_eq!((zeros.roughness, zeros.wild), (None, 0.0));
    }

    #[test]
    fn wild_samples_are_counted_and_left_out() {
        let mut samples: Vec<f64> = (0..1000).map(|n| (0.01 * f64::from(n)).sin() + 2.0).collect();
        for (at, wild) in [(10, f64::NAN), (20, f64::INFINITY), (30, 1e-310), (40, 1e200), (50, 1e-200)] {
            samples[at] = wild;
        }
        let found = look(&samples, f64::MIN_POSITIVE);
        assert_eq!(found.wild, 0.005);
        assert!(found.roughness.unwrap() < 1e-6, "{found:?}");
    }
}
