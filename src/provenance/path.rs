//! Paths to numbers: a stage's id, then steps as in JavaScript: `modes[0].frequency_hz`.

use afmid_pipeline::config::nearest;
use serde_json::Value;

/// A step into a JSON value.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// A key of an object.
    Key(String),
    /// An element of a list.
    Index(usize),
}

/// A path: a stage's id and the steps behind it.
pub type Path = (String, Vec<Step>);

/// Parses `ID.key[0]["odd key"]`. Errors: what is wrong, and what would be right.
pub fn parse(text: &str) -> Result<Path, String> {
    let end = text.find(['.', '[']).unwrap_or(text.len());
    let (id, mut rest) = text.split_at(end);
    if id.is_empty() {
        return Err(format!("`{text}` begins with no stage's id"));
    }
    let mut steps = Vec::new();
    while !rest.is_empty() {
        let (step, left) = step(rest).ok_or_else(|| format!("`{text}`: `{rest}` is no step of a path"))?;
        steps.push(step);
        rest = left;
    }
    Ok((id.to_owned(), steps))
}

fn step(text: &str) -> Option<(Step, &str)> {
    if let Some(rest) = text.strip_prefix("[\"") {
        let (key, rest) = rest.split_once("\"]")?;
        return Some((Step::Key(key.to_owned()), rest));
    }
    if let Some(rest) = text.strip_prefix('[') {
        let (index, rest) = rest.split_once(']')?;
        return Some((Step::Index(index.trim().parse().ok()?), rest));
    }
    let rest = text.strip_prefix('.')?;
    let end = rest.find(['.', '[']).unwrap_or(rest.len());
    let (key, rest) = rest.split_at(end);
    (!key.is_empty()).then(|| (Step::Key(key.to_owned()), rest))
}

/// A path as it is typed.
pub fn typed(id: &str, steps: &[Step]) -> String {
    steps.iter().fold(id.to_owned(), |text, step| match step {
        Step::Index(index) => format!("{text}[{index}]"),
        Step::Key(key) if key.contains(['.', '[', ']', '"']) => format!("{text}[\"{key}\"]"),
        Step::Key(key) => format!("{text}.{key}"),
    })
}

/// Steps as a JSON pointer.
pub fn pointer(steps: &[Step]) -> String {
    let step = |step: &Step| match step {
        Step::Index(index) => format!("/{index}"),
        Step::Key(key) => format!("/{}", key.replace('~', "~0").replace('/', "~1")),
    };
    steps.iter().map(step).collect()
}

/// Goes a path into a value. Errors: the steps that lead nowhere and what there is instead, as (problem, help).
pub fn walk<'a>(root: &'a Value, id: &str, steps: &[Step]) -> Result<&'a Value, (String, String)> {
    let mut value = root;
    for (depth, step) in steps.iter().enumerate() {
        let here = typed(id, steps.get(..depth).unwrap_or_default());
        value = match (value, step) {
            (Value::Object(entries), Step::Key(key)) => {
                let keys = || entries.keys().map(String::as_str);
                entries.get(key).ok_or_else(|| (format!("`{here}` has no `{key}`"), suggestion(key, keys())))?
            }
            (Value::Array(values), Step::Index(index)) => values.get(*index).ok_or_else(|| {
                (format!("`{here}` has no [{index}]"), format!("it has {} elements, the first is [0]", values.len()))
            })?,
            (Value::Array(values), Step::Key(key)) => {
                let help = format!("it is a list of {}: write `{here}[0].{key}`", values.len());
                return Err((format!("`{here}` has no `{key}`"), help));
            }
            (Value::Object(entries), Step::Index(index)) => {
                let help = format!("it has: {}", entries.keys().map(String::as_str).collect::<Vec<_>>().join(", "));
                return Err((format!("`{here}` is no list, it has no [{index}]"), help));
            }
            (leaf, _) => {
                let wrong = format!("`{here}` is {leaf}: nothing lies below it");
                return Err((wrong, format!("write `{here}`")));
            }
        };
    }
    Ok(value)
}

/// The nearest of the names that there are, or all of them.
pub fn suggestion<'a>(word: &str, names: impl Iterator<Item = &'a str> + Clone) -> String {
    match nearest(word, names.clone()) {
        Some(name) => format!("did you mean `{name}`?"),
        None => format!("it has: {}", names.collect::<Vec<_>>().join(", ")),
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn paths_are_read_and_written_alike() {
        let key = |key: &str| Step::Key(key.to_owned());
        let steps = vec![Step::Index(0), key("frequency_hz"), key("a.h5"), Step::Index(12)];
        let text = "modes[0].frequency_hz[\"a.h5\"][12]";
        assert_eq!(parse(text), Ok(("modes".to_owned(), steps.clone())));
        assert_eq!(typed("modes", &steps), text);
        assert_eq!(pointer(&steps), "/0/frequency_hz/a.h5/12");
        for wrong in ["", ".a", "[0]", "a..b", "a[x]", "a[0", "a.", "a[0]b", "a[-1]"] {
            assert!(parse(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_step_that_leads_nowhere_is_reported_with_what_there_is() {
        let root = json!({ "modes": [{ "frequency_hz": 1.5 }] });
        let go = |text: &str| parse(text).map(|(id, steps)| walk(&root, &id, &steps).cloned()).unwrap();
        assert_eq!(go("m.modes[0].frequency_hz"), Ok(json!(1.5)));
        let help = |text: &str| go(text).unwrap_err().1;
        assert_eq!(help("m.modes[0].frequenzy_hz"), "did you mean `frequency_hz`?");
        assert_eq!(help("m.modes[3]"), "it has 1 elements, the first is [0]");
        assert_eq!(help("m.modes.x"), "it is a list of 1: write `m.modes[0].x`");
        assert_eq!(help("m.modes[0].frequency_hz.x"), "write `m.modes[0].frequency_hz`");
        assert_eq!(help("m[0]"), "it has: modes");
    }
}
