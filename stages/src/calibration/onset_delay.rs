//! What an averaged snap-off can say about the delay: an upper bound by causality, and a family of onsets.

use super::error::CalibrationError;

/// What is known of the onset and the delay. All times on the average's own axis, s.
#[derive(Debug, Clone, PartialEq)]
pub struct OnsetDelay {
    /// First sustained departure from the line before the event: rupture plus delay cannot be later (causality).
    pub latest_s: f64,
    /// Onset plus delay for each assumed order of the first rise, where the data bear it.
    pub by_order: Vec<OrderedOnset>,
    /// Earliest and latest of the bearable onsets: the ambiguity of t0 plus delay.
    pub range_s: (f64, f64),
}

/// An onset under the assumption that the response first rises as `(t - t0)^order`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OrderedOnset {
    /// Order of the first rise: 2 for a bare lever under a force step, one more per detector pole.
    pub order: u32,
    /// t0 plus delay, s.
    pub onset_s: f64,
    /// chi-square per degree of freedom of the rise.
    pub misfit: f64,
}

/// Settings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct OnsetRule {
    /// Departure in standard errors that counts, sustained over `sustained_samples`.
    pub threshold: f64,
    /// See above.
    pub sustained_samples: usize,
    /// Share of the step up to which the first rise is a power law.
    pub rise_share: f64,
    /// Largest number of detector poles considered.
    pub most_poles: u32,
}

/// What the average says.
///
/// # Model
/// A delay `exp(-s T)` and a later t0 are the same signal: from the response alone only their sum is seen, and no lower bound exists without
/// a model of the rise (a chain of fast poles mimics a delay). Causality gives an upper bound: the sum is not later than the first departure.
/// For a stated order m of the rise, `y = c (t - t0)^m`, the sum is an ordinary parameter.
///
/// # Method
/// Line through the first half of the stretch before `search_from`; first sample from which `sustained_samples` in a row
/// depart by `threshold` standard errors in the same sense; for each order, linear regression of `|y|^(1/m)` on time over the samples from there
/// to `rise_share` of the step, of which the zero is t0.
///
/// # Errors
/// Lengths differ; no departure; fewer than three samples on the rise for every order.
pub fn onset_delay(
    time_s: &[f64],
    mean: &[f64],
    standard_error: &[f64],
    rule: OnsetRule,
) -> Result<OnsetDelay, CalibrationError> {
    if mean.len() != time_s.len() || standard_error.len() != time_s.len() || time_s.len() < 64 {
        let wanted = format!("{} and at least 64, as the time axis", time_s.len());
        return Err(CalibrationError::Length {
            what: "averaged event",
            got: mean.len().min(standard_error.len()),
            wanted,
        });
    }
    let before = time_s.iter().take_while(|t| **t < 0.0).count();
    let baseline = Baseline::fit(time_s, mean, before * 3 / 4).ok_or(CalibrationError::TooLittle {
        what: "samples before the event",
        found: before,
        wanted: 32,
        hint: "the average must begin before its onset (time 0)",
    })?;
    let rest: Vec<f64> = time_s.iter().zip(mean).map(|(t, y)| y - baseline.at(*t)).collect();
    let level: Vec<f64> = rest.iter().zip(standard_error).map(|(y, s)| y / s.max(baseline.noise / 4.0)).collect();
    let start = before * 3 / 4;
    let departs = |k: usize| {
        level
            .get(k..k + rule.sustained_samples)
            .is_some_and(|run| run.iter().all(|z| *z > rule.threshold) || run.iter().all(|z| *z < -rule.threshold))
    };
    let first = (start..level.len()).find(|&k| departs(k)).ok_or(CalibrationError::TooLittle {
        what: "sustained departures from the line before the event",
        found: 0,
        wanted: 1,
        hint: "lower threshold, or average more events",
    })?;
    let step = rest.iter().skip(first).take(64).fold(0.0f64, |top, y| top.max(y.abs()));
    let end = (first..rest.len()).find(|&k| rest[k].abs() > rule.rise_share * step).unwrap_or(rest.len());
    let latest_s = time_s[first];
    let rise: Vec<(f64, f64, f64)> =
        (first..end).map(|k| (time_s[k], rest[k].abs(), standard_error[k].max(baseline.noise / 4.0))).collect();
    let by_order: Vec<OrderedOnset> =
        (2..=2 + rule.most_poles).filter_map(|order| ordered(order, &rise, latest_s)).collect();
    if by_order.is_empty() {
        let hint = "raise rise_share: the first rise is shorter than three samples";
        return Err(CalibrationError::TooLittle {
            what: "samples on the first rise",
            found: rise.len(),
            wanted: 3,
            hint,
        });
    }
    let onsets = || by_order.iter().map(|o| o.onset_s);
    let range_s = (onsets().fold(f64::INFINITY, f64::min), onsets().fold(f64::NEG_INFINITY, f64::max));
    Ok(OnsetDelay { latest_s, by_order, range_s })
}

struct Baseline {
    centre: f64,
    level: f64,
    slope: f64,
    noise: f64,
}

impl Baseline {
    fn fit(time: &[f64], values: &[f64], count: usize) -> Option<Self> {
        let (time, values) = (time.get(..count)?, values.get(..count)?);
        if count < 32 {
            return None;
        }
        let n = count as f64;
        let (centre, level) = (time.iter().sum::<f64>() / n, values.iter().sum::<f64>() / n);
        let square: f64 = time.iter().map(|t| (t - centre).powi(2)).sum();
        let slope = time.iter().zip(values).map(|(t, y)| (t - centre) * (y - level)).sum::<f64>() / square;
        let rest: f64 = time.iter().zip(values).map(|(t, y)| (y - level - slope * (t - centre)).powi(2)).sum();
        Some(Self { centre, level, slope, noise: (rest / n).sqrt() })
    }

    fn at(&self, time: f64) -> f64 {
        self.level + self.slope * (time - self.centre)
    }
}

/// The onset of one order: weighted line through `y^(1/m)`, whose error is `sigma y^(1/m - 1) / m`.
fn ordered(order: u32, rise: &[(f64, f64, f64)], latest_s: f64) -> Option<OrderedOnset> {
    if rise.len() < 3 {
        return None;
    }
    let power = 1.0 / f64::from(order);
    let points: Vec<(f64, f64, f64)> = rise
        .iter()
        .map(|(t, y, s)| (t - latest_s, y.powf(power), (s * power * y.powf(power - 1.0)).powi(-2)))
        .collect();
    let weight: f64 = points.iter().map(|p| p.2).sum();
    let (mean_t, mean_y) = points.iter().fold((0.0, 0.0), |m, p| (m.0 + p.2 * p.0 / weight, m.1 + p.2 * p.1 / weight));
    let covariance: f64 = points.iter().map(|p| p.2 * (p.0 - mean_t) * (p.1 - mean_y)).sum();
    let slope = covariance / points.iter().map(|p| p.2 * (p.0 - mean_t).powi(2)).sum::<f64>();
    let square: f64 = points.iter().map(|p| p.2 * (p.1 - mean_y - slope * (p.0 - mean_t)).powi(2)).sum();
    let onset_s = latest_s + mean_t - mean_y / slope;
    let misfit = square / (points.len() - 2) as f64;
    // causality: an onset after the first departure is no onset
    (onset_s.is_finite() && onset_s <= latest_s && slope > 0.0).then_some(OrderedOnset { order, onset_s, misfit })
}
