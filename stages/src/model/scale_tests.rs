//! Poles and damping of a measured record do not depend on units, offsets, or what was recorded before.

use afmid_pipeline::{Array, Axis, Context, Document, Port, Ports, Stage, StateSpace, Table};

use super::order::Order;
use super::{FrfModeFit, GreyEstimate, Modes, Pem, RingdownFit, SubspaceEstimate};
use crate::artifacts::RateError;
use crate::fixture::white_noise;
use crate::spectrum::MeasuredFrf;

const RATE: f64 = 1000.0;
const MODEL: Port<StateSpace> = Port::new("model", "model", "");
const PAIR: Port<Array> = Port::new("pair", "pair", "");
const FRF: Port<Array> = Port::new("frf", "frf", "");
const MODES: Port<Table> = Port::new("modes", "modes", "");
const SUMMARY: Port<Document> = Port::new("summary", "summary", "");

/// Input and output of a mode at 61 Hz with Q = 25, both at rest for `rest` samples first.
fn record(samples: usize, rest: usize) -> [Vec<f64>; 2] {
    let turn = std::f64::consts::TAU * 61.0 / RATE;
    let (fall, damped) = ((-0.5 * turn / 25.0).exp(), turn * (1.0 - 0.25 / 625.0_f64).sqrt());
    let drive = white_noise(samples, 1.0, 5);
    // the same noise beside the same motion
    let noise = [white_noise(rest, 0.02, 7), white_noise(samples, 0.02, 6)].concat();
    let input: Vec<f64> = (0..samples + rest).map(|k| if k < rest { 0.0 } else { drive[k - rest] }).collect();
    let mut y = vec![0.0; samples + rest];
    for k in 2..y.len() {
        y[k] = 2.0 * fall * damped.cos() * y[k - 1] - fall * fall * y[k - 2] + input[k - 1];
    }
    let output = y.iter().zip(&noise).map(|(y, e)| y + e).collect();
    [input, output]
}

fn pair([input, output]: [Vec<f64>; 2]) -> Array {
    let time = (0..input.len()).map(|k| k as f64 / RATE).collect();
    Array::over(vec![Axis::new("time", "s", "time", time)])
        .with("response", "m", "", &["time"], output)
        .with("force", "N", "", &["time"], input)
        .attribute("sample_rate_hz", RATE)
        .attribute("t0_sample", 0_usize)
}

/// Frequency, its error, quality factor and its error of the only mode.
type Found = [f64; 4];

fn only(modes: &Table) -> Found {
    assert_eq!(modes.rows(), 1, "{:?}", modes.real("frequency_hz"));
    ["frequency_hz", "frequency_std_hz", "quality_factor", "quality_factor_std"]
        .map(|name| modes.real(name).unwrap()[0])
}

fn by_pem(pair: &Array) -> Found {
    let stage = Pem { order: Order::Fixed(2), ..Pem::default() };
    let fitted = stage.run(&Ports::new().with(&PAIR, pair.clone()), &Context::alone(0)).unwrap();
    by_model(fitted.get(&MODEL).unwrap().clone(), pair)
}

fn by_subspace(pair: &Array) -> Found {
    let stage = SubspaceEstimate { order: Order::Fixed(2), ..SubspaceEstimate::default() };
    let fitted = stage.run(&Ports::new().with(&PAIR, pair.clone()), &Context::alone(0)).unwrap();
    by_model(fitted.get(&MODEL).unwrap().clone(), pair)
}

fn by_model(model: StateSpace, pair: &Array) -> Found {
    let inputs = Ports::new().with(&MODEL, model).with(&PAIR, pair.clone());
    let found = Modes::default().run(&inputs, &Context::alone(0)).unwrap();
    assert!(found.get(&SUMMARY).unwrap().0["unexcited"].as_array().unwrap().is_empty());
    only(found.get(&MODES).unwrap())
}

fn by_responses(pair: &Array) -> Found {
    let blocks = MeasuredFrf { block_samples: Some(2048), ..MeasuredFrf::default() };
    let frf = blocks.run(&Ports::new().with(&PAIR, pair.clone()), &Context::alone(0)).unwrap();
    let inputs = Ports::new().with(&FRF, frf.get(&FRF).unwrap().clone());
    let fitted = FrfModeFit { max_modes: 2, ..FrfModeFit::default() }.run(&inputs, &Context::alone(0)).unwrap();
    only(fitted.get(&MODES).unwrap())
}

