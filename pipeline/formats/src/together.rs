//! Channels that are put together: of one rate, and begun at one instant.
//!
//! Whole samples of a difference between first instants are left out, the rest is taken out by interpolation with a sinc
//! function under Kaiser's window, whose phase is exact and whose amplitude is 1 to 1e-4 up to 0.9 of half the rate.

use std::f64::consts::PI;
use std::sync::Arc;

use crate::{FormatError, FoundChannel, Raw, Source, rates_agree};

/// Rest of a difference, in samples, that is left: it turns phases by less than a hundredth of a sample.
pub(crate) const LEFT_SAMPLES: f64 = 0.005;
/// Samples on either side that an interpolated one is made from.
const HALF_WIDTH: usize = 32;
/// Shape of Kaiser's window: side lobes at -80 dB.
const KAISER_BETA: f64 = 8.0;

/// Where a channel begins so that all begin together, in its samples.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Start {
    skipped: usize,
    /// What is left, from -0.5 to 0.5.
    fraction: f64,
    samples: usize,
}

/// Whether channels have one clock. Errors: the two whose rates differ.
pub fn one_rate(channels: &[&FoundChannel]) -> Result<(), FormatError> {
    let mut rated = channels.iter().filter_map(|channel| Some((*channel, channel.sample_rate_hz?)));
    let Some((first, rate)) = rated.next() else { return Ok(()) };
    let differs = |(channel, other): &(&FoundChannel, f64)| {
        !rates_agree(*other, rate, channel.rate_relative_std + first.rate_relative_std)
    };
    match rated.find(differs) {
        None => Ok(()),
        Some((channel, other)) => Err(FormatError::new(
            format!(
                "{} has {other} samples per second, {} has {rate}: channels are put together only where their clocks \
                 agree",
                channel.location, first.location
            ),
            "take channels of one rate, or resample one of them to the rate of the other",
        )),
    }
}

/// The channels as they are from the instant on at which the last of them begins, and what to say of it; none where they
/// begin together, or where nothing says when they do.
///
/// Errors: they have other rates; they do not overlap; one does not say when it begins; one that is interrupted begins a
/// part of a sample later.
pub fn begun_together(channels: &[&FoundChannel]) -> Result<Option<(Vec<FoundChannel>, String)>, FormatError> {
    one_rate(channels)?;
    let known = channels.iter().filter_map(|channel| Some((*channel, channel.start_s?, channel.sample_rate_hz?)));
    let known: Vec<(&FoundChannel, f64, f64)> = known.collect();
    let last = known.iter().copied().max_by(|a, b| a.1.total_cmp(&b.1));
    let Some((last, start_s, rate)) = last else { return Ok(None) };
    let late = |start: f64| (start_s - start) * rate;
    let Some(first) = known.iter().copied().min_by(|a, b| a.1.total_cmp(&b.1)) else { return Ok(None) };
    if late(first.1) <= LEFT_SAMPLES {
        return Ok(None);
    }
    if let Some(unknown) = channels.iter().find(|channel| channel.start_s.is_none()) {
        let problem = format!(
            "{} begins {} s after {}, and {} does not say when it begins",
            last.location,
            start_s - first.1,
            first.0.location,
            unknown.location
        );
        return Err(FormatError::new(problem, "leave that channel out"));
    }
    let fractional = known.iter().any(|(_, start, _)| (late(*start) - late(*start).round()).abs() > LEFT_SAMPLES);
    let edge = if fractional { HALF_WIDTH } else { 0 };
    let starts: Vec<Start> = known.iter().map(|(channel, start, _)| begin(channel, late(*start), edge)).collect();
    let samples = starts.iter().map(|start| start.samples).min().unwrap_or(0);
    if samples < 2 {
        let problem =
            format!("{} begins {} s after {}: they do not overlap", last.location, start_s - first.1, first.0.location);
        return Err(FormatError::new(problem, "take channels that were recorded at once"));
    }
    let interrupted =
        known.iter().zip(&starts).find(|((channel, ..), start)| start.fraction != 0.0 && !channel.gaps.is_empty());
    if let Some(((channel, ..), start)) = interrupted {
        let problem =
            format!("{} is interrupted and begins {} of a sample beside the others", channel.location, start.fraction);
        return Err(FormatError::new(problem, "leave that channel out"));
    }
    let moved = known.iter().zip(&starts).map(|((channel, ..), start)| moved(channel, &Start { samples, ..*start }));
    let by = late(first.1);
    let said = format!(
        "{} begins {} s ({by:.3} samples) after {}: all begin with it",
        last.location,
        start_s - first.1,
        first.0.location
    );
    Ok(Some((moved.collect(), said)))
}

