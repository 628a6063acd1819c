//! Aligned windows of an ensemble: what each event is, beside the others.

use afmid_pipeline::artifact::RowWriter;
use afmid_pipeline::rows::{RowSource, in_blocks};
use afmid_pipeline::{StageError, Values};
use rayon::prelude::*;

use afmid_kernels::events::{Aligned, REACH, baseline, first_sustained_departure, fractional_shift};
use afmid_kernels::statistics::median_and_scale;

/// Samples that the onset of the average must be sustained for.
const SUSTAINED: usize = 4;

/// The window that is cut for every event.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WindowSettings {
    /// Its length.
    pub window_samples: usize,
    /// Samples before the onset.
    pub pre_samples: usize,
    /// How far the onset of the average may lie from the detected one.
    pub max_onset_samples: usize,
    /// Least noise to assume, in the signal's unit (rounding).
    pub noise_floor: f64,
}

impl WindowSettings {
    /// Samples that a segment needs before the detected onset and after, for shifts up to `max_shift_samples`.
    pub fn margins(&self, max_shift_samples: usize) -> (usize, usize) {
        let slack = max_shift_samples + self.max_onset_samples + REACH + 1;
        (self.pre_samples + slack, self.window_samples.saturating_sub(self.pre_samples) + slack)
    }
}

/// What one aligned event is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct EventWindow {
    /// Position of the onset in the segment, fractional.
    pub onset: f64,
    /// Correlation with the average of the others.
    pub correlation: f64,
    /// Jump of level at the onset.
    pub amplitude: f64,
    /// The level without force at the onset.
    pub offset: f64,
    /// Standard deviation of the noise before the onset.
    pub noise_std: f64,
    /// What the average of the others leaves after the onset, rms, over what noise would leave: 1 is ideal.
    pub quality: f64,
}

/// The aligned windows of an ensemble.
#[derive(Debug, Clone, PartialEq)]
pub struct Windows {
    /// In the order of the events.
    pub events: Vec<EventWindow>,
    /// The signals, band-limited interpolated so that the onset of the average is sample `pre_samples`: a row of
    /// `window_samples` per event.
    pub values: Values,
    /// The onset of the average after the detected onsets, in samples; 0 if the average shows none.
    pub onset_correction: i64,
}

/// Cuts aligned windows out of segments with the detected onset at sample `onset`.
///
/// # Method
/// 1. Windows at the aligned positions.
/// 2. The onset of their average, whose noise is the root of their number smaller: the first sustained departure beyond
///    4 standard deviations, for 4 samples; all windows move by it as one, in whole samples.
/// 3. Lines before and after (its second half) give the jump of the average; each event's own is its share of it, by
///    the amplitude of the correlation.
/// 4. Each event is regressed on the average of the others and 1, after the onset, for the quality.
///
/// `loaded_before`: a snap-off is free after the onset, a snap-to-contact before: there the offset is read.
/// # Shapes
/// Segments with [`WindowSettings::margins`] round `onset`; `chosen` are numbers of segments, each with its alignment.
/// Windows go to `writer`; no more of them than a block is in memory otherwise.
/// # Units
/// As the segments; positions in samples.
/// # Accuracy
/// Interpolation 5e-5 of the jump at the onset, 1e-6 elsewhere (see
/// [`fractional_shift`](afmid_kernels::events::fractional_shift)); the onset is late by the samples that the signal
/// stays within the average's noise, one to three, alike in all events.
/// # Errors
/// Segments that cannot be read, windows that cannot be written. Segments shorter than that are padded with their end
/// values.
pub fn cut_windows(
    segments: &dyn RowSource,
    onset: usize,
    chosen: &[(usize, Aligned)],
    loaded_before: bool,
    settings: &WindowSettings,
    mut writer: RowWriter,
) -> Result<Windows, StageError> {
    let cutting = Cutting { segments, onset, chosen, settings };
    // the mean's onset asks for the samples before it and few after
    let seen = (settings.pre_samples + settings.max_onset_samples + SUSTAINED).min(settings.window_samples);
    let start = cutting.mean(0, seen, |_| Ok(()))?;
    let correction = onset_of_mean(&start, settings).unwrap_or(0);
    let mean = cutting.mean(correction, settings.window_samples, |window| writer.push(window).map(|_| ()))?;
    let values = writer.finish();
    let jump = levels(&mean, settings.pre_samples).map_or(f64::NAN, |levels| levels.after - levels.before);
    let mean_amplitude = chosen.iter().map(|(_, event)| event.amplitude).sum::<f64>() / chosen.len().max(1) as f64;
    let describe = |values: &[f64], event: &Aligned| {
        let levels = levels(values, settings.pre_samples);
        let noise_std = levels.map_or(f64::NAN, |levels| levels.noise_std.max(settings.noise_floor));
        EventWindow {
            onset: onset as f64 + event.shift + correction as f64,
            correlation: event.correlation,
            amplitude: jump * event.amplitude / mean_amplitude,
            offset: levels.map_or(f64::NAN, |levels| if loaded_before { levels.after } else { levels.before }),
            noise_std,
            quality: quality(values, &mean, chosen.len(), settings.pre_samples, noise_std),
        }
    };
    let mut events = Vec::with_capacity(chosen.len());
    let windows = values.rows(settings.window_samples).ok_or_else(|| StageError::new("windows without samples"))?;
    in_blocks(&windows, &(0..chosen.len()).collect::<Vec<_>>(), |first, block| -> Result<(), StageError> {
        events.par_extend(block.par_iter().zip(&chosen[first..]).map(|(values, (_, event))| describe(values, event)));
        Ok(())
    })?;
    Ok(Windows { events, values, onset_correction: correction })
}

