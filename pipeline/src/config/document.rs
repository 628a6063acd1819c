//! From text to a TOML document with places.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::problem::Problem;
use super::suggest::most_helped;

/// A parsed document and its problems. `usable` is false if the syntax is so broken that further checks would mislead.
pub(super) struct Document<'a> {
    pub root: DeTable<'a>,
    pub usable: bool,
}

/// The parser's word for a key that is given twice.
const DUPLICATE: &str = "duplicate key";

/// Parses the text, with all syntax errors at once.
pub(super) fn parse<'a>(text: &'a str, problems: &mut Vec<Problem>) -> Document<'a> {
    let (root, errors) = DeTable::parse_recoverable(text);
    let root = root.into_inner();
    let mut usable = true;
    // behind broken syntax the parser sees tables where there are none: keys that seem to be given twice mostly are not
    let broken = errors.iter().filter(|error| error.message() != DUPLICATE);
    let broken = broken.map(|error| error.span().unwrap_or_default().start).min().unwrap_or(text.len());
    let stages = root.get("stage").and_then(|stages| stages.get_ref().as_array()).map_or(0, |stages| stages.len());
    let (mut looked_up, helped) = (0, most_helped(stages));
    for error in errors {
        let span = error.span().unwrap_or_default();
        if error.message() == DUPLICATE {
            if span.start > broken {
                continue;
            }
            // every stage is looked at for each: the first ones, which are printed, get better help
            looked_up += 1;
            problems.push(duplicate(text, &root, span, looked_up <= helped));
        } else {
            usable = false;
            problems.push(syntax(text, error.message(), span));
        }
    }
    Document { root, usable }
}

fn syntax(text: &str, message: &str, span: Range<usize>) -> Problem {
    let word = text.get(span.clone()).unwrap_or_default();
    if word.starts_with(char::is_alphabetic) {
        let message = format!("`{word}` is not a TOML value");
        return Problem::new(message, span, "not TOML").help(format!("text needs quotes: {word:?}"));
    }
    let message = message.replace(", expected ", ", wanted ");
    Problem::new(message, span, "here").help("a config is TOML: https://toml.io")
}

/// A key that is given twice; within `inputs`, a port that is wired twice.
fn duplicate(text: &str, root: &DeTable<'_>, span: Range<usize>, look_up: bool) -> Problem {
    let key = text.get(span.clone()).unwrap_or_default();
    let stages = root.get("stage").filter(|_| look_up).and_then(|stages| stages.get_ref().as_array());
    let is_input = stages.into_iter().flatten().filter_map(|stage| stage.get_ref().get("inputs")).any(|inputs| {
        let own = inputs.span();
        own.contains(&span.start) || entries_after_header(inputs).any(|entry| within(text, own.end, entry, &span))
    });
    if is_input {
        return Problem::new(format!("port `{key}` is wired twice"), span, "wired before")
            .help("a port takes one wire: remove one");
    }
    Problem::new(format!("the key `{key}` is given twice"), span, "given before").help("remove one")
}

fn entries_after_header<'a>(inputs: &'a Spanned<DeValue<'_>>) -> impl Iterator<Item = Range<usize>> + 'a {
    inputs.get_ref().as_table().into_iter().flatten().map(|(key, _)| key.span())
}

/// Whether `span` follows `entry` in the table whose header ends at `header`, before another header.
fn within(text: &str, header: usize, entry: Range<usize>, span: &Range<usize>) -> bool {
    header <= entry.start
        && entry.start < span.start
        && text.get(entry.end..span.start).is_some_and(|between| !between.contains("\n["))
}