/// Where a channel begins that is `late` samples early, without `edge` samples at either end.
fn begin(channel: &FoundChannel, late: f64, edge: usize) -> Start {
    let whole = late.round();
    let rest = late - whole;
    // more samples than can be counted are none of any channel
    let skipped = (whole as usize).saturating_add(edge);
    let samples = channel.samples.saturating_sub(skipped).saturating_sub(edge);
    Start { skipped, fraction: if rest.abs() > LEFT_SAMPLES { rest } else { 0.0 }, samples }
}

fn moved(channel: &FoundChannel, start: &Start) -> FoundChannel {
    let source = Moved { source: Arc::clone(&channel.source), start: *start, fill_code: channel.fill_code };
    let gaps = channel.gaps.iter().filter_map(|gap| gap.checked_sub(start.skipped));
    FoundChannel {
        samples: start.samples,
        gaps: gaps.filter(|gap| *gap < start.samples).collect(),
        fill_code: channel.fill_code.filter(|_| start.fraction == 0.0),
        start_s: channel.start_s.zip(channel.sample_rate_hz).map(|(s, rate)| s + start.skipped as f64 / rate),
        source: Arc::new(source),
        ..channel.clone()
    }
}

/// A channel's samples from a later instant on.
#[derive(Debug)]
struct Moved {
    source: Arc<dyn Source>,
    start: Start,
    fill_code: Option<f64>,
}

impl Source for Moved {
    fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
        let Start { skipped, fraction, samples } = self.start;
        if start.checked_add(count).is_none_or(|end| end > samples) {
            let problem = format!("samples {start} to {start} + {count} asked for, there are {samples}");
            return Err(FormatError::new(problem, "run again, so that the file is opened again"));
        }
        if fraction == 0.0 {
            return self.source.read(skipped + start, count);
        }
        let read = self.source.read(skipped + start - HALF_WIDTH, count + 2 * HALF_WIDTH)?;
        let missing = |code: f64| if self.fill_code == Some(code) { f64::NAN } else { code };
        let codes: Vec<f64> = read.widened().into_iter().map(missing).collect();
        let weights = weights(fraction);
        let at = |window: &[f64]| window.iter().zip(&weights).map(|(code, weight)| code * weight).sum();
        Ok(Raw::Float64(codes.windows(weights.len()).take(count).map(at).collect()))
    }

    fn preferred_samples(&self) -> usize {
        self.source.preferred_samples()
    }

    fn kept_bytes(&self) -> u64 {
        self.source.kept_bytes()
    }
}

/// Weights of the samples from `HALF_WIDTH` before to `HALF_WIDTH` behind one, of the value `fraction` of a sample later.
fn weights(fraction: f64) -> Vec<f64> {
    let half = HALF_WIDTH as f64;
    let weight = |k: usize| {
        let x = k as f64 - half - fraction;
        let sinc = if x == 0.0 { 1.0 } else { (PI * x).sin() / (PI * x) };
        let inside = (1.0 - (x / (half + 1.0)).powi(2)).max(0.0).sqrt();
        sinc * bessel_i0(KAISER_BETA * inside) / bessel_i0(KAISER_BETA)
    };
    (0..=2 * HALF_WIDTH).map(weight).collect()
}

