//! What a channel's stored samples are, counted in one pass.

use afmid_kernels::statistics::median;

/// Samples in a stretch that the noise is taken from.
const STRETCH: usize = 256;
/// Distinct values remembered at either end.
const ENDS: usize = 5;

/// What to count.
#[derive(Debug, Clone, PartialEq)]
pub struct CensusSettings {
    /// The code that the file declares as missing.
    pub fill_code: Option<f64>,
    /// Codes that stand for something else than a value.
    pub sentinels: Vec<f64>,
    /// Samples per second.
    pub sample_rate_hz: f64,
}

/// Counts of one channel, chunk by chunk.
///
/// # Method
/// Each sample is NaN (or infinite), the declared fill code, a sentinel, or valid. Of the valid ones the five largest
/// and smallest distinct values are counted: samples are saturated if the extreme occurs 8 times or more, and over four
/// times as often as each of the next four (a signal that merely turns there visits them alike). Noise: the median over
/// stretches of 256 samples of the variance about a line. Bandwidth: from the mean square of successive differences
/// over twice that variance, `r = 1 - sin(x) / x`, `x = 2 pi B / rate` for noise that is flat up to B (von Neumann's
/// ratio).
/// # Units
/// Stored codes; [`Found`] likewise.
/// # Accuracy
/// Noise to 5 % on a record of 10^5 samples; the bandwidth is that of the noise, rounding included: an order of
/// magnitude. Cost: one pass, memory 8 bytes per 256 samples.
/// # Source
/// Von Neumann, Ann. Math. Stat. 12 (1941) 367.
#[derive(Debug, Clone, PartialEq)]
pub struct ChannelCensus {
    settings: CensusSettings,
    found: Found,
    top: Vec<(f64, usize)>,
    bottom: Vec<(f64, usize)>,
    stretch: Vec<f64>,
    variances: Vec<f64>,
    ratios: Vec<f64>,
}

/// The counts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found {
    /// All samples.
    pub samples: usize,
    /// NaN and infinities.
    pub not_finite: usize,
    /// The declared fill code.
    pub fill: usize,
    /// Sentinel codes.
    pub sentinels: usize,
    /// Samples piled up at the lower end; 0 if they do not pile up.
    pub saturated_low: usize,
    /// At the upper end.
    pub saturated_high: usize,
    /// Smallest valid code; NaN if there is none.
    pub least: f64,
    /// Largest valid code; NaN if there is none.
    pub largest: f64,
    /// Robust standard deviation of the noise, in codes; NaN if the record is too short.
    pub noise_std: f64,
    /// Bandwidth of the noise in Hz, at most half the sample rate; NaN if there is no noise.
    pub bandwidth_hz: f64,
}

impl ChannelCensus {
    /// Nothing counted yet.
    pub fn new(settings: CensusSettings) -> Self {
        let found = Found {
            samples: 0,
            not_finite: 0,
            fill: 0,
            sentinels: 0,
            saturated_low: 0,
            saturated_high: 0,
            least: f64::NAN,
            largest: f64::NAN,
            noise_std: f64::NAN,
            bandwidth_hz: f64::NAN,
        };
        Self {
            settings,
            found,
            top: Vec::new(),
            bottom: Vec::new(),
            stretch: Vec::new(),
            variances: Vec::new(),
            ratios: Vec::new(),
        }
    }

    /// Counts the next samples.
    pub fn push(&mut self, codes: impl IntoIterator<Item = f64>) {
        for code in codes {
            self.found.samples += 1;
            if !code.is_finite() {
                self.found.not_finite += 1;
            } else if Some(code) == self.settings.fill_code {
                self.found.fill += 1;
            } else if self.settings.sentinels.contains(&code) {
                self.found.sentinels += 1;
            } else {
                self.push_valid(code);
                continue;
            }
            // a stretch with a gap says nothing about noise
            self.stretch.clear();
        }
    }

    fn push_valid(&mut self, code: f64) {
        count_end(&mut self.top, code, |a, b| a > b);
        count_end(&mut self.bottom, code, |a, b| a < b);
        self.stretch.push(code);
        if self.stretch.len() == STRETCH {
            let (variance, ratio) = noise_of(&self.stretch);
            self.variances.push(variance);
            if variance > 0.0 {
                self.ratios.push(ratio);
            }
            self.stretch.clear();
        }
    }

    /// The counts so far.
    pub fn finish(mut self) -> Found {
        let ratio = median(&mut self.ratios);
        Found {
            saturated_low: pile_up(&self.bottom),
            saturated_high: pile_up(&self.top),
            least: self.bottom.first().map_or(f64::NAN, |end| end.0),
            largest: self.top.first().map_or(f64::NAN, |end| end.0),
            noise_std: median(&mut self.variances).sqrt(),
            bandwidth_hz: bandwidth_share(ratio) * self.settings.sample_rate_hz,
            ..self.found
        }
    }
}

/// Counts `code` among the outermost distinct values, the outermost first.
fn count_end(end: &mut Vec<(f64, usize)>, code: f64, beyond: impl Fn(f64, f64) -> bool) {
    if end.len() == ENDS && end.last().is_some_and(|last| beyond(last.0, code)) {
        return;
    }
    match end.iter().position(|entry| !beyond(entry.0, code)) {
        Some(at) if end[at].0 == code => end[at].1 += 1,
        Some(at) => {
            end.insert(at, (code, 1));
            end.truncate(ENDS);
        }
        None => end.push((code, 1)),
    }
}

