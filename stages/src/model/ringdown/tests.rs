//! The stage: gaps, knowledge, free stretches and the number of modes through parameters and ports.

use afmid_pipeline::recording::Raw;
use afmid_pipeline::{Array, Axis, Context, Ports, Recording, Stage};
use faer::c64;
use serde_json::Value;

use super::{ENSEMBLE, FREE, RingdownFit, SUMMARY};
use crate::fixture::{Lever, white_noise};
use crate::io::{memory_channel, memory_record};

const RATE_HZ: f64 = 5e6;
const WINDOW: usize = 4096;

/// White noise, wander and thermal motion of the paper's first two modes: sampled recursions in their stationary state.
fn noise(samples: usize, seed: u64) -> Vec<f64> {
    let white = white_noise(samples, 1.2e-3, seed);
    let kick = white_noise(5 * (samples + 1), 1.0, seed + 1_000_000);
    let lever = Lever::paper();
    let decay = (-4e3 / RATE_HZ).exp();
    let steps = [0, 2].map(|i| (lever.poles()[i] / RATE_HZ).exp());
    let std = [6e-4, 4e-4];
    let mut wander = 3e-4 * kick[0];
    let mut modes = [0, 1].map(|i| c64::new(std[i] * kick[1 + 2 * i], std[i] * kick[2 + 2 * i]));
    (0..samples)
        .map(|k| {
            let kick = &kick[5 * (k + 1)..5 * (k + 2)];
            let value = white[k] + wander + modes[0].re + modes[1].re;
            wander = decay * wander + 3e-4 * (1.0 - decay * decay).sqrt() * kick[0];
            for i in 0..2 {
                let rest = std[i] * (1.0 - steps[i].norm_sqr()).sqrt();
                modes[i] = steps[i] * modes[i] + c64::new(rest * kick[1 + 2 * i], rest * kick[2 + 2 * i]);
            }
            value
        })
        .collect()
}

fn ensemble(events: &[Vec<f64>]) -> Array {
    let time = (0..WINDOW).map(|k| k as f64 / RATE_HZ).collect();
    Array::over(vec![
        Axis::new("event", "1", "event", (0..events.len()).map(|k| k as f64).collect()),
        Axis::new("time", "s", "time after the onset", time),
    ])
    .with("signal", "V", "deflection signal", &["event", "time"], events.concat())
    .attribute("sample_rate_hz", RATE_HZ)
    .attribute("onset_sample", 0_usize)
    .attribute("kind", "snap-off")
}

fn event(seed: u64) -> Vec<f64> {
    let release = Lever::paper().release(WINDOW + 1, 0.3, -0.8);
    release[1..].iter().zip(noise(WINDOW, seed)).map(|(y, n)| y + n).collect()
}

fn run(params: &str, inputs: &Ports) -> Result<(Value, Vec<String>), String> {
    let stage: RingdownFit = afmid_pipeline::toml::from_str(params).map_err(|error| error.to_string())?;
    afmid_pipeline::stage::check(&stage).map_err(|error| error.to_string())?;
    let context = Context::alone(1);
    let outputs = stage.run(inputs, &context).map_err(|error| error.to_string())?;
    Ok((outputs.get(&SUMMARY).unwrap().0.clone(), context.into_warnings()))
}

#[test]
fn one_event_and_its_records_noise_give_errors_that_hold() {
    let truth = Lever::paper();
    let (mut z, mut alone, mut ratio) = (0.0, 0.0, 0.0);
    let seeds = 40;
    for seed in 0..seeds {
        let record = noise(200_000, 500 + seed);
        let channel = memory_channel("deflection", Raw::Float64(record), 1.0);
        let records = Recording { records: vec![memory_record("quiet.h5", RATE_HZ, vec![channel])] };
        let open = Ports::new().with(&ENSEMBLE, ensemble(&[event(seed)]));
        let wired = open.clone().with(&FREE, records);
        let mut squares = |ports: &Ports| {
            let (summary, _) = run("", ports).unwrap();
            ratio += summary["free_windows"].as_f64().unwrap();
            let modes = summary["modes"].as_array().unwrap();
            modes.iter().zip(truth.frequency_hz.iter().zip(&truth.quality_factor)).fold(0.0, |sum, (mode, (f, q))| {
                let score = |value: &str, std: &str, truth: f64| {
                    ((mode[value].as_f64().unwrap() - truth) / mode[std].as_f64().unwrap()).powi(2)
                };
                sum + score("frequency_hz", "frequency_std_hz", *f) + score("quality_factor", "quality_factor_std", *q)
            })
        };
        alone += squares(&open);
        z += squares(&wired);
    }
    let count = (8 * seeds) as f64;
    let (z, alone) = ((z / count).sqrt(), (alone / count).sqrt());
    println!("rms z with free stretches {z:.3}, without {alone:.3}; windows {:.1}", ratio / seeds as f64);
    // 200000 samples: some forty windows
    assert!(ratio / seeds as f64 > 20.0, "{ratio}");
    // 320 numbers: 4 %; four of these
    assert!((0.84..1.16).contains(&z), "{z} {alone}");
}

