//! Least and largest value of equal stretches: what a picture shows of a signal too long to draw.

/// Least and largest values of consecutive stretches, filled chunk by chunk.
///
/// Model: stretch k holds the samples from `k * stretch_samples`; the last one may be shorter. NaN and infinities are
/// passed over; a stretch without a finite value is NaN. Cost: one pass, two values kept per stretch.
#[derive(Debug, Clone, PartialEq)]
pub struct StretchExtremes {
    stretch_samples: usize,
    seen: usize,
    /// Least value of each stretch.
    pub minimum: Vec<f64>,
    /// Largest value of each stretch.
    pub maximum: Vec<f64>,
}

impl StretchExtremes {
    /// None seen yet; a stretch has at least one sample.
    pub fn new(stretch_samples: usize) -> Self {
        Self { stretch_samples: stretch_samples.max(1), seen: 0, minimum: Vec::new(), maximum: Vec::new() }
    }

    /// Takes the samples that follow.
    pub fn push(&mut self, mut values: &[f64]) {
        while !values.is_empty() {
            let room = self.stretch_samples - self.seen % self.stretch_samples;
            let (now, later) = values.split_at(room.min(values.len()));
            if self.seen.is_multiple_of(self.stretch_samples) {
                self.minimum.push(f64::NAN);
                self.maximum.push(f64::NAN);
            }
            let finite = || now.iter().copied().filter(|value| value.is_finite());
            // f64::min and f64::max pass over NaN
            if let (Some(low), Some(high)) = (self.minimum.last_mut(), self.maximum.last_mut()) {
                *low = finite().fold(*low, f64::min);
                *high = finite().fold(*high, f64::max);
            }
            self.seen += now.len();
            values = later;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn chunks_do_not_matter() {
        let values: Vec<f64> = (0..1003).map(|k| f64::from((k * 7919) % 1009)).collect();
        let mut whole = StretchExtremes::new(10);
        whole.push(&values);
        assert_eq!(whole.minimum.len(), 101);
        for (k, stretch) in values.chunks(10).enumerate() {
            assert_eq!(whole.minimum[k], stretch.iter().copied().fold(f64::INFINITY, f64::min));
            assert_eq!(whole.maximum[k], stretch.iter().copied().fold(f64::NEG_INFINITY, f64::max));
        }
        for size in [1, 3, 10, 64, 999] {
            let mut pieces = StretchExtremes::new(10);
            values.chunks(size).for_each(|chunk| pieces.push(chunk));
            assert_eq!(pieces, whole, "chunks of {size}");
        }
    }

    #[test]
    fn what_is_not_finite_is_passed_over() {
        let mut extremes = StretchExtremes::new(2);
        extremes.push(&[1.0, f64::NAN, f64::INFINITY, f64::NAN, -2.0]);
        assert_eq!(extremes.minimum[0], 1.0);
        assert!(extremes.minimum[1].is_nan() && extremes.maximum[1].is_nan());
        assert_eq!((extremes.minimum[2], extremes.maximum[2]), (-2.0, -2.0));
        assert_eq!(StretchExtremes::new(0).stretch_samples, 1);
    }
}
