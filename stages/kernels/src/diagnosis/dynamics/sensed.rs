//! What a sensor senses of the motion.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// What of a mode's motion a channel shows.
///
/// In a linear motion the three differ by a phase; the forces of causes are in the acceleration at once, and in the
/// deflection only by what they move: an accelerometer's harmonics are those of the force.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Sensed {
    /// Deflection q.
    #[default]
    Deflection,
    /// Rate, as q' / w.
    Rate,
    /// Acceleration, as - q'' / w^2: where nothing drives and damps, the deflection.
    Acceleration,
}

/// Units of accelerations and of rates, as recorders write them; lower case, without spaces.
const ACCELERATIONS: [&str; 12] =
    ["m/s^2", "m/s2", "m/s²", "m/s**2", "ms^-2", "mm/s^2", "mm/s2", "mm/s²", "g", "gn", "mg", "m/(s^2)"];
const RATES: [&str; 8] = ["m/s", "mm/s", "um/s", "µm/s", "μm/s", "nm/s", "in/s", "ms^-1"];

impl Sensed {
    /// What a sensor senses whose channel has that unit; a deflection where the unit does not say.
    pub fn of_unit(unit: &str) -> Self {
        let plain: String = unit.chars().filter(|c| !c.is_whitespace()).collect::<String>().to_lowercase();
        let is = |units: &[&str]| units.contains(&plain.as_str());
        if is(&ACCELERATIONS) {
            Self::Acceleration
        } else if is(&RATES) {
            Self::Rate
        } else {
            Self::Deflection
        }
    }

    /// Weights of a section that is seen by itself: of deflection or acceleration, of the rate.
    pub(crate) fn weights(self) -> [f64; 2] {
        if self == Self::Rate { [0.0, 1.0] } else { [1.0, 0.0] }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_unit_says_what_is_sensed() {
        for (unit, sensed) in [
            ("m/s^2", Sensed::Acceleration),
            ("G", Sensed::Acceleration),
            ("mm / s", Sensed::Rate),
            ("V", Sensed::Deflection),
            ("um", Sensed::Deflection),
            ("", Sensed::Deflection),
        ] {
            assert_eq!(Sensed::of_unit(unit), sensed, "{unit}");
        }
    }
}
