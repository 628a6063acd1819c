//! Both lines, the moment between them, and the input and response that follow.

use super::line::correlation_inflation;
use crate::events::EventKind;
use crate::force::error::ForceError;
use crate::force::line::{Line, Weighting, fit_line};
use crate::force::t0::{T0, T0Settings, find_t0};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Shape of the line without force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum ZeroLine {
    /// Constant.
    Constant,
    /// Offset and slope (crosstalk of the piezo, slow drift).
    Linear,
}

/// How the lines and the moment are found.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ExtrapolationSettings {
    /// Kind of event.
    pub event: EventKind,
    /// Shape of the zero-force line.
    pub zero_line: ZeroLine,
    /// Samples left out between the line before and the expected event.
    pub guard: usize,
    /// Search for the moment; its `near` is the expected event.
    pub onset: T0Settings,
}

/// Lines before and after, and the load between them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Lines {
    /// Line before the event.
    pub before: Line,
    /// Line after the event, ringing weighted away.
    pub after: Line,
    /// The moment.
    pub onset: T0,
    /// Static deflection under the force at `t0`: negative where the tip is pulled to the surface.
    pub load: f64,
    /// Its standard error, from the noise of the mean and its correlation; adhesion scatter is no part of it.
    pub load_std: f64,
    /// Change of the load per sample while in contact.
    pub load_slope: f64,
    /// Root mean square of the mean about the line before.
    pub rms_before: f64,
}

/// Input and response of one averaged event.
#[derive(Debug, Clone, PartialEq)]
pub struct Pair {
    /// Force in units of the static deflection that it causes.
    pub force: Vec<f64>,
    /// Deflection above the zero-force line.
    pub response: Vec<f64>,
}

/// Fewest samples for a line.
const LINE_SAMPLES: usize = 32;

/// Extrapolates both lines to the moment of the event.
///
/// # Model
/// Snap-off: the lever follows the load quasi-statically along a line before `t0` and rings about the zero-force line
/// after. Snap-in: it follows the zero-force line before, and rings about a line after that rises with the piezo.
///
/// # Method
/// Uniform line before, up to `guard` samples ahead of the expected event; Hann-weighted line after, from the expected
/// event to the end, which suppresses ringing (46 kHz, Q = 40) to a millionth without a model of it. With `t0` given
/// (sub-ensembles), it is used; otherwise [`find_t0`] looks for it.
///
/// # Shapes
/// `mean` and `standard_error` `[time]`.
///
/// # Units
/// Samples and the unit of the mean (volts).
///
/// # Accuracy
/// The load's standard error counts white noise, enlarged by the correlation of the residual before the event. Noise
/// slower than the stretches is not seen by it.
///
/// # Errors
/// Stretches under 32 samples, values not finite, no departure, or a load within three standard errors of zero.
///
/// # Source
/// Stark et al. 2005, "Data processing", Fig. 2(d).
pub fn extrapolate(
    mean: &[f64],
    standard_error: &[f64],
    settings: ExtrapolationSettings,
    t0: Option<T0>,
) -> Result<Lines, ForceError> {
    if mean.len() != standard_error.len() {
        return Err(ForceError::Lengths { mean: mean.len(), standard_error: standard_error.len() });
    }
    if let Some(at) = mean.iter().zip(standard_error).position(|(m, s)| !m.is_finite() || !s.is_finite()) {
        return Err(ForceError::NotFinite(at));
    }
    let near = settings.onset.near;
    let end = near.saturating_sub(settings.guard);
    if end < LINE_SAMPLES {
        return Err(ForceError::TooShort { samples: end, stretch: "before", wanted: LINE_SAMPLES });
    }
    if near.saturating_add(LINE_SAMPLES) > mean.len() {
        let samples = mean.len().saturating_sub(near);
        return Err(ForceError::TooShort { samples, stretch: "after", wanted: LINE_SAMPLES });
    }
    let linear = settings.zero_line == ZeroLine::Linear;
    let snap_off = settings.event == EventKind::SnapOff;
    let before = fit_line(mean, 0, end, Weighting::Uniform, linear || snap_off);
    let after = fit_line(mean, near, mean.len(), Weighting::Hann, linear || !snap_off);

    let departure: Vec<f64> = mean.iter().enumerate().map(|(k, y)| y - before.at(k as f64)).collect();
    let quiet = &departure[..end];
    let rms_before = (quiet.iter().map(|e| e * e).sum::<f64>() / (end - 2) as f64).sqrt();
    let step = after.at(near as f64) - before.at(near as f64);
    let onset = match t0 {
        Some(onset) => onset,
        None => find_t0(&departure, step, rms_before, settings.onset)?,
    };
    let at = onset.latest as f64;
    let jump = after.at(at) - before.at(at);
    let load = if snap_off { -jump } else { jump };
    let inflation = correlation_inflation(quiet, (end as f64).sqrt() as usize);
    let noise = (standard_error[near..].iter().map(|s| s * s).sum::<f64>() / (mean.len() - near) as f64).sqrt();
    let load_std = inflation * before.std_at(at, rms_before).hypot(after.std_at(at, noise));
    if load.abs() <= 3.0 * load_std {
        return Err(ForceError::NoLoad { load, sigmas: load.abs() / load_std });
    }
    let load_slope = if snap_off { before.slope - after.slope } else { after.slope - before.slope };
    Ok(Lines { before, after, onset, load, load_std, load_slope, rms_before })
}

