//! Mean and variance per sample.

use afmid_pipeline::rows::{RowSource, in_blocks};
use rayon::prelude::*;

use super::EnsembleError;
use super::rows::check_chosen;

/// Samples per parallel piece: large enough to stream, small enough to balance.
const PIECE: usize = 1024;

/// First two moments of chosen events.
#[derive(Debug, Clone, PartialEq)]
pub struct Moments {
    /// Mean per sample.
    pub mean: Vec<f64>,
    /// Unbiased variance between events per sample; adhesion scatter and offsets are in it.
    pub variance: Vec<f64>,
    /// Events averaged.
    pub count: usize,
}

/// Mean and unbiased variance per sample over the chosen events.
///
/// # Model
/// None: plain moments. Amplitude scatter counts as variance here; see [`scatter`](super::scatter()) for the noise
/// alone.
///
/// # Method
/// Corrected two-pass: the mean, improved by the mean of the deviations from it, then the squared deviations less the
/// square of their sum. Sums run over the events in the order given, so the result depends neither on threads nor on
/// where the rows lie. Two passes over the rows.
///
/// # Shapes
/// `rows` `[event, time]`; results `[time]`.
///
/// # Units
/// Those of the rows; variance in their square.
///
/// # Accuracy
/// Relative error of the variance about `count * eps`, also when the offset is a million times the spread.
///
/// # Errors
/// No event chosen, or an index outside. One event alone has variance zero.
///
/// # Source
/// Chan, Golub, LeVeque, The American Statistician 37 (1983) 242, Eq. 1.7.
pub fn moments(rows: impl RowSource, chosen: &[usize]) -> Result<Moments, EnsembleError> {
    check_chosen(&rows, chosen)?;
    if chosen.is_empty() {
        return Err(EnsembleError::TooFewEvents { got: 0, wanted: 1, purpose: "an average" });
    }
    let (samples, n) = (rows.row_length(), chosen.len() as f64);
    let mut mean = vec![0.0; samples];
    in_blocks(&rows, chosen, |_, block| -> Result<(), EnsembleError> {
        mean.par_chunks_mut(PIECE).enumerate().for_each(|(piece, mean)| {
            for row in block {
                mean.iter_mut().zip(&row[piece * PIECE..]).for_each(|(m, y)| *m += y);
            }
        });
        Ok(())
    })?;
    mean.iter_mut().for_each(|m| *m /= n);
    let (mut drift, mut square) = (vec![0.0; samples], vec![0.0; samples]);
    in_blocks(&rows, chosen, |_, block| -> Result<(), EnsembleError> {
        let pieces = drift.par_chunks_mut(PIECE).zip(square.par_chunks_mut(PIECE)).zip(mean.par_chunks(PIECE));
        pieces.enumerate().for_each(|(piece, ((drift, square), mean))| {
            for row in block {
                deviations(mean, &row[piece * PIECE..], drift, square);
            }
        });
        Ok(())
    })?;
    let freedom = (n - 1.0).max(1.0);
    let variance = square.iter().zip(&drift).map(|(s, d)| ((s - d * d / n) / freedom).max(0.0)).collect();
    for (m, d) in mean.iter_mut().zip(&drift) {
        *m += d / n;
    }
    Ok(Moments { mean, variance, count: chosen.len() })
}

/// Adds a row's deviations from the mean, and their squares.
fn deviations(mean: &[f64], row: &[f64], drift: &mut [f64], square: &mut [f64]) {
    for (((m, y), d), s) in mean.iter().zip(row).zip(drift).zip(square) {
        let e = y - m;
        *d += e;
        *s += e * e;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ensemble::Rows;
    use crate::fixture::white_noise;

    #[test]
    fn moments_survive_an_offset_a_million_times_the_spread() {
        for seed in 0..3 {
            let (events, samples) = (24, 2500);
            let noise = white_noise(events * samples, 1e-3, seed);
            let high: Vec<f64> = noise.iter().map(|v| v + 1000.0).collect();
            let all: Vec<usize> = (0..events).collect();
            let low = moments(Rows::new(&noise, samples).unwrap(), &all).unwrap();
            let high = moments(Rows::new(&high, samples).unwrap(), &all).unwrap();
            for (a, b) in low.mean.iter().zip(&high.mean) {
                // the offset itself rounds every value to 1000 * eps = 1.1e-13
                assert!((a + 1000.0 - b).abs() < 3e-13);
            }
            for (a, b) in low.variance.iter().zip(&high.variance) {
                // values rounded to 1e-13 of a spread of 1e-3: 2e-10 relative, times the sum
                assert!((a - b).abs() < 1e-9 * a);
            }
        }
    }

    #[test]
    fn a_piecewise_average_equals_the_naive_one() {
        let (events, samples) = (7, 1030);
        let values = white_noise(events * samples, 1.0, 9);
        let chosen = [1, 3, 6];
        let got = moments(Rows::new(&values, samples).unwrap(), &chosen).unwrap();
        for t in 0..samples {
            let column: Vec<f64> = chosen.iter().map(|i| values[i * samples + t]).collect();
            let mean = column.iter().sum::<f64>() / 3.0;
            let variance = column.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / 2.0;
            // rounding of three terms of order one
            assert!((got.mean[t] - mean).abs() < 1e-15 && (got.variance[t] - variance).abs() < 5e-15);
        }
    }

    #[test]
    fn bad_ensembles_are_refused_by_name() {
        assert_eq!(Rows::new(&[1.0; 5], 2).unwrap_err(), EnsembleError::Ragged { values: 5, samples: 2 });
        assert_eq!(
            Rows::new(&[1.0, 2.0, f64::NAN, 4.0], 2).unwrap_err(),
            EnsembleError::NotFinite { event: 1, sample: 0 }
        );
        let rows = Rows::new(&[1.0; 4], 2).unwrap();
        assert_eq!(moments(rows, &[2]).unwrap_err(), EnsembleError::NoSuchEvent { index: 2, count: 2 });
        assert!(moments(rows, &[]).is_err());
        assert_eq!(moments(rows, &[1]).unwrap().variance, vec![0.0, 0.0]);
    }
}
