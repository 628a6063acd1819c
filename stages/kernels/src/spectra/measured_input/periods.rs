//! A periodic input: its period, and the periods of a record.

use num_complex::Complex64;

use super::blocks::{Block, LEAST_SAMPLES, check};
use crate::signal::RealTransform;
use crate::spectra::SpectrumError;

/// Squared difference of an input to itself a lag later, over twice its power, of a period at most: noise of a tenth of
/// its amplitude.
const REPEATS: f64 = 0.02;
/// The same that lies between two periods at least. Why: what is smooth is like itself a few samples later.
const DIFFERS: f64 = 0.5;
/// Difference of a shorter period over that of the best one, at most, and what rounding of a stored input leaves.
const AS_GOOD: (f64, f64) = (2.0, 1e-6);
/// Lines with half the power of the input, at least. Why: a sine, or a square wave, says nothing of a response between
/// its lines.
const LEAST_LINES: usize = 4;

/// Samples of the period with which all inputs repeat themselves; none where they do not, or have few lines.
///
/// # Model
/// `u_(k+P) = u_k` up to noise, throughout a record of two periods or more.
/// # Method
/// Mean square of `u_(k+L) - u_k` over twice the mean square of `u`, of all inputs together, for each lag L, by the
/// autocorrelation: a period is where it falls below 0.02 after it has been above 0.5; the shortest of those as good as the
/// best.
/// # Shapes
/// Inputs of one length.
/// # Source
/// R. Pintelon, J. Schoukens, System Identification: A Frequency Domain Approach, 2nd ed. (2012), section 2.4.
pub fn period_samples(inputs: &[&[f64]]) -> Option<usize> {
    let samples = inputs.first()?.len();
    if samples < 2 * LEAST_SAMPLES || inputs.iter().any(|input| input.len() != samples) {
        return None;
    }
    let differences = inputs.iter().map(|input| difference(input)).collect::<Option<Vec<Vec<f64>>>>()?;
    let worst = |lag: usize| differences.iter().map(|one| one[lag]).fold(0.0, f64::max);
    let all: Vec<f64> = (0..=samples / 2).map(worst).collect();
    let first = all.iter().position(|d| *d > DIFFERS)?;
    let lowest = |lag: &usize| {
        let beside = |lag: usize| all.get(lag).copied().unwrap_or(f64::INFINITY);
        all[*lag] < REPEATS && all[*lag] <= beside(lag - 1) && all[*lag] <= beside(lag + 1)
    };
    let found: Vec<usize> = (first.max(LEAST_SAMPLES)..all.len()).filter(lowest).collect();
    let best = found.iter().map(|lag| all[*lag]).fold(f64::INFINITY, f64::min);
    let period = found.into_iter().find(|lag| all[*lag] <= AS_GOOD.0 * best + AS_GOOD.1)?;
    inputs.iter().all(|input| lines_of_half_power(&input[..period]) >= LEAST_LINES).then_some(period)
}

/// For each lag up to half the length the squared difference of values to themselves, over their power; none of a
/// constant.
fn difference(values: &[f64]) -> Option<Vec<f64>> {
    let (count, mean) = (values.len(), values.iter().sum::<f64>() / values.len() as f64);
    let mut padded: Vec<f64> = values.iter().map(|value| value - mean).collect();
    let squares: Vec<f64> = std::iter::once(0.0)
        .chain(padded.iter().scan(0.0, |sum, value| {
            *sum += value * value;
            Some(*sum)
        }))
        .collect();
    padded.resize((2 * count).next_power_of_two(), 0.0);
    let transform = RealTransform::new(padded.len());
    // N times the signal of the bins
    let scale = padded.len() as f64;
    let power = transform.power(padded).into_iter().map(|power| Complex64::new(power / scale, 0.0)).collect();
    let correlation = transform.inverse(power);
    let all = squares[count];
    (all > 0.0).then(|| {
        (0..=count / 2)
            .map(|lag| {
                let both = squares[count - lag] + (all - squares[lag]);
                if both > 0.0 { (1.0 - 2.0 * correlation[lag] / both).max(0.0) } else { 1.0 }
            })
            .collect()
    })
}

/// Share of the bins of a period's spectrum, up to half the sample rate, that have a hundredth and more of the strongest's
/// power: 1 of what excites everything.
pub fn excited_share(period: &[f64]) -> f64 {
    let power = spectrum(period);
    let peak = power.iter().copied().fold(0.0, f64::max);
    power.iter().filter(|power| **power >= EXCITED * peak && peak > 0.0).count() as f64 / power.len().max(1) as f64
}

/// Power of a bin over that of the strongest from which on it is excited.
const EXCITED: f64 = 0.01;

fn spectrum(period: &[f64]) -> Vec<f64> {
    let mean = period.iter().sum::<f64>() / period.len().max(1) as f64;
    RealTransform::new(period.len()).power(period.iter().map(|value| value - mean))
}

