//! Decays and steady stretches that stationary noise makes.

use std::ops::Range;

use rayon::prelude::*;

use super::excursion::{Judged, Size};
use super::found::{DecaySearch, DismissedDecay, DismissedReason, FreeDecay, Steady};
use super::search::Record;

/// Rises, steady ones among them, that may be those of a random vibration. Why: fewer do not know a fourth moment.
const RANDOM_RISES: usize = 10;
/// Lags in samples at which a random walk shows itself, each twice the one before.
const LAGS: [usize; 5] = [1, 2, 4, 8, 16];
/// Periods of the strongest oscillation in which the longest lag lies at most an eighth.
const LAGS_OF_PERIOD: usize = 8;
/// Power of the lag with which the squared differences of a random walk grow: 1; of white noise 0, of what is smooth 2. Of
/// white noise on what is smooth one step of two lies between, not all four.
const WALKS: std::ops::Range<f64> = 0.8..1.2;
/// Departure of a random vibration's kurtosis from that of a normal distribution. Why: four standard errors of 1,500
/// independent samples, of which ten rises have some; the narrower the band, the more.
const RANDOM_KURTOSIS: f64 = 0.5;

impl Record<'_> {
    /// Dismisses decays that are no larger than the excursions of stationary noise; where no decay is larger, all of
    /// them.
    pub(super) fn dismiss_excursions(&self, found: &mut DecaySearch) {
        let of_noise =
            |steady: &Steady| self.judged(&steady.range, steady.frequency_hz, 0.0, &steady.amplitude).is_sustained();
        let sustained: Vec<bool> = found.steady.par_iter().map(of_noise).collect();
        // a drive's amplitude is none of the noise's
        let steady = found.steady.iter().zip(&sustained).filter(|(_, sustained)| !**sustained).map(|(s, _)| &s.range);
        let mut taken: Vec<Range<usize>> = found.decays.iter().map(|d| &d.range).chain(steady).cloned().collect();
        taken.sort_by_key(|range| range.start);
        let size = |decay: &FreeDecay| {
            let peaks: Vec<f64> = decay.channels.iter().map(|channel| channel.peak.abs()).collect();
            self.judged(&decay.range, decay.frequency_hz, decay.decline.rate_per_s, &peaks).size(&taken)
        };
        let sizes: Vec<Size> = found.decays.par_iter().map(size).collect();
        let of_noise = sizes.iter().any(|size| matches!(size, Size::OfNoise { .. }));
        let larger = sizes.contains(&Size::Larger);
        let fluctuates = found.decays.is_empty() && sustained.contains(&true);
        found.random = !larger && (of_noise || fluctuates || self.is_normal(found));
        let mut sizes = sizes.into_iter();
        let random = found.random;
        found.decays.retain(|decay| {
            let reason = match sizes.next() {
                Some(Size::OfNoise { ratio, limit }) => DismissedReason::Excursion { ratio, limit },
                _ if random => DismissedReason::Random,
                _ => return true,
            };
            found.dismissed.push(DismissedDecay { onset: decay.onset, reason });
            false
        });
    }

    /// Dismisses everything where every channel is a random walk: its slow parts look like a decay of few periods.
    pub(super) fn dismiss_walks(&self, found: &mut DecaySearch) {
        let live = self.channels.iter().zip(&self.noise_std).filter(|(_, noise)| noise.is_finite());
        let mut channels = live.map(|(channel, _)| *channel).peekable();
        let long = self.envelope.period >= LAGS_OF_PERIOD * LAGS[LAGS.len() - 1];
        if !long || channels.peek().is_none() || !channels.all(is_walk) {
            return;
        }
        let onsets = found.decays.drain(..).map(|decay| decay.onset);
        let onsets: Vec<usize> = onsets.chain(found.steady.drain(..).map(|steady| steady.range.start)).collect();
        found.dismissed.extend(onsets.into_iter().map(|onset| DismissedDecay { onset, reason: DismissedReason::Walk }));
    }

    /// A stretch as it is judged, in the channel in which its amplitude is largest over the noise.
    fn judged(&self, range: &Range<usize>, frequency_hz: f64, rate_per_s: f64, amplitudes: &[f64]) -> Judged<'_> {
        let over = |c: &usize| amplitudes.get(*c).map_or(0.0, |amplitude| amplitude / self.noise_std[*c]);
        let strongest = (0..self.channels.len()).max_by(|a, b| over(a).total_cmp(&over(b))).unwrap_or(0);
        Judged {
            values: self.channels[strongest],
            range: range.clone(),
            frequency: frequency_hz / self.rate_hz,
            rate: rate_per_s / self.rate_hz,
        }
    }

    /// Whether many decays may be those of a random vibration, which is normally distributed.
    ///
    /// Hits `x` decay times apart have a fourth moment of `1.5 x` times the second's square: 6 and more with quiet
    /// between them. Of hits some two decay times apart it is a normal distribution's.
    fn is_normal(&self, found: &DecaySearch) -> bool {
        let kurtosis = |swing: &Vec<f64>| {
            let moment = |power: i32| swing.iter().map(|y| y.powi(power)).sum::<f64>() / swing.len() as f64;
            moment(4) / moment(2).powi(2).max(f64::MIN_POSITIVE)
        };
        let normal = |swing: &Vec<f64>| (kurtosis(swing) - 3.0).abs() < RANDOM_KURTOSIS;
        let live = self.swings.iter().zip(&self.noise_std).filter(|(_, noise)| noise.is_finite());
        let rises = found.decays.len() + found.steady.len();
        !found.decays.is_empty() && rises >= RANDOM_RISES && live.map(|(swing, _)| swing).all(normal)
    }
}

/// Whether the mean squares of differences grow as the lag.
fn is_walk(values: &[f64]) -> bool {
    let square = |lag: usize| {
        let differences = values.iter().zip(values.iter().skip(lag)).map(|(a, b)| (b - a).powi(2));
        differences.sum::<f64>() / values.len().saturating_sub(lag).max(1) as f64
    };
    let squares = LAGS.map(square);
    squares.windows(2).all(|pair| pair[0] > 0.0 && WALKS.contains(&(pair[1] / pair[0]).log2()))
}