/// Segments and where to cut them.
struct Cutting<'a> {
    segments: &'a dyn RowSource,
    onset: usize,
    chosen: &'a [(usize, Aligned)],
    settings: &'a WindowSettings,
}

impl Cutting<'_> {
    /// The mean of the first `count` samples of all windows, which go to `each` in the order of the events.
    fn mean(
        &self,
        correction: i64,
        count: usize,
        mut each: impl FnMut(&[f64]) -> Result<(), StageError>,
    ) -> Result<Vec<f64>, StageError> {
        let shift_all = correction as f64 - self.settings.pre_samples as f64;
        let places: Vec<usize> = self.chosen.iter().map(|&(place, _)| place).collect();
        let mut mean = vec![0.0; count];
        in_blocks(self.segments, &places, |first, block| {
            let aligned = &self.chosen[first..];
            let cut = |(segment, (_, event)): (&&[f64], &(usize, Aligned))| {
                fractional_shift(segment, self.onset, count, event.shift + shift_all)
            };
            let windows: Vec<Vec<f64>> = block.par_iter().zip(aligned).map(cut).collect();
            for window in &windows {
                mean.iter_mut().zip(window).for_each(|(mean, value)| *mean += value / self.chosen.len() as f64);
                each(window)?;
            }
            Ok::<(), StageError>(())
        })?;
        Ok(mean)
    }
}

/// Indices of events whose quality is out of line: beyond the median by `significance` robust deviations and by a
/// factor of `factor`.
pub fn quality_outliers(qualities: &[f64], significance: f64, factor: f64) -> Vec<usize> {
    let (center, scale) = median_and_scale(&mut qualities.to_vec());
    let limit = (center + significance * scale).max(factor * center);
    (0..qualities.len()).filter(|&index| qualities[index] > limit).collect()
}

/// The onset of the average against `pre_samples`.
fn onset_of_mean(mean: &[f64], settings: &WindowSettings) -> Option<i64> {
    let (pre, reach) = (settings.pre_samples, settings.max_onset_samples);
    // the interpolation may ring ahead of the onset by its reach: the line comes from before
    let start = pre.checked_sub(reach)?;
    let onset = first_sustained_departure(mean, start..pre + reach, pre / 2, 4.0, SUSTAINED, 0.0)?;
    Some(onset.index as i64 - pre as i64)
}

#[derive(Debug, Clone, Copy)]
struct Levels {
    before: f64,
    after: f64,
    noise_std: f64,
}

/// Levels at the onset, extrapolated from the stretch before and from the second half of the window.
fn levels(window: &[f64], pre: usize) -> Option<Levels> {
    let before = baseline(window, 0..pre.saturating_sub(pre / 16))?;
    let start = pre.max(window.len() / 2);
    let after = extrapolated_past_ringing(window.get(start..)?, pre as f64 - start as f64)?;
    Some(Levels { before: before.at(pre as f64), after, noise_std: before.noise_std })
}

/// The least-squares line through `values` with Hann weights, at `position` (of `values`): a ringing of many periods
/// averages out.
fn extrapolated_past_ringing(values: &[f64], position: f64) -> Option<f64> {
    let n = values.len() as f64;
    if values.len() < 8 {
        return None;
    }
    let half = 0.5 * (n - 1.0);
    let (mut w0, mut wxx, mut wy, mut wxy) = (0.0, 0.0, 0.0, 0.0);
    for (k, y) in values.iter().enumerate() {
        let x = k as f64 - half;
        let weight = 1.0 + (std::f64::consts::TAU * x / n).cos();
        w0 += weight;
        wxx += weight * x * x;
        wy += weight * y;
        wxy += weight * x * y;
    }
    Some(wy / w0 + wxy / wxx * (position - half))
}