/// How many lines of a period's spectrum, the strongest, have half of its power.
fn lines_of_half_power(period: &[f64]) -> usize {
    let mut power = spectrum(period);
    power.sort_by(|a, b| b.total_cmp(a));
    let half = 0.5 * power.iter().sum::<f64>();
    let mut sum = 0.0;
    let enough = |power: &f64| {
        sum += power;
        sum > half
    };
    power.iter().position(enough).map_or(0, |last| last + 1)
}

/// Periods below which the first one is kept although the response has not settled in it.
const FEW: usize = 3;

/// The whole periods of a record up to its end; of three and more without the first one, in which the response settles.
///
/// # Errors
/// Fewer than eight samples, more than the record has; unequal series.
pub fn periods<'a>(record: &Block<'a>, samples: usize) -> Result<Vec<Block<'a>>, SpectrumError> {
    let whole = check(record)?;
    if samples < LEAST_SAMPLES || whole < samples {
        return Err(SpectrumError::TooShort { got: whole.min(samples), wanted: samples.max(LEAST_SAMPLES) });
    }
    let count = whole / samples;
    let left_out = usize::from(count >= FEW);
    let first = whole - (count - left_out) * samples;
    let cut = |series: &[&'a [f64]], from: usize| series.iter().map(|x| &x[from..from + samples]).collect();
    let block = |from| Block { inputs: cut(&record.inputs, from), outputs: cut(&record.outputs, from) };
    Ok((first..whole).step_by(samples).map(block).collect())
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use super::*;
    use crate::fixture::white_noise;

    /// Lines of random phases at these multiples of the frequency of a period, `samples` of it.
    fn multisine(period: usize, lines: std::ops::Range<usize>, samples: usize, seed: u64) -> Vec<f64> {
        let phases = white_noise(lines.len(), 3.0, seed);
        let at = |k: usize| {
            let turn = TAU * (k % period) as f64 / period as f64;
            lines.clone().zip(&phases).map(|(line, phase)| (line as f64 * turn + phase).cos()).sum::<f64>()
        };
        let own: Vec<f64> = (0..period).map(at).collect();
        (0..samples).map(|k| own[k % period]).collect()
    }

    #[test]
    fn a_period_is_found_in_noise_and_smooth_or_random_inputs_have_none() {
        for seed in 0..40 {
            let period = 300 + 37 * seed as usize;
            let lines = [1..period / 2, 10..40, 3..18][seed as usize % 3].clone();
            let clean = multisine(period, lines, 3 * period + 70, seed);
            let rms = (clean.iter().map(|u| u * u).sum::<f64>() / clean.len() as f64).sqrt();
            let noise = white_noise(clean.len(), [0.0, 0.03, 0.1][seed as usize % 3] * rms, seed + 100);
            let noisy: Vec<f64> = clean.iter().zip(noise).map(|(u, e)| u + e + 0.3).collect();
            assert_eq!(period_samples(&[&noisy]), Some(period), "seed {seed}");
            // one of the inputs is random
            assert_eq!(period_samples(&[&noisy, &white_noise(noisy.len(), rms, seed + 200)]), None);
            // low-passed noise is like itself for some hundred samples
            let mut slow = 0.0;
            let smooth: Vec<f64> = white_noise(4000, 1.0, seed + 300)
                .iter()
                .map(|e| {
                    slow += 0.01 * (e - slow);
                    slow
                })
                .collect();
            assert_eq!(period_samples(&[&smooth]), None, "seed {seed}");
            let sine: Vec<f64> = (0..4000).map(|k| (0.01 * (seed + 3) as f64 * f64::from(k)).sin()).collect();
            assert_eq!(period_samples(&[&sine]), None, "seed {seed}");
        }
        let bits: Vec<f64> = (0..2000).map(|k| if (k % 127 * (k % 127)) % 31 < 15 { 1.0 } else { -1.0 }).collect();
        assert_eq!(period_samples(&[&bits]), Some(127));
        assert!(excited_share(&white_noise(500, 1.0, 9)) > 0.8 && excited_share(&multisine(500, 5..30, 500, 1)) < 0.2);
        assert_eq!(period_samples(&[&[1.0; 500]]), None);
        assert_eq!(period_samples(&[]), None);
    }

    #[test]
    fn periods_end_with_the_record_and_the_first_of_several_is_left_out() {
        let values: Vec<f64> = (0..1050).map(f64::from).collect();
        let record = Block { inputs: vec![&values], outputs: vec![&values] };
        let starts = |samples: usize| -> Vec<f64> {
            periods(&record, samples).unwrap().iter().map(|block| block.inputs[0][0]).collect()
        };
        assert_eq!(starts(250), [300.0, 550.0, 800.0]);
        assert_eq!(starts(500), [50.0, 550.0]);
        assert!(periods(&record, 2000).is_err() && periods(&record, 4).is_err());
    }
}