type Method = (&'static str, fn(&Array) -> Found);

const METHODS: [Method; 3] = [("pem", by_pem), ("subspace", by_subspace), ("responses", by_responses)];

#[test]
fn scales_of_input_and_output_change_no_pole() {
    let [input, output] = record(16_384, 0);
    for (name, method) in METHODS {
        let plain = method(&pair([input.clone(), output.clone()]));
        for (of_input, of_output) in [(1e-12, 1.0), (1e12, 1.0), (1.0, 1e-12), (1.0, 1e12), (1e-12, 1e12)] {
            let scaled = |values: &[f64], factor: f64| values.iter().map(|value| factor * value).collect::<Vec<f64>>();
            let found = method(&pair([scaled(&input, of_input), scaled(&output, of_output)]));
            for (a, b) in plain.iter().zip(&found) {
                // where a search ends depends on rounding: to a ten-thousandth of an error of 1 %
                assert!((a / b - 1.0).abs() < 1e-6, "{name}, {of_input} {of_output}: {plain:?} {found:?}");
            }
        }
    }
}

#[test]
fn offsets_and_what_was_before_the_onset_move_no_pole_beyond_its_error() {
    let [input, output] = record(16_384, 0);
    for (name, method) in METHODS {
        let [f, f_std, q, q_std] = method(&pair([input.clone(), output.clone()]));
        let offset = pair([
            input.iter().map(|u| u + 7.0).collect::<Vec<f64>>(),
            output.iter().map(|y| y - 300.0).collect::<Vec<f64>>(),
        ]);
        for (what, changed) in [("offset", offset), ("20 samples before", pair(record(16_384, 20)))] {
            let found = method(&changed);
            let far = ((found[0] - f) / f_std).abs().max(((found[2] - q) / q_std).abs());
            // of the same noise beside the same motion: what differs are an offset and twenty samples of sixteen thousand
            assert!(far < 0.5, "{name}, {what}: {f} {q}, {found:?}");
        }
        // the truth
        assert!((f - 61.0).abs() < 4.0 * f_std && (q - 25.0).abs() < 4.0 * q_std, "{name}: {f}({f_std}) {q}({q_std})");
    }
}

fn by_grey(pair: &Array) -> Found {
    let mut stage = GreyEstimate::default();
    (stage.fit.modes, stage.fit.real_poles) = (1, 0);
    let fitted = stage.run(&Ports::new().with(&PAIR, pair.clone()), &Context::alone(0)).unwrap();
    only(fitted.get(&MODES).unwrap())
}

fn by_ringdown(ensemble: &Array) -> Found {
    let mut stage = RingdownFit { modes: super::count::Count::Fixed(1), ..RingdownFit::default() };
    stage.fit.real_poles = 0;
    let inputs = Ports::new().with(&Port::<Array>::new("ensemble", "ensemble", ""), ensemble.clone());
    only(stage.run(&inputs, &Context::alone(0)).unwrap().get(&MODES).unwrap())
}

#[test]
fn the_error_of_the_rate_goes_into_that_of_frequencies_and_into_nothing_else() {
    let record = pair(record(4096, 0));
    let methods: [(Method, Array); 5] = [
        (("pem", by_pem), record.clone()),
        (("subspace", by_subspace), record.clone()),
        (("grey", by_grey), record.clone()),
        (("responses", by_responses), record),
        (("ringdown", by_ringdown), crate::ensemble::example::ensemble()),
    ];
    let relative_std = 1e-2;
    for ((name, by), known) in methods {
        let [f, std, quality, quality_std] = by(&known);
        let wider = by(&RateError { relative_std }.stated_by(known));
        // two numbers added in squares: rounding
        assert!((wider[1] / std.hypot(relative_std * f) - 1.0).abs() < 1e-9, "{name}: {wider:?}, {std}");
        assert_eq!([wider[0], wider[2], wider[3]], [f, quality, quality_std], "{name}");
        assert!(wider[1] > 2.0 * std, "{name}: {std} is not small beside {}", relative_std * f);
    }
}
