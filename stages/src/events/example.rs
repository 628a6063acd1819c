//! The example of `events.correlation`: releases of a single mode, at known times.

use afmid_pipeline::recording::Raw;
use afmid_pipeline::{Array, Example, Ports, Recording, StageError, Table};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use crate::io::{memory_channel, memory_record};

const RATE: f64 = 5e6;
const LSB: f64 = 1e-3;
/// Times of rupture in samples, and the record without one.
const RUPTURES: [Option<f64>; 4] = [Some(30_000.25), Some(31_777.8), None, Some(28_500.5)];

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "three releases at known times, and a record without a rupture",
        params: "kind = \"snap-off\"\nwindow_samples = 4096",
        inputs: records,
        expect,
    }]
}

/// 46 kHz, Q 40, 0.9 V, 1 mV of noise.
fn records() -> Result<Ports, StageError> {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let records = RUPTURES
        .iter()
        .enumerate()
        .map(|(number, rupture)| {
            let codes = (0..60_000).map(|k| {
                let noise: f64 = StandardNormal.sample(&mut rng);
                let volts = rupture.map_or(0.0, |t0| released(f64::from(k) - t0)) + 1e-3 * noise;
                (volts / LSB).round() as i16
            });
            let channel = memory_channel("deflection", Raw::Int16(codes.collect()), LSB);
            memory_record(&format!("record_{number}.h5"), RATE, vec![channel])
        })
        .collect();
    let mut ports = Ports::new();
    ports.insert("records", afmid_pipeline::Artifact::Recording(std::sync::Arc::new(Recording { records })));
    Ok(ports)
}

/// Volts `t` samples after the rupture.
fn released(t: f64) -> f64 {
    if t < 0.0 {
        return -0.9 - 4.5e-6 * t;
    }
    let angle = std::f64::consts::TAU * 46e3 / RATE * t;
    -0.9 * (-angle / 80.0).exp() * (angle.cos() + angle.sin() / 80.0)
}

fn expect(outputs: &Ports) -> Result<String, String> {
    let fail = |error: StageError| error.to_string();
    let Some(afmid_pipeline::Artifact::Array(ensemble)) = outputs.artifact("ensemble") else {
        return Err("no ensemble".to_owned());
    };
    let Some(afmid_pipeline::Artifact::Table(table)) = outputs.artifact("events") else {
        return Err("no table of events".to_owned());
    };
    let (ensemble, table): (&Array, &Table) = (ensemble, table);
    let onsets = ensemble.real("onset").map_err(fail)?;
    let late: Vec<f64> =
        onsets.iter().zip(RUPTURES.iter().flatten()).map(|(onset, rupture)| onset * RATE - rupture).collect();
    let rejected = table.text("rejected").map_err(fail)?;
    let spread = late.iter().fold(0.0f64, |spread, value| spread.max((value - late[0]).abs()));
    // 0.9 V in 1 mV of noise: 0.003 samples; the release bends sharply at its onset, which interpolation sees: some
    // hundredths
    if onsets.len() != 3
        || spread > 0.05
        || !(0.0..4.0).contains(&late[0])
        || rejected.get(2).map(String::as_str) != Some("no rupture")
    {
        return Err(format!(
            "{} events, onsets {late:?} samples after the ruptures, rejected: {rejected:?}",
            onsets.len()
        ));
    }
    Ok(format!("3 of 3 ruptures found, aligned to {spread:.3} samples; record_2.h5: no rupture"))
}
