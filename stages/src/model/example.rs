//! Examples of the stages: known truth, as inputs.

use afmid_pipeline::{Array, Context, Document, Example, Port, Ports, Stage, StageError, StateSpace, Table};

use super::order::Order;
use super::pem::{self, Pem};
use super::{bootstrap, modes, stabilisation, vector_fitting, zeros};
use crate::artifacts::{DataSet, innovations};
use crate::ensemble::example::{
    FREQUENCY_HZ, LOAD_V, QUALITY_FACTOR, SAMPLE_RATE_HZ, T0, ensemble_of, pair_of, release,
};
use crate::spectrum::{Etfe, Window};
use afmid_kernels::signal::Taper;

pub(super) fn pem() -> Vec<Example> {
    vec![Example {
        title: "One resonance, released",
        params: "order = 2",
        inputs: || Ok(Ports::new().with(&pem::PAIR, pair())),
        // noise-free: rounding alone
        expect: |outputs| the_resonance(outputs, 1e-9, 1e-7),
    }]
}

pub(super) fn grey() -> Vec<Example> {
    vec![Example {
        title: "One resonance, released a third of a sample late",
        params: "modes = 1\nreal_poles = 0\nfeedthrough = false\ndrift = false",
        inputs: || {
            let pair = pair();
            let late = shifted(&pair)?;
            Ok(Ports::new().with(&pem::PAIR, late))
        },
        // noise-free: the search ends where the residual is rounding
        expect: |outputs| {
            let summary = outputs.get(&pem::SUMMARY).map_err(|error| error.to_string())?;
            let mode = &summary.0["modes"][0];
            let number = |value: &serde_json::Value| value.as_f64().unwrap_or(f64::NAN);
            let (f, q) = (number(&mode["frequency_hz"]), number(&mode["quality_factor"]));
            let delay = number(&summary.0["delay_s"]["value"]) * SAMPLE_RATE_HZ;
            if (f / FREQUENCY_HZ - 1.0).abs() < 1e-8
                && (q / QUALITY_FACTOR - 1.0).abs() < 1e-6
                && (delay - LATE).abs() < 1e-6
            {
                Ok(format!("The mode lies at {f:.1} Hz with Q = {q:.3}, {delay:.4} samples late."))
            } else {
                Err(format!("{f} Hz, Q = {q}, {delay} samples"))
            }
        },
    }]
}

/// Samples by which the example's event is late.
const LATE: f64 = 1.0 / 3.0;

/// The pair with an event that is [`LATE`].
fn shifted(pair: &Array) -> Result<Array, StageError> {
    let samples = pair.axis("time")?.values.len();
    let late = |k: usize| (k as f64 - T0 as f64 - LATE).max(0.0) / SAMPLE_RATE_HZ;
    let (w0, a) = (std::f64::consts::TAU * FREQUENCY_HZ, std::f64::consts::PI * FREQUENCY_HZ / QUALITY_FACTOR);
    let w = (w0 * w0 - a * a).sqrt();
    let ringing = |t: f64| LOAD_V * (-a * t).exp() * ((w * t).cos() + a / w * (w * t).sin());
    let response: Vec<f64> = (0..samples).map(|k| ringing(late(k))).collect();
    Ok(pair_of(&response, None, &[DataSet::All]))
}

pub(super) fn subspace() -> Vec<Example> {
    vec![Example {
        title: "One resonance, released, without iteration",
        params: "order = 2",
        inputs: || Ok(Ports::new().with(&pem::PAIR, pair())),
        // noise-free: rounding, over a Hankel matrix of 60 rows
        expect: |outputs| the_resonance(outputs, 1e-8, 1e-6),
    }]
}

pub(super) fn era() -> Vec<Example> {
    vec![Example {
        title: "The free decay of one resonance",
        params: "order = 3\nblock_rows = 100",
        inputs: || Ok(Ports::new().with(&pem::PAIR, pair())),
        // the third pole takes what the decay's last tenth leaves of its rest
        expect: |outputs| the_resonance(outputs, 1e-8, 1e-6),
    }]
}

pub(super) fn vector_fitting() -> Vec<Example> {
    vec![Example {
        title: "One resonance, from its response",
        params: "order = 2",
        inputs: || Ok(Ports::new().with(&vector_fitting::TRANSFER, response()?)),
        // the response is exact but for rounding; the first pole may come after other pairs, of which order 2 has none
        expect: |outputs| the_resonance(outputs, 1e-9, 1e-7),
    }]
}

