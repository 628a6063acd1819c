//! Units as titles name them.

pub(super) use crate::frequency::rate_unit as hertz;
pub(super) use crate::time_units::seconds;

/// Names of units and their symbols. Oscilloscopes write `Second,Volt`.
const NAMES: [(&str, &str); 12] = [
    ("volt", "V"),
    ("second", "s"),
    ("sec", "s"),
    ("ampere", "A"),
    ("amp", "A"),
    ("newton", "N"),
    ("metre", "m"),
    ("meter", "m"),
    ("hertz", "Hz"),
    ("pascal", "Pa"),
    ("radian", "rad"),
    ("watt", "W"),
];

/// Symbols that take a prefix.
const PREFIXED: [&str; 18] =
    ["s", "V", "A", "N", "m", "Hz", "Pa", "W", "J", "K", "F", "H", "T", "C", "g", "rad", "Ω", "Ohm"];
/// Symbols that take none.
const PLAIN: [&str; 14] = ["min", "h", "%", "°", "deg", "°C", "bar", "dB", "degC", "in", "lbf", "mil", "div", "Vpp"];
const PREFIXES: [&str; 11] = ["G", "M", "k", "c", "m", "u", "µ", "μ", "n", "p", "f"];

/// The symbol of a unit that is given by its name or its symbol; none if it is no unit that is known.
pub(super) fn symbol(text: &str) -> Option<String> {
    let lower = text.to_lowercase();
    let singular = lower.strip_suffix('s').filter(|word| word.len() > 2).unwrap_or(&lower);
    if let Some((_, symbol)) = NAMES.iter().find(|(name, _)| *name == singular || *name == lower) {
        return Some((*symbol).to_owned());
    }
    let factors = text.split(['/', '*', '·', ' ']).map(|factor| factor.trim_end_matches(is_power));
    (!text.is_empty() && factors.into_iter().all(is_symbol)).then(|| text.to_owned())
}

fn is_power(c: char) -> bool {
    matches!(c, '^' | '-' | '²' | '³' | '2' | '3')
}

fn is_symbol(text: &str) -> bool {
    let prefixed = |prefix: &str| text.strip_prefix(prefix).is_some_and(|rest| PREFIXED.contains(&rest));
    PREFIXED.contains(&text) || PLAIN.contains(&text) || PREFIXES.iter().any(|prefix| prefixed(prefix))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_have_symbols() {
        for (text, wanted) in
            [("Volt", "V"), ("second", "s"), ("Amps", "A"), ("mV", "mV"), ("m/s²", "m/s²"), ("rad", "rad")]
        {
            assert_eq!(symbol(text).as_deref(), Some(wanted), "{text}");
        }
        for text in ["", "CH1", "TIME", "Sequence", "x", "V1"] {
            assert_eq!(symbol(text), None, "{text}");
        }
    }

    #[test]
    fn rates_and_times_have_units() {
        assert_eq!((hertz("kHz"), hertz("MSa/s"), hertz("V")), (Some(1e3), Some(1e6), None));
        assert_eq!((seconds("S"), seconds("ms"), seconds("V")), (Some(1.0), Some(1e-3), None));
    }
}
