//! The extended model of a finished release diagnosis.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use crate::causes::find;
use crate::simulate::{
    Estimated, LeverModel, LinearPart, ModelAmplitude, ModelCause, ModelMode, ModelNoise, ModelThermal, ModelWander,
};
use afmid_kernels::diagnosis::release::{Cut, DiagnosedReleases, JointFit, LeverMode};
use afmid_kernels::diagnosis::verdict::NamedCause;
use afmid_kernels::ringdown::RingdownNoise;

/// Baseline, extension and noise as an artifact; the extension is that of the answer: none unless causes are named.
pub(super) fn lever_model(found: &DiagnosedReleases, cut: &Cut, records: usize) -> LeverModel {
    let extended = found.extended.as_ref().unwrap_or(&found.baseline);
    LeverModel {
        sample_rate_hz: 1.0 / cut.interval_s,
        records,
        baseline: linear(&found.baseline),
        extended: linear(extended),
        causes: found.diagnosis.causes.iter().filter_map(cause).collect(),
        noise: noise(&found.noise),
        amplitude: amplitude(extended),
    }
}

/// Lever and detector with errors from the fit's covariance: ln w and ln Q per mode, shares of all modes but the first,
/// ln of the poles.
fn linear(fitted: &JointFit) -> LinearPart {
    let lever = &fitted.state.lever;
    let modes = lever.modes.len();
    let variance = |i: usize, j: usize| fitted.covariance[(i, j)];
    let std = |i: usize| finite(variance(i, i).max(0.0).sqrt());
    let relative = |value: f64, i: usize| Estimated { value, std: std(i).map(|s| s * value) };
    let share = |m: usize, value: f64| {
        let others = 2 * modes..3 * modes - 1;
        let std = match m {
            // one less the others
            0 => {
                finite(others.clone().map(|i| others.clone().map(|j| variance(i, j)).sum::<f64>()).sum::<f64>().sqrt())
            }
            m => std(2 * modes + m - 1),
        };
        Estimated { value, std }
    };
    let mode = |(m, mode): (usize, &LeverMode)| ModelMode {
        frequency_hz: relative(mode.omega / TAU, 2 * m),
        quality_factor: relative(mode.quality_factor, 2 * m + 1),
        share: share(m, mode.share),
    };
    let pole = |(k, pole): (usize, &f64)| relative(pole / TAU, 3 * modes - 1 + k);
    LinearPart {
        modes: lever.modes.iter().enumerate().map(mode).collect(),
        detector_poles_hz: lever.poles.iter().enumerate().map(pole).collect(),
    }
}

fn finite(value: f64) -> Option<f64> {
    value.is_finite().then_some(value)
}

/// A named cause with all parameters of its entry in the catalogue.
fn cause(named: &NamedCause) -> Option<ModelCause> {
    let mut assumed = Vec::new();
    let parameter = |known: &crate::causes::Parameter| {
        let found = named.parameters.get(known.name);
        let estimated = match found.and_then(|found| found.value) {
            Some(value) => Estimated { value, std: found.and_then(|found| found.std) },
            None => {
                assumed.push(known.name.to_owned());
                Estimated { value: 0.0_f64.clamp(known.low, known.high), std: None }
            }
        };
        (known.name.to_owned(), estimated)
    };
    let parameters: BTreeMap<String, Estimated> = find(&named.id)?.about().parameters.iter().map(parameter).collect();
    Some(ModelCause { id: named.id.clone(), parameters, assumed })
}

fn noise(noise: &RingdownNoise) -> ModelNoise {
    let thermal = noise.thermal.iter();
    let wander = noise.wander.iter();
    ModelNoise {
        white_v2: noise.white,
        thermal: thermal.map(|t| ModelThermal { frequency_hz: t.pole.norm() / TAU, variance_v2: t.variance }).collect(),
        wander: wander.map(|w| ModelWander { rate_per_s: w.rate_per_s, variance_v2: w.variance }).collect(),
    }
}

fn amplitude(fitted: &JointFit) -> ModelAmplitude {
    let values: Vec<f64> = fitted.state.events.iter().map(|event| event.amplitude).collect();
    let events = values.len();
    let mean_v = values.iter().sum::<f64>() / events.max(1) as f64;
    let square: f64 = values.iter().map(|a| (a - mean_v).powi(2)).sum();
    ModelAmplitude { mean_v, scatter_v: (square / events.saturating_sub(1).max(1) as f64).sqrt(), events }
}
