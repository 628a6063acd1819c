//! Estimates from columns of a file, whose noise nobody has measured.

use std::path::Path;
use std::sync::Arc;

use afmid_kernels::spectra::Intersample;
use afmid_pipeline::stage::NoProgress;
use afmid_pipeline::{Array, Artifact, Context, Ports, Stage};
use num_complex::Complex64;

use super::{Etfe, MeasuredFrf};
use crate::artifacts::{Frf, Transfer};
use crate::fixture::white_noise;
use crate::io::columns::{Column, Columns};

const RATE: f64 = 100.0;

/// A pole driven by noise, with noise on the output, in a file; as `io.columns` reads it.
fn columns(folder: &Path, samples: usize, seed: u64) -> Array {
    let (u, e) = (white_noise(samples, 1.0, 2 * seed), white_noise(samples, 0.3, 2 * seed + 1));
    let (mut y, mut text) = (0.0, "u,y\n".to_owned());
    for (u, e) in u.iter().zip(e) {
        y = 0.5 * y + u;
        text += &format!("{u},{}\n", y + e + 2.0);
    }
    std::fs::write(folder.join("a.csv"), text).unwrap();
    let stage = Columns { file: "a.csv".to_owned(), sample_rate_hz: Some(RATE), ..Columns::default() };
    assert_eq!(stage.output, Column::Number(2));
    of(stage.run(&Ports::new(), &Context::new(folder, 1, &NoProgress)).unwrap(), "pair")
}

fn truth(frequency_hz: f64) -> Complex64 {
    1.0 / (1.0 - 0.5 * Complex64::from_polar(1.0, -std::f64::consts::TAU * frequency_hz / RATE))
}

fn run<S: Stage>(stage: &S, pair: &Array, output: &str) -> Array {
    let mut inputs = Ports::new();
    inputs.insert("pair", Artifact::Array(Arc::new(pair.clone())));
    of(stage.run(&inputs, &Context::alone(1)).unwrap(), output)
}

fn of(ports: Ports, name: &str) -> Array {
    match ports.artifact(name) {
        Some(Artifact::Array(array)) => array.as_ref().clone(),
        other => panic!("{other:?}"),
    }
}

/// Squared errors over stated variances, in the mean.
fn calibration<'a>(rows: impl Iterator<Item = (&'a f64, &'a Complex64, &'a f64)>) -> f64 {
    let ratios: Vec<f64> = rows
        .filter(|(f, _, variance)| variance.is_finite() && **f > 1.0)
        .map(|(f, found, variance)| (found - truth(*f)).norm_sqr() / variance)
        .collect();
    ratios.iter().sum::<f64>() / ratios.len() as f64
}

#[test]
fn an_etfe_of_columns_takes_its_noise_from_neighbouring_bins() {
    let folder = tempfile::tempdir().unwrap();
    let etfe = Etfe { bandwidth_hz: 50.0, intersample: Intersample::Sampled, normalise: false, ..Etfe::default() };
    let mean = |seed: u64| {
        let array = run(&etfe, &columns(folder.path(), 4096, seed), "etfe");
        let found = Transfer::new(&array).unwrap();
        calibration(found.frequency_hz.iter().zip(found.transfer).zip(found.variance).map(|((f, h), v)| (f, h, v)))
    };
    let all = (1..=10).map(mean).sum::<f64>() / 10.0;
    // 20000 ratios: 1 %; a variance of 14 degrees of freedom makes the mean ratio 14/13, its own bin in it somewhat less
    assert!((0.9..1.15).contains(&all), "{all}");
}

#[test]
fn averaged_responses_of_columns_have_the_variance_that_they_state() {
    let folder = tempfile::tempdir().unwrap();
    let stage = MeasuredFrf { block_samples: Some(128), ..MeasuredFrf::default() };
    let mean = |seed: u64| {
        let array = run(&stage, &columns(folder.path(), 8192, 100 + seed), "frf");
        let found = Frf::new(&array).unwrap();
        assert_eq!((found.responses.len(), found.driving_point), (1, None));
        let variance = found.row_variance(0).unwrap();
        calibration(found.frequency_hz.iter().zip(found.row(0)).zip(variance).map(|((f, h), v)| (f, h, v)))
    };
    let all = (1..=20).map(mean).sum::<f64>() / 20.0;
    // 20 records of 62 bins, every other independent: 4 %; and 120 averages: (n - 1) / (n - 2)
    assert!((all - 1.0).abs() < 0.16, "{all}");
}
