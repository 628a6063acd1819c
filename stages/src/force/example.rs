//! Examples of the stage.

use afmid_pipeline::{Array, Axis, Example, Ports, StageError};

use super::extrapolation::{AVERAGE, PAIR, SUMMARY};
use crate::artifacts::{AveragedSet, DataSet, empty_average};
use crate::ensemble::example::{LOAD_V, SAMPLE_RATE_HZ, T0, release};
use afmid_kernels::events::EventKind;

pub(super) fn examples() -> Vec<Example> {
    vec![
        Example {
            title: "The load at a rupture of -0.8 V",
            params: "guard_s = 4e-6",
            inputs: || Ok(Ports::new().with(&AVERAGE, average())),
            expect: |outputs| {
                let load = number(outputs, &["load", "value"])?;
                // Hann weights leave a millionth of the ringing in the line after
                if (load - LOAD_V).abs() < 1e-4 && number(outputs, &["t0_sample"])? == T0 as f64 {
                    Ok(format!("The load is {load:.4} V, t0 is found to the sample."))
                } else {
                    Err(format!("load {load}"))
                }
            },
        },
        Example {
            title: "In newtons, with stiffness and sensitivity",
            params: "guard_s = 4e-6\nstiffness_n_per_m = 3.8\nsensitivity_v_per_m = 1e7",
            inputs: || Ok(Ports::new().with(&AVERAGE, average())),
            expect: |outputs| {
                let force = number(outputs, &["force", "value"])?;
                let first = newtons(outputs).map_err(|error| error.to_string())?;
                // -0.8 V / 1e7 V/m * 3.8 N/m; the line is exact to 1e-4 V
                if (force + 304e-9).abs() < 0.1e-9 && (first + 304e-9).abs() < 0.1e-9 {
                    Ok(format!("The force at the rupture is {:.1} nN.", 1e9 * force))
                } else {
                    Err(format!("force {force}"))
                }
            },
        },
    ]
}

fn newtons(outputs: &Ports) -> Result<f64, StageError> {
    Ok(outputs.get(&PAIR)?.real("force_newton")?.first().copied().unwrap_or(f64::NAN))
}

fn number(outputs: &Ports, path: &[&str]) -> Result<f64, String> {
    let summary = outputs.get(&SUMMARY).map_err(|error| error.to_string())?;
    let found = path.iter().try_fold(&summary.0, |value, key| value.get(key));
    found.and_then(|value| value.as_f64()).ok_or_else(|| format!("no number {path:?}"))
}

/// A noise-free release with a stated standard error.
fn average() -> Array {
    let samples = 4096;
    let time = (0..samples).map(|k| (k as f64 - T0 as f64) / SAMPLE_RATE_HZ).collect();
    let axes = vec![Axis::new("time", "s", "time after the onset", time)];
    AveragedSet {
        set: DataSet::All,
        mean: release(samples, T0, LOAD_V),
        standard_error: vec![1e-4; samples],
        noise_variance: None,
        variance: None,
        count: 24,
        unit: "V",
    }
    .add(empty_average(axes, SAMPLE_RATE_HZ, T0 + 1, EventKind::SnapOff))
}
