//! Numbers as they are printed.

/// The number in a field: blanks and quotes around it don't matter. With a decimal comma a point is none.
pub(super) fn parse(field: &str, decimal: char) -> Option<f64> {
    let field = bare(field);
    // What Rust also takes for a number, but a title may be: inf, infinity, nan are values in tables, too.
    if decimal == '.' {
        return field.parse().ok();
    }
    let whole = !field.contains('.') && !field.ends_with(decimal);
    whole.then(|| field.replacen(decimal, ".", 1).parse().ok()).flatten()
}

/// A field without blanks and quotes around it.
pub(super) fn bare(field: &str) -> &str {
    let field = field.trim();
    let quoted = field.strip_prefix('"').and_then(|f| f.strip_suffix('"'));
    quoted.map_or(field, str::trim)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_parse_with_either_decimal_sign() {
        assert_eq!(parse(" \"1.5\" ", '.'), Some(1.5));
        assert_eq!(parse("-1,5E-3", ','), Some(-1.5e-3));
        for (text, decimal) in [("1,5", '.'), ("1.5", ','), ("1,", ','), ("1,5,5", ','), ("", '.'), ("V", '.')] {
            assert_eq!(parse(text, decimal), None, "{text}");
        }
        assert!(parse("NaN", '.').is_some_and(f64::is_nan));
    }
}