/// The modified Bessel function of order 0, by its power series, which converges for every argument.
pub(crate) fn bessel_i0(x: f64) -> f64 {
    let quarter = 0.25 * x * x;
    let (mut term, mut sum) = (1.0, 1.0);
    for k in 1..100 {
        term *= quarter / f64::from(k * k);
        sum += term;
        if term < f64::EPSILON * sum {
            break;
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pinned::stretch_of;

    #[derive(Debug)]
    struct Values(Vec<f64>);

    impl Source for Values {
        fn read(&self, start: usize, count: usize) -> Result<Raw, FormatError> {
            stretch_of(&self.0, start, count)
        }
    }

    /// A sum of tones up to 0.9 of half the rate, from `start_s` on.
    fn channel(name: &str, rate: f64, start_s: Option<f64>, samples: usize) -> FoundChannel {
        let tone = |t: f64| (1..10).map(|k| (PI * rate * 0.1 * f64::from(k) * t + f64::from(k)).sin()).sum::<f64>();
        let values = (0..samples).map(|k| tone(start_s.unwrap_or(0.0) + k as f64 / rate)).collect();
        let found = FoundChannel::new(name, samples, "float64", Arc::new(Values(values)));
        FoundChannel { sample_rate_hz: Some(rate), start_s, ..found }
    }

    fn read(channel: &FoundChannel) -> Vec<f64> {
        channel.source.read(0, channel.samples).unwrap().widened()
    }

    #[test]
    fn channels_that_begin_apart_are_read_at_the_same_instants() {
        for late in [0.0, 1.0, 30.0, 0.5, 0.37, 12.25, 29.9] {
            let (a, b) = (channel("a", 1e4, Some(0.2), 900), channel("b", 1e4, Some(0.2 + late * 1e-4), 900));
            let found = begun_together(&[&a, &b]).unwrap();
            let Some((found, said)) = found else {
                assert_eq!(late, 0.0);
                continue;
            };
            let (a, b) = (read(&found[0]), read(&found[1]));
            assert_eq!(a.len(), b.len());
            // the window's ripple, on each of nine tones
            assert!(a.iter().zip(&b).all(|(a, b)| (a - b).abs() < 9.0 * 1e-3), "{late} {said}");
            // pieces are those of the whole
            assert_eq!(found[0].source.read(100, 7).unwrap().widened(), a[100..107]);
        }
    }

    #[test]
    fn other_rates_unknown_starts_and_no_overlap_are_refused() {
        let a = channel("a", 1e4, Some(0.0), 900);
        let said = |other: FoundChannel| begun_together(&[&a, &other]).unwrap_err().to_string();
        assert!(said(channel("b", 5e3, Some(0.0), 900)).contains("b has 5000 samples per second, a has 10000"));
        assert!(said(channel("b", 1e4, Some(0.1), 900)).contains("do not overlap"));
        let (late, unknown) = (channel("b", 1e4, Some(1e-3), 900), channel("c", 1e4, None, 900));
        let problem = begun_together(&[&a, &late, &unknown]).unwrap_err().to_string();
        assert!(problem.contains("c does not say when it begins"), "{problem}");
        assert!(begun_together(&[&a, &unknown]).unwrap().is_none());
        let near = FoundChannel { rate_relative_std: 1e-4, ..channel("b", 1e4 * (1.0 + 1e-4), Some(0.0), 900) };
        assert!(begun_together(&[&a, &near]).unwrap().is_none());
    }

    #[test]
    fn gaps_move_with_the_samples_and_an_interrupted_channel_is_not_interpolated() {
        let a = FoundChannel { gaps: vec![5, 100], ..channel("a", 1e4, Some(0.0), 900) };
        let found = begun_together(&[&a, &channel("b", 1e4, Some(1e-3), 900)]).unwrap().unwrap().0;
        assert_eq!((found[0].gaps.clone(), found[0].samples, found[1].samples), (vec![90], 890, 890));
        assert!(begun_together(&[&a, &channel("b", 1e4, Some(1.03e-3), 900)]).is_err());
    }
}
