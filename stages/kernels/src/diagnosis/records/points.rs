//! A record as a thousand block means.

/// Blocks of a record at most: sixteen bytes each is all that is kept of its slow part.
const POINTS: usize = 1024;

/// Block means of a record.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Points {
    /// Samples in a block.
    pub step: usize,
    /// Mean deflection, V.
    pub values: Vec<f64>,
    /// Variance of the deflection within the block, V^2.
    pub variances: Vec<f64>,
    /// Mean piezo position, m.
    pub piezo: Option<Vec<f64>>,
}

/// Block means; samples that are not finite are left out, a block of nothing else repeats the one before. The last,
/// unfinished block is dropped.
pub(super) fn points(deflection: &[f64], piezo: Option<&[f64]>) -> Points {
    let step = deflection.len().div_ceil(POINTS).max(1);
    let (values, variances) = blocks(deflection, step);
    Points { step, values, variances, piezo: piezo.map(|piezo| blocks(piezo, step).0) }
}

fn blocks(samples: &[f64], step: usize) -> (Vec<f64>, Vec<f64>) {
    let mut last = (0.0, 0.0);
    samples
        .chunks_exact(step)
        .map(|block| {
            last = moments(block).or_else(|| finite_moments(block)).unwrap_or(last);
            last
        })
        .unzip()
}

/// Mean and variance, about the first sample so that a large offset costs no digits; none if a sample is missing.
fn moments(block: &[f64]) -> Option<(f64, f64)> {
    let pivot = *block.first()?;
    let (mut sum, mut squares) = (0.0, 0.0);
    for value in block {
        let d = value - pivot;
        sum += d;
        squares += d * d;
    }
    let n = block.len() as f64;
    let mean = sum / n;
    mean.is_finite().then_some((pivot + mean, (squares / n - mean * mean).max(0.0)))
}

fn finite_moments(block: &[f64]) -> Option<(f64, f64)> {
    moments(&block.iter().copied().filter(|value| value.is_finite()).collect::<Vec<_>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_variances_are_those_of_the_blocks() {
        let samples: Vec<f64> = (0..10_240).map(|k| if k == 15 { f64::NAN } else { 1e3 + f64::from(k % 10) }).collect();
        let points = points(&samples, None);
        assert_eq!((points.step, points.values.len()), (10, 1024));
        assert!((points.values[0] - 1004.5).abs() < 1e-9 && (points.variances[0] - 8.25).abs() < 1e-9);
        // the fifth is missing: (45 - 5) / 9
        assert!((points.values[1] - 1000.0 - 40.0 / 9.0).abs() < 1e-9);
    }
}
