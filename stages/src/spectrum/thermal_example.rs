//! The example of `spectrum.thermal`: a spectrum in closed form with a deterministic ripple in place of chance.

use afmid_pipeline::{Array, Axis, Example, Ports};

use super::thermal::SUMMARY;
use crate::io::DENSITY;

const FREQUENCY_HZ: f64 = 70e3;
const QUALITY_FACTOR: f64 = 28e3;

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "A lever in vacuum, with a line on its flank",
        params: "window = \"none\"",
        inputs: || Ok(Ports::new().with(&DENSITY, density())),
        expect: |outputs| {
            let summary = &outputs.get(&SUMMARY).map_err(|error| error.to_string())?.0;
            let number = |pointer: &str| summary.pointer(pointer).and_then(|value| value.as_f64()).unwrap_or(f64::NAN);
            let (f, q) = (number("/frequency/value"), number("/quality_factor/value"));
            // the ripple averages out over its period of 7 bins: a hundredth of what chance would do
            let off =
                ((f - FREQUENCY_HZ) / number("/frequency/std"), (q - QUALITY_FACTOR) / number("/quality_factor/std"));
            if off.0.abs() < 0.5 && off.1.abs() < 0.5 && number("/lines") == 1.0 {
                Ok(format!("f0 = {f:.2} +- {:.2} Hz, one line set aside.", number("/frequency/std")))
            } else {
                Err(format!("f0 {f}, Q {q}, {off:?}, lines {}", summary["lines"]))
            }
        },
    }]
}

/// 32 averages of a resonance of 2.5 Hz over a floor, bins of 0.25 Hz, rippled by an average's 1 / sqrt(32).
fn density() -> Array {
    let frequency: Vec<f64> = (0..2000).map(|k| 69_750.0 + 0.25 * f64::from(k)).collect();
    let at = |(k, f): (usize, &f64)| {
        let (f0, q) = (FREQUENCY_HZ, QUALITY_FACTOR);
        let peak = 1e-3 * f0.powi(3) / q / ((f0 * f0 - f * f).powi(2) + (f * f0 / q).powi(2));
        let ripple = (2.0 / 32.0_f64).sqrt() * (std::f64::consts::TAU * k as f64 / 7.0).sin();
        (peak + 1e-8) * (1.0 + ripple) + if k == 1100 { 1e-5 } else { 0.0 }
    };
    let density: Vec<f64> = frequency.iter().enumerate().map(at).collect();
    Array::over(vec![Axis::new("frequency_hz", "Hz", "frequency", frequency)])
        .with("density", "V^2/Hz", "density", &["frequency_hz"], density)
        .attribute("averages", 32.0)
}
