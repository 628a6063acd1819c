//! Examples of the stages, on one resonance in closed form.

use std::f64::consts::TAU;

use afmid_pipeline::{Array, Context, Example, Ports, Stage, StageError};
use rustfft::num_complex::Complex64;

use super::etfe::{ETFE, Etfe};
use super::periodogram::PERIODOGRAM;
use super::smoothing::SMOOTHED;
use super::window::{PAIR, WINDOWED, Window};
use crate::artifacts::DataSet;
use crate::ensemble::example::{FREQUENCY_HZ, LOAD_V, QUALITY_FACTOR, SAMPLE_RATE_HZ, T0, pair_of, release};
use afmid_kernels::signal::Taper;

const SAMPLES: usize = 4096;

pub(super) fn window() -> Vec<Example> {
    vec![Example {
        title: "A Tukey window tapers a tenth",
        params: "kind = \"tukey\"\nalpha = 0.1",
        inputs: || Ok(Ports::new().with(&PAIR, pair())),
        expect: |outputs| {
            let array = outputs.get(&WINDOWED).map_err(|error| error.to_string())?;
            let gain = array.number("coherent_gain").map_err(|error| error.to_string())?;
            // 1 - alpha / 2, but for the samples at the very ends
            if (gain - 0.95).abs() < 5e-4 {
                Ok(format!("Its coherent gain is {gain:.3}."))
            } else {
                Err(format!("coherent gain {gain}"))
            }
        },
    }]
}

pub(super) fn periodogram() -> Vec<Example> {
    vec![Example {
        title: "Where one resonance rings",
        params: "",
        inputs: || prepared(Taper::Tukey, false).map(|pair| Ports::new().with(&PAIR, pair)),
        expect: |outputs| {
            let array = outputs.get(&PERIODOGRAM).map_err(|error| error.to_string())?;
            let density = array.real("response").map_err(|error| error.to_string())?;
            let frequency = &array.axis("frequency_hz").map_err(|error| error.to_string())?.values;
            let peak = (20..density.len()).max_by(|&a, &b| density[a].total_cmp(&density[b])).unwrap_or(0);
            // one bin is 1.2 kHz, the peak 6 kHz wide
            if (frequency[peak] - FREQUENCY_HZ).abs() < 3e3 {
                Ok(format!("The response peaks at {:.1} kHz.", 1e-3 * frequency[peak]))
            } else {
                Err(format!("peak at {}", frequency[peak]))
            }
        },
    }]
}

pub(super) fn etfe() -> Vec<Example> {
    vec![Example {
        title: "One resonance from its release",
        params: "bandwidth_hz = 400e3",
        inputs: || prepared(Taper::Rectangular, true).map(|pair| Ports::new().with(&PAIR, pair)),
        expect: |outputs| {
            let worst = worst_error(outputs.get(&ETFE)).map_err(|error| error.to_string())?;
            // exp(-a t) at the end of the window is 1e-6; folding at 400 kHz is (f / (fs - f))^2 * 1.5 = 1 %
            if worst < 0.02 {
                Ok(format!("It agrees with the closed form to {:.4} %.", 100.0 * worst))
            } else {
                Err(format!("worst relative error {worst}"))
            }
        },
    }]
}

pub(super) fn smoothing() -> Vec<Example> {
    vec![
        Example {
            title: "A local rational keeps the resonance",
            params: "half_width_bins = 10",
            inputs: smoothing_inputs,
            expect: |outputs| peak_kept(outputs, 1e-3),
        },
        Example {
            title: "So does a parabola that narrows itself, without the line at 240 kHz",
            params: "method = \"local-polynomial\"\nlines = [{ frequency_hz = 240e3, half_width_hz = 3e3 }]",
            inputs: smoothing_inputs,
            expect: |outputs| peak_kept(outputs, 0.02),
        },
    ]
}

fn peak_kept(outputs: &Ports, limit: f64) -> Result<String, String> {
    let array = outputs.get(&SMOOTHED).map_err(|error| error.to_string())?;
    let transfer = array.complex("transfer").map_err(|error| error.to_string())?;
    let bin = (FREQUENCY_HZ / SAMPLE_RATE_HZ * SAMPLES as f64).round();
    let truth = lever(bin * SAMPLE_RATE_HZ / SAMPLES as f64).norm();
    let change = transfer.get(bin as usize).map_or(f64::NAN, |g| g.norm() / truth - 1.0);
    if change.abs() < limit {
        Ok(format!("The peak is kept to {:.4} %.", 100.0 * change.abs()))
    } else {
        Err(format!("the peak changed by {change}"))
    }
}

fn smoothing_inputs() -> Result<Ports, StageError> {
    let windowed = prepared(Taper::Rectangular, true)?;
    Etfe { bandwidth_hz: 400e3, ..Etfe::default() }.run(&Ports::new().with(&PAIR, windowed), &Context::alone(0))
}

fn prepared(kind: Taper, differenced: bool) -> Result<Array, StageError> {
    let window = Window { kind, differenced, ..Window::default() };
    Ok(window.run(&Ports::new().with(&PAIR, pair()), &Context::alone(0))?.get(&WINDOWED)?.clone())
}

/// The transfer function of the examples.
fn lever(frequency_hz: f64) -> Complex64 {
    let (s, w) = (Complex64::new(0.0, TAU * frequency_hz), TAU * FREQUENCY_HZ);
    w * w / (s * s + s * (w / QUALITY_FACTOR) + w * w)
}

fn worst_error(etfe: Result<&Array, StageError>) -> Result<f64, StageError> {
    let etfe = etfe?;
    let frequency = &etfe.axis("frequency_hz")?.values;
    let defined = frequency.iter().zip(etfe.complex("transfer")?).filter(|(_, g)| g.re.is_finite());
    Ok(defined.map(|(f, g)| (g - lever(*f)).norm() / lever(*f).norm()).fold(0.0, f64::max))
}

/// A release and its force, free of noise.
fn pair() -> Array {
    pair_of(&release(SAMPLES, T0, LOAD_V), Some(1e-4), &[DataSet::All])
}
