//! The example of `model.harmonics`.

use afmid_pipeline::{Example, Ports, Recording, StageError};

use super::harmonics::{RECORDS, SUMMARY};
use crate::events::decay_example::{MODE, record};

pub(super) fn examples() -> Vec<Example> {
    vec![Example {
        title: "A hum of 60 Hz, seen by two sensors",
        params: "harmonics = 3",
        inputs: || Ok(Ports::new().with(&RECORDS, Recording { records: vec![record("hum", false)?] })),
        expect: |outputs| {
            let text = |error: StageError| error.to_string();
            let summary = &outputs.get(&SUMMARY).map_err(text)?.0;
            let number =
                |channel: usize, name: &str| summary["oscillations"][channel][name].as_f64().unwrap_or(f64::NAN);
            // four standard errors; the second sensor sees half of it
            let right = (0..2).all(|channel| {
                let off = (number(channel, "frequency_hz") - MODE.0) / number(channel, "frequency_std_hz");
                let size = (number(channel, "amplitude") - [1.0, 0.5][channel]) / number(channel, "amplitude_std");
                off.abs() < 4.0 && size.abs() < 4.0
            });
            let (frequency, std) = (number(0, "frequency_hz"), number(0, "frequency_std_hz"));
            match right {
                true => Ok(format!("{frequency:.5} Hz, known to {std:.1e} Hz.")),
                false => Err(format!("{summary}")),
            }
        },
    }]
}
