//! The example of `diagnosis.causes` under an input: an oscillator with a cubic spring.

use afmid_pipeline::{Array, Axis, Document, Example, Port, Ports};

const SUMMARY: Port<Document> = Port::new("summary", "summary", "the verdict");
const PAIR: Port<Array> = Port::new("pair", "pair", "input and output");
/// Relative change of the stiffness per square of the output.
const STIFFENING: f64 = 0.3;
const SAMPLES: usize = 2048;
const RATE_HZ: f64 = 1000.0;

pub(super) fn example() -> Example {
    Example {
        title: "an oscillator of 80 Hz whose stiffness grows by 0.3 per square volt",
        params: "",
        inputs: || Ok(Ports::new().with(&PAIR, pair())),
        expect: |outputs| {
            let text = |error: afmid_pipeline::StageError| error.to_string();
            let found = &outputs.get(&SUMMARY).map_err(text)?.0;
            let cause = &found["causes"][0];
            let k3 = &cause["parameters"]["k3"];
            let (value, std) = (k3["value"].as_f64().unwrap_or(f64::NAN), k3["std"].as_f64().unwrap_or(f64::NAN));
            // four standard errors
            if found["verdict"] == "named" && cause["id"] == "duffing" && (value - STIFFENING).abs() < 4.0 * std {
                Ok(format!("named: duffing, k3 = {value:.3} +- {std:.3} 1/V^2."))
            } else {
                Err(found.to_string())
            }
        },
    }
}

/// The oscillator under a held sum of sines in a little noise, by explicit Euler steps so short that their error is far
/// below the noise.
fn pair() -> Array {
    const STEPS: usize = 400;
    let omega = std::f64::consts::TAU * 80.0;
    let phase = |line: usize| (line * line) as f64 * 2.4;
    let input: Vec<f64> = (0..SAMPLES)
        .map(|k| (1..=40).map(|line| (0.0245 * line as f64 * k as f64 + phase(line)).sin()).sum::<f64>() * 0.03)
        .collect();
    let (mut q, mut v, mut state, mut output) = (0.0_f64, 0.0_f64, 12345_u32, Vec::with_capacity(SAMPLES));
    let step = 1.0 / RATE_HZ / STEPS as f64;
    for u in &input {
        // a linear congruential generator (Numerical Recipes); twelve of them make a normal deviate
        let mut draw = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state) / f64::from(u32::MAX)
        };
        output.push(q + 1e-3 * ((0..12).map(|_| draw()).sum::<f64>() - 6.0));
        for _ in 0..STEPS {
            let force = omega * omega * (u - q - STIFFENING * q * q * q) - 0.1 * omega * v;
            // rate first: the semi-implicit form keeps the energy
            v += step * force;
            q += step * v;
        }
    }
    let axis = |name: &str| {
        Axis::new(name, "s", "time since the first sample", (0..SAMPLES).map(|k| k as f64 / RATE_HZ).collect())
    };
    Array::over(vec![axis("time"), axis("time_identification"), axis("time_verification")])
        .with("response", "V", "output", &["time"], output.clone())
        .with("force", "V", "input", &["time"], input.clone())
        .with("response_identification", "V", "output", &["time_identification"], output.clone())
        .with("force_identification", "V", "input", &["time_identification"], input.clone())
        .with("response_verification", "V", "output", &["time_verification"], output)
        .with("force_verification", "V", "input", &["time_verification"], input)
        .attribute("sample_rate_hz", RATE_HZ)
        .attribute("t0_sample", 0_usize)
        .attribute("kind", "columns")
}