/// Transfer function of the release, by the estimate over its differences.
fn response() -> Result<Array, StageError> {
    let cx = Context::alone(0);
    let window = Window { kind: Taper::Rectangular, differenced: true, ..Window::default() };
    let windowed = window.run(&named("pair", pair()), &cx)?;
    let windowed = windowed.get(&Port::<Array>::new(Window::SPEC.outputs[0].name, "", ""))?.clone();
    let etfe = Etfe { bandwidth_hz: 0.5 * SAMPLE_RATE_HZ, ..Etfe::default() }.run(&named("pair", windowed), &cx)?;
    Ok(etfe.get(&Port::<Array>::new(Etfe::SPEC.outputs[0].name, "", ""))?.clone())
}

fn named(name: &'static str, array: Array) -> Ports {
    Ports::new().with(&Port::<Array>::new(name, "", ""), array)
}

pub(super) fn stabilisation() -> Vec<Example> {
    vec![Example {
        title: "One resonance stays, whatever the order",
        params: "to_order = 8\nblock_rows = 60\nmethod = \"release\"",
        inputs: || Ok(Ports::new().with(&pem::PAIR, pair())),
        expect: |outputs| {
            let modes = outputs.get(&stabilisation::MODES).map_err(|error| error.to_string())?;
            let summary = outputs.get(&stabilisation::SUMMARY).map_err(|error| error.to_string())?;
            let f = modes.real("frequency_hz").map_err(|error| error.to_string())?;
            // noise-free: rounding, as for `model.subspace`
            if f.len() == 1 && (f[0] / FREQUENCY_HZ - 1.0).abs() < 1e-6 {
                Ok(format!("One mode, at {:.1} Hz; the proposed order is {}.", f[0], summary.0["proposed_order"]))
            } else {
                Err(format!("{f:?} {}", summary.0))
            }
        },
    }]
}

pub(super) fn bootstrap() -> Vec<Example> {
    vec![Example {
        title: "The resonance of twelve noisy events",
        params: "replicates = 40",
        inputs: || {
            let pair = pair();
            let (clean, samples) = (release(2048, T0, LOAD_V), 2048);
            // a deterministic disturbance that no two events share; 1 mV
            let wiggle =
                |event: usize, k: usize| 1e-3 * ((k * k + 7 * event * k) as f64 * (0.37 + 0.11 * event as f64)).sin();
            let signal: Vec<f64> =
                (0..12 * samples).map(|i| clean[i % samples] + wiggle(i / samples, i % samples)).collect();
            let ensemble = ensemble_of(signal, 12, samples);
            Ok(Ports::new().with(&bootstrap::ENSEMBLE, ensemble).with(&pem::PAIR, pair).with(&pem::MODEL, model()?))
        },
        expect: |outputs| {
            let roots = outputs.get(&bootstrap::ROOTS).map_err(|error| error.to_string())?;
            let column = |name: &str| roots.real(name).map(|x| x.first().copied()).ok().flatten().unwrap_or(f64::NAN);
            let (f, low, high) = (column("frequency_hz"), column("frequency_low_hz"), column("frequency_high_hz"));
            // 1 mV over sqrt(12) against 0.9 V over 20 periods: some hertz; four half intervals
            if (f - FREQUENCY_HZ).abs() < 2.0 * (high - low) && high - low < 200.0 && low < high {
                Ok(format!("The pole lies between {low:.1} and {high:.1} Hz."))
            } else {
                Err(format!("{f} {low} {high}"))
            }
        },
    }]
}

/// Whether the model's first pair is the example's resonance.
fn the_resonance(outputs: &Ports, frequency_tolerance: f64, quality_tolerance: f64) -> Result<String, String> {
    let model = outputs.get(&pem::MODEL).map_err(|error| error.to_string())?;
    let (model, _) = innovations(model).map_err(|error| error.to_string())?;
    let Some(z) = model.sections.first().and_then(|section| section.poles().first().copied()) else {
        return Err("no pole".to_owned());
    };
    let s = z.ln() / model.sample_time_s;
    let (f, q) = (s.norm() / std::f64::consts::TAU, s.norm() / (-2.0 * s.re));
    if (f / FREQUENCY_HZ - 1.0).abs() < frequency_tolerance && (q / QUALITY_FACTOR - 1.0).abs() < quality_tolerance {
        Ok(format!("The pole lies at {f:.1} Hz with Q = {q:.3}."))
    } else {
        Err(format!("{f} Hz, Q = {q}"))
    }
}

