//! The example of `model.frf_modes`: two modes of a beam at three points, struck at the first.

use afmid_pipeline::{Example, Ports, StageError};
use num_complex::Complex64;

use super::decay::MODES;
use super::frf_modes::SUMMARY;
use crate::artifacts::{NewFrf, Point, Quantity, ResponseOf};
use crate::events::decay_example::white_noise;
use crate::io::FRF;

/// Frequencies and damping ratios.
const TRUTH: [(f64, f64); 2] = [(110.0, 0.01), (300.0, 0.02)];
/// At unit modal mass, per root of a kilogram.
const SHAPES: [[f64; 3]; 2] = [[1.0, 0.6, -0.3], [0.8, -0.5, 0.7]];

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "Two modes of a beam, accelerances of three points",
        params: "max_modes = 4",
        inputs: || Ok(Ports::new().with(&FRF, responses().array()?)),
        expect: |outputs| {
            let text = |error: StageError| error.to_string();
            let table = outputs.get(&MODES).map_err(text)?;
            let real = |name: &str| table.real(name).map(<[f64]>::to_vec).map_err(text);
            let (f, f_std) = (real("frequency_hz")?, real("frequency_std_hz")?);
            let (damping, damping_std) = (real("damping_ratio")?, real("damping_ratio_std")?);
            let third = &outputs.get(&SUMMARY).map_err(text)?.0["modes"][0]["mass_normalised"][2];
            let of = |name: &str| third[name].as_f64().unwrap_or(f64::NAN);
            // four standard errors, which hold
            let near = |k: usize| {
                let (frequency, ratio) = TRUTH[k];
                (f[k] - frequency).abs() < 4.0 * f_std[k] && (damping[k] - ratio).abs() < 4.0 * damping_std[k]
            };
            match f.len() == 2 && near(0) && near(1) && (of("value") + 0.3).abs() < 4.0 * of("std") {
                true => Ok(format!(
                    "{:.3} Hz +- {:.3}, damping {:.3} % +- {:.3}; {:.3} of the third point at unit modal mass.",
                    f[0],
                    f_std[0],
                    100.0 * damping[0],
                    100.0 * damping_std[0],
                    of("value")
                )),
                false => Err(format!("{f:?} {f_std:?} {damping:?} {damping_std:?} {third}")),
            }
        },
    }]
}

/// Their responses, with noise.
pub(super) fn responses() -> NewFrf {
    let frequency_hz: Vec<f64> = (40..800).map(|k| 0.5 * f64::from(k)).collect();
    let point = |number: usize| Point { name: number.to_string(), ..Point::default() };
    let row = |r: usize| {
        let noise = white_noise(2 * frequency_hz.len(), 0.3, r as u64);
        let exact = frequency_hz.iter().map(move |f| accelerance(r, *f));
        exact.enumerate().map(move |(k, h)| h + Complex64::new(noise[2 * k], noise[2 * k + 1])).collect::<Vec<_>>()
    };
    NewFrf {
        responses: (0..3).map(|r| ResponseOf { output: point(r + 1), input: point(1), run: 0 }).collect(),
        frf: (0..3).flat_map(row).collect(),
        frequency_hz: frequency_hz.clone(),
        quantity: Quantity::Accelerance,
        unit: "(m/s^2)/N".to_owned(),
        driving_point: Some(0),
        ..NewFrf::default()
    }
}

fn accelerance(response: usize, frequency_hz: f64) -> Complex64 {
    let w = std::f64::consts::TAU * frequency_hz;
    let mode = |(shape, (f, damping)): (&[f64; 3], &(f64, f64))| {
        let natural = std::f64::consts::TAU * f;
        shape[response] * shape[0] / Complex64::new(natural * natural - w * w, 2.0 * damping * natural * w)
    };
    -w * w * SHAPES.iter().zip(&TRUTH).map(mode).sum::<Complex64>()
}
