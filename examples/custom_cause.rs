//! A cause of one's own, added to the catalogue: `cargo run --example custom_cause -- run examples/custom_cause.toml -o c.h5`,
//! then `cargo run --example custom_cause -- show c.h5 diagnosis`.
//!
//! A liquid neck holds on to the tip and pinches off. The simulator hides it, the diagnosis looks for it and names it, and `causes`, `exam` and
//! `simulate.model` know it like any built-in one: the program is afmid with one more cause.

use std::process::ExitCode;
use std::sync::Arc;

use afmid_stages::causes::{About, Cause, Domain, Effects, Identifiable, Parameter, Part, Scene, add};

/// A share of the load falls as the neck's radius does: `u = -F p (1 - t / T)^(2/3)`, and is gone at T.
struct NeckPinchOff;

const ABOUT: About = About {
    id: "neck-pinch-off",
    physics: "a liquid neck between tip and sample holds on after the solids have parted, thins by inertia and pinches off",
    part: Part::Force,
    domain: Domain::Release,
    parameters: &[
        Parameter {
            name: "fraction",
            unit: "1",
            meaning: "share of the load that the neck holds",
            low: -0.3,
            high: 0.3,
        },
        Parameter { name: "pinch_off_s", unit: "s", meaning: "when it pinches off", low: 2e-6, high: 5e-4 },
    ],
    class: &["neck-pinch-off"],
    resembles: "two-step-rupture: lets go at once; tether-tail: never quite lets go",
    next_measurement: "the same in dry nitrogen: the neck is gone",
    identifiable: Identifiable::Shape,
    source: "J. Eggers, E. Villermaux, Rep. Prog. Phys. 71 (2008) 036601, section 4: radius as the 2/3 power of the time left",
};

impl Cause for NeckPinchOff {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let (fraction, end) = (values[0], values[1]);
        effects.remaining_load.push(Arc::new(move |t| fraction * (1.0 - t / end).max(0.0).powf(2.0 / 3.0)));
    }

    fn trials(&self, scene: &Scene) -> Vec<Vec<f64>> {
        // fifths of a decade from twenty samples to an eighth of the window, no further apart than a third of the first mode's period: the pinch-off rings, and
        // beyond, one duration's ringing is another's with the opposite sign
        let (first, last) = (20.0 * scene.interval_s, scene.window_s / 8.0);
        let period = scene.frequency_hz.iter().copied().fold(f64::INFINITY, f64::min).recip();
        let further = |end: &f64| Some((end * 10f64.powf(0.2)).min(end + period.max(1e-3 * last) / 3.0));
        let durations = std::iter::successors(Some(first), further).take_while(|end| *end <= last);
        let within = ABOUT.parameters[1].low..=ABOUT.parameters[1].high;
        durations.filter(|end| within.contains(end)).map(|end| vec![0.01, end]).collect()
    }
}

fn main() -> ExitCode {
    if let Err(error) = add(&NeckPinchOff, 1) {
        eprintln!("{error}");
        return ExitCode::from(2);
    }
    match afmid::registry() {
        Ok(registry) => afmid::main(&registry),
        Err(double) => {
            eprintln!("{double}");
            ExitCode::from(2)
        }
    }
}
