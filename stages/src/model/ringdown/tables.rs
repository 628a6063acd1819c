//! What the stage hands on.

use afmid_pipeline::{Array, Axis, Table};

use super::ErrorSource;
use crate::artifacts::{self, RateError};
use afmid_kernels::contact::Ringing;
use afmid_kernels::ringdown::{EventParameters, ModeEstimate, Quantity, Ringdown};

pub(super) fn mode_table(fit: &Ringdown, modes: &[ModeEstimate], rate_error: RateError) -> Table {
    let scatter = fit.sandwich.as_ref().map(|covariance| {
        let mut scatter = fit.modes_with(covariance);
        rate_error.widen_modes(&mut scatter);
        scatter
    });
    let other = |value: fn(&ModeEstimate) -> f64| match &scatter {
        Some(scatter) => scatter.iter().map(value).collect::<Vec<f64>>(),
        None => vec![f64::NAN; modes.len()],
    };
    let oscillating = || fit.exponentials.iter().filter(|e| e.oscillates());
    let thermal = (0..modes.len())
        .map(|i| fit.noise.thermal.get(i).map_or(f64::NAN, |mode| mode.variance.max(0.0).sqrt()))
        .collect::<Vec<f64>>();
    let table = artifacts::mode_table(modes)
        .with(
            "frequency_scatter_hz",
            "Hz",
            "standard error from the events' scatter and the rate's error",
            other(|m| m.frequency_hz.std),
        )
        .with("quality_factor_scatter", "1", "standard error from the events' scatter", other(|m| m.quality_factor.std))
        .with(
            "amplitude",
            "V",
            "ringing of an event of amplitude 1 at its onset",
            oscillating().map(|e| e.residue.norm()).collect::<Vec<f64>>(),
        )
        .with("thermal_std", "V", "rms of the mode's thermal motion", thermal);
    let Some(mut intervals) = fit.bootstrap_intervals(0.95) else { return table };
    for ([frequency, _], mode) in intervals.iter_mut().zip(modes) {
        *frequency = rate_error.widened_ends(mode.frequency_hz.value, *frequency);
    }
    let end = |value: fn(&[(f64, f64); 2]) -> f64| intervals.iter().map(value).collect::<Vec<f64>>();
    table
        .with(
            "frequency_low_hz",
            "Hz",
            "lower end of the bootstrap's 95 % interval, with the rate's error",
            end(|i| i[0].0),
        )
        .with("frequency_high_hz", "Hz", "upper end of it", end(|i| i[0].1))
        .with("quality_factor_low", "1", "lower end of the bootstrap's 95 % interval", end(|i| i[1].0))
        .with("quality_factor_high", "1", "upper end of it", end(|i| i[1].1))
}

/// Poles and residues with the covariance that this source of errors gives, without the error of the sample rate: two
/// ringings that are compared have one clock.
pub(super) fn poles(fit: &Ringdown, source: ErrorSource) -> Array {
    let covariance = match (source, &fit.sandwich) {
        (ErrorSource::Events, Some(sandwich)) => sandwich,
        _ => &fit.covariance,
    };
    artifacts::ringing_array(&Ringing::of(fit, covariance))
}

pub(super) fn event_table(fit: &Ringdown) -> Table {
    let events: Vec<(&EventParameters, &EventParameters)> = fit.events.iter().zip(&fit.event_std).collect();
    Table::of(&events)
        .with_std(["amplitude", "amplitude_std"], "1", "factor of the shared shape", |(e, s)| {
            (e.amplitude, s.amplitude)
        })
        .with_std(["onset_s", "onset_std_s"], "s", "onset after the first sample used", |(e, s)| (e.onset_s, s.onset_s))
        .with_std(["offset", "offset_std"], "V", "level that it decays to", |(e, s)| (e.offset, s.offset))
        .with_std(["slope", "slope_std"], "V", "change of that level over half the window", |(e, s)| (e.slope, s.slope))
        .table()
}

pub(super) fn spectrum(fit: &Ringdown) -> Array {
    let over = &["frequency_hz"];
    Array::over(vec![Axis::new("frequency_hz", "Hz", "frequency", fit.frequency_hz.clone())])
        .with("residual", "V^2/Hz", "mean Hann periodogram of the residuals", over, fit.residual_periodogram.clone())
        .with("expected", "V^2/Hz", "what the noise model expects of it", over, fit.expected_periodogram.clone())
        .attribute("events", fit.events.len())
}

/// The name of a quantity in messages.
pub(super) fn named(quantity: Quantity) -> String {
    match quantity {
        Quantity::Frequency(mode) => format!("the frequency of mode {}", mode + 1),
        Quantity::QualityFactor(mode) => format!("the quality factor of mode {}", mode + 1),
        Quantity::RealPole(pole) => format!("real pole {}", pole + 1),
    }
}
