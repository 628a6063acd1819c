//! From aligned events to a smoothed transfer function, on the paper's lever in noise.

use afmid_pipeline::{Array, Axis, Context, Ports, Stage};
use rustfft::num_complex::Complex64;

use super::{Etfe, Smoothing, SmoothingMethod, Window};
use crate::artifacts::RateError;
use crate::ensemble::Average;
use crate::fixture::{Lever, white_noise};
use crate::force::Extrapolation;
use afmid_kernels::signal::Taper;

const SAMPLES: usize = 8192;
const ONSET: usize = 1024;
const EVENTS: usize = 16;
const NOISE_V: f64 = 1.2e-3;
const RATE_ERROR: RateError = RateError { relative_std: 1e-6 };
/// The release lies between two samples.
const T0: f64 = ONSET as f64 - 1.4;

/// Aligned releases: amplitudes scatter by a tenth, offsets by 4 mV, the load grows by 4.2 uV per sample.
fn ensemble(seed: u64) -> Array {
    let shape = Lever::paper().release(SAMPLES, T0, -0.9);
    let scatter = white_noise(EVENTS, 0.1, seed);
    let mut values = Vec::new();
    for (event, scatter) in scatter.iter().enumerate() {
        let noise = white_noise(SAMPLES, NOISE_V, seed * 100 + event as u64);
        let ramp = |k: usize| 4.2e-6 * (T0 - k as f64).max(0.0);
        values.extend((0..SAMPLES).map(|k| (1.0 + scatter) * shape[k] + ramp(k) + 0.04 * scatter + noise[k]));
    }
    let time = (0..SAMPLES).map(|k| (k as f64 - ONSET as f64) / 5e6).collect();
    Array::over(vec![
        Axis::new("event", "1", "event", (0..EVENTS).map(|k| k as f64).collect()),
        Axis::new("time", "s", "time", time),
    ])
    .with("signal", "V", "signal", &["event", "time"], values)
    .attribute("sample_rate_hz", 5e6)
    .attribute("onset_sample", ONSET)
    .attribute("kind", "snap-off")
}

/// Runs a stage on what is wired to it, under the names that its ports have.
fn run<S: Stage>(stage: &S, port: &str, input: &Array) -> Array {
    let mut inputs = Ports::new();
    inputs.insert(port, afmid_pipeline::Artifact::Array(std::sync::Arc::new(input.clone())));
    afmid_pipeline::stage::check(stage).unwrap();
    let outputs = stage.run(&inputs, &Context::alone(3)).unwrap();
    match outputs.artifact(S::SPEC.outputs[0].name) {
        Some(afmid_pipeline::Artifact::Array(array)) => array.as_ref().clone(),
        other => panic!("{other:?}"),
    }
}

fn chain(seed: u64, window: &Window, smoothing: &Smoothing) -> (Array, Array) {
    let average = run(&Average::default(), "ensemble", &RATE_ERROR.stated_by(ensemble(seed)));
    let pair = run(&Extrapolation::default(), "average", &average);
    let windowed = run(window, "pair", &pair);
    let etfe = run(&Etfe::default(), "pair", &windowed);
    let smoothed = run(smoothing, "etfe", &etfe);
    // how well the rate is known goes along
    [&pair, &smoothed].into_iter().for_each(|array| assert_eq!(RateError::of(array), RATE_ERROR));
    (pair, smoothed)
}

/// The closed form, released `delay` samples before the `t0` that was found.
fn truth(frequency_hz: f64, delay_samples: f64) -> Complex64 {
    let w = std::f64::consts::TAU * frequency_hz;
    let g = Lever::paper().transfer(faer::c64::new(0.0, w));
    Complex64::new(g.re, g.im) * Complex64::from_polar(1.0, -w * delay_samples / 5e6)
}

