//! What a field is.

use super::number;

/// What a field holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(super) enum Kind {
    /// Nothing, or a word that stands for a missing value.
    Empty,
    Number,
    /// A date or a time of day.
    Stamp,
    Text,
}

/// Words that programs write where a value is missing.
const MISSING: [&str; 6] = ["n/a", "na", "#n/a", "null", "none", "missing"];

impl Kind {
    pub(super) fn of(field: &str, decimal: char) -> Self {
        let text = number::bare(field);
        if text.chars().all(|c| c == '-') || MISSING.iter().any(|word| text.eq_ignore_ascii_case(word)) {
            Self::Empty
        } else if number::parse(text, decimal).is_some() {
            Self::Number
        } else if is_stamp(text) {
            Self::Stamp
        } else {
            Self::Text
        }
    }
}

/// Whether a text is a date, a time of day, or both: digits with `:`, or with two `/`, `-` or `.`, between them.
fn is_stamp(text: &str) -> bool {
    let text = text.trim_end_matches(['A', 'P', 'M', 'a', 'p', 'm', 'Z', '.', ' ']);
    let digit = |c: Option<char>| c.is_some_and(|c| c.is_ascii_digit());
    let separators = |mark: char| text.chars().filter(|c| *c == mark).count();
    digit(text.chars().next())
        && digit(text.chars().last())
        && text.chars().all(|c| c.is_ascii_digit() || matches!(c, ':' | '/' | '-' | '.' | ',' | ' ' | 'T' | '+'))
        && (separators(':') > 0 || ['/', '-', '.'].into_iter().any(|mark| separators(mark) == 2))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn fields_are_numbers_stamps_texts_or_nothing() {
        for stamp in ["12:00:01", "4/16/2021  11:31:19.528906", "2016-08-23T10:45:47", "30.04.2020", "1:02 PM"] {
            assert_eq!(Kind::of(stamp, '.'), Kind::Stamp, "{stamp}");
        }
        for text in ["CH1", "delta t", "#1", "1 V", "a:b", "Analog:4E-9", "1/2"] {
            assert_eq!(Kind::of(text, '.'), Kind::Text, "{text}");
        }
        for empty in ["", "  ", "--", "\"\"", "N/A"] {
            assert_eq!(Kind::of(empty, '.'), Kind::Empty, "{empty}");
        }
        assert_eq!((Kind::of("-1e-3", '.'), Kind::of("\"1,5\"", ',')), (Kind::Number, Kind::Number));
    }
}
