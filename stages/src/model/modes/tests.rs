use crate::fixture::{Lever, white_noise};

/// t0 one sample late turns mode 4 by 76 degrees: its share moves far beyond the error for a known t0, and within the
/// one that counts t0.
#[test]
fn static_shares_lie_within_errors_that_count_the_ambiguity_of_t0() {
    use crate::model::{Modes, Pem};
    use afmid_pipeline::{Array, Axis, Context, Port, Ports, Stage, StateSpace, Table};
    const MODEL: Port<StateSpace> = Port::new("model", "model", "");
    const MODES: Port<Table> = Port::new("modes", "modes", "");
    const PAIR: Port<Array> = Port::new("pair", "pair", "");
    let (samples, true_t0, lever) = (4096, 500usize, Lever::paper());
    // mode n is pole 2n; a release from a load of one rings by -R / p
    let truth: Vec<f64> = lever.step_residues().iter().step_by(2).take(4).map(|(_, r)| -2.0 * r.re).collect();
    let shares = |seed: u64, late: usize, ambiguity: Option<f64>| -> (Vec<f64>, Vec<f64>) {
        let t0 = true_t0 + late;
        let noise = white_noise(samples, 2e-4, seed);
        let response: Vec<f64> =
            lever.release(samples, true_t0 as f64, -0.9).iter().zip(noise).map(|(y, e)| y + e).collect();
        let force: Vec<f64> = (0..samples).map(|k| if k < t0 { -0.9 } else { 0.0 }).collect();
        let time = (0..samples).map(|k| (k as f64 - t0 as f64) / 5e6).collect();
        let mut pair = Array::over(vec![Axis::new("time", "s", "time", time)])
            .with("response", "V", "", &["time"], response)
            .with("force", "V", "", &["time"], force)
            .attribute("sample_rate_hz", 5e6)
            .attribute("t0_sample", t0);
        if let Some(ambiguity) = ambiguity {
            pair = pair.attribute("t0_ambiguity_s", ambiguity);
        }
        let fitted = Pem::default().run(&Ports::new().with(&PAIR, pair), &Context::alone(0)).unwrap();
        let model = fitted.get(&MODEL).unwrap().clone();
        let found = Modes::default().run(&Ports::new().with(&MODEL, model), &Context::alone(0)).unwrap();
        let modes = found.get(&MODES).unwrap();
        let column = |name: &str| modes.real(name).unwrap().to_vec();
        (column("static_share"), column("static_share_std"))
    };
    for seed in 1..=3 {
        let (known, known_std) = shares(seed, 1, None);
        let (found, std) = shares(seed, 1, Some(2e-7));
        assert_eq!((found.len(), &found), (4, &known), "the ambiguity changes no estimate");
        for n in 0..4 {
            // the true t0 lies at the interval's end, where the error is at most sqrt(3) of its rms to first order; 2
            // more for the noise
            assert!((found[n] - truth[n]).abs() < 4.0 * std[n], "{n}: {} +- {} {}", found[n], std[n], truth[n]);
        }
        let off = (known[3] - truth[3]).abs() / known_std[3];
        assert!(off > 10.0, "with a known t0 the error is far too small: {off}");
    }
}

/// A measured record of a second-order system of the given frequency in hertz and quality factor, at 100 Hz.
fn driven(frequency_hz: f64, quality_factor: f64, seed: u64) -> afmid_pipeline::Array {
    use afmid_pipeline::{Array, Axis};
    let turn = std::f64::consts::TAU * frequency_hz / 100.0;
    let fall = (-0.5 * turn / quality_factor).exp();
    let damped = turn * (1.0 - 0.25 / quality_factor.powi(2)).sqrt();
    let (input, noise) = (white_noise(4000, 1.0, seed), white_noise(4000, 0.05, seed + 1));
    let mut y = vec![0.0; 4000];
    for k in 2..4000 {
        y[k] = 2.0 * fall * damped.cos() * y[k - 1] - fall * fall * y[k - 2] + turn * turn * input[k - 1];
    }
    let output: Vec<f64> = y.iter().zip(noise).map(|(y, e)| y + 0.2 * turn * e).collect();
    let time = (0..4000).map(|k| f64::from(k) / 100.0).collect();
    Array::over(vec![Axis::new("time", "s", "time", time)])
        .with("response", "rad", "", &["time"], output)
        .with("force", "V", "", &["time"], input)
        .attribute("sample_rate_hz", 100.0)
        .attribute("t0_sample", 0_usize)
}

/// A propeller's pendulum has a quality factor of 2 or 3: no mode of a lever, and no detector either.
#[test]
fn what_oscillates_strongly_damped_is_listed_apart_with_its_error() {
    use crate::model::order::Order;
    use crate::model::{Modes, Pem};
    use afmid_pipeline::{Array, Context, Document, Port, Ports, Stage, StateSpace};
    const MODEL: Port<StateSpace> = Port::new("model", "model", "");
    const PAIR: Port<Array> = Port::new("pair", "pair", "");
    const SUMMARY: Port<Document> = Port::new("summary", "summary", "");
    for (seed, (frequency, quality)) in [(1.8, 2.6), (4.1, 1.2), (9.0, 3.9), (0.9, 4.4)].into_iter().enumerate() {
        let pair = driven(frequency, quality, 40 + 2 * seed as u64);
        let stage = Pem { order: Order::Fixed(2), ..Pem::default() };
        let fitted = stage.run(&Ports::new().with(&PAIR, pair.clone()), &Context::alone(0)).unwrap();
        let inputs = Ports::new().with(&MODEL, fitted.get(&MODEL).unwrap().clone()).with(&PAIR, pair);
        let found = Modes::default().run(&inputs, &Context::alone(0)).unwrap();
        let summary = &found.get(&SUMMARY).unwrap().0;
        assert!(summary["modes"].as_array().unwrap().is_empty(), "{summary}");
        let [damped] = &summary["damped"].as_array().unwrap()[..] else { panic!("{quality}: {summary}") };
        for (name, std, truth) in
            [("frequency_hz", "frequency_std_hz", frequency), ("quality_factor", "quality_factor_std", quality)]
        {
            let off = (damped[name].as_f64().unwrap() - truth) / damped[std].as_f64().unwrap();
            // eight numbers, of which none is beyond four errors but once in two thousand times
            assert!(off.abs() < 4.0, "{name} of {truth}: {damped}");
        }
    }
}
