//! Inputs of the stages' examples: one resonance in closed form.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use afmid_kernels::events::EventKind;
use afmid_pipeline::Array;

use crate::artifacts::{DataSet, NewEnsemble, NewPair, PairSet, RateError};

/// Sample rate of the examples.
pub(crate) const SAMPLE_RATE_HZ: f64 = 5e6;
/// Resonance of the examples.
pub(crate) const FREQUENCY_HZ: f64 = 120e3;
/// Its quality factor.
pub(crate) const QUALITY_FACTOR: f64 = 20.0;
/// Load before the release, in volts.
pub(crate) const LOAD_V: f64 = -0.8;
/// Sample of the release.
pub(crate) const T0: usize = 256;

/// `load` held until sample `t0`, then `load exp(-a t) (cos(w t) + (a / w) sin(w t))`.
pub(crate) fn release(samples: usize, t0: usize, load: f64) -> Vec<f64> {
    let w0 = std::f64::consts::TAU * FREQUENCY_HZ;
    let a = 0.5 * w0 / QUALITY_FACTOR;
    let w = (w0 * w0 - a * a).sqrt();
    (0..samples)
        .map(|k| {
            let t = k.saturating_sub(t0) as f64 / SAMPLE_RATE_HZ;
            load * (-a * t).exp() * ((w * t).cos() + a / w * (w * t).sin())
        })
        .collect()
}

/// Twelve releases of 4096 samples whose amplitudes scatter by a tenth, in noise of one millivolt.
pub(crate) fn ensemble() -> Array {
    let (count, samples) = (12, 4096);
    let mut rng = ChaCha8Rng::seed_from_u64(2005);
    let mut gauss = || -> f64 { StandardNormal.sample(&mut rng) };
    let mut values = Vec::with_capacity(count * samples);
    for _ in 0..count {
        let (amplitude, offset) = (1.0 + 0.1 * gauss(), 4e-3 * gauss());
        values.extend(release(samples, T0, LOAD_V).iter().map(|y| amplitude * y + offset + 1e-3 * gauss()));
    }
    ensemble_of(values, count, samples)
}

/// Events one after the other as an ensemble, in volts.
pub(crate) fn ensemble_of(signal: Vec<f64>, events: usize, samples: usize) -> Array {
    let (sample_rate_hz, onset_sample) = (SAMPLE_RATE_HZ, T0);
    let (kind, unit) = (Some(EventKind::SnapOff), "V");
    let rate_error = RateError::default();
    NewEnsemble { signal: signal.into(), events, samples, sample_rate_hz, rate_error, onset_sample, kind, unit }.array()
}

/// A pair of the sets given: the force held until the release, and these responses.
pub(crate) fn pair_of(response: &[f64], standard_error: Option<f64>, sets: &[DataSet]) -> Array {
    let samples = response.len();
    let (t0_sample, kind) = (T0, EventKind::SnapOff.name());
    sets.iter().fold(NewPair { sample_rate_hz: SAMPLE_RATE_HZ, t0_sample, kind }.samples(samples), |pair, &set| {
        PairSet {
            set,
            dims: &["time"],
            response_dims: &["time"],
            response: response.to_vec(),
            force: (0..samples).map(|k| if k < T0 { LOAD_V } else { 0.0 }).collect(),
            standard_error: standard_error.map(|error| vec![error; samples]),
            newtons_per_volt: None,
            labels: PairSet::LEVER,
        }
        .add(pair)
    })
}
