//! Whether an output follows its inputs at a frequency at all.

use super::blocks::{Block, BlockKind, segments};
use super::estimate::{Estimator, ResponseSettings, frequency_response};
use crate::spectra::SpectrumError;
use crate::statistics::incomplete_beta;

/// Segments in a record, if they did not overlap: thirty with their overlap, of which a coherence of 0.3 stands out.
const SEGMENTS: usize = 16;
/// Bins on either side of a frequency at least: a Hann window spreads a line over as many.
const BINS: f64 = 2.0;

/// Probability, at each frequency of `centres` (hertz, with its half width), of as large a coherence as is found near it,
/// were the output independent of the inputs.
///
/// # Model
/// Output and inputs stationary, with independent noise. Of `n` independent blocks and `p` inputs the multiple coherence
/// of an output that follows none is `Beta(p, n - p)`.
///
/// # Method
/// Coherence by half-overlapping Hann segments, sixteen to the record; of the bins within a half width, two at least on
/// either side, the smallest probability times their number.
///
/// # Shapes
/// As many as `centres`.
///
/// # Accuracy
/// In 1000 pairs of independent series a probability below 0.001 comes up at most three times (test).
///
/// # Errors
/// A record of fewer than 16 segments of 32 samples; inputs that are zero or not independent; no single output.
///
/// # Source
/// J. S. Bendat, A. G. Piersol, Random Data, 2010, sections 7.3 and 9.2.
pub fn chance_coherence(
    record: &Block<'_>,
    sample_rate_hz: f64,
    centres: &[(f64, f64)],
) -> Result<Vec<f64>, SpectrumError> {
    let (whole, inputs) = (record.inputs.first().map_or(0, |input| input.len()), record.inputs.len());
    let samples = whole / SEGMENTS;
    if samples < 2 * SEGMENTS {
        return Err(SpectrumError::TooShort { got: whole, wanted: 2 * SEGMENTS * SEGMENTS });
    }
    let settings =
        ResponseSettings { sample_rate_hz, estimator: Estimator::H1, kind: BlockKind::Segments, excited_share: 0.0 };
    let found = frequency_response(&segments(record, samples)?, settings)?;
    let coherence = found.coherence.as_ref().and_then(|rows| rows.first()).map_or(&[][..], Vec::as_slice);
    let width = sample_rate_hz / samples as f64;
    let (p, rest) = (inputs as f64, (found.averages - inputs as f64).max(1.0));
    let chance = |(centre, half): &(f64, f64)| {
        let half = half.max(BINS * width);
        let near =
            found.frequency_hz.iter().zip(coherence).filter(|(f, g)| (*f - centre).abs() <= half && g.is_finite());
        // 1 - I_g(p, n - p)
        let own = near.map(|(_, g)| incomplete_beta(rest, p, 1.0 - g));
        (own.clone().fold(1.0, f64::min) * own.count() as f64).min(1.0)
    };
    Ok(centres.iter().map(chance).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn an_output_that_follows_its_input_in_a_band_does_so_there_alone() {
        let (mut low, mut high) = (0, 0);
        for seed in 0..50 {
            let samples = 4096;
            let white = white_noise(samples, 1.0, 2 * seed);
            // a mean of eight samples has its first zero at an eighth of the rate and stays below 0.05 of the power beyond
            let mean = |k: usize| white[k.saturating_sub(7)..=k].iter().sum::<f64>() / 8.0;
            let noise = white_noise(samples, 0.5, 2 * seed + 1);
            let output: Vec<f64> = noise.iter().enumerate().map(|(k, e)| mean(k) + e).collect();
            let record = Block { inputs: vec![&white], outputs: vec![&output] };
            let found = chance_coherence(&record, 1000.0, &[(40.0, 1.0), (250.0, 1.0)]).unwrap();
            low += usize::from(found[0] < 1e-3);
            high += usize::from(found[1] < 1e-3);
        }
        // 40 Hz: a coherence of 0.7; 250 Hz is a zero of the mean
        assert_eq!((low, high), (50, 0));
    }

    #[test]
    fn independent_series_seem_to_follow_as_seldom_as_stated() {
        let alarms = (0..1000)
            .filter(|seed| {
                let [u, v, y] = [0, 1, 2].map(|which| white_noise(1024, 1.0, 3 * seed + which));
                let inputs = if seed % 2 == 0 { vec![&u[..]] } else { vec![&u[..], &v[..]] };
                let record = Block { inputs, outputs: vec![&y] };
                chance_coherence(&record, 1000.0, &[(200.0, 0.0)]).unwrap()[0] < 1e-3
            })
            .count();
        assert!(alarms <= 3, "{alarms}");
    }

    #[test]
    fn short_records_are_refused() {
        let x = white_noise(500, 1.0, 1);
        let record = Block { inputs: vec![&x], outputs: vec![&x] };
        assert!(chance_coherence(&record, 1000.0, &[(1.0, 1.0)]).is_err());
    }
}