fn pile_up(end: &[(f64, usize)]) -> usize {
    match end {
        [extreme, inner @ ..]
            if !inner.is_empty() && extreme.1 >= 8 && inner.iter().all(|next| extreme.1 > 4 * next.1) =>
        {
            extreme.1
        }
        _ => 0,
    }
}

/// Variance about a line, and von Neumann's ratio.
fn noise_of(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let half = 0.5 * (n - 1.0);
    let mean = values.iter().sum::<f64>() / n;
    let moment: f64 = values.iter().enumerate().map(|(k, value)| (k as f64 - half) * (value - mean)).sum();
    let slope = moment * 12.0 / (n * (n * n - 1.0));
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    let variance = ((squares - slope * moment) / (n - 2.0)).max(0.0);
    let differences: f64 = values.windows(2).map(|pair| (pair[1] - pair[0] - slope).powi(2)).sum();
    (variance, differences / (n - 1.0) / (2.0 * variance))
}

/// Bandwidth over sample rate from `r = 1 - sin(x) / x`, by bisection; half at most.
fn bandwidth_share(ratio: f64) -> f64 {
    if ratio.is_nan() {
        return f64::NAN;
    }
    let (mut low, mut high) = (0.0, std::f64::consts::PI);
    for _ in 0..60 {
        let x = 0.5 * (low + high);
        if 1.0 - x.sin() / x < ratio { low = x } else { high = x }
    }
    0.5 * (low + high) / std::f64::consts::TAU
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    fn census(codes: &[f64], cut: usize) -> Found {
        let settings =
            CensusSettings { fill_code: Some(-999.0), sentinels: vec![-32768.0, 32767.0], sample_rate_hz: 5e6 };
        let mut census = ChannelCensus::new(settings);
        codes.chunks(cut).for_each(|chunk| census.push(chunk.iter().copied()));
        census.finish()
    }

    #[test]
    fn every_kind_of_sample_is_counted_whatever_the_chunks() {
        let mut codes: Vec<f64> = (0..5000).map(|k| f64::from(k % 100)).collect();
        codes[10] = f64::NAN;
        codes[20] = f64::INFINITY;
        codes[30..33].fill(-999.0);
        codes[40..44].fill(32767.0);
        codes[50] = -32768.0;
        let found = census(&codes, 5000);
        assert_eq!((found.samples, found.not_finite, found.fill, found.sentinels), (5000, 2, 3, 5));
        assert_eq!((found.least, found.largest, found.saturated_low, found.saturated_high), (0.0, 99.0, 0, 0));
        assert_eq!(census(&codes, 7), found);
    }

    #[test]
    fn noise_and_its_bandwidth_are_those_that_were_put_in() {
        for seed in 0..5 {
            let white = white_noise(100_000, 3.0, seed);
            let ramp: Vec<f64> = white.iter().zip(0..).map(|(e, k)| e + 0.01 * f64::from(k)).collect();
            let found = census(&ramp, 4096);
            // 390 stretches of 256: sigma * sqrt(pi / 2 / 1e5 / 2) = 0.3 %, four of them and some
            assert!((found.noise_std / 3.0 - 1.0).abs() < 0.015, "{}", found.noise_std);
            assert!(found.bandwidth_hz > 2e6, "{}", found.bandwidth_hz);
            // two running means over 50 samples pass some 50 kHz of 5 MHz
            let mean =
                |values: &[f64]| -> Vec<f64> { values.windows(50).map(|part| part.iter().sum::<f64>()).collect() };
            let bandwidth = census(&mean(&mean(&white)), 4096).bandwidth_hz;
            assert!((1e4..2e5).contains(&bandwidth), "{bandwidth}");
        }
    }

    #[test]
    fn pile_up_is_saturation_and_turning_is_not() {
        let sine = |limit: f64| -> Vec<f64> {
            let noise = white_noise(100_000, 1.2, 3);
            noise
                .iter()
                .zip(0..)
                .map(|(e, k)| ((f64::from(k) / 17.0).sin() * 500.0 + e).clamp(-limit, limit).round())
                .collect()
        };
        let whole = census(&sine(1e9), 1000);
        assert_eq!((whole.saturated_low, whole.saturated_high), (0, 0));
        let clipped = census(&sine(450.0), 1000);
        // a sine is beyond 0.9 of its height for 14 % of the time on either side
        assert!(
            (12_000..16_000).contains(&clipped.saturated_high) && (12_000..16_000).contains(&clipped.saturated_low)
        );
    }

    #[test]
    fn empty_and_constant_channels_say_so() {
        let none = census(&[], 1);
        assert!(none.least.is_nan() && none.noise_std.is_nan() && none.bandwidth_hz.is_nan());
        let constant = census(&[4.0; 1000], 100);
        assert_eq!((constant.noise_std, constant.saturated_high, constant.least), (0.0, 0, 4.0));
        assert!(constant.bandwidth_hz.is_nan());
    }
}