/// Input and response on the grid of the mean.
///
/// # Model
/// Snap-off: `u = load(t)` before `t0`, zero from it on. Snap-in: zero before, `load(t)` from `t0` on. The response is
/// the deflection above the zero-force line. Each value of `u` is held until the next sample, so the step lies on `t0`
/// exactly, where the response has not moved yet.
///
/// # Shapes
/// All `[time]`.
///
/// # Units
/// Those of the mean: the quasi-static gain from force to response is one.
pub fn pair(mean: &[f64], lines: &Lines, event: EventKind) -> Pair {
    let (zero, loaded) = match event {
        EventKind::SnapOff => (lines.after, lines.before),
        EventKind::SnapIn => (lines.before, lines.after),
    };
    let t0 = lines.onset.latest;
    let acts = |k: usize| (k < t0) == (event == EventKind::SnapOff);
    let at = |k: usize| k as f64;
    Pair {
        force: (0..mean.len()).map(|k| if acts(k) { loaded.at(at(k)) - zero.at(at(k)) } else { 0.0 }).collect(),
        response: mean.iter().enumerate().map(|(k, y)| y - zero.at(at(k))).collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::{Lever, white_noise};

    const SAMPLES: usize = 8192;
    const T0: usize = 1024;

    fn settings(event: EventKind) -> ExtrapolationSettings {
        ExtrapolationSettings {
            event,
            zero_line: ZeroLine::Linear,
            guard: 30,
            onset: T0Settings { near: T0 + 2, reach: 30, departure_sigma: 4.0, sure_share: 0.1 },
        }
    }

    /// A loaded ramp that breaks at -0.9 V, on an offset and a slight slope.
    fn rupture(noise: f64, seed: u64) -> Vec<f64> {
        let e = white_noise(SAMPLES, noise, seed);
        let ring = Lever::paper().release(SAMPLES, T0 as f64, -0.9);
        (0..SAMPLES)
            .map(|k| {
                let d = k as f64 - T0 as f64;
                ring[k] - 4.2e-6 * d.min(0.0) + 3e-3 + 1e-8 * d + e[k]
            })
            .collect()
    }

    #[test]
    fn the_force_at_rupture_is_recovered_within_its_errors() {
        let se = vec![2.5e-4; SAMPLES];
        let mut scaled = Vec::new();
        for seed in 0..20 {
            let got = extrapolate(&rupture(2.5e-4, seed), &se, settings(EventKind::SnapOff), None).unwrap();
            // the ramp goes on between the truth and the found moment, 4.2e-6 per sample
            let truth = -0.9 - 4.2e-6 * (got.onset.latest as f64 - T0 as f64);
            scaled.push((got.load - truth) / got.load_std);
            assert!(got.load_std < 5e-5 && got.onset.ambiguity() < 5.0, "{got:?}");
        }
        let rms = (scaled.iter().map(|z| z * z).sum::<f64>() / 20.0).sqrt();
        // 20 draws: relative standard error 16 %, four of them
        assert!((0.4..1.65).contains(&rms), "{rms} {scaled:?}");
    }

    #[test]
    fn without_noise_pair_and_truth_coincide() {
        let mean = rupture(0.0, 0);
        let got = extrapolate(&mean, &vec![0.0; SAMPLES], settings(EventKind::SnapOff), None).unwrap();
        assert_eq!(got.onset.latest, T0);
        // what ringing leaves in the Hann-weighted line, see its test
        assert!((got.load + 0.9).abs() < 3e-6, "{}", got.load);
        let pair = pair(&mean, &got, EventKind::SnapOff);
        assert_eq!(pair.force[T0], 0.0);
        for k in 0..T0 {
            // the same, over a line continued by 1024 samples
            assert!((pair.force[k] - (-0.9 - 4.2e-6 * (k as f64 - T0 as f64))).abs() < 5e-6);
            assert!((pair.response[k] - pair.force[k]).abs() < 1e-12);
        }
    }

    #[test]
    fn snap_in_steps_from_zero_to_a_ramp() {
        let ring = Lever::paper().release(SAMPLES, T0 as f64, 0.04);
        let mean: Vec<f64> = (0..SAMPLES)
            .map(|k| {
                let d = k as f64 - T0 as f64;
                // released from +0.04 about -0.04: the same as a step to -0.04 from zero, moved by a constant
                ring[k] - 0.04 + 4.2e-6 * d.max(0.0) + 2e-3
            })
            .collect();
        let se = vec![1e-9; SAMPLES];
        let got = extrapolate(&mean, &se, settings(EventKind::SnapIn), None).unwrap();
        assert!(got.onset.latest >= T0 && got.onset.latest <= T0 + 1);
        // the ramp meets the lever's lag of 2 samples: not modelled here, and the extrapolation to the edge
        assert!((got.load + 0.04).abs() < 1e-5, "{}", got.load);
        assert!((got.load_slope - 4.2e-6).abs() < 1e-9);
        let pair = pair(&mean, &got, EventKind::SnapIn);
        assert!(pair.force[T0 - 1] == 0.0 && (pair.force[T0 + 1000] + 0.04 - 4.2e-3).abs() < 2e-5);
    }

    #[test]
    fn what_cannot_be_extrapolated_is_refused() {
        let se = vec![1e-3; SAMPLES];
        let quiet = white_noise(SAMPLES, 1e-3, 1);
        assert!(extrapolate(&quiet, &se, settings(EventKind::SnapOff), None).is_err());
        let short = ExtrapolationSettings {
            onset: T0Settings { near: 40, ..settings(EventKind::SnapOff).onset },
            ..settings(EventKind::SnapOff)
        };
        assert!(matches!(extrapolate(&quiet, &se, short, None), Err(ForceError::TooShort { stretch: "before", .. })));
        assert!(matches!(
            extrapolate(&quiet[..1030], &se[..1030], settings(EventKind::SnapOff), None),
            Err(ForceError::TooShort { stretch: "after", .. })
        ));
    }
}
