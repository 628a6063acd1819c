//! What the unit of a response over a force says: its quantity, and the factor to SI.

use afmid_pipeline::StageError;

use super::Quantity;

/// What responses are, and how they become SI.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Understood {
    pub quantity: Quantity,
    /// The unit after `factor`: metres, metres per second or per second squared, per newton; else the one that is stated.
    pub unit: String,
    /// Factor on values.
    pub factor: f64,
    /// What was taken for granted.
    pub remark: Option<String>,
}

impl Understood {
    /// Of responses in a unit, which are of the quantity that is given, else of what the unit says. Errors: a quantity
    /// that contradicts the unit.
    pub fn new(given: Option<Quantity>, unit: &str) -> Result<Self, StageError> {
        let known = known(unit);
        let (quantity, factor) = match (given, known) {
            (Some(given), Some((stated, _))) if given != stated && given != Quantity::Transfer => {
                let (given, stated) = (given.name(), stated.name());
                return Err(StageError::new(format!("`quantity` is `{given}`, {unit} is the unit of a `{stated}`"))
                    .help("leave `quantity` out, or correct the unit"));
            }
            (given, Some((stated, factor))) => (given.unwrap_or(stated), factor),
            (given, None) => (given.unwrap_or_default(), 1.0),
        };
        let stated = if unit.is_empty() { "no unit is stated" } else { unit };
        let taken = given.is_none() && quantity == Quantity::Transfer;
        let remark = taken.then(|| {
            format!(
                "taken as a plain transfer ({stated}): give `quantity` if it is a receptance, mobility or accelerance"
            )
        });
        let unit = match known {
            Some((stated, factor)) if factor != 1.0 => si_unit(stated).to_owned(),
            _ => unit.to_owned(),
        };
        Ok(Self { quantity, unit, factor, remark })
    }
}

/// The quantity that a unit of output over force states: `m/N`, `(mm/s)/N`, `g/N`; none where it states no such.
pub fn quantity_of_unit(unit: &str) -> Option<Quantity> {
    known(unit).map(|(quantity, _)| quantity)
}

/// Metres of a unit of length, by its symbol or its name; none of any other unit.
pub fn length_m(unit: &str) -> Option<f64> {
    let named = unit.to_lowercase().replace("metre", "meter");
    let named = named.strip_suffix('s').unwrap_or(&named);
    let by_name = || WRITTEN_OUT.iter().find(|(name, _)| *name == named);
    LENGTHS.iter().find(|(name, _)| *name == unit).or_else(by_name).map(|(_, metres)| *metres)
}

/// The SI unit of a quantity.
fn si_unit(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::Receptance => "m/N",
        Quantity::Mobility => "(m/s)/N",
        Quantity::Accelerance => "(m/s^2)/N",
        Quantity::Transfer => "",
    }
}

/// Newtons of each unit of force; the longest name that fits counts.
const FORCES: [(&str, f64); 4] = [("/kN", 1e3), ("/mN", 1e-3), ("/uN", 1e-6), ("/N", 1.0)];
/// Metres of each unit of length; the longest name that fits counts.
const LENGTHS: [(&str, f64); 7] =
    [("mm", 1e-3), ("cm", 1e-2), ("um", 1e-6), ("\u{b5}m", 1e-6), ("\u{3bc}m", 1e-6), ("nm", 1e-9), ("m", 1.0)];
/// The same by names in the singular and small letters, and what has no prefix.
const WRITTEN_OUT: [(&str, f64); 8] = [
    ("\u{e5}", 1e-10),
    ("angstrom", 1e-10),
    ("picometer", 1e-12),
    ("nanometer", 1e-9),
    ("micrometer", 1e-6),
    ("micron", 1e-6),
    ("millimeter", 1e-3),
    ("meter", 1.0),
];
/// Standard acceleration of gravity, exact (CGPM 1901).
const GRAVITY_M_PER_S2: f64 = 9.806_65;

/// Quantity of a unit, and its factor to SI.
fn known(unit: &str) -> Option<(Quantity, f64)> {
    let bare: String = unit.chars().filter(|c| !matches!(c, '(' | ')' | ' ' | '^' | '\u{b7}' | '*')).collect();
    let (output, newtons) = FORCES.iter().find_map(|(name, newtons)| Some((bare.strip_suffix(name)?, newtons)))?;
    if output == "g" {
        return Some((Quantity::Accelerance, GRAVITY_M_PER_S2 / newtons));
    }
    let (rate, metres) = LENGTHS.iter().find_map(|(name, metres)| Some((output.strip_prefix(name)?, metres)))?;
    let quantity = match rate {
        "" => Quantity::Receptance,
        "/s" => Quantity::Mobility,
        "/s\u{b2}" | "/s2" | "/s/s" => Quantity::Accelerance,
        _ => return None,
    };
    Some((quantity, metres / newtons))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_of_responses_to_a_force_are_known_with_their_factors() {
        let of = |unit: &str| known(unit).unwrap_or_default();
        assert_eq!(of("m/N"), (Quantity::Receptance, 1.0));
        assert_eq!(of("\u{b5}m/N"), (Quantity::Receptance, 1e-6));
        assert_eq!(of("(mm/s)/N"), (Quantity::Mobility, 1e-3));
        assert_eq!(of("(m/s\u{b2})/N"), (Quantity::Accelerance, 1.0));
        assert_eq!(of("(m/s^2)/kN"), (Quantity::Accelerance, 1e-3));
        assert_eq!(of("g/N"), (Quantity::Accelerance, 9.806_65));
        assert_eq!(
            (length_m("nm"), length_m("m"), length_m("V"), length_m("m/s")),
            (Some(1e-9), Some(1.0), None, None)
        );
        // the letter and the sign of an angstrom
        let named = ["\u{c5}", "\u{212b}", "Angstrom", "nanometers", "Micrometre", "metres", "second", ""];
        let metres = [Some(1e-10), Some(1e-10), Some(1e-10), Some(1e-9), Some(1e-6), Some(1.0), None, None];
        assert_eq!(named.map(length_m), metres);
        for other in ["", "V/N", "m", "m/V", "N/m", "mol/N", "m/s^3/N"] {
            assert_eq!(known(other), None, "{other}");
        }
    }

    #[test]
    fn a_quantity_that_contradicts_the_unit_is_refused_and_what_is_not_known_is_said() {
        let read = Understood::new(None, "mm/N").unwrap();
        assert_eq!((read.quantity, read.unit.as_str(), read.factor), (Quantity::Receptance, "m/N", 1e-3));
        assert!(read.remark.is_none());
        let wrong = Understood::new(Some(Quantity::Mobility), "m/N").unwrap_err().to_string();
        assert!(wrong.contains("m/N is the unit of a `receptance`"), "{wrong}");
        let plain = Understood::new(None, "V").unwrap();
        assert!(plain.quantity == Quantity::Transfer && plain.remark.is_some_and(|remark| remark.contains("(V)")));
        let given = Understood::new(Some(Quantity::Mobility), "").unwrap();
        assert_eq!((given.quantity, given.factor, given.remark), (Quantity::Mobility, 1.0, None));
    }
}
