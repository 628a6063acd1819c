//! The example of `force.reconstruction`: releases of one resonance and its exact discrete model.

use afmid_pipeline::{Example, Matrix, Ports, StageError, StateSpace};

use super::reconstruction::{ENSEMBLE, FORCE, MODEL, SUMMARY};
use crate::ensemble::example::{FREQUENCY_HZ, LOAD_V, QUALITY_FACTOR, SAMPLE_RATE_HZ, T0, ensemble};

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "The force of two releases, in noise of a millivolt",
        params: "events = [0, 1]",
        inputs: || Ok(Ports::new().with(&ENSEMBLE, ensemble()).with(&MODEL, model()?)),
        expect: |outputs| {
            let array = outputs.get(&FORCE).map_err(|error| error.to_string())?;
            let force = array.real("force").map_err(|error| error.to_string())?;
            let band = array.real("standard_error").map_err(|error| error.to_string())?;
            let summary = &outputs.get(&SUMMARY).map_err(|error| error.to_string())?.0;
            let rise = summary.pointer("/rise_time/mean").and_then(|v| v.as_f64()).unwrap_or(f64::NAN);
            // zero after the release; before it the load times the event's amplitude, which scatters by a tenth
            let late = T0 + 100..4096;
            let within = late.clone().filter(|&k| force[k].abs() < 2.0 * band[k]).count() as f64 / late.len() as f64;
            if within > 0.85 && (force[T0 / 2] / LOAD_V - 1.0).abs() < 0.4 && rise < 1.5e-6 {
                Ok(format!(
                    "{:.0} % of the force after the release lies within two standard errors of zero; it rises in {:.2} us.",
                    100.0 * within,
                    1e6 * rise
                ))
            } else {
                Err(format!("{within} within the band, {} before, rise {rise}", force[T0 / 2]))
            }
        },
    }]
}

/// The resonance under a held force, exactly: `a` from the poles, `b` from two samples of its step response.
fn model() -> Result<StateSpace, StageError> {
    let w0 = std::f64::consts::TAU * FREQUENCY_HZ;
    let a = 0.5 * w0 / QUALITY_FACTOR;
    let w = (w0 * w0 - a * a).sqrt();
    let step = |k: f64| {
        let t = k / SAMPLE_RATE_HZ;
        1.0 - (-a * t).exp() * ((w * t).cos() + a / w * (w * t).sin())
    };
    let radius = (-a / SAMPLE_RATE_HZ).exp();
    let (a1, a2) = (-2.0 * radius * (w / SAMPLE_RATE_HZ).cos(), radius * radius);
    let b1 = step(1.0);
    let b2 = step(2.0) - b1 + a1 * b1;
    Ok(StateSpace {
        a: Matrix::new(2, 2, vec![-a1, 1.0, -a2, 0.0])?,
        b: Matrix::column(vec![b1, b2]),
        c: Matrix::row(vec![1.0, 0.0]),
        d: Matrix::row(vec![0.0]),
        k: Matrix::column(vec![0.0; 2]),
        x0: vec![0.0; 2],
        sample_time_s: 1.0 / SAMPLE_RATE_HZ,
        innovation_variance: 1e-6,
        ..StateSpace::default()
    })
}
