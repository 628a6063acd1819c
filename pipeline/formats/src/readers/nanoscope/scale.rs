//! CIAO parameters: `V [soft scale] (hard scale) hard value` and `S [internal name] "name"`.

use crate::text;

/// A value parameter.
#[derive(Debug, Default, PartialEq)]
pub(super) struct Value {
    /// Name of the parameter that leads on to what the user sees: `Sens. DeflSens`.
    pub(super) soft: Option<String>,
    /// Hard units per code, and the unit: 0.000375 and `V`.
    pub(super) hard: Option<(f64, String)>,
}

/// Reads a value parameter; none if it is none.
pub(super) fn value(line: &str) -> Option<Value> {
    let rest = line.trim().strip_prefix('V')?;
    let soft = between(rest, '[', ']').map(str::to_owned).filter(|s| !s.is_empty());
    let hard = between(rest, '(', ')').and_then(|inside| {
        let (number, unit) = inside.split_once(char::is_whitespace)?;
        let factor = text::number(number).filter(|&x| x != 0.0)?;
        Some((factor, unit.trim().strip_suffix("/LSB")?.trim().to_owned()))
    });
    Some(Value { soft, hard })
}

/// The internal and the user's name of a selection.
pub(super) fn selection(line: &str) -> (Option<&str>, Option<&str>) {
    let some = |s: Option<&'_ str>| s.map(str::len).is_some_and(|n| n > 0);
    let (internal, shown) = (between(line, '[', ']'), between(line, '"', '"'));
    (internal.filter(|_| some(internal)), shown.filter(|_| some(shown)))
}

fn between(text: &str, open: char, close: char) -> Option<&str> {
    let (_, rest) = text.split_once(open)?;
    // a hard scale's unit may hold parentheses itself: `(0.1 log(Pa)/LSB)`
    let end =
        if close == ')' { rest.find("LSB)").map(|i| i + 3).or_else(|| rest.find(close)) } else { rest.find(close) };
    rest.get(..end?).map(str::trim)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn value_parameters_of_every_form_are_read() {
        let read = |line| value(line).map(|v| (v.soft.unwrap_or_default(), v.hard));
        let volt = |x| Some((x, "V".to_owned()));
        assert_eq!(
            read("V [Sens. DeflSens] (0.0003750000 V/LSB) 2.500000 V"),
            Some(("Sens. DeflSens".to_owned(), volt(0.000375)))
        );
        assert_eq!(read("V (0.1 V/LSB) 2 V"), Some((String::new(), volt(0.1))));
        assert_eq!(read("V 72.7 nm/V"), Some((String::new(), None)));
        assert_eq!(read("V [] (0.5 log(Pa)/LSB) 3 log(Pa)"), Some((String::new(), Some((0.5, "log(Pa)".to_owned())))));
        assert_eq!(read("V (zero V/LSB) 2 V"), Some((String::new(), None)));
        assert_eq!(read("S [Height] \"Height\""), None);
        assert_eq!(selection("S [ZSensor] \"Height Sensor\""), (Some("ZSensor"), Some("Height Sensor")));
        assert_eq!(selection("S [] \"\""), (None, None));
    }
}
