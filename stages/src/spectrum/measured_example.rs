//! Examples of `spectrum.measured_frf`: a pole driven by a steady signal, by one that repeats itself, and by a hammer.

use std::f64::consts::TAU;
use std::path::Path;

use afmid_pipeline::stage::NoProgress;
use afmid_pipeline::{Array, Context, Example, Ports, Stage, StageError};
use num_complex::Complex64;

use super::MeasuredFrf;
use super::measured_frf::{BEFORE, PAIR, SUMMARY};
use crate::artifacts::{DataSet, Frf, NewPair, PairSet};
use crate::io::FRF;

const RATE: f64 = 1000.0;
const LABELS: [(&str, &str); 2] = [("velocity", "m/s"), ("force", "N")];

pub(super) fn examples() -> Vec<Example> {
    vec![
        Example {
            title: "a pole driven by a steady signal, noise on the output",
            params: "block_samples = 256",
            inputs: || Ok(Ports::new().with(&PAIR, steady())),
            expect: |outputs| near_truth(outputs, 0.0),
        },
        Example {
            title: "three hits, an exponential window whose rate is stated",
            params: "blocks = \"hits\"\nblock_samples = 600\nadded_decay_per_s = 5.0\nquantity = \"mobility\"\ndriving_point = 1",
            inputs: || Ok(Ports::new().with(&PAIR, struck())),
            expect: |outputs| near_truth(outputs, 5.0),
        },
        Example {
            title: "an input that repeats itself, whose period is found",
            params: "blocks = \"periods\"",
            inputs: || Ok(Ports::new().with(&PAIR, repeated())),
            expect: |outputs| near_truth(outputs, 0.0),
        },
        Example {
            title: "a second point joins the first",
            params: "point = \"tip\"",
            inputs: || Ok(Ports::new().with(&PAIR, steady()).with(&BEFORE, first_point()?)),
            expect: two_points,
        },
    ]
}

/// `y(k) = a y(k - 1) + u(k)`.
const POLE: f64 = 0.9;

fn response(frequency_hz: f64, added_decay_per_s: f64) -> Complex64 {
    let z = Complex64::from_polar((-added_decay_per_s / RATE).exp(), -TAU * frequency_hz / RATE);
    1.0 / (1.0 - POLE * z)
}

/// A linear congruential generator (Numerical Recipes): noise enough to excite.
pub(super) fn noise(samples: usize, mut state: u32) -> Vec<f64> {
    let mut next = || {
        state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        f64::from(state) / f64::from(u32::MAX) - 0.5
    };
    (0..samples).map(|_| next()).collect()
}

/// The pole's response to a force, with noise of this level; names and units of response and force.
pub(super) fn pair(force: Vec<f64>, level: f64, labels: [(&str, &str); 2]) -> Array {
    let mut response = vec![0.0; force.len()];
    for k in 0..force.len() {
        response[k] = force[k] + if k > 0 { POLE * response[k - 1] } else { 0.0 };
    }
    let added = noise(force.len(), 7);
    let response = response.iter().zip(added).map(|(y, e)| y + level * e + 0.2).collect();
    let set = PairSet {
        set: DataSet::All,
        dims: &["time"],
        response_dims: &["time"],
        response,
        force,
        standard_error: None,
        newtons_per_volt: None,
        labels,
    };
    let samples = set.force.len();
    set.add(NewPair { sample_rate_hz: RATE, t0_sample: 0, kind: "columns" }.samples(samples))
}

fn steady() -> Array {
    pair(noise(8192, 1), 0.5, LABELS)
}

/// Seven periods of 600 samples.
fn repeated() -> Array {
    let period = noise(600, 3);
    pair((0..4200).map(|k| period[k % 600]).collect(), 0.5, LABELS)
}

/// Two responses, of one record twice.
fn two_points(outputs: &Ports) -> Result<String, String> {
    let frf = outputs.get(&FRF).and_then(Frf::new).map_err(|error| error.to_string())?;
    let names: Vec<&str> = frf.responses.iter().map(|of| of.input.name.as_str()).collect();
    match names == ["root", "tip"] && frf.row(0) == frf.row(1) {
        true => Ok("a response of each point".to_owned()),
        false => Err(format!("the responses of {names:?} are not those of one record twice")),
    }
}

/// The responses of another point: of the same record.
fn first_point() -> Result<Array, StageError> {
    let stage = MeasuredFrf { block_samples: Some(256), point: Some("root".to_owned()), ..MeasuredFrf::default() };
    let outputs = stage.run(&Ports::new().with(&PAIR, steady()), &Context::new(Path::new("."), 1, &NoProgress))?;
    outputs.get(&FRF).cloned()
}

fn struck() -> Array {
    let pulse = |k: usize| match k % 700 {
        j @ 40..=45 => (std::f64::consts::PI * (j as f64 - 39.0) / 7.0).sin() * (1.0 + (k / 700) as f64),
        _ => 0.0,
    };
    pair((0..2100).map(pulse).collect(), 1e-3, LABELS)
}

fn near_truth(outputs: &Ports, added_decay_per_s: f64) -> Result<String, String> {
    let text = |error: StageError| error.to_string();
    let frf = Frf::new(outputs.get(&FRF).map_err(text)?).map_err(text)?;
    let Some(variance) = frf.row_variance(0) else { return Err("no variance".to_owned()) };
    let squares: f64 = frf
        .row(0)
        .iter()
        .zip(frf.frequency_hz)
        .zip(variance)
        .map(|((found, f), variance)| (found - response(*f, added_decay_per_s)).norm_sqr() / variance)
        .sum();
    let per_bin = squares / frf.frequency_hz.len() as f64;
    let summary = &outputs.get(&SUMMARY).map_err(text)?.0;
    let coherent = frf.coherence.is_some_and(|coherence| coherence.iter().all(|share| (0.0..=1.0).contains(share)));
    let known = coherent && frf.sample_rate_hz == Some(RATE) && frf.averages.is_some_and(|count| count >= 3.0);
    // few blocks have heavy tails: squares over their variance are 1 in the mean for many
    match known && per_bin < 4.0 && frf.added_decay_per_s == added_decay_per_s {
        true => Ok(format!("{} blocks; squared errors are {per_bin:.1} of the stated variance", summary["blocks"])),
        false => Err(format!("{per_bin} of the stated variance; {summary}")),
    }
}
