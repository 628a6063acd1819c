//! What names and units say of frequencies.

/// Names of arrays of frequencies that others may have, too, in lower case.
const PERHAPS_FREQUENCIES: [&str; 5] = ["f", "hz", "fvec", "faxis", "f_axis"];

/// Whether an array of this name holds frequencies if it is an axis.
pub(crate) fn perhaps_frequencies(name: &str) -> bool {
    PERHAPS_FREQUENCIES.contains(&name.to_lowercase().as_str())
}

/// Hertz in the unit of a frequency; none if it is no such unit. Small and capital letters are alike but for the prefix
/// that is milli or mega.
pub fn hertz(unit: &str) -> Option<f64> {
    Some(match unit.to_lowercase().as_str() {
        "hz" | "1/s" => 1.0,
        "khz" => 1e3,
        "mhz" if unit.starts_with('M') => 1e6,
        "mhz" if unit == "mHz" => 1e-3,
        "ghz" => 1e9,
        "rad/s" => std::f64::consts::TAU.recip(),
        _ => return None,
    })
}

/// Hertz in the unit of a rate; none if it is no unit of a rate. `Sa/s` is what oscilloscopes call samples per second.
pub(crate) fn rate_unit(unit: &str) -> Option<f64> {
    let lower = unit.trim().to_lowercase();
    if ["samples/min", "samples per minute", "1/min", "/min"].contains(&lower.as_str()) {
        return Some(1.0 / 60.0);
    }
    let base = ["hz", "sa/s", "s/s", "sps", "samples/sec", "samples/s", "samples per second", "1/s"];
    let prefix = base.iter().find_map(|name| lower.strip_suffix(name))?;
    Some(match prefix {
        "" => 1.0,
        "k" => 1e3,
        "m" => 1e6,
        "g" => 1e9,
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::hertz;

    #[test]
    fn milli_and_mega_are_two_prefixes() {
        assert_eq!((hertz("mHz"), hertz("MHz"), hertz("MHZ")), (Some(1e-3), Some(1e6), Some(1e6)));
        // which of both is meant, nobody knows
        assert_eq!(hertz("mhz"), None);
        assert_eq!((hertz("khz"), hertz("kHz"), hertz("HZ"), hertz("V")), (Some(1e3), Some(1e3), Some(1.0), None));
    }
}
