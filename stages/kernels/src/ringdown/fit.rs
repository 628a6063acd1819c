//! The joint fit, from records to estimates.

use super::bootstrap::bootstrap;
use super::estimate::Ringdown;
use super::fitted::{ARRIVED, Fitted};
use super::freedom::freedom;
use super::gap_start::gap_start;
use super::gaps::Gaps;
use super::guess::{first_guess, white_variance};
use super::knowledge::Knowledge;
use super::noise::RingdownNoise;
use super::noise_estimate::estimated;
use super::normal::Freedom;
use super::options::{NoiseSource, RingdownOptions};
use super::records::Records;
use super::search::Point;
use crate::model::{ModelError, finite};

/// Rounds of noise estimation: the third changes variances by less than their own errors.
const NOISE_ROUNDS: usize = 3;

/// Fits one set of exponentials to several ringdowns at once.
///
/// # Model
/// `y_e(k) = a_e sum_j Re(rho_j exp(s_j (k T - t_e))) + offset_e + slope_e x_k + n(k)`, x from -1 to 1: poles and
/// residues shared, amplitude, shift, offset and slope each event's own, `n` of a [`RingdownNoise`].
/// # Method
/// Maximum likelihood. Records are whitened exactly ([`RingdownNoise`]'s Kalman filter), projected on the three dozen
/// directions that the shape can reach, and fitted there by Levenberg-Marquardt with the events' own parameters
/// eliminated; noise variances by a Whittle likelihood of the residuals with what the fit absorbed added back
/// (restricted likelihood), fit and noise in turns. Over missing samples the filter predicts without correcting; for
/// the noise's variances gaps are cut out of the taper, and the expected periodograms are exact for the taper that is
/// left: neither is biased, and no window is lost. Modes of which something is known are searched in frequency and
/// quality factor, bounds by an active set.
/// # Shapes
/// `events`: E records of equal length, each from the first sample after its release on, [`RingdownOptions::missing`]
/// their gaps; `free`: stretches of noise alone, any length.
/// # Units
/// Volts, seconds, rad/s.
/// # Accuracy
/// The Cramer-Rao bound within a few per cent (docs/results/ringdown.md). About 3 ms per record of 8192 samples and
/// noise round on one core, ten times that for one with gaps, whose filter and basis are its own.
/// # Errors
/// No event, unequal lengths, values that are not finite, too few samples, no oscillation, knowledge of what is not
/// fitted.
/// # Source
/// S. M. Kay, Fundamentals of Statistical Signal Processing I, 1993, chapter 7; G. H. Golub, V. Pereyra, SIAM J. Numer.
/// Anal. 10 (1973) 413; D. A. Harville, J. Am. Stat. Assoc. 72 (1977) 320 (restricted likelihood).
pub fn fit_ringdowns(
    events: &[&[f64]],
    free: &[&[f64]],
    interval_s: f64,
    options: &RingdownOptions,
) -> Result<Ringdown, ModelError> {
    fit_to(events, free, interval_s, options, ARRIVED)
}

/// The same, at most `arrived` standard errors from the best.
pub(super) fn fit_to(
    events: &[&[f64]],
    free: &[&[f64]],
    interval_s: f64,
    options: &RingdownOptions,
    arrived: f64,
) -> Result<Ringdown, ModelError> {
    let samples = check(events, free, interval_s, options)?;
    let gaps = Gaps::of(&options.missing, events.len(), samples)?;
    present(events, &gaps, options)?;
    let bridged = gaps.bridged(events);
    let events: &[&[f64]] = &bridged.iter().map(|event| &**event).collect::<Vec<_>>();
    let records = Records { events, gaps: &gaps, free, interval_s };
    let mut point = if gaps.any() { gap_start(&records, options)? } else { first_guess(events, interval_s, options)? };
    let freedom = freedom(&point.exponentials, options);
    let (fitted, noise) = with_noise(&records, &mut point, &freedom, options, arrived)?;
    let draws = bootstrap(&fitted, &point, &freedom, options);
    fitted
        .result(&records, point, noise, &freedom, &options.known)
        .map(|result| Ringdown { bootstrap: draws, ..result })
}

/// Fit and noise in turns.
fn with_noise(
    records: &Records<'_>,
    point: &mut Point,
    freedom: &Freedom,
    options: &RingdownOptions,
    arrived: f64,
) -> Result<(Fitted, RingdownNoise), ModelError> {
    let mut noise = RingdownNoise::white(white_variance(records));
    let mut fitted = Fitted::of(records, &noise, point, freedom, arrived)?;
    match &options.noise {
        NoiseSource::White => {
            let used = fitted.used(freedom);
            let excess = fitted.chi_square() / records.observed().saturating_sub(used).max(1) as f64;
            noise.white *= excess;
            fitted.rescale(excess);
            if options.known.iter().any(|known| matches!(known.knowledge, Knowledge::About(..))) {
                // a prior weighs against the noise: once more under the right one
                fitted = Fitted::of(records, &noise, point, freedom, arrived)?;
            }
        }
        NoiseSource::Known(known) => {
            noise = known.clone();
            fitted = Fitted::of(records, &noise, point, freedom, arrived)?;
        }
        NoiseSource::Estimated => {
            for round in 0..NOISE_ROUNDS {
                let absorbed = if round == 0 { None } else { Some(&fitted) };
                noise = estimated(records, point, &noise, absorbed, freedom);
                fitted = Fitted::of(records, &noise, point, freedom, arrived)?;
            }
        }
    }
    Ok((fitted, noise))
}

/// Enough samples in every event, and finite ones.
fn present(events: &[&[f64]], gaps: &Gaps, options: &RingdownOptions) -> Result<(), ModelError> {
    for (number, event) in events.iter().enumerate() {
        let (found, wanted) = (event.len() - gaps.count(number), 8 * (options.modes + options.real_poles + 2));
        if found < wanted {
            return Err(ModelError::TooShort { found, wanted });
        }
        if let Some(index) = (0..event.len()).find(|&k| !event[k].is_finite() && !gaps.missing(number, k)) {
            return Err(ModelError::NotFinite { what: "event", index });
        }
    }
    Ok(())
}

fn check(events: &[&[f64]], free: &[&[f64]], interval_s: f64, options: &RingdownOptions) -> Result<usize, ModelError> {
    let Some(first) = events.first() else { return Err(ModelError::NoExperiment) };
    let samples = first.len();
    let wanted = 8 * (options.modes + options.real_poles + 2);
    if samples < wanted {
        return Err(ModelError::TooShort { found: samples, wanted });
    }
    for event in events {
        if event.len() != samples {
            return Err(ModelError::Length { what: "event", found: event.len(), wanted: samples });
        }
    }
    for stretch in free {
        finite("free stretch", stretch)?;
    }
    if !(interval_s > 0.0 && interval_s.is_finite()) {
        return Err(ModelError::Parameter { name: "interval_s", found: interval_s, wanted: "above 0" });
    }
    if options.start_samples.is_some_and(|count| count < wanted) {
        let found = options.start_samples.unwrap_or(0);
        return Err(ModelError::TooShort { found, wanted });
    }
    if options.modes == 0 && options.start.is_none() {
        return Err(ModelError::Parameter { name: "modes", found: 0.0, wanted: "at least 1" });
    }
    super::knowledge::check(&options.known)?;
    Ok(samples)
}
