//! Sentences and units of the answer.

use super::balance::{ASYMMETRY, COULOMB, OFFSET, QUADRATIC};
use super::controller::{Coefficient, Controller};
use super::data::ClosedLoopUnits;

/// What a cause's number is called, and its unit.
pub(super) fn parameter(column: usize, units: &ClosedLoopUnits) -> (&'static str, String) {
    let ClosedLoopUnits { output, force, .. } = units;
    match column {
        COULOMB => ("friction_force", force.clone()),
        OFFSET => ("offset_force", force.clone()),
        QUADRATIC => ("quadratic_damping", format!("{force} s^2/{output}^2")),
        ASYMMETRY => ("viscous_difference", format!("{force} s/{output}")),
        _ => ("value", String::new()),
    }
}

/// Unit of the mass.
pub(super) fn mass_unit(units: &ClosedLoopUnits) -> String {
    match (units.force.as_str(), units.output.as_str()) {
        ("N", "m") => "kg".to_owned(),
        ("N m" | "Nm", "rad") => "kg m^2".to_owned(),
        (force, output) => format!("{force} s^2/{output}"),
    }
}

/// What would settle a cause.
pub(super) fn next_measurement(column: usize) -> &'static str {
    match column {
        COULOMB => "move back and forth at two slow constant speeds: dry friction takes the same force at both",
        OFFSET => "hold or move slowly at constant speed both ways: a constant force has the same sign in both",
        QUADRATIC => "move at twice the speed: this part of the force becomes four times as large",
        ASYMMETRY => {
            "move both ways at two constant speeds: the difference of the forces grows with the speed, that of a \
             constant force does not"
        }
        _ => "",
    }
}

fn list(coefficients: &[Coefficient], of: &str, first: usize) -> String {
    let one = |(i, c): (usize, &Coefficient)| match i + first {
        0 => format!("{:+.5e} {of}(k)", c.value),
        lag => format!("{:+.5e} {of}(k-{lag})", c.value),
    };
    coefficients.iter().enumerate().map(one).collect::<Vec<_>>().join(" ")
}

/// The feedback and its law.
pub(super) fn feedback(law: &Controller, extra: Option<&str>) -> Vec<String> {
    let mut lines = vec![format!(
        "the drive is fed back: reference r and output y predict it to {:.3} % of its deviation, without r {:.0} times \
         worse, without y {:.0} times",
        100.0 * law.residual_share,
        law.worse_without.0,
        law.worse_without.1
    )];
    let mut terms = vec![list(&law.reference, "r", 0), list(&law.output, "y", 0)];
    if !law.past.is_empty() {
        terms.push(list(&law.past, "u", 1));
    }
    if let (Some(gain), Some(name)) = (law.extra, extra) {
        terms.push(format!("{:+.5} {name}(k)", gain.value));
    }
    lines.push(format!("controller: u(k) = {}", terms.join(" ")));
    if let (Some(gain), Some(name)) = (law.extra, extra) {
        lines.push(format!("{name} is added to the drive with gain {:.4} +- {:.1e}", gain.value, gain.std));
    }
    let rest = law.at_rest;
    let all: f64 = law.reference.iter().map(|c| c.value).sum();
    if rest.value.abs() > 3.0 * rest.std && rest.value.abs() > 0.01 * all.abs() {
        lines.push(format!(
            "the law does not see the difference of reference and output alone: its gains at rest differ by {:.2} %",
            100.0 * rest.value / all
        ));
    }
    if let (None, None) = law.limits {
    } else {
        let side = |limit: Option<f64>| limit.map_or("none".to_owned(), |limit| format!("{limit:.4}"));
        lines.push(format!("the drive is limited: {} to {}", side(law.limits.0), side(law.limits.1)));
    }
    lines
}
