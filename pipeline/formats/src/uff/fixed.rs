//! Fields at fixed columns, as FORTRAN writes them.

/// The text of columns `from..to` (from 0) without blanks around it.
pub(super) fn text(line: &[u8], from: usize, to: usize) -> String {
    let field = line.get(from..to.min(line.len())).unwrap_or_default();
    field.trim_ascii().iter().map(|&b| char::from(b)).collect()
}

/// The text, unless it says that there is none.
pub(super) fn stated(line: &[u8], from: usize, to: usize) -> Option<String> {
    Some(text(line, from, to)).filter(|t| !t.is_empty() && !t.eq_ignore_ascii_case("NONE"))
}

/// A number; exponents may be written with a D.
pub(super) fn number(field: &[u8]) -> Option<f64> {
    let field = std::str::from_utf8(field.trim_ascii()).ok()?;
    if field.contains(['d', 'D']) { field.replace(['d', 'D'], "E").parse().ok() } else { field.parse().ok() }
}
