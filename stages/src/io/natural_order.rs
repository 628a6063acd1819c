//! The order in which people read file names: digits count as numbers.

use std::cmp::Ordering;

/// Compares names with runs of digits as numbers: `record_2.h5` before `record_10.h5`; ties are broken byte by byte.
pub fn natural_order(a: &str, b: &str) -> Ordering {
    let (mut left, mut right) = (a.as_bytes(), b.as_bytes());
    loop {
        let ((l, left_rest), (r, right_rest)) = match (token(left), token(right)) {
            (None, None) => return a.cmp(b),
            (None, Some(_)) => return Ordering::Less,
            (Some(_), None) => return Ordering::Greater,
            (Some(l), Some(r)) => (l, r),
        };
        let order = match (number(l), number(r)) {
            // without leading zeros, the longer number is the larger
            (Some(l), Some(r)) => l.len().cmp(&r.len()).then_with(|| l.cmp(r)),
            _ => l.cmp(r),
        };
        if order != Ordering::Equal {
            return order;
        }
        (left, right) = (left_rest, right_rest);
    }
}

/// A run of digits, or one other byte.
fn token(text: &[u8]) -> Option<(&[u8], &[u8])> {
    let digits = text.iter().take_while(|byte| byte.is_ascii_digit()).count();
    (!text.is_empty()).then(|| text.split_at(digits.max(1)))
}

/// Digits without leading zeros.
fn number(token: &[u8]) -> Option<&[u8]> {
    token.first().filter(|byte| byte.is_ascii_digit())?;
    let zeros = token.iter().take_while(|&&byte| byte == b'0').count();
    Some(&token[zeros..])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn digits_count_as_numbers() {
        let mut names = ["a10", "a9", "b1", "a010", "a", "", "a9x", "a99999999999999999999999", "é2", "a1.h5"];
        names.sort_by(|a, b| natural_order(a, b));
        assert_eq!(names, ["", "a", "a1.h5", "a9", "a9x", "a010", "a10", "a99999999999999999999999", "b1", "é2"]);
    }
}
