//! What differs between the origins of two results of one stage.

use std::collections::{HashMap, HashSet};

use serde_json::Value;

use crate::cache::{Origin, OriginFile, OriginInput};

/// One thing that changed from an earlier result to a later one.
#[derive(Debug, Clone, PartialEq)]
pub enum Change {
    /// The layout of stage files.
    Format {
        /// Before.
        was: u32,
        /// Now.
        is: u32,
    },
    /// The stage's version.
    Version {
        /// Before.
        was: u32,
        /// Now.
        is: u32,
    },
    /// A parameter.
    Parameter {
        /// Its name.
        name: String,
        /// Before; none if there was none.
        was: Option<Value>,
        /// Now; none if there is none.
        is: Option<Value>,
    },
    /// The seed.
    Seed {
        /// Before.
        was: Option<u64>,
        /// Now.
        is: Option<u64>,
    },
    /// Processor or build.
    Arithmetic {
        /// Before.
        was: String,
        /// Now.
        is: String,
    },
    /// Plugins of the stage.
    DependsOn {
        /// Before.
        was: Vec<String>,
        /// Now.
        is: Vec<String>,
    },
    /// A file: other bytes, no longer read, or read in addition.
    File {
        /// Its name.
        name: String,
        /// Before.
        was: Option<OriginFile>,
        /// Now.
        is: Option<OriginFile>,
    },
    /// The same files in another order.
    Order,
    /// What an input takes has changed, and its own row says why; or another stage or output is wired to it.
    Input {
        /// The input port.
        port: String,
        /// Before, as `stage.output`; none if it was not wired.
        was: Option<String>,
        /// Now.
        is: Option<String>,
    },
    /// What changed in a stage that it takes, whose results are not kept.
    Upstream {
        /// That stage's id.
        stage: String,
        /// What changed there.
        change: Box<Change>,
    },
}

/// What differs between two origins, in the order in which a key is made.
pub fn changes(was: &Origin, is: &Origin) -> Vec<Change> {
    let mut found = Vec::new();
    if was.format != is.format {
        found.push(Change::Format { was: was.format, is: is.format });
    }
    if was.version != is.version {
        found.push(Change::Version { was: was.version, is: is.version });
    }
    parameters(was, is, &mut found);
    if was.depends_on != is.depends_on {
        found.push(Change::DependsOn { was: was.depends_on.clone(), is: is.depends_on.clone() });
    }
    if was.arithmetic != is.arithmetic {
        found.push(Change::Arithmetic { was: was.arithmetic.clone(), is: is.arithmetic.clone() });
    }
    if was.seed != is.seed {
        found.push(Change::Seed { was: was.seed, is: is.seed });
    }
    files(&was.files, &is.files, &mut found);
    inputs(&was.inputs, &is.inputs, &mut found);
    found
}

fn parameters(was: &Origin, is: &Origin, found: &mut Vec<Change>) {
    let none = serde_json::Map::new();
    let (before, now) = (was.params.as_object().unwrap_or(&none), is.params.as_object().unwrap_or(&none));
    let mut names: Vec<&String> = before.keys().chain(now.keys()).collect();
    names.sort_unstable();
    names.dedup();
    for name in names.into_iter().filter(|name| !is.location_params.contains(name)) {
        let (was, is) = (before.get(name).cloned(), now.get(name).cloned());
        if was != is {
            found.push(Change::Parameter { name: name.clone(), was, is });
        }
    }
}

fn files(was: &[OriginFile], is: &[OriginFile], found: &mut Vec<Change>) {
    let before = found.len();
    let (old, new): (HashSet<&OriginFile>, HashSet<&OriginFile>) = (was.iter().collect(), is.iter().collect());
    // of several of one name the first
    let mut named: HashMap<&str, &OriginFile> = HashMap::new();
    is.iter().rev().for_each(|file| {
        named.insert(&file.name, file);
    });
    let mut reported: HashSet<&OriginFile> = HashSet::new();
    for file in was.iter().filter(|file| !new.contains(file)) {
        let now = named.get(file.name.as_str()).copied().filter(|other| !old.contains(other));
        reported.extend(now);
        found.push(Change::File { name: file.name.clone(), was: Some(file.clone()), is: now.cloned() });
    }
    for file in is.iter().filter(|file| !old.contains(file)) {
        if reported.insert(file) {
            found.push(Change::File { name: file.name.clone(), was: None, is: Some(file.clone()) });
        }
    }
    if found.len() == before && was != is {
        found.push(Change::Order);
    }
}

