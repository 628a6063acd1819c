//! Titles and units of columns.

use super::number::bare;
use super::units;
use crate::time_units::time_name;
use std::collections::HashMap;

/// A column's title and unit.
#[derive(Debug, Clone, Default, PartialEq)]
pub(super) struct Title {
    pub(super) name: String,
    pub(super) unit: String,
}

/// Words that stand in a row of units for a column without one.
const NO_UNIT: [&str; 8] = ["sequence", "index", "sample", "samples", "points", "pts", "#", "-"];

/// Splits `Deflection (V)`, `Deflection [V]`, `"Weg" s_A1 / m` (CASSY), `C1 in V` (Rohde & Schwarz); otherwise the
/// title is the name.
pub(super) fn split_unit(text: &str) -> Title {
    let text = bare(text.trim().strip_prefix("DEF=").unwrap_or(text));
    for (open, close) in [('(', ')'), ('[', ']')] {
        if let Some((name, unit)) = text.strip_suffix(close).and_then(|t| t.rsplit_once(open)) {
            return Title {
                name: quoted(name).to_owned(),
                unit: units::symbol(unit).unwrap_or_else(|| unit.trim().to_owned()),
            };
        }
    }
    for mark in [" / ", " in "] {
        let split = text.rsplit_once(mark).map(|(name, unit)| (name, unit.trim()));
        if let Some((name, unit)) = split.and_then(|(name, unit)| Some((name, units::symbol(unit)?))) {
            return Title { name: quoted(name).to_owned(), unit };
        }
    }
    if let Some(time) = time_by_stroke(text) {
        return time;
    }
    // `in s` is a unit without a name
    if let Some(unit) = text.strip_prefix("in ").and_then(units::symbol) {
        return Title { name: String::new(), unit };
    }
    Title { name: text.to_owned(), unit: String::new() }
}

/// `t/s`: no blanks round the stroke, which others use for ratios.
fn time_by_stroke(text: &str) -> Option<Title> {
    let (name, unit) = text.split_once('/')?;
    let time = Title { name: name.to_owned(), unit: unit.to_owned() };
    (is_time(&time) && units::seconds(unit).is_some()).then_some(time)
}

/// The titles of one row. Beside `t/s` another stroke stands before a unit, too: `a/V`.
pub(super) fn of_row(fields: &[String]) -> Vec<Title> {
    let strokes = fields.iter().any(|field| time_by_stroke(bare(field)).is_some());
    let by_stroke = |title: &Title| {
        let (name, unit) = title.name.split_once('/').filter(|_| strokes && title.unit.is_empty())?;
        Some(Title { name: name.trim().to_owned(), unit: units::symbol(unit.trim())? })
    };
    let of = |field: &String| {
        let title = split_unit(field);
        by_stroke(&title).unwrap_or(title)
    };
    fields.iter().map(of).collect()
}

/// `"Weg" s_A1`: what is between the quotes, with the symbol left out; otherwise all of it.
fn quoted(name: &str) -> &str {
    let name = name.trim();
    name.strip_prefix('"').and_then(|rest| rest.split_once('"')).map_or(name, |(inside, _)| inside.trim())
}

/// Whether a row of fields names units only: all in brackets, or most of them units and the others short words.
pub(super) fn are_units(fields: &[String]) -> bool {
    let all: Vec<&str> = fields.iter().map(|f| bare(f)).filter(|f| !f.is_empty()).collect();
    let bracketed = |f: &&str| (f.starts_with('[') && f.ends_with(']')) || (f.starts_with('(') && f.ends_with(')'));
    let is_unit = |f: &&&str| units::symbol(f).is_some() || NO_UNIT.contains(&f.to_lowercase().as_str());
    let known = all.iter().filter(is_unit).count();
    let short = all.iter().all(|f| f.chars().count() <= 8 && !f.contains(' '));
    !all.is_empty() && (all.iter().all(bracketed) || (2 * known > all.len() && short))
}