/// Residual after the onset of the regression of an event on the average of the others and 1, over the noise of both.
fn quality(window: &[f64], mean: &[f64], count: usize, pre: usize, noise_std: f64) -> f64 {
    if count < 2 || pre >= window.len() {
        return f64::NAN;
    }
    let n = count as f64;
    let others: Vec<f64> = window.iter().zip(mean).skip(pre).map(|(own, mean)| (n * mean - own) / (n - 1.0)).collect();
    let own = &window[pre..];
    let samples = own.len() as f64;
    let (mean_own, mean_others) = (own.iter().sum::<f64>() / samples, others.iter().sum::<f64>() / samples);
    let (mut xx, mut xy) = (0.0, 0.0);
    for (x, y) in others.iter().zip(own) {
        xx += (x - mean_others).powi(2);
        xy += (x - mean_others) * (y - mean_own);
    }
    let ratio = xy / xx;
    let squares: f64 = others.iter().zip(own).map(|(x, y)| (y - mean_own - ratio * (x - mean_others)).powi(2)).sum();
    (squares / samples / (1.0 + ratio * ratio / (n - 1.0))).sqrt() / noise_std
}

#[cfg(test)]
mod tests {
    use super::*;
    use afmid_pipeline::rows::{RowView, Scratch};

    use crate::fixture::{Lever, white_noise};
    use afmid_kernels::events::{AveragingSettings, correlation_average};

    const AVERAGING: AveragingSettings = AveragingSettings {
        correlation_samples: 256,
        max_shift_samples: 32,
        max_iterations: 20,
        tolerance_samples: 1e-3,
        min_correlation: 0.8,
    };
    const WINDOW: WindowSettings =
        WindowSettings { window_samples: 4096, pre_samples: 512, max_onset_samples: 16, noise_floor: 0.0 };

    #[test]
    fn windows_show_the_release_itself_with_its_amplitude_offset_and_noise() {
        let lever = Lever::paper();
        let onset = 700;
        let truth: Vec<(f64, f64, f64)> = (0..16)
            .map(|k| (0.3 * f64::from(k) - 2.0, -0.9 * (0.8 + 0.02 * f64::from(k)), 0.01 * f64::from(k)))
            .collect();
        let segments: Vec<Vec<f64>> = (0..)
            .zip(&truth)
            .map(|(seed, &(shift, load, offset))| {
                let noise = white_noise(4600, 1.2e-3, seed);
                let signal = lever.release(4600, onset as f64 + shift, load);
                signal.iter().zip(noise).map(|(y, e)| y + e + offset).collect()
            })
            .collect();
        let averaging = correlation_average(&segments, onset, &AVERAGING);
        let aligned: Vec<Aligned> = averaging.events.iter().map(|event| event.unwrap()).collect();
        let aligned: Vec<(usize, Aligned)> = aligned.into_iter().enumerate().collect();
        let segments = segments.concat();
        let view = RowView::Memory(&segments, 4600);
        let writer = || RowWriter::new(Scratch::default(), WINDOW.window_samples);
        let windows = cut_windows(&view, onset, &aligned, true, &WINDOW, writer()).unwrap();
        let signals = windows.values.real().unwrap().unwrap();
        for ((event, signal), (shift, load, offset)) in windows.events.iter().zip(signals.chunks(4096)).zip(truth) {
            let late = event.onset - (onset as f64 + shift);
            // the average's noise is 0.3 mV: the release leaves it within two samples
            assert!((-0.1..2.1).contains(&late), "{late}");
            // levels from lines over 480 and 2048 samples (1.2 mV / sqrt(480) * 2 = 0.1 mV), the rest of the ringing:
            // 0.3 %
            assert!((event.amplitude / -load - 1.0).abs() < 3e-3, "{} for {load}", event.amplitude);
            assert!((event.offset - offset).abs() < 3e-3, "{} for {offset}", event.offset);
            assert!((event.noise_std / 1.2e-3 - 1.0).abs() < 0.15, "{}", event.noise_std);
            // 1 / sqrt(2 * 480) = 3 % of the noise estimate: four of them
            assert!((event.quality - 1.0).abs() < 0.15, "{}", event.quality);
            let clean = lever.release(4096, 512.0 - late, load);
            let squares: f64 = signal.iter().zip(&clean).map(|(y, c)| (y - c - offset).powi(2)).sum();
            // interpolation leaves white noise as it is, less what lies above 0.45 of the rate: the rms must stay the
            // noise's
            let rms = (squares / 4096.0).sqrt();
            assert!((0.8..1.1).contains(&(rms / 1.2e-3)), "{rms:.2e}");
        }
    }

    #[test]
    fn an_outlier_of_quality_stands_out_from_scatter() {
        let mut qualities: Vec<f64> = white_noise(24, 0.05, 4).iter().map(|e| 1.0 + e).collect();
        assert!(quality_outliers(&qualities, 6.0, 3.0).is_empty());
        qualities[7] = 2.0;
        assert!(quality_outliers(&qualities, 6.0, 3.0).is_empty());
        qualities[7] = 9.0;
        assert_eq!(quality_outliers(&qualities, 6.0, 3.0), vec![7]);
        assert!(quality_outliers(&[f64::NAN], 6.0, 3.0).is_empty());
    }
}
