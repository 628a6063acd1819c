//! Words that the repository does without, in code, comments, messages and pages: whatever they stood for has a plainer
//! name of its own.

use std::fs;
use std::path::{Path, PathBuf};

use super::common::ROOT;

const OUT: [&str; 8] = ["told", "lively", "restless", "needless", "gathered", "lent", "anew", "whoever"];

const READ: [&str; 5] = ["rs", "md", "py", "toml", "m"];

/// This file, which lists the words, and the history, which quotes them.
const EXEMPT: [&str; 2] = ["tests/integrity/words.rs", "CHANGELOG.md"];

/// What git ignores, at any depth.
const GENERATED: [&str; 4] = ["target", "book", "node_modules", "__pycache__"];

/// The words of a line: letters without a break, and the parts of `snake_case` and `CamelCase`.
fn words(line: &str) -> impl Iterator<Item = &str> {
    line.split(|c: char| !c.is_alphabetic()).flat_map(|run| {
        let mut lower = false;
        // a capital behind a small letter begins a word
        let starts = run
            .char_indices()
            .filter(move |(_, c)| std::mem::replace(&mut lower, c.is_lowercase()) && c.is_uppercase());
        let starts: Vec<usize> = [0].into_iter().chain(starts.map(|(at, _)| at)).collect();
        let ends: Vec<usize> = starts.iter().skip(1).copied().chain([run.len()]).collect();
        starts.into_iter().zip(ends).map(|(start, end)| &run[start..end])
    })
}

/// Lines, counted from 1, with the words out of [`OUT`] in them.
fn found(text: &str) -> Vec<(usize, &'static str)> {
    let of = |line: &str| {
        let out = |word: &str| OUT.into_iter().find(|out| word.eq_ignore_ascii_case(out));
        words(line).filter_map(out).collect::<Vec<_>>()
    };
    (1..).zip(text.lines()).flat_map(|(number, line)| of(line).into_iter().map(move |word| (number, word))).collect()
}

/// The files that are read, as paths from the root, in order.
fn files(root: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    let mut folders = vec![PathBuf::new()];
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(root.join(&folder)).expect("a folder").map(|entry| entry.expect("an entry")) {
            let name = entry.file_name().to_string_lossy().into_owned();
            let path = folder.join(&name);
            let kind = entry.file_type().expect("a kind");
            if EXEMPT.iter().any(|exempt| path == Path::new(exempt)) {
                continue;
            }
            if kind.is_dir() && !name.starts_with('.') && !GENERATED.contains(&name.as_str()) {
                folders.push(path);
            } else if kind.is_file() && path.extension().is_some_and(|end| READ.iter().any(|read| end == *read)) {
                found.push(path);
            }
        }
    }
    found.sort();
    found
}

#[test]
fn plain_words_are_used() {
    let root = Path::new(ROOT);
    let files = files(root);
    for kind in READ {
        assert!(files.iter().any(|path| path.extension().is_some_and(|end| end == kind)), "no .{kind} was read");
    }
    let mut places = Vec::new();
    for path in &files {
        let text = String::from_utf8_lossy(&fs::read(root.join(path)).expect("a file")).into_owned();
        let of_name = found(&path.to_string_lossy()).into_iter().map(|(_, word)| (0, word));
        places.extend(of_name.chain(found(&text)).map(|(line, word)| format!("{}:{line}: {word}", path.display())));
    }
    assert!(places.is_empty(), "find a plainer word:\n{}", places.join("\n"));
}

#[test]
fn a_word_is_found_however_it_is_written() {
    let text = "let told = 1;\n/// Begins Anew.\nfn it_is_told_twice() {}\nstruct WasToldOnce;\nlet told2 = LENT;\n";
    let wanted = [(1, "told"), (2, "anew"), (3, "told"), (4, "told"), (5, "told"), (5, "lent")];
    assert_eq!(found(text), wanted);
    assert_eq!(found("untold lentils, silent; talented, gather, needles\nnewly, restlessness"), []);
}

#[test]
fn files_are_read_at_any_depth_but_for_the_exempt() {
    let scratch = tempfile::tempdir().expect("a folder");
    let put = |name: &str| {
        let path = scratch.path().join(name);
        fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
        fs::write(path, "").expect("a file");
    };
    for name in ["a/b/c.rs", "d.m", "e.toml", "f.txt", "target/g.rs", ".tools/i.py", EXEMPT[0], EXEMPT[1]] {
        put(name);
    }
    let read = files(scratch.path());
    assert_eq!(read, ["a/b/c.rs", "d.m", "e.toml"].map(PathBuf::from));
}