#[test]
fn differences_recover_the_lever_within_the_errors_that_they_state() {
    let window = Window { kind: Taper::Rectangular, differenced: true, ..Window::default() };
    for seed in 1..4 {
        let (pair, smooth) = chain(seed, &window, &Smoothing::default());
        let t0 = pair.number("t0_sample").unwrap();
        // latest causal sample: the response has not left its noise, 3e-4 of the load, for three samples at most
        assert!((T0 - 1.0..T0 + 3.0).contains(&t0), "{t0}");
        let ambiguity = pair.number("t0_ambiguity_s").unwrap();
        assert!(t0 - ambiguity * 5e6 < T0 + 0.5 && ambiguity < 1e-6, "{ambiguity:e}");
        let f = &smooth.axis("frequency_hz").unwrap().values;
        let (g, v) = (smooth.complex("transfer").unwrap(), smooth.real("variance").unwrap());
        let score = |from: usize, to: usize| {
            (from..to).map(|k| (g[k] - truth(f[k], T0 - t0)).norm_sqr() / v[k]).sum::<f64>() / (to - from) as f64
        };
        // neighbours share their data: 10 kHz to 1.1 MHz holds some 200 independent values; folding adds at
        // antiresonances
        let whole = score(16, 1800);
        assert!((0.7..1.4).contains(&whole), "seed {seed}: {whole}");
        for resonance in [46.3e3, 247.4e3, 580.8e3, 1051.2e3] {
            let k = (resonance / 5e6 * SAMPLES as f64).round() as usize;
            let error = (g[k] - truth(f[k], T0 - t0)).norm() / g[k].norm();
            // 4 sigma of the stated error, and 3e-4 for folding
            assert!(error < 4.0 * v[k].sqrt() / g[k].norm() + 3e-4, "seed {seed}, {resonance}: {error:e}");
        }
    }
}

#[test]
fn the_papers_window_and_polynomial_work_too() {
    let smoothing = Smoothing { method: SmoothingMethod::LocalPolynomial, ..Smoothing::default() };
    let (pair, smooth) = chain(5, &Window::default(), &smoothing);
    let t0 = pair.number("t0_sample").unwrap();
    let (f, g) = (&smooth.axis("frequency_hz").unwrap().values, smooth.complex("transfer").unwrap());
    // the window's own error at each resonance, see the kernel's test, and noise
    for (resonance, limit) in [(46.3e3, 0.02), (247.4e3, 0.01), (580.8e3, 0.01), (1051.2e3, 0.04)] {
        let k = (resonance / 5e6 * SAMPLES as f64).round() as usize;
        let error = (g[k] - truth(f[k], T0 - t0)).norm() / g[k].norm();
        assert!(error < limit, "{resonance}: {error:e}");
    }
}

#[test]
fn both_halves_are_there_for_the_parametric_fit() {
    let average = run(&Average::default(), "ensemble", &ensemble(9));
    let pair = run(&Extrapolation::default(), "average", &average);
    for suffix in ["", "_identification", "_verification"] {
        let force = pair.real(&format!("force{suffix}")).unwrap();
        let response = pair.real(&format!("response{suffix}")).unwrap();
        let error = pair.real(&format!("standard_error{suffix}")).unwrap();
        let t0 = pair.number("t0_sample").unwrap() as usize;
        assert!(force[t0 - 1] < -0.8 && force[t0] == 0.0);
        let count = pair.number(&format!("count{suffix}")).unwrap();
        assert_eq!(count, if suffix.is_empty() { 16.0 } else { 8.0 });
        // 8192 samples: 4 sigma of the mean variance is 2 %
        let level = (error.iter().map(|e| e * e).sum::<f64>() / error.len() as f64).sqrt();
        assert!((level / (NOISE_V / count.sqrt()) - 1.0).abs() < 0.02, "{suffix} {level:e}");
        assert!((response[0] - force[0]).abs() < 5.0 * level);
    }
    assert!(pair.real("force_newton").is_err());
}
