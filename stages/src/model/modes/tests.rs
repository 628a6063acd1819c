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
