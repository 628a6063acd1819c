//! The paths in a crate's code: which folder of `src` names which.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Per pair of folders (or files) directly below `src`: the places where the first names the second, as `file: path`.
pub type Arrows = BTreeMap<(String, String), BTreeSet<String>>;

/// Arrows between the folders of a crate, read from every `use`, inline `crate::` and `super::` of its code. Tests are
/// left out: a test may use whatever lies above what it tests.
pub fn arrows(src: &Path) -> Arrows {
    let mut found = Arrows::new();
    for file in sources(src) {
        let text = fs::read_to_string(&file).expect("a source file");
        let place = file.strip_prefix(src).expect("below src").with_extension("");
        let mut module: Vec<String> = place.iter().map(|part| part.to_string_lossy().into_owned()).collect();
        if module.last().is_some_and(|last| matches!(last.as_str(), "mod" | "lib" | "main")) {
            module.pop();
        }
        // the crate's own front door names everything
        let Some(own) = module.first().cloned() else { continue };
        let code = without_tests(&without_texts(&text));
        for path in paths(&code) {
            let Some(target) = absolute(&path, &module) else { continue };
            if target != own {
                let shown = format!("{}: {}", place.display(), path.join("::"));
                found.entry((own.clone(), target)).or_default().insert(shown);
            }
        }
    }
    let named: BTreeSet<String> = sources(src)
        .iter()
        .filter_map(|file| {
            file.strip_prefix(src)
                .ok()?
                .with_extension("")
                .iter()
                .next()
                .map(|part| part.to_string_lossy().into_owned())
        })
        .collect();
    // names that the front door re-exports are no folders
    found.retain(|(_, target), _| named.contains(target));
    found
}

/// The folder that a path leads to, below `src`; none if it leads out of the crate or to the front door.
fn absolute(path: &[String], module: &[String]) -> Option<String> {
    match path.first()?.as_str() {
        "crate" => path.get(1).cloned(),
        "super" => {
            let up = path.iter().take_while(|part| *part == "super").count();
            let below = module.len().checked_sub(up)?;
            if below == 0 { path.get(up).cloned() } else { module.first().cloned() }
        }
        _ => None,
    }
}

/// All paths of a code without comments and texts: those of `use` with their braces undone, and those that stand
/// anywhere else.
fn paths(code: &str) -> Vec<Vec<String>> {
    let mut found = Vec::new();
    let mut rest = code;
    let mut elsewhere = String::new();
    while let Some(at) = rest.find("use ") {
        let before = rest[..at].chars().next_back();
        let (head, tail) = rest.split_at(at);
        elsewhere.push_str(head);
        if before.is_some_and(|c| c.is_alphanumeric() || c == '_') {
            elsewhere.push_str("use ");
            rest = &tail[4..];
            continue;
        }
        let end = tail.find(';').unwrap_or(tail.len());
        expand(&tail[4..end], &[], &mut found);
        rest = &tail[end..];
    }
    elsewhere.push_str(rest);
    for start in ["crate::", "super::"] {
        for (at, _) in elsewhere.match_indices(start) {
            if elsewhere[..at].chars().next_back().is_some_and(|c| c.is_alphanumeric() || matches!(c, '_' | ':' | '$'))
            {
                continue;
            }
            let word = |c: char| c.is_alphanumeric() || matches!(c, '_' | ':');
            let path: String = elsewhere[at..].chars().take_while(|&c| word(c)).collect();
            found.push(path.split("::").filter(|part| !part.is_empty()).map(str::to_owned).collect());
        }
    }
    found
}