#[test]
fn samples_that_are_missing_say_nothing() {
    let mut events = vec![event(1), event(2)];
    let plain = run("noise = \"white\"", &Ports::new().with(&ENSEMBLE, ensemble(&events))).unwrap().0;
    assert_eq!(plain["missing_samples"], 0);
    events[0][700..720].fill(f64::NAN);
    events[1][100..120].fill(9.0);
    for event in &mut events {
        event[2000..2040].fill(-0.3);
    }
    let params = "noise = \"white\"\nmissing = [[2000, 2040]]\nrange_v = [-2.0, 9.0]";
    let holed = run(params, &Ports::new().with(&ENSEMBLE, ensemble(&events))).unwrap().0;
    assert_eq!(holed["missing_samples"], 20 + 20 + 80);
    for (a, b) in plain["modes"].as_array().unwrap().iter().zip(holed["modes"].as_array().unwrap()) {
        let (f, g, std) = (&a["frequency_hz"], &b["frequency_hz"], &b["frequency_std_hz"]);
        // 60 of 8192 samples moved it by a tenth of its error or so
        assert!((f.as_f64().unwrap() - g.as_f64().unwrap()).abs() < std.as_f64().unwrap(), "{a} {b}");
    }
}

#[test]
fn knowledge_holds_and_what_sits_on_a_bound_has_no_error() {
    let inputs = Ports::new().with(&ENSEMBLE, ensemble(&[event(1), event(2)]));
    let fixed = "noise = \"white\"\nknown = [{ mode = 2, quantity = \"quality_factor\", fixed = 193.2 }]";
    let (summary, _) = run(fixed, &inputs).unwrap();
    assert!((summary["modes"][1]["quality_factor"].as_f64().unwrap() - 193.2).abs() < 1e-9);
    assert_eq!(summary["modes"][1]["quality_factor_std"], 0.0);
    assert_eq!(summary["fixed"][0], "the quality factor of mode 2");
    let bound = "noise = \"white\"\nknown = [{ mode = 2, quantity = \"quality_factor\", between = [180.0, 185.0] }]";
    let (summary, warnings) = run(bound, &inputs).unwrap();
    assert!(summary["modes"][1]["quality_factor_std"].is_null(), "{summary}");
    assert!(
        warnings.iter().any(|warning| warning.contains("quality factor of mode 2 sits on a bound")),
        "{warnings:?}"
    );
}

#[test]
fn the_number_of_modes_is_found_and_reported() {
    let events: Vec<Vec<f64>> = (0..6).map(event).collect();
    let (summary, _) =
        run("modes = \"auto\"\nmax_modes = 6", &Ports::new().with(&ENSEMBLE, ensemble(&events))).unwrap();
    assert_eq!(summary["modes"].as_array().unwrap().len(), 4, "{summary}");
    let seen = summary["mode_numbers"].as_array().unwrap();
    assert!(seen.len() >= 4 && seen[3]["held_out_chi_square"].as_f64() < seen[2]["held_out_chi_square"].as_f64());
}

#[test]
fn parameters_that_cannot_be_are_refused() {
    let inputs = Ports::new();
    for (params, part) in [
        ("known = [{ mode = 5, quantity = \"frequency_hz\", fixed = 1e5 }]", "mode 5 of 4"),
        ("known = [{ mode = 1, quantity = \"frequency_hz\" }]", "one of `fixed`"),
        ("known = [{ quantity = \"frequency_hz\", fixed = 1e5 }]", "wanted `mode` beside"),
        ("known = [{ real_pole = 1, quantity = \"quality_factor\", fixed = 1.0 }]", "`real_pole` does not go with"),
        ("known = [{ mode = 1, quantity = \"quality_factor\", fixed = 0.3 }]", "above 0.5"),
        ("modes = \"auto\"\nknown = [{ mode = 1, quantity = \"quality_factor\", fixed = 9.0 }]", "auto"),
        ("missing = [[5, 5]]", "ascending"),
        ("range_v = [1.0, -1.0]", "least"),
        ("modes = 0", "`modes` is 0"),
        ("modes = \"many\"", "auto"),
    ] {
        let error = run(params, &inputs).unwrap_err();
        assert!(error.contains(part), "{params}: {error}");
    }
}
