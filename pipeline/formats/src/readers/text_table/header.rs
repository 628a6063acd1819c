//! Titles and units of a plain table's columns, from the lines above its first row.

use super::kind::Kind;
use super::number;
use super::sniff::Sniffed;
use super::stated::is_key;
use super::titles::{self, Title};

/// Titles and units from the header's lines.
pub(super) fn titles(lines: &[&str], sniffed: &Sniffed) -> Vec<Title> {
    // A line that says something of the whole table has no titles, wherever it stands.
    let said = || lines.iter().rev().filter(|l| !l.trim().is_empty());
    let above_units = said().nth(1).is_some_and(|line| announces_units(line));
    let candidates = said().filter(|l| !announces_units(l) && !is_key(first_field(l, sniffed)));
    let fitting = |line: &&str| fields(uncommented(line), sniffed).filter(|f| f.iter().any(|f| !f.trim().is_empty()));
    let mut rows = candidates.map_while(fitting);
    let Some(mut lowest) = rows.next() else { return vec![Title::default(); sniffed.kinds.len()] };
    for (field, kind) in lowest.iter_mut().zip(&sniffed.kinds) {
        // A number over a column of nothing: the value of the key above it.
        if *kind == Kind::Empty && Kind::of(field, sniffed.dialect.decimal) == Kind::Number {
            field.clear();
        }
    }
    let units_only = above_units || titles::are_units(&lowest);
    let names = rows.next().filter(|_| units_only);
    let of_row = titles::of_row(&lowest);
    let title = |(column, field): (usize, &String)| {
        let name = names.as_ref().map(|names| names.get(column).map_or("", |name| number::bare(name)));
        match name {
            Some(name) => Title { name: name.to_owned(), unit: titles::unit_of(field) },
            None if units_only => Title { name: number::bare(field).to_owned(), unit: titles::unit_of(field) },
            None => of_row.get(column).cloned().unwrap_or_default(),
        }
    };
    let mut found: Vec<Title> = lowest.iter().enumerate().map(title).collect();
    for (title, kind) in found.iter_mut().zip(&sniffed.kinds) {
        // `Start` over a column of nothing: the key of a number in the line below.
        if *kind == Kind::Empty && is_key(&title.name) {
            *title = Title::default();
        }
    }
    found
}

/// A header line's fields, without the mark of a comment.
pub(super) fn cells<'a>(line: &'a str, sniffed: &Sniffed) -> Vec<&'a str> {
    let line = uncommented(line);
    // Blanks set words apart, too: a line of them is one field.
    if sniffed.dialect.delimiter == ' ' { line.split('\t').collect() } else { sniffed.dialect.fields(line) }
}

/// Whether a line says that the next one has the units (SignalCalc: `Units:`).
fn announces_units(line: &str) -> bool {
    line.trim().trim_end_matches(':').eq_ignore_ascii_case("units")
}

fn uncommented(line: &str) -> &str {
    line.trim_start_matches(['#', '%', ' '])
}

fn first_field<'a>(line: &'a str, sniffed: &Sniffed) -> &'a str {
    cells(line, sniffed).first().copied().unwrap_or_default()
}

/// A line's fields, if they are as many as the columns.
fn fields(line: &str, sniffed: &Sniffed) -> Option<Vec<String>> {
    let owned = |fields: Vec<&str>| -> Vec<String> { fields.into_iter().map(str::to_owned).collect() };
    let tries = [
        owned(sniffed.dialect.fields(line)),
        owned(line.split('\t').collect()),
        owned(line.split("  ").map(str::trim).filter(|f| !f.is_empty()).collect()),
        with_brackets_joined(line),
    ];
    tries.into_iter().find_map(|fields| fitted(fields, sniffed))
}

/// Rows may end with a delimiter where the titles don't, and the other way round; behind the titles there may be keys
/// and their values.
fn fitted(mut fields: Vec<String>, sniffed: &Sniffed) -> Option<Vec<String>> {
    let columns = sniffed.kinds.len();
    let filled = columns - sniffed.kinds.iter().rev().take_while(|kind| **kind == Kind::Empty).count();
    while fields.len() > filled && fields.last().is_some_and(|f| f.trim().is_empty()) {
        fields.pop();
    }
    let is_no_title = |field: &String| is_key(field) || Kind::of(field, sniffed.dialect.decimal) != Kind::Text;
    if fields.get(columns..).is_some_and(|surplus| surplus.iter().all(is_no_title)) {
        fields.truncate(columns);
    }
    let fits = (filled..=columns).contains(&fields.len());
    fields.resize(columns, String::new());
    fits.then_some(fields)
}

/// Words, each with the bracket behind it: `Time (s) Deflection (V)` are two.
fn with_brackets_joined(line: &str) -> Vec<String> {
    let mut fields: Vec<String> = Vec::new();
    for word in line.split_whitespace() {
        match fields.last_mut().filter(|_| word.starts_with(['(', '['])) {
            Some(before) => {
                before.push(' ');
                before.push_str(word);
            }
            None => fields.push(word.to_owned()),
        }
    }
    fields
}
