//! The stage: its port in a chain with `model.modes`, knowledge, gaps and refusals through parameters.

use afmid_pipeline::{Array, Axis, Context, Ports, Stage, StateSpace};
use serde_json::Value;

use super::{GreyEstimate, MODEL, MODES, PAIR, PARAMETERS, START, SUMMARY};
use crate::fixture::{Lever, white_noise};
use crate::model::Modes;
use afmid_kernels::subspace::Subspace;

const RATE_HZ: f64 = 5e6;
const SAMPLES: usize = 6000;
const T0: usize = 800;

/// The paper's lever with its first two modes and one detector pole, released 0.4 samples after T0.
fn pair(seed: u64) -> Array {
    let lever = Lever {
        frequency_hz: vec![46.3e3, 247.4e3],
        quality_factor: vec![40.8, 193.2],
        static_share: vec![0.92, 0.08],
        detector_pole_hz: vec![0.6e6],
        ..Lever::paper()
    };
    let clean = lever.release(SAMPLES, T0 as f64 + 0.4, -0.9);
    let response: Vec<f64> = clean.iter().zip(white_noise(SAMPLES, 1e-3, seed)).map(|(y, n)| y + n).collect();
    let force: Vec<f64> = (0..SAMPLES).map(|k| if k < T0 { -0.9 } else { 0.0 }).collect();
    let time = (0..SAMPLES).map(|k| (k as f64 - T0 as f64) / RATE_HZ).collect();
    Array::over(vec![Axis::new("time", "s", "time since t0", time)])
        .with("response", "V", "response", &["time"], response)
        .with("force", "V", "force", &["time"], force)
        .attribute("sample_rate_hz", RATE_HZ)
        .attribute("t0_sample", T0)
        .attribute("kind", "snap-off")
}

const TWO: &str = "modes = 2\nfeedthrough = false\nhistory = \"settled\"\n";

fn run(params: &str, inputs: &Ports) -> Result<(Ports, Vec<String>), String> {
    let stage: GreyEstimate = afmid_pipeline::toml::from_str(params).map_err(|error| error.to_string())?;
    afmid_pipeline::stage::check(&stage).map_err(|error| error.to_string())?;
    let context = Context::alone(1);
    let outputs = stage.run(inputs, &context).map_err(|error| error.to_string())?;
    Ok((outputs, context.into_warnings()))
}

fn summary(outputs: &Ports) -> Value {
    outputs.get(&SUMMARY).unwrap().0.clone()
}

