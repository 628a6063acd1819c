//! The stage, on what the spectrum stages make, and read by `model.modes`.

use afmid_pipeline::{Array, Artifact, Axis, Context, Ports, Stage, StateSpace};

use crate::fixture::{Lever, white_noise};
use crate::model::{Modes, ResponseWeight, VectorFittingEstimate};
use crate::spectrum::{Etfe, Smoothing, Window};
use afmid_kernels::signal::Taper;
use afmid_kernels::spectra::Presence;
use afmid_kernels::vector_fitting::VectorFitting;

const SAMPLES: usize = 4096;
const T0: usize = 500;

/// A release of the paper's lever with its force.
fn pair(seed: u64, noise_v: f64) -> Array {
    let noise = white_noise(SAMPLES, noise_v, seed);
    let response: Vec<f64> =
        Lever::paper().release(SAMPLES, T0 as f64, -0.8).iter().zip(noise).map(|(y, e)| y + e).collect();
    let force: Vec<f64> = (0..SAMPLES).map(|k| if k < T0 { -0.8 } else { 0.0 }).collect();
    let time = (0..SAMPLES).map(|k| (k as f64 - T0 as f64) / 5e6).collect();
    Array::over(vec![Axis::new("time", "s", "time since t0", time)])
        .with("response", "V", "response", &["time"], response)
        .with("force", "V", "force", &["time"], force)
        .with("standard_error", "V", "standard error", &["time"], vec![noise_v; SAMPLES])
        .attribute("sample_rate_hz", 5e6)
        .attribute("t0_sample", T0)
        .attribute("kind", "snap-off")
}

/// Runs a stage on one input; its first output.
fn run<S: Stage>(stage: &S, port: &str, input: Artifact) -> Artifact {
    afmid_pipeline::stage::check(stage).unwrap();
    let mut inputs = Ports::new();
    inputs.insert(port, input);
    stage.run(&inputs, &Context::alone(3)).unwrap().artifact(S::SPEC.outputs[0].name).unwrap().clone()
}

fn etfe(seed: u64, noise_v: f64, differenced: bool, bandwidth_hz: f64) -> Artifact {
    let kind = if differenced { Taper::Rectangular } else { Taper::Tukey };
    let window = Window { kind, differenced, ..Window::default() };
    let windowed = run(&window, "pair", Artifact::Array(std::sync::Arc::new(pair(seed, noise_v))));
    run(&Etfe { bandwidth_hz, ..Etfe::default() }, "pair", windowed)
}

/// Frequencies and quality factors with their errors, through `model.modes`.
fn modes(model: Artifact) -> Vec<(f64, f64)> {
    let Artifact::Table(table) = run(&Modes::default(), "model", model) else { panic!("modes are a table") };
    let column = |name: &str| table.real(name).unwrap().to_vec();
    let frequencies = column("frequency_hz").into_iter().zip(column("frequency_std_hz"));
    let qualities = column("quality_factor").into_iter().zip(column("quality_factor_std"));
    frequencies.zip(qualities).flat_map(|(f, q)| [f, q]).collect()
}

fn truth() -> Vec<f64> {
    let lever = Lever::paper();
    lever.frequency_hz.iter().zip(&lever.quality_factor).flat_map(|(f, q)| [*f, *q]).collect()
}

fn squares(found: &[(f64, f64)]) -> f64 {
    assert_eq!(found.len(), 8, "four modes: {found:?}");
    found.iter().zip(truth()).map(|((value, std), truth)| ((value - truth) / std).powi(2)).sum::<f64>() / 8.0
}

#[test]
fn modes_reads_the_model_of_a_noise_free_estimate() {
    let fit = VectorFittingEstimate::default();
    let model = run(&fit, "transfer", etfe(0, 0.0, true, 2.5e6));
    let Artifact::StateSpace(state_space) = &model else { panic!("a model") };
    let StateSpace { a, parameters, covariance, .. } = state_space.as_ref();
    assert_eq!((a.rows, parameters.len(), covariance.rows), (11, 23, 23));
    for ((found, _), truth) in modes(model.clone()).iter().zip(truth()) {
        // rounding, as in the kernel's test
        assert!((found / truth - 1.0).abs() < 1e-9, "{found} {truth}");
    }
}

#[test]
fn stated_errors_hold_for_raw_and_for_smoothed_estimates() {
    let (mut raw, mut smooth) = (0.0, 0.0);
    let seeds = 8;
    for seed in 1..=seeds {
        let estimate = etfe(seed, 1.3e-4, true, 2.5e6);
        raw += squares(&modes(run(&VectorFittingEstimate::default(), "transfer", estimate.clone()))) / seeds as f64;
        let smoothed = run(&Smoothing::default(), "etfe", estimate);
        let fit = run(&VectorFittingEstimate::default(), "transfer", smoothed);
        smooth += squares(&modes(fit)) / seeds as f64;
    }
    println!("mean squared score: raw {raw:.2}, smoothed {smooth:.2}");
    // 64 squares: standard error sqrt(2 / 64) = 0.18, four of them
    assert!((0.3..1.8).contains(&raw), "{raw}");
    // the correlation's factor is one number for all frequencies: half or twice the error
    assert!((0.2..4.0).contains(&smooth), "{smooth}");
}

#[test]
fn tapered_and_equally_weighted_estimates_are_taken_too() {
    let fit = VectorFittingEstimate {
        weight: ResponseWeight::Uniform,
        transient: Presence::Off,
        ..VectorFittingEstimate::default()
    };
    let model = run(&fit, "transfer", etfe(1, 1.3e-4, false, 1.2e6));
    let found = modes(model);
    // the taper damps the first mode by its own decay: 1.5 % of the peak, and of the quality factor some per cent
    let near = |f: f64| found.iter().any(|(value, _)| (value / f - 1.0).abs() < 1e-2);
    assert!(Lever::paper().frequency_hz.iter().take(3).all(|f| near(*f)), "{found:?}");
}

#[test]
fn parameters_out_of_range_are_refused() {
    let usual = VectorFittingEstimate::default;
    let of = |fit: VectorFitting| VectorFittingEstimate { fit, ..usual() };
    for wrong in [
        of(VectorFitting { order: 0, ..VectorFitting::default() }),
        of(VectorFitting { order: 41, ..VectorFitting::default() }),
        of(VectorFitting { modes: Some(6), ..VectorFitting::default() }),
        VectorFittingEstimate { min_frequency_hz: -1.0, ..usual() },
        VectorFittingEstimate { max_frequency_hz: Some(0.0), ..usual() },
        of(VectorFitting { iterations: 0, ..VectorFitting::default() }),
    ] {
        assert!(afmid_pipeline::stage::check(&wrong).is_err(), "{wrong:?}");
    }
    assert!(afmid_pipeline::stage::check(&usual()).is_ok());
}