fn inputs(was: &[OriginInput], is: &[OriginInput], found: &mut Vec<Change>) {
    for now in is {
        match was.iter().find(|input| input.port == now.port) {
            Some(before) => input(before, now, found),
            None => found.push(Change::Input { port: now.port.clone(), was: None, is: Some(name(now)) }),
        }
    }
    for before in was.iter().filter(|before| !is.iter().any(|now| now.port == before.port)) {
        found.push(Change::Input { port: before.port.clone(), was: Some(name(before)), is: None });
    }
}

fn input(was: &OriginInput, is: &OriginInput, found: &mut Vec<Change>) {
    if (&was.key, &was.output) == (&is.key, &is.output) {
        return;
    }
    let inner = match (&was.origin, &is.origin) {
        (Some(before), Some(now)) if was.output == is.output && before.uses == now.uses => changes(before, now),
        _ => Vec::new(),
    };
    let upstream = |change| Change::Upstream { stage: is.stage.clone(), change: Box::new(change) };
    // two ports may take one stage: said once
    let new: Vec<Change> = inner.into_iter().map(upstream).filter(|change| !found.contains(change)).collect();
    let reported = !new.is_empty()
        || found.iter().any(|change| matches!(change, Change::Upstream { stage, .. } if *stage == is.stage));
    found.extend(new);
    if !reported {
        found.push(Change::Input { port: is.port.clone(), was: Some(name(was)), is: Some(name(is)) });
    }
}

fn name(input: &OriginInput) -> String {
    format!("{}.{}", input.stage, input.output)
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn file(name: &str, hash: &str) -> OriginFile {
        OriginFile { name: name.to_owned(), size: 1, blake3: hash.to_owned() }
    }

    fn origin() -> Origin {
        Origin {
            key: "k".to_owned(),
            format: 1,
            uses: "a.b".to_owned(),
            version: 1,
            params: json!({ "x": 1, "files": ["a"] }),
            location_params: vec!["files".to_owned()],
            depends_on: Vec::new(),
            arithmetic: String::new(),
            seed: None,
            files: vec![file("a", "0"), file("b", "1")],
            inputs: Vec::new(),
            pipeline: "p".to_owned(),
            id: "i".to_owned(),
            program: String::new(),
        }
    }

    fn input(key: &str, origin: Option<Origin>) -> OriginInput {
        let text = |text: &str| text.to_owned();
        OriginInput {
            port: text("in"),
            stage: text("s"),
            output: text("o"),
            key: text(key),
            origin: origin.map(Box::new),
        }
    }

    #[test]
    fn places_do_not_count_and_parameters_versions_and_seeds_do() {
        let moved = Origin { params: json!({ "x": 1, "files": ["b"] }), ..origin() };
        assert_eq!(changes(&origin(), &moved), []);
        let later = Origin { params: json!({ "x": 2, "y": 3 }), version: 2, seed: Some(1), ..origin() };
        let parameter = |name: &str, was: Option<Value>, is| Change::Parameter { name: name.to_owned(), was, is };
        assert_eq!(
            changes(&origin(), &later),
            [
                Change::Version { was: 1, is: 2 },
                parameter("x", Some(json!(1)), Some(json!(2))),
                parameter("y", None, Some(json!(3))),
                Change::Seed { was: None, is: Some(1) },
            ]
        );
    }

    #[test]
    fn files_change_come_go_and_swap_places() {
        let with = |files: Vec<OriginFile>| changes(&origin(), &Origin { files, ..origin() });
        let change = |name: &str, was: Option<&str>, is: Option<&str>| Change::File {
            name: name.to_owned(),
            was: was.map(|hash| file(name, hash)),
            is: is.map(|hash| file(name, hash)),
        };
        assert_eq!(with(vec![file("a", "0"), file("b", "2")]), [change("b", Some("1"), Some("2"))]);
        assert_eq!(with(vec![file("a", "0")]), [change("b", Some("1"), None)]);
        let more = vec![file("a", "0"), file("b", "1"), file("c", "2")];
        assert_eq!(with(more), [change("c", None, Some("2"))]);
        assert_eq!(with(vec![file("b", "1"), file("a", "0")]), [Change::Order]);
    }

    #[test]
    fn a_changed_stage_whose_results_are_not_kept_is_looked_into() {
        let with = |input| Origin { inputs: vec![input], ..origin() };
        let found = changes(&with(input("k", None)), &with(input("l", None)));
        let port = Change::Input { port: "in".to_owned(), was: Some("s.o".to_owned()), is: Some("s.o".to_owned()) };
        assert_eq!(found, [port]);
        let (before, now) = (origin(), Origin { version: 2, ..origin() });
        let found = changes(&with(input("k", Some(before))), &with(input("l", Some(now))));
        let change = Box::new(Change::Version { was: 1, is: 2 });
        assert_eq!(found, [Change::Upstream { stage: "s".to_owned(), change }]);
    }
}
