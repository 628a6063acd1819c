//! A cause of one's own, added to the catalogue:
//! `cargo run --example custom_cause -- run examples/custom_cause.toml -o c.h5`, then
//! `cargo run --example custom_cause -- show c.h5 diagnosis`.
//!
//! The segments of a split photodiode are amplified unequally. The simulator hides it, the diagnosis looks for it and
//! names it, and `causes`, `exam` and `simulate.model` know it like any built-in one: the program is afmid with one
//! more cause.

use afmid_stages::causes::{About, Cause, Effects, Identifiable, Need, Parameter, Part, Passage, Scene, add};
use std::process::ExitCode;

/// The signal has another slope on either side of the spot's centre: `y = v + a |v|`.
struct UnequalSegments;

const ABOUT: About = About {
    id: "unequal-segments",
    physics: "the amplifiers of the photodiode's two segments differ in gain, so that the slope changes where the spot \
        crosses their gap",
    part: Part::Detector,
    needs: &[Need::Release],
    parameters: &[Parameter {
        name: "asymmetry",
        unit: "1",
        meaning: "half the difference of the slopes, over their mean",
        low: -0.3,
        high: 0.3,
    }],
    class: &["unequal-segments"],
    resembles: "quadratic-detector: bends everywhere and not at one place; large events tell the two apart",
    next_measurement: "move the photodiode: the bend moves with the spot's centre",
    identifiable: Identifiable::Shape,
    source: "any amplifier's data sheet on gain error; `afmid causes output-absolute` for general systems",
};

impl Cause for UnequalSegments {
    fn about(&self) -> &About {
        &ABOUT
    }

    fn add(&self, values: &[f64], effects: &mut Effects) {
        let asymmetry = values[0];
        effects.optics.push(Passage::map(move |v| v + asymmetry * v.abs()));
    }

    fn trials(&self, _scene: &Scene) -> Vec<Vec<f64>> {
        // its effect is in proportion to its strength: one trial says all
        vec![vec![0.01]]
    }
}

fn main() -> ExitCode {
    if let Err(error) = add(&UnequalSegments, 1) {
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
