//! Examples of `model.decay`: two modes of close frequencies, two hits, three sensors; hits of two systems.

use afmid_pipeline::{Example, Ports, StageError};

use super::decay::{MODES, SUMMARY, SYSTEMS};
use crate::artifacts::{Sensor, decay_array};
use crate::events::DECAYS;
use crate::events::decay_example::white_noise;

const RATE_HZ: f64 = 1000.0;
/// Frequencies and quality factors.
const TRUTH: [(f64, f64); 2] = [(52.0, 80.0), (61.0, 120.0)];
const SHAPES: [[f64; 3]; 2] = [[1.0, 0.6, -0.3], [0.4, -0.8, 1.0]];

pub(super) fn examples() -> Vec<Example> {
    vec![
        Example {
            title: "Two modes of three sensors, two hits",
            params: "max_modes = 4",
            inputs: || Ok(Ports::new().with(&DECAYS, decays()?)),
            expect: |outputs| {
                let text = |error: StageError| error.to_string();
                let table = outputs.get(&MODES).map_err(text)?;
                let real = |name: &str| table.real(name).map(<[f64]>::to_vec).map_err(text);
                let (f, f_std, q, q_std) = (
                    real("frequency_hz")?,
                    real("frequency_std_hz")?,
                    real("quality_factor")?,
                    real("quality_factor_std")?,
                );
                let shape = &outputs.get(&SUMMARY).map_err(text)?.0["modes"][0]["shape"][2];
                // four standard errors, which hold
                let near = |k: usize| {
                    let (frequency, quality) = TRUTH[k];
                    (f[k] - frequency).abs() < 4.0 * f_std[k] && (q[k] - quality).abs() < 4.0 * q_std[k]
                };
                let of = |name: &str| shape[name].as_f64().unwrap_or(f64::NAN);
                let right = f.len() == 2 && near(0) && near(1) && (of("re") + 0.3).abs() < 4.0 * of("re_std");
                match right {
                    true => Ok(format!(
                        "{:.3} Hz +- {:.3}, Q {:.2} +- {:.2}; {:.3} of sensor 3.",
                        f[0],
                        f_std[0],
                        q[0],
                        q_std[0],
                        of("re")
                    )),
                    false => Err(format!("{f:?} {f_std:?} {q:?} {q_std:?} {shape}")),
                }
            },
        },
        Example {
            title: "Three hits, the last of another system",
            params: "",
            inputs: || Ok(Ports::new().with(&DECAYS, two_systems()?)),
            expect: |outputs| {
                let text = |error: StageError| error.to_string();
                let (modes, systems) = (outputs.get(&MODES).map_err(text)?, outputs.get(&SYSTEMS).map_err(text)?);
                let real = |name: &str| modes.real(name).map(<[f64]>::to_vec).map_err(text);
                let (f, f_std) = (real("frequency_hz")?, real("frequency_std_hz")?);
                let own = systems.real("frequency_hz").map_err(text)?;
                // the first two hits' mode alone, within four standard errors
                match f.len() == 1 && (f[0] - TRUTH[0].0).abs() < 4.0 * f_std[0] && own.len() == 3 {
                    true => Ok(format!("{:.3} Hz +- {:.3} of two hits; by themselves {own:.2?} Hz.", f[0], f_std[0])),
                    false => Err(format!("{f:?} {f_std:?} {own:?}")),
                }
            },
        },
    ]
}

/// One sensor, two hits of the first mode and one of the second.
fn two_systems() -> Result<afmid_pipeline::Array, StageError> {
    let sensors = [Sensor { name: "sensor".to_owned(), unit: "m/s^2".to_owned() }];
    let hits: Vec<Vec<Vec<f64>>> = [0, 0, 1]
        .iter()
        .zip(31..)
        .map(|(&mode, seed)| {
            let noise = white_noise(1500, 5e-3, seed);
            vec![(0..1500).map(|k| ring(mode, k) + noise[k]).collect()]
        })
        .collect();
    decay_array(&hits, &[], &sensors, RATE_HZ)
}

/// A mode of unit amplitude.
fn ring(mode: usize, sample: usize) -> f64 {
    let (frequency, quality) = TRUTH[mode];
    let (t, w) = (sample as f64 / RATE_HZ, std::f64::consts::TAU * frequency);
    let turn = w * (1.0 - 0.25 / (quality * quality)).sqrt();
    (-0.5 * w / quality * t).exp() * (turn * t).sin()
}

fn decays() -> Result<afmid_pipeline::Array, StageError> {
    let sensors = [1, 2, 3].map(|number| Sensor { name: format!("sensor{number}"), unit: "m/s^2".to_owned() });
    let row = |hit: usize, sensor: usize| {
        let noise = white_noise(2000, 2e-3, (10 * hit + sensor) as u64);
        let amplitudes = [[1.0, 0.7], [0.6, -0.5]][hit];
        let at = |k: usize| {
            let mode = |j: usize| amplitudes[j] * SHAPES[j][sensor] * ring(j, k);
            mode(0) + mode(1) + noise[k]
        };
        (0..2000).map(at).collect::<Vec<f64>>()
    };
    let hits: Vec<Vec<Vec<f64>>> = (0..2).map(|hit| (0..3).map(|sensor| row(hit, sensor)).collect()).collect();
    decay_array(&hits, &[], &sensors, RATE_HZ)
}