/// Undoes the braces of a `use`.
fn expand(tree: &str, prefix: &[String], found: &mut Vec<Vec<String>>) {
    let tree = tree.trim();
    let parts = |text: &str| -> Vec<String> {
        text.split("::").map(str::trim).filter(|part| !part.is_empty()).map(str::to_owned).collect()
    };
    match tree.split_once('{') {
        Some((head, inner)) => {
            let prefix = [prefix, &parts(head)].concat();
            let inner = inner.trim_end().strip_suffix('}').unwrap_or(inner);
            let (mut depth, mut start) = (0, 0);
            for (at, c) in inner.char_indices().chain([(inner.len(), ',')]) {
                match c {
                    '{' => depth += 1,
                    '}' => depth -= 1,
                    ',' if depth == 0 => {
                        expand(&inner[start..at], &prefix, found);
                        start = (at + 1).min(inner.len());
                    }
                    _ => {}
                }
            }
        }
        None if tree.is_empty() => {}
        None => {
            let name = tree.split(" as ").next().unwrap_or_default();
            found.push([prefix, &parts(name)].concat());
        }
    }
}

/// The code without comments and texts.
fn without_texts(text: &str) -> String {
    let mut code = String::new();
    let mut rest = text;
    while let Some(c) = rest.chars().next() {
        if rest.starts_with("//") {
            rest = &rest[rest.find('\n').unwrap_or(rest.len())..];
        } else if rest.starts_with("r#\"") {
            rest = &rest[rest[3..].find("\"#").map_or(rest.len(), |at| at + 5)..];
        } else if rest.starts_with("'\"'") || rest.starts_with("'\\\"'") {
            rest = &rest[rest[1..].find('\'').map_or(rest.len(), |at| at + 2)..];
        } else if c == '"' {
            let mut escaped = false;
            let end = rest[1..].find(|c: char| {
                let ends = c == '"' && !escaped;
                escaped = c == '\\' && !escaped;
                ends
            });
            rest = &rest[end.map_or(rest.len(), |at| at + 2)..];
            code.push_str("\"\"");
        } else {
            code.push(c);
            rest = &rest[c.len_utf8()..];
        }
    }
    code
}

/// The code without items that only tests have: each `#[cfg(test)]` with what it stands before.
pub fn without_tests(code: &str) -> String {
    let mut kept = String::new();
    let mut rest = code;
    while let Some(at) = rest.find("#[cfg(test)]") {
        kept.push_str(&rest[..at]);
        let item = &rest[at..];
        let semicolon = item.find(';').unwrap_or(item.len());
        let brace = item.find('{').unwrap_or(item.len());
        let end = if semicolon < brace { semicolon + 1 } else { closing(item, brace) };
        rest = &item[end.min(item.len())..];
    }
    kept + rest
}

/// The byte behind the brace that closes the one at `open`.
fn closing(code: &str, open: usize) -> usize {
    let mut depth = 0;
    for (at, c) in code.char_indices().skip_while(|(at, _)| *at < open) {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            _ => {}
        }
        if depth == 0 {
            return at + 1;
        }
    }
    code.len()
}

/// The source files of a crate without those that only tests have.
pub fn sources(src: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(src).expect("a folder").map(|entry| entry.expect("an entry").path()) {
        let name = entry.file_name().unwrap_or_default().to_string_lossy().into_owned();
        if entry.is_dir() {
            found.extend(sources(&entry));
        } else if name.ends_with(".rs") && !name.ends_with("tests.rs") && name != "fixture.rs" {
            found.push(entry);
        }
    }
    found.sort();
    found
}

#[test]
fn every_kind_of_path_is_read() {
    let scratch = tempfile::tempdir().expect("a folder");
    let file = |name: &str, text: &str| {
        let path = scratch.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, text).expect("a file");
    };
    file("lib.rs", "mod a; mod b; mod c; mod d; mod e;");
    file(
        "a/mod.rs",
        "use super::b::{X, y::{Z, W as V}};\n// crate::d::Comment\nfn f() { \"crate::d::Text\"; crate::c::g() }",
    );
    file(
        "a/deep/file.rs",
        "use super::super::super::e::T;\nuse super::other;\n#[cfg(test)]\nmod tests { use crate::d::In; }",
    );
    file("a/more_tests.rs", "use crate::d::Test;");
    for leaf in ["b.rs", "c/mod.rs", "d.rs", "e.rs"] {
        file(leaf, "");
    }
    let found: Vec<String> = arrows(scratch.path()).into_keys().map(|(from, to)| format!("{from} {to}")).collect();
    assert_eq!(found, ["a b", "a c", "a e"]);
}
