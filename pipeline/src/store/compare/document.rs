//! Two JSON documents, number by number.

use serde_json::Value;

use super::numbers::Numbers;
use super::values::Found;
use crate::artifact::std_name;

/// What differs between two texts that are both JSON objects or lists; none if they are equal or no such texts.
pub(super) fn differing(x: &str, y: &str) -> Option<Found> {
    if x == y {
        return None;
    }
    let parse = |text: &str| {
        let value: Option<Value> = serde_json::from_str(text).ok();
        value.filter(|value| value.is_object() || value.is_array())
    };
    let (left, right) = (parse(x)?, parse(y)?);
    let mut walk = Walk { numbers: Numbers::new(0, 0), others: 0, first: None };
    walk.values(&left, &right, None, "");
    let (place, x, y) = walk.first?;
    let (differing, others) = (walk.numbers.differing, walk.others);
    let what = match others {
        0 => format!("{differing} of {} numbers differ, first at {place}: {x} and {y}", walk.numbers.of),
        _ => format!("{} values differ, first at {place}: {x} and {y}", differing + others),
    };
    Some(Found { what, numbers: (others == 0).then_some(walk.numbers) })
}

struct Walk {
    numbers: Numbers,
    /// Differences that are none of numbers.
    others: usize,
    first: Option<(String, String, String)>,
}

impl Walk {
    fn values(&mut self, x: &Value, y: &Value, error: Option<f64>, at: &str) {
        match (x, y) {
            (Value::Object(left), Value::Object(right)) => {
                for (name, x) in left {
                    let std = std_name(name, left.keys().map(String::as_str)).and_then(|std| left.get(std)?.as_f64());
                    self.values(x, right.get(name).unwrap_or(&ABSENT), std, &format!("{at}/{name}"));
                }
                for (name, y) in right.iter().filter(|(name, _)| !left.contains_key(*name)) {
                    self.other(&ABSENT, y, &format!("{at}/{name}"));
                }
            }
            (Value::Array(left), Value::Array(right)) if left.len() == right.len() => {
                for (index, (x, y)) in left.iter().zip(right).enumerate() {
                    self.values(x, y, None, &format!("{at}/{index}"));
                }
            }
            (Value::Number(_), Value::Number(_)) => self.pair(x, y, error, at),
            _ if x == y => {}
            _ => self.other(x, y, at),
        }
    }

    fn pair(&mut self, x: &Value, y: &Value, error: Option<f64>, at: &str) {
        self.numbers.of += 1;
        let (left, right) = (x.as_f64().unwrap_or(f64::NAN), y.as_f64().unwrap_or(f64::NAN));
        self.numbers.add(left, right, error, || at.to_owned());
        if x != y {
            self.numbers.differing += 1;
            self.keep_first(x, y, at);
        }
    }

    fn other(&mut self, x: &Value, y: &Value, at: &str) {
        self.others += 1;
        self.keep_first(x, y, at);
    }

    fn keep_first(&mut self, x: &Value, y: &Value, at: &str) {
        let short = |value: &Value| value.to_string().chars().take(60).collect::<String>();
        self.first.get_or_insert_with(|| (at.to_owned(), short(x), short(y)));
    }
}

/// What stands for a key that one document lacks: no number.
static ABSENT: Value = Value::Null;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_are_compared_in_their_standard_errors() {
        let (x, y) =
            (r#"{"f_hz": 10.0, "f_std_hz": 0.5, "n": [1, 2]}"#, r#"{"f_hz": 11.0, "f_std_hz": 0.5, "n": [1, 2]}"#);
        let found = differing(x, y).unwrap();
        let numbers = found.numbers.unwrap();
        assert_eq!((numbers.differing, numbers.of, numbers.largest), (1, 4, 1.0));
        assert_eq!((numbers.in_errors, numbers.at.as_str()), (Some(2.0), "/f_hz"));
        assert!(found.what.contains("1 of 4 numbers differ, first at /f_hz: 10.0 and 11.0"), "{}", found.what);
    }

    #[test]
    fn other_texts_keys_and_lengths_are_no_matter_of_numbers() {
        for (x, y) in
            [(r#"{"a": "x"}"#, r#"{"a": "y"}"#), (r#"{"a": 1}"#, r#"{"b": 1}"#), ("[1]", "[1, 2]"), ("[null]", "[1]")]
        {
            let found = differing(x, y).unwrap();
            assert!(found.numbers.is_none(), "{}", found.what);
        }
        assert!(differing("{}", "{ }").is_none() && differing("1", "2").is_none() && differing("a", "b").is_none());
    }
}
