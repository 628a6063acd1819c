//! The second step: from a `params` table to the stage itself.

use std::collections::HashMap;

use serde_json::Value;

use super::problem::Problem;
use super::stage::StageDecl;
use super::suggest::did_you_mean;
use crate::error::StageError;
use crate::stage::{Bounds, DynStage, Entry, ParamError};

/// The ranges that the schemas of stages state, each schema made once.
#[derive(Debug, Default)]
pub(crate) struct Ranges(HashMap<&'static str, Bounds>);

impl Ranges {
    fn of(&mut self, entry: &Entry) -> &Bounds {
        self.0.entry(entry.spec.name).or_insert_with(|| Bounds::of(entry))
    }
}

/// Makes the stage from its `params`. Errors: one problem per wrong parameter, each at its value or key.
pub(crate) fn instantiate(
    decl: &StageDecl,
    entry: &Entry,
    ranges: &mut Ranges,
) -> Result<(Box<dyn DynStage>, Value), Vec<Problem>> {
    let mut problems = Vec::new();
    let mut params = decl.params.clone();
    // serde stops at the first error: take the wrong parameter out and go on, so that all are seen at once
    let stage = loop {
        match entry.parse(params.clone()) {
            Ok(stage) => break Some(stage),
            Err(error) => {
                let kind = Kind::of(&error);
                let path = steps(&error.path);
                let at_root = matches!(&kind, Kind::Missing(_)) && path.is_empty();
                if !at_root {
                    problems.push(describe(decl, entry, ranges, &path, &kind, &error));
                }
                let Some(key) = path.first().filter(|key| params.contains_key(key.as_str())) else {
                    problems.extend(missing(decl, entry, &kind));
                    break None;
                };
                params.remove(key);
            }
        }
    };
    let outside = if params.is_empty() { Vec::new() } else { ranges.of(entry).check(&params) };
    for wrong in &outside {
        let error = StageError::new(format!("`{}` {}", dotted(&wrong.path), wrong.message));
        problems.push(unchecked(decl, &error.help(wrong.doc.clone())));
    }
    let Some(stage) = stage else { return Err(problems) };
    // with a parameter left out or out of its range, what relates others to it says nothing
    if problems.is_empty() {
        problems.extend(stage.faults().iter().map(|error| unchecked(decl, error)));
    }
    if !problems.is_empty() {
        return Err(problems);
    }
    let resolved = stage.params().map_err(|error| vec![unchecked(decl, &error)])?;
    Ok((stage, resolved))
}

/// What serde found wrong, as far as its wording tells.
enum Kind {
    Unknown(String),
    Missing(String),
    Variant(String),
    Other,
}

impl Kind {
    fn of(error: &ParamError) -> Self {
        let name = || quoted(&error.message).next().unwrap_or_default().to_owned();
        if error.message.starts_with("unknown field") {
            Self::Unknown(name())
        } else if error.message.starts_with("missing field") {
            Self::Missing(name())
        } else if error.message.starts_with("unknown variant") {
            Self::Variant(name())
        } else {
            Self::Other
        }
    }
}

fn describe(
    decl: &StageDecl,
    entry: &Entry,
    ranges: &mut Ranges,
    path: &[String],
    kind: &Kind,
    error: &ParamError,
) -> Problem {
    let (title, name) = (decl.title(), entry.spec.name);
    let known = || quoted(&error.message).skip(1);
    let dotted = dotted(path);
    match kind {
        Kind::Unknown(field) => {
            let owner = match dotted.rsplit_once('.') {
                Some((owner, _)) => format!("`{owner}` of {title}"),
                None => format!("{title} (`{name}`)"),
            };
            let place = decl.locate(path, true);
            Problem::new(format!("{owner} has no parameter `{field}`"), 0..0, "unknown parameter")
                .at(place)
                .help(did_you_mean(field, "parameter to set", known()))
        }
        Kind::Missing(field) => lacks(decl, entry, path, field),
        Kind::Variant(found) => {
            let wanted = known().map(|name| format!("{name:?}")).collect::<Vec<_>>().join(" or ");
            let message = format!("parameter `{dotted}` of {title}: found {found:?}, wanted {wanted}");
            let nearest = super::nearest(found, known()).map(|name| format!("did you mean {name:?}?"));
            Problem::new(message, 0..0, "not one of these").at(decl.locate(path, false)).maybe_help(nearest)
        }
        Kind::Other => {
            let subject = if path.is_empty() { title } else { format!("parameter `{dotted}` of {title}") };
            let message = ranged(entry, ranges, path, &error.message).unwrap_or_else(|| plain(&error.message));
            Problem::new(format!("{subject}: {message}"), 0..0, "wrong value")
                .at(decl.locate(path, false))
                .help(entry.manual())
        }
    }
}

/// The message about a negative number where a count is wanted, with the parameter's range.
fn ranged(entry: &Entry, ranges: &mut Ranges, path: &[String], message: &str) -> Option<String> {
    let negative = message.strip_prefix("invalid value: integer `-").is_some();
    if !negative || !(message.ends_with(" usize") || message.ends_with(" u64")) {
        return None;
    }
    let range = ranges.of(entry).range(path);
    let plain = plain(message);
    let (found, _) = plain.split_once(", wanted ").filter(|_| !range.is_empty())?;
    Some(format!("{found}, wanted {range}"))
}

/// All parameters without default that are not given; at least the one that was found missing, if it is none that is
/// wrong.
fn missing(decl: &StageDecl, entry: &Entry, found: &Kind) -> Vec<Problem> {
    let schema = entry.schema(&mut schemars::SchemaGenerator::default());
    let required = schema.get("required").and_then(Value::as_array).into_iter().flatten().filter_map(Value::as_str);
    let mut names: Vec<&str> = required.filter(|name| !decl.params.contains_key(*name)).collect();
    if let Kind::Missing(name) = found
        && !names.contains(&name.as_str())
        && !decl.params.contains_key(name)
    {
        names.push(name);
    }
    names.into_iter().map(|name| lacks(decl, entry, &[], name)).collect()
}

fn lacks(decl: &StageDecl, entry: &Entry, path: &[String], field: &str) -> Problem {
    let name = entry.spec.name;
    let full = if path.is_empty() { field.to_owned() } else { format!("{}.{field}", dotted(path)) };
    Problem::new(format!("{} (`{name}`) lacks the parameter `{full}`", decl.title()), 0..0, format!("lacks `{field}`"))
        .at(decl.locate(path, false))
        .help(format!("it has no default: add `{field} = ...`; {}", entry.manual()))
}

/// A parameter out of its range, or the error of [`DynStage::check`]: at the parameter that its message begins with, or
/// at the whole table.
fn unchecked(decl: &StageDecl, error: &StageError) -> Problem {
    let message = error.to_string();
    let named = message.starts_with('`').then(|| quoted(&message).next().map(steps)).flatten().unwrap_or_default();
    let changes = decl.changes();
    let note = (named.is_empty() && !changes.is_empty()).then(|| format!("with {}", changes.join(" ")));
    let help = match (&error.help, note) {
        (Some(help), Some(note)) => Some(format!("{help} ({note})")),
        (help, note) => help.clone().or(note),
    };
    let label = if named.is_empty() { "these parameters" } else { "out of range" };
    Problem::new(format!("{}: {message}", decl.title()), 0..0, label).at(decl.locate(&named, false)).maybe_help(help)
}

/// The steps of a path such as `list[2].a`.
fn steps(path: &str) -> Vec<String> {
    path.split(['.', '[', ']']).filter(|step| !step.is_empty()).map(str::to_owned).collect()
}

/// A path for people, `list[2].a`.
fn dotted(path: &[String]) -> String {
    path.iter().enumerate().fold(String::new(), |mut text, (depth, step)| {
        match step.bytes().all(|byte| byte.is_ascii_digit()) {
            true => text.push_str(&format!("[{step}]")),
            false if depth > 0 => text.push_str(&format!(".{step}")),
            false => text.push_str(step),
        }
        text
    })
}

/// The words in backquotes.
fn quoted(message: &str) -> impl Iterator<Item = &str> + Clone {
    message.split('`').skip(1).step_by(2)
}

/// serde's wording in the terms of a config: `found the string "x", wanted a number`.
fn plain(message: &str) -> String {
    let Some((found, wanted)) = message.split_once(", expected ") else { return message.to_owned() };
    let found = found.strip_prefix("invalid type: ").or(found.strip_prefix("invalid value: ")).unwrap_or(found);
    let words = [
        ("integer ", "the integer "),
        ("floating point ", "the number "),
        ("string ", "the string "),
        ("boolean ", "the flag "),
        ("sequence", "an array"),
        ("map", "a table"),
        ("unit variant", "a value of another kind"),
        ("invalid length ", "length "),
    ];
    let found = words
        .iter()
        .find_map(|(word, ours)| found.strip_prefix(word).map(|rest| format!("{ours}{rest}")))
        .unwrap_or_else(|| found.to_owned());
    let wanted = match wanted {
        "f64" | "f32" => "a number".to_owned(),
        "a sequence" => "an array".to_owned(),
        "a boolean" => "true or false".to_owned(),
        "a string" | "string only" => "text".to_owned(),
        "u8" => whole(0, u8::MAX),
        "u16" => whole(0, u16::MAX),
        "u32" => whole(0, u32::MAX),
        "u64" | "usize" => "a whole number, 0 or more".to_owned(),
        "i8" => whole(i8::MIN, i8::MAX),
        "i16" => whole(i16::MIN, i16::MAX),
        "i32" => whole(i32::MIN, i32::MAX),
        "i64" | "isize" => "a whole number".to_owned(),
        _ if wanted.starts_with("struct ") || wanted.starts_with("a map") => "a table".to_owned(),
        _ if wanted.starts_with("a nonzero ") => "a whole number above 0".to_owned(),
        _ => wanted.to_owned(),
    };
    format!("found {found}, wanted {wanted}")
}

fn whole(low: impl std::fmt::Display, high: impl std::fmt::Display) -> String {
    format!("a whole number from {low} to {high}")
}
