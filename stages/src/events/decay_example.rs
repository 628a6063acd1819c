//! The example of `events.decay`: two hits in a record of two sensors, and a hum that does not die away.

use std::path::Path;

use afmid_pipeline::recording::{
    Codes, InputFiles, NativeChannel, NativeRecord, RecordStorage, Wanted, open_native, write_native,
};
use afmid_pipeline::{Example, Ports, Record, Recording, StageError};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::decay::{DECAYS, EVENTS, RECORDS};
use crate::artifacts::{DEFLECTION, Decays, SENSOR};

/// An example's inputs have no parameters, so its folder is fixed.
const FOLDER: &str = "/tmp/afmid-example-decay";
pub(crate) const RATE_HZ: f64 = 2000.0;
/// Frequency and decay rate of the mode.
pub(crate) const MODE: (f64, f64) = (60.0, 8.0);
const HITS: [usize; 2] = [1000, 3000];

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "Two hits seen by two sensors, and a hum without a hit",
        params: "least_rise = 4.0",
        inputs: || {
            Ok(Ports::new().with(&RECORDS, Recording { records: vec![record("hits", true)?, record("hum", false)?] }))
        },
        expect: |outputs| {
            let text = |error: StageError| error.to_string();
            let decays = Decays::new(outputs.get(&DECAYS).map_err(text)?).map_err(text)?;
            let events = outputs.get(&EVENTS).map_err(text)?;
            let rejected = events.text("rejected").map_err(text)?;
            let first: Vec<usize> =
                events.integer("first").map_err(text)?.iter().take(2).map(|first| *first as usize).collect();
            // on or after the hit, late by less than half a period: 17 samples
            let right =
                decays.hits.len() == 2 && first.iter().zip(HITS).all(|(first, hit)| (hit..hit + 17).contains(first));
            match right && rejected[2].contains("Q cannot be had") {
                true => Ok(format!("Decays from samples {} and {}; {}.", first[0], first[1], rejected[2])),
                false => Err(format!("{} decays, {first:?}, {rejected:?}", decays.hits.len())),
            }
        },
    }]
}

/// A mode of 60 Hz hit twice, or humming; the second sensor sees half of it, turned round.
pub(crate) fn signal(hit: bool, sensor: usize) -> Vec<f64> {
    let noise = white_noise(5000, 1e-3, 7 + sensor as u64);
    let (frequency, rate) = MODE;
    let gain = [1.0, -0.5][sensor];
    let ringing = |k: usize| {
        let t = k as f64 / RATE_HZ;
        let turned = |t: f64| (std::f64::consts::TAU * frequency * t).sin();
        match hit {
            false => turned(t),
            true => HITS
                .iter()
                .filter(|&&start| k >= start)
                .map(|&start| t - start as f64 / RATE_HZ)
                .map(|t| (-rate * t).exp() * turned(t))
                .sum(),
        }
    };
    (0..5000).map(|k| gain * ringing(k) + noise[k]).collect()
}

/// White Gaussian noise.
pub(crate) fn white_noise(samples: usize, std: f64, seed: u64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..samples).map(|_| std * <StandardNormal as Distribution<f64>>::sample(&StandardNormal, &mut rng)).collect()
}

pub(crate) fn record(name: &str, hit: bool) -> Result<Record, StageError> {
    std::fs::create_dir_all(FOLDER).map_err(|error| StageError::from_error(error).at(FOLDER))?;
    let path = Path::new(FOLDER).join(format!("{name}.h5"));
    let channel = |sensor: usize| NativeChannel {
        location: format!("sensor{}", sensor + 1),
        codes: Codes::Float64(signal(hit, sensor)),
        unit: "m/s^2".to_owned(),
        scale_factor: 1.0,
        add_offset: 0.0,
        long_name: format!("acceleration {}", sensor + 1),
    };
    let record = NativeRecord {
        sample_rate_hz: RATE_HZ,
        started_at: "2026-11-26T00:00:00Z".to_owned(),
        channels: vec![channel(0), channel(1)],
    };
    write_native(&path, &record, RecordStorage::Raw)?;
    let wanted = |role, location| Wanted { role, location, required: true };
    open_native(&InputFiles::new(), &path, &[wanted(DEFLECTION, "/sensor1"), wanted(SENSOR, "/sensor2")])
}