/// The unit that a field of such a row names; empty for words that stand for none.
pub(super) fn unit_of(field: &str) -> String {
    // `(m/s²)(N)`: the units of output and input of a frequency response
    let whole = bare(field).trim();
    if let Some((over, under)) = whole.strip_prefix('(').and_then(|t| t.strip_suffix(')')?.split_once(")(")) {
        return crate::unit_ratio(over, under);
    }
    let text = bare(field).trim_matches(['(', ')', '[', ']']).trim();
    if NO_UNIT.contains(&text.to_lowercase().as_str()) {
        return String::new();
    }
    units::symbol(text).unwrap_or_else(|| text.to_owned())
}

/// Whether a title is that of time; with a word beside that may say which columns the times are for (`Time A`, `t_in`).
pub(super) fn time_of(title: &Title) -> Option<Option<String>> {
    if title.name.eq_ignore_ascii_case("x_value") {
        return Some(None);
    }
    let found = time_name(&title.name, true)?;
    // without a unit of time a word more makes it another quantity (`Time constant`, `T room`)
    let stated = found.seconds.is_some() || units::seconds(&title.unit).is_some() || title.unit.is_empty();
    (stated || found.label.is_none()).then_some(found.label)
}

/// Seconds in the unit that a title's name states: `time_ms`, `seconds_elapsed`.
pub(super) fn seconds_in_name(title: &Title) -> Option<f64> {
    time_name(&title.name, true)?.seconds
}

fn is_time(title: &Title) -> bool {
    time_of(title).is_some()
}

/// Whether a title is that of frequency.
pub(super) fn is_frequency(title: &Title) -> bool {
    let named = ["frequency", "freq", "frequenz"].contains(&title.name.trim().to_lowercase().as_str());
    named || units::hertz(&title.unit).is_some()
}

/// Locations: the title, `column_3` without one, `Title[2]` for the second of a title.
pub(super) fn locations(names: &[&str]) -> Vec<String> {
    let mut seen: HashMap<String, usize> = HashMap::new();
    let of = |(number, name): (usize, &&str)| {
        let name = if name.is_empty() { format!("column_{}", number + 1) } else { (*name).to_owned() };
        let times = seen.entry(name.clone()).and_modify(|n| *n += 1).or_insert(1);
        if *times == 1 { name } else { format!("{name}[{times}]") }
    };
    names.iter().enumerate().map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn units_are_split_from_titles() {
        let title = |name: &str, unit: &str| Title { name: name.to_owned(), unit: unit.to_owned() };
        assert_eq!(split_unit("Deflection (V)"), title("Deflection", "V"));
        assert_eq!(split_unit("\"Height [nm]\""), title("Height", "nm"));
        assert_eq!(split_unit("PressCo ABS. (MPa)"), title("PressCo ABS.", "MPa"));
        assert_eq!(split_unit("[V]"), title("", "V"));
        assert_eq!(split_unit("Plain"), title("Plain", ""));
        assert_eq!(split_unit("DEF=\"Zeit\" t / s"), title("Zeit", "s"));
        assert_eq!(split_unit("C1 in V"), title("C1", "V"));
        assert_eq!(split_unit("in / out"), title("in / out", ""));
        assert_eq!((split_unit("t/s"), split_unit("Time/ms")), (title("t", "s"), title("Time", "ms")));
        assert_eq!((split_unit("m/s"), split_unit("H1/N")), (title("m/s", ""), title("H1/N", "")));
        let row = |fields: [&str; 3]| of_row(&fields.map(str::to_owned));
        assert_eq!(row(["t/ms", "a/V", "b/m/s^2"]), [title("t", "ms"), title("a", "V"), title("b", "m/s^2")]);
        assert_eq!(row(["t/ms", "a/b", "H1 (1/N)"]), [title("t", "ms"), title("a/b", ""), title("H1", "1/N")]);
        assert_eq!(row(["t", "a/V", "b"]), [title("t", ""), title("a/V", ""), title("b", "")]);
    }

    #[test]
    fn locations_are_distinct() {
        assert_eq!(locations(&["a", "", "a"]), ["a", "column_2", "a[2]"]);
    }
}
