//! The joint fit, from records to estimates.

use super::bootstrap::bootstrap;
use super::estimate::Ringdown;
use super::fitted::Fitted;
use super::freedom::freedom;
use super::guess::{first_guess, white_variance};
use super::noise::RingdownNoise;
use super::noise_estimate::estimated;
use super::options::{NoiseSource, RingdownOptions};
use crate::model::error::{ModelError, finite};

/// Rounds of noise estimation: the third changes variances by less than their own errors.
const NOISE_ROUNDS: usize = 3;

/// Fits one set of exponentials to several ringdowns at once.
///
/// # Model
/// `y_e(k) = a_e sum_j Re(rho_j exp(s_j (k T - t_e))) + c_e + d_e k + n(k)`: poles and residues shared, amplitude, sub-sample onset, offset
/// and slope each event's own, `n` of a [`RingdownNoise`].
/// # Method
/// Maximum likelihood. Records are whitened exactly ([`RingdownNoise`]'s Kalman filter), projected on the three dozen directions that
/// the shape can reach, and fitted there by Levenberg-Marquardt with the events' own parameters eliminated; noise variances by a
/// Whittle likelihood of the residuals with what the fit absorbed added back (restricted likelihood), fit and noise in turns.
/// # Shapes
/// `events`: E records of equal length, each from the first sample after its release on; `free`: stretches of noise alone, any length.
/// # Units
/// Volts, seconds, rad/s.
/// # Accuracy
/// The Cramer-Rao bound within a few per cent (docs/accuracy.md). About 3 ms per record of 8192 samples and noise round on one core.
/// # Errors
/// No event, unequal lengths, values that are not finite, too few samples, no oscillation.
/// # Source
/// S. M. Kay, Fundamentals of Statistical Signal Processing I, 1993, chapter 7; G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413;
/// D. A. Harville, J. Am. Stat. Assoc. 72 (1977) 320 (restricted likelihood).
pub fn fit_ringdowns(
    events: &[&[f64]],
    free: &[&[f64]],
    interval_s: f64,
    options: &RingdownOptions,
) -> Result<Ringdown, ModelError> {
    let samples = check(events, free, interval_s, options)?;
    let mut point = first_guess(events, interval_s, options)?;
    let freedom = freedom(&point.exponentials, options);
    let mut noise = RingdownNoise::white(white_variance(events));
    let mut fitted = Fitted::of(events, interval_s, &noise, &mut point, &freedom, samples)?;
    match &options.noise {
        NoiseSource::White => {
            let used = fitted.used(&freedom);
            let excess = fitted.chi_square() / (events.len() * samples).saturating_sub(used).max(1) as f64;
            noise.white *= excess;
            fitted.rescale(excess);
        }
        NoiseSource::Known(known) => {
            noise = known.clone();
            fitted = Fitted::of(events, interval_s, &noise, &mut point, &freedom, samples)?;
        }
        NoiseSource::Estimated => {
            for round in 0..NOISE_ROUNDS {
                let absorbed = if round == 0 { None } else { Some(&fitted) };
                noise = estimated(events, free, interval_s, &point, &noise, absorbed, &freedom);
                fitted = Fitted::of(events, interval_s, &noise, &mut point, &freedom, samples)?;
            }
        }
    }
    let draws = bootstrap(&fitted, &point, &freedom, options);
    fitted.result(events, interval_s, point, noise, &freedom).map(|result| Ringdown { bootstrap: draws, ..result })
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
        finite("event", event)?;
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
    Ok(samples)
}
