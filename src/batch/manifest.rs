//! Manifests: a data set per line, as JSON.

use afmid_pipeline::config::nearest;
use afmid_pipeline::toml;
use serde_json::{Map, Value, json};

use super::dataset::{DataSet, absolute, check_name};

const KEYS: [&str; 3] = ["name", "files", "set"];

/// The data sets of a manifest, `{"name": "...", "files": ["..."], "set": {"stage.param": value}}` a line; empty lines
/// are passed over.
///
/// Errors: everything that is wrong with it, each with its line.
pub fn read(file: &str, text: &str) -> Result<Vec<DataSet>, Vec<String>> {
    let (mut sets, mut problems) = (Vec::new(), Vec::new());
    for (number, line) in (1..).zip(text.lines()).filter(|(_, line)| !line.trim().is_empty()) {
        match data_set(line) {
            Ok(set) => sets.push(set),
            Err(problem) => problems.push(format!("{file}:{number}: {problem}")),
        }
    }
    if problems.is_empty() { Ok(sets) } else { Err(problems) }
}

/// A manifest of these data sets, whose paths are absolute: [`read`] gives them back.
pub fn write(sets: &[DataSet]) -> Result<String, String> {
    let line = |set: &DataSet| -> Result<String, String> {
        let changes: Map<String, Value> = set.set.iter().map(|argument| change(argument)).collect::<Result<_, _>>()?;
        Ok(format!("{}\n", json!({ "name": set.name, "files": set.files, "set": changes })))
    };
    sets.iter().map(line).collect()
}

/// A `--set` argument as key and value.
fn change(argument: &str) -> Result<(String, Value), String> {
    let value = argument.split_once('=').and_then(|(key, value)| {
        let table: toml::Table = format!("value = {value}").parse().ok()?;
        Some((key.to_owned(), serde_json::to_value(table.get("value")?).ok()?))
    });
    value.ok_or_else(|| format!("`{argument}` cannot be written as JSON"))
}

fn data_set(line: &str) -> Result<DataSet, String> {
    let value: Value = serde_json::from_str(line).map_err(|error| format!("not JSON: {error}"))?;
    let Value::Object(entries) = value else {
        return Err("wanted an object such as {\"name\": \"a\", \"files\": [\"a/*.h5\"]}".to_owned());
    };
    if let Some(unknown) = entries.keys().find(|key| !KEYS.contains(&key.as_str())) {
        let help = match nearest(unknown, KEYS) {
            Some(key) => format!("did you mean `{key}`?"),
            None => format!("there is: {}", KEYS.join(", ")),
        };
        return Err(format!("a data set has no key `{unknown}`; {help}"));
    }
    let Some(Value::String(name)) = entries.get("name") else {
        return Err("`name` is missing or no text".to_owned());
    };
    check_name(name)?;
    Ok(DataSet { name: name.clone(), files: files(&entries)?, set: set(&entries)? })
}

fn files(entries: &Map<String, Value>) -> Result<Vec<String>, String> {
    let wanted = || "`files` is missing or empty, wanted a list of files, patterns or folders".to_owned();
    let Some(Value::Array(files)) = entries.get("files") else { return Err(wanted()) };
    let files: Option<Vec<&str>> = files.iter().map(Value::as_str).collect();
    let files = files.filter(|files| !files.is_empty()).ok_or_else(wanted)?;
    files.into_iter().map(absolute).collect()
}

fn set(entries: &Map<String, Value>) -> Result<Vec<String>, String> {
    match entries.get("set") {
        None => Ok(Vec::new()),
        Some(Value::Object(set)) => {
            set.iter().map(|(key, value)| Ok(format!("{key}={}", plain(key, value)?))).collect()
        }
        Some(_) => Err("`set` is no object, wanted {\"stage.param\": value}".to_owned()),
    }
}

/// A value of JSON in TOML.
fn plain(key: &str, value: &Value) -> Result<toml::Value, String> {
    toml::Value::try_from(value).map_err(|_| format!("`set`: the value of `{key}` has a null in it, which TOML lacks"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_a_data_set() {
        let text = "{\"name\": \"a\", \"files\": [\"/x/*.h5\"]}\n\n\
            {\"name\": \"b\", \"files\": [\"/y\"], \"set\": {\"fit.order\": 9, \"r.f\": \"x\"}}";
        let sets = read("m.jsonl", text).unwrap();
        assert_eq!(sets[0], DataSet { name: "a".into(), files: vec!["/x/*.h5".into()], set: vec![] });
        assert_eq!(sets[1].set, ["fit.order=9", "r.f=\"x\""]);
    }

    #[test]
    fn what_is_written_is_read_again() {
        let text = r#"{"name": "a 'b' \"c\"", "files": ["/x y/[*]/*.h5"], "set": {"f.order": 9, "f.name": "it's \n\t\u00e9", "f.x": 1e-300, "f.y": 0.1,
            "f.list": [[1.0, 2], [true]], "f.table": {"k l": [{"m": 1.5}]}}}"#;
        let sets = read("m", &text.replace('\n', " ")).unwrap();
        let written = write(&sets).unwrap();
        assert_eq!(written.lines().count(), 1);
        assert_eq!(read("w", &written).unwrap(), sets);
    }

    #[test]
    fn every_wrong_line_is_reported() {
        let text = [
            "{\"name\": \"a\", \"file\": []}",
            "7",
            "{",
            "{\"name\": \"a\"}",
            "{\"name\": \"a/b\", \"files\": [\"x\"]}",
            "{\"name\": \"a\", \"files\": [\"x\"], \"set\": {\"a.b\": null}}",
        ];
        let problems = read("m.jsonl", &text.join("\n")).unwrap_err();
        let words = ["did you mean `files`", "wanted an object", "not JSON", "`files`", "a/b", "null"];
        assert_eq!(problems.len(), words.len());
        for (number, (problem, word)) in (1..).zip(problems.iter().zip(words)) {
            assert!(problem.starts_with(&format!("m.jsonl:{number}: ")) && problem.contains(word), "{problem}");
        }
    }
}