pub(super) fn modes() -> Vec<Example> {
    vec![Example {
        title: "The mode of one resonance, beside a sweep",
        params: "reference_frequency_hz = [119.9e3]",
        inputs: || Ok(Ports::new().with(&pem::MODEL, model()?)),
        expect: |outputs| {
            let modes = outputs.get(&modes::MODES).map_err(|error| error.to_string())?;
            let f = modes.real("frequency_hz").map_err(|error| error.to_string())?;
            let summary: &Document = outputs.get(&modes::SUMMARY).map_err(|error| error.to_string())?;
            let difference = summary.0["reference"][0]["frequency_difference"].as_f64().unwrap_or(f64::NAN);
            // the example's resonance is exact; the sweep is off by 0.1 kHz in 119.9
            if f.len() == 1 && (f[0] / FREQUENCY_HZ - 1.0).abs() < 1e-9 && (difference - 0.1 / 119.9).abs() < 1e-8 {
                Ok(format!("One mode at {:.1} Hz, {:.2e} above the sweep.", f[0], difference))
            } else {
                Err(format!("{f:?} {difference}"))
            }
        },
    }]
}

pub(super) fn zeros() -> Vec<Example> {
    vec![Example {
        title: "A zero that stays while its pole moves",
        params: "",
        inputs: || {
            let free = roots(&[(50e3, "pole"), (137e3, "zero"), (270e3, "pole")], 50.0);
            let coupled = roots(&[(137.3e3, "zero"), (157e3, "pole"), (334e3, "pole")], 100.0);
            Ok(Ports::new().with(&zeros::FREE, free).with(&zeros::COUPLED, coupled))
        },
        expect: |outputs| {
            let column = |port: &Port<Table>, name: &str| -> Result<Vec<f64>, StageError> {
                Ok(outputs.get(port)?.real(name)?.to_vec())
            };
            let errors = column(&zeros::ZEROS, "combined_errors").map_err(|error| error.to_string())?;
            let shifts = column(&zeros::SHIFTS, "shift_hz").map_err(|error| error.to_string())?;
            // 300 Hz over sqrt(50^2 + 100^2) Hz
            if errors.len() == 1 && (errors[0] - 2.683).abs() < 1e-3 && (shifts[0] - 107e3).abs() < 1e-6 {
                Ok(format!("The zero differs by {:.2} combined errors, the first pole moves by 107 kHz.", errors[0]))
            } else {
                Err(format!("{errors:?} {shifts:?}"))
            }
        },
    }]
}

/// The release of one resonance, noise-free, as a pair with both halves.
fn pair() -> Array {
    pair_of(&release(2048, T0, LOAD_V), Some(1e-4), &DataSet::EACH)
}

fn model() -> Result<StateSpace, StageError> {
    let stage = Pem { order: Order::Fixed(2), ..Pem::default() };
    let outputs = stage.run(&Ports::new().with(&pem::PAIR, pair()), &Context::alone(0))?;
    Ok(outputs.get(&pem::MODEL)?.clone())
}

/// A table as `model.modes` makes it, with one standard error for all.
fn roots(rows: &[(f64, &str)], std_hz: f64) -> Table {
    let text =
        |value: &dyn Fn(&str) -> &'static str| rows.iter().map(|row| value(row.1).to_owned()).collect::<Vec<String>>();
    let number = |value: f64| vec![value; rows.len()];
    Table::new()
        .with("kind", "", "pole or zero", text(&|kind| if kind == "pole" { "pole" } else { "zero" }))
        .with("class", "", "class", text(&|kind| if kind == "pole" { "mechanical" } else { "pair" }))
        .with("frequency_hz", "Hz", "frequency", rows.iter().map(|row| row.0).collect::<Vec<f64>>())
        .with("frequency_std_hz", "Hz", "standard error", number(std_hz))
        .with("quality_factor", "1", "quality factor", number(100.0))
        .with("quality_factor_std", "1", "standard error", number(1.0))
}