#[test]
fn a_release_gives_its_modes_its_delay_and_a_model_that_others_read() {
    let (outputs, warnings) = run(TWO, &Ports::new().with(&PAIR, pair(1))).unwrap();
    assert!(warnings.is_empty(), "{warnings:?}");
    let found = summary(&outputs);
    let delay = &found["delay_s"];
    // four standard errors of the truth
    let off = |value: &Value, std: &Value, truth: f64| (value.as_f64().unwrap() - truth) / std.as_f64().unwrap();
    assert!(off(&delay["value"], &delay["std"], 0.4 / RATE_HZ).abs() < 4.0, "{delay}");
    for (mode, (f, q, share)) in
        found["modes"].as_array().unwrap().iter().zip([(46.3e3, 40.8, 0.92), (247.4e3, 193.2, 0.08)])
    {
        assert!(off(&mode["frequency_hz"], &mode["frequency_std_hz"], f).abs() < 4.0, "{mode}");
        assert!(off(&mode["quality_factor"], &mode["quality_factor_std"], q).abs() < 4.0, "{mode}");
        assert!(off(&mode["static_share"], &mode["static_share_std"], share).abs() < 4.0, "{mode}");
    }
    let (simulated, fitted) = (&found["simulation_fit_percent"], &found["prediction_fit_percent"]);
    assert!((simulated.as_f64().unwrap() - fitted.as_f64().unwrap()).abs() < 0.01, "{found}");
    let model: &StateSpace = outputs.get(&MODEL).unwrap();
    let modes = Modes::default().run(&Ports::new().with(&MODEL, model.clone()), &Context::alone(1)).unwrap();
    let (theirs, ours) = (modes.get(&MODES).unwrap(), outputs.get(&MODES).unwrap());
    for column in ["frequency_hz", "frequency_std_hz", "quality_factor", "quality_factor_std"] {
        let (a, b) = (theirs.real(column).unwrap(), ours.real(column).unwrap());
        assert_eq!(a.len(), 2, "{column} {a:?}");
        // the covariance through the sections and back: differences of 1e-5
        a.iter().zip(b).for_each(|(a, b)| assert!((a / b - 1.0).abs() < 1e-4, "{column} {a} {b}"));
    }
    assert_eq!(outputs.get(&PARAMETERS).unwrap().real("value").unwrap().len(), 8);
    // a single release does not say what the force did between two samples
    let between = &found["input_between_samples"];
    assert_eq!((between["kind"].as_str(), between["chosen_by"].as_str()), (Some("held"), Some("data")), "{between}");
    assert!(between["over_held_in_2_log_likelihood"]["linear"].is_number(), "{between}");
    // its model is a start again
    let again = Ports::new().with(&PAIR, pair(1)).with(&START, model.clone());
    let (outputs, _) = run(TWO, &again).unwrap();
    let same = summary(&outputs)["modes"][0]["frequency_hz"].as_f64().unwrap();
    assert!((same / found["modes"][0]["frequency_hz"].as_f64().unwrap() - 1.0).abs() < 1e-7);
    assert!(Subspace::new(&[0.0; 8], &[0.0; 8], 60).is_err());
}

#[test]
fn gaps_bounds_and_late_events_are_reported() {
    let mut holed = pair(2);
    for variable in &mut holed.variables {
        if let (true, afmid_pipeline::Values::Real(values)) = (variable.name == "response", &mut variable.values) {
            values[1000..1050].fill(f64::NAN);
        }
    }
    let bounded = format!("{TWO}known = [{{ quantity = \"quality_factor\", mode = 1, between = [45.0, 60.0] }}]");
    let (outputs, warnings) = run(&bounded, &Ports::new().with(&PAIR, holed)).unwrap();
    let found = summary(&outputs);
    assert_eq!(found["samples"].as_u64().unwrap() - found["used_samples"].as_u64().unwrap(), 50);
    assert!(found["modes"][0]["quality_factor_std"].is_null());
    assert!(warnings.iter().any(|w| w.contains("quality_factor of mode 1 sits on a bound")), "{warnings:?}");
}

#[test]
fn parameters_that_cannot_be_are_refused() {
    for (params, part) in [
        ("modes = 0", "`modes` is 0"),
        ("block_rows = 10", "`block_rows` is 10, wanted 15"),
        ("start_modes = [[1e5, 20.0]]", "`start_modes` has 1, wanted 4"),
        ("modes = 1\nstart_modes = [[1e5, 0.3]]", "above 0.5"),
        ("known = [{ quantity = \"gain\", fixed = 1.0 }]", "wanted `mode`"),
        ("known = [{ quantity = \"delay_s\", mode = 1, fixed = 1e-6 }]", "does not go with"),
        ("known = [{ quantity = \"delay_s\" }]", "one of `fixed`"),
        ("delay = false\nknown = [{ quantity = \"delay_s\", fixed = 1e-6 }]", "not fitted"),
        ("known = [{ quantity = \"frequency_hz\", mode = 5, fixed = 1e5 }]", "not fitted"),
        ("known = [{ quantity = \"quality_factor\", mode = 1, fixed = 0.2 }]", "above 0.5"),
        ("before_s = -1.0", "`before_s`"),
    ] {
        let error = run(params, &Ports::new()).unwrap_err();
        assert!(error.contains(part), "{params}: {error}");
    }
}
