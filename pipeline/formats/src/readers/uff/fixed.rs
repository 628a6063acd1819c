//! Fields at fixed columns, as FORTRAN writes them.

use crate::text::latin;

/// The text of columns `from..to` (from 0) without blanks around it.
///
/// A column is a character: of one byte, as the standard has it, or of several in a line of UTF-8 (`m/s²`), which newer
/// writers pad to as many characters. What is no UTF-8 is Latin-1.
pub(super) fn text(line: &[u8], from: usize, to: usize) -> String {
    let count = to.saturating_sub(from);
    match std::str::from_utf8(line) {
        Ok(text) if !line.is_ascii() => text.chars().skip(from).take(count).collect::<String>().trim().to_owned(),
        _ => latin(line.get(from..to.min(line.len())).unwrap_or_default().trim_ascii()),
    }
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

/// Digits that a number is printed to, from the first that is not 0.
pub(super) fn digits(field: &[u8]) -> usize {
    let mantissa = field.iter().take_while(|b| !b.eq_ignore_ascii_case(&b'e') && !b.eq_ignore_ascii_case(&b'd'));
    mantissa.filter(|b| b.is_ascii_digit()).skip_while(|b| **b == b'0').count()
}
