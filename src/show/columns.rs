//! Which lists of objects are tables.

use std::collections::HashSet;

use serde_json::{Map, Value};

/// Columns that any table may have.
const MOST_COLUMNS: usize = 64;

/// Cells that a table of more columns may have.
const MOST_CELLS: usize = 100_000;

/// The keys of objects in the order in which they first appear: the columns of their table. None where few objects
/// share a key: the table would be as large as their number times that of all keys, and nearly empty.
pub fn columns<'a>(rows: &[&'a Map<String, Value>]) -> Option<Vec<&'a str>> {
    let (mut names, mut seen) = (Vec::new(), HashSet::new());
    for name in rows.iter().flat_map(|row| row.keys()) {
        if seen.insert(name) {
            names.push(name.as_str());
            if names.len() > MOST_COLUMNS && names.len().saturating_mul(rows.len()) > MOST_CELLS {
                return None;
            }
        }
    }
    Some(names)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_objects_that_share_no_keys_are_no_tables() {
        let own = |count: usize, width: usize| -> Vec<Value> {
            let object = |k: usize| (0..width).map(|j| (format!("{k}-{j}"), Value::Null)).collect::<Map<_, _>>();
            (0..count).map(|k| object(k).into()).collect()
        };
        let columns = |values: &[Value]| {
            columns(&values.iter().filter_map(Value::as_object).collect::<Vec<_>>()).map(|names| names.len())
        };
        assert_eq!(columns(&own(300, 1)), Some(300));
        assert_eq!(columns(&own(400, 1)), None);
        assert_eq!(columns(&own(1, 99_000)), Some(99_000));
        assert_eq!(columns(&vec![own(1, 64).remove(0); 5000]), Some(64));
        assert_eq!(columns(&vec![own(1, 65).remove(0); 5000]), None);
    }
}
