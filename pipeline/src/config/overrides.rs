//! `--set ID.PARAM=VALUE`.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::RESERVED_ID;
use super::place::Place;
use super::problem::{Origin, Problem};
use super::read::Config;
use super::suggest::did_you_mean;
use super::value::plain;
use super::{pipeline, stage};

/// A `--set` argument: a parameter's path and its new value.
#[derive(Debug, Clone)]
pub struct Override {
    /// As it was typed, or would be.
    pub(super) text: String,
    /// The text that its places refer to.
    origin: Origin,
    /// Stage id, then the path within `params`; with the bytes of each step.
    path: Vec<(String, Range<usize>)>,
    /// The value.
    value: toml::Value,
    /// Where the value lies.
    place: Place,
}

const FORM: &str = "write `--set ID.PARAM=VALUE`, such as `--set fit.order=11`";

impl Override {
    /// Parses `ID.PARAM=VALUE`; VALUE is TOML or bare text, and PARAM may lead into a table (`ID.a.b`). Errors: another
    /// form.
    pub fn parse(text: &str) -> Result<Self, Problem> {
        let Some(equals) = equals_sign(text) else {
            return Err(problem(text, "the argument has no `=`", 0..text.len(), "wanted ID.PARAM=VALUE", FORM));
        };
        let path = path(text, equals)?;
        let offset = equals + 1;
        let (rest, pad) = trimmed(&text[offset..]);
        let value = value_of(rest).map_err(|error| {
            let at = offset + pad;
            let span = error.span().map_or(at..text.len(), |span| span.start + at..span.end + at);
            problem(text, &error.message().replace(", expected ", ", wanted "), span, "not TOML", &value_help(rest))
        })?;
        let mut problems = Vec::new();
        let place = Place::of(&value, offset + pad);
        let plain = plain(&value, &mut problems);
        match problems.pop() {
            Some(wrong) => {
                let span = wrong.span.start + offset + pad..wrong.span.end + offset + pad;
                Err(wrong.at((Origin::Argument(text.to_owned()), span)))
            }
            None => {
                Ok(Self { text: text.to_owned(), origin: Origin::Argument(text.to_owned()), path, value: plain, place })
            }
        }
    }

    /// A value of a sweep: as a `--set` argument, with its places in the config.
    pub(super) fn swept(
        path: &[(String, Range<usize>)],
        value: &Spanned<DeValue<'_>>,
        problems: &mut Vec<Problem>,
    ) -> Self {
        let (plain, place) = (plain(value, problems), Place::of(value, 0));
        let text = format!("{}={plain}", dotted(path));
        Self { text, origin: Origin::Config, path: path.to_vec(), value: plain, place }
    }

    /// As it would be typed: `ID.PARAM=VALUE`.
    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    /// The id of the stage that it changes.
    pub(crate) fn stage(&self) -> Option<&str> {
        self.path.first().map(|(id, _)| id.as_str())
    }

    /// The value as JSON.
    pub(crate) fn json(&self) -> serde_json::Value {
        match &self.value {
            toml::Value::Datetime(time) => time.to_string().into(),
            value => serde_json::to_value(value).unwrap_or_default(),
        }
    }

    /// Whether one of two sets what the other sets, or a part of it.
    pub(super) fn overlaps(&self, other: &Self) -> bool {
        self.path.iter().zip(&other.path).all(|((own, _), (other, _))| own == other)
    }

    /// Whether it was typed as an argument.
    pub(super) fn is_argument(&self) -> bool {
        self.origin != Origin::Config
    }

    /// Where this argument set the parameter at `path`, if it did.
    pub(super) fn locate(&self, path: &[String], key: bool) -> Option<(Origin, Range<usize>)> {
        let own = self.path.get(1..).unwrap_or_default();
        let shared = own.iter().zip(path).take_while(|((step, _), wanted)| step == *wanted).count();
        let span = if path.is_empty() || shared < own.len().min(path.len()) {
            return None;
        } else if path.len() > own.len() {
            let (span, place, depth) = self.place.find(&path[own.len()..]);
            if key && depth > 0 { span } else { place.value.clone() }
        } else if key || path.len() < own.len() {
            own[path.len() - 1].1.clone()
        } else {
            self.place.value.clone()
        };
        Some((self.origin.clone(), span))
    }

    fn wrong(&self, message: &str, span: Range<usize>, label: &str, help: &str) -> Problem {
        Problem::new(message, span.clone(), label).at((self.origin.clone(), span)).help(help)
    }
}

/// Applies an argument. Errors: an unknown stage; a path through something that is not a table.
pub(super) fn apply(set: Override, config: &mut Config) -> Result<(), Problem> {
    let Some((id, id_span)) = set.path.first().cloned() else { return Ok(()) };
    if id == RESERVED_ID {
        return apply_to_pipeline(&set, config);
    }
    let stage = stage::find(&mut config.stages, &id)
        .map_err(|help| set.wrong(&format!("there is no stage `{id}`"), id_span, "unknown stage", &help))?;
    let [_, steps @ .., (last, _)] = set.path.as_slice() else {
        return Err(set.wrong("the argument names no parameter", 0..id.len(), "wanted ID.PARAM", FORM));
    };
    let mut table = &mut stage.params;
    for (step, span) in steps {
        let entry = table.entry(step.clone()).or_insert_with(|| toml::Value::Table(toml::Table::new()));
        table = match entry {
            toml::Value::Table(inner) => inner,
            other => {
                let message = format!("`{step}` of stage `{id}`: found {}, wanted a table", other.type_str());
                return Err(set.wrong(&message, span.clone(), "not a table", "set it as a whole"));
            }
        };
    }
    table.insert(last.clone(), set.value.clone());
    stage.overrides.push(set);
    Ok(())
}

fn apply_to_pipeline(set: &Override, config: &mut Config) -> Result<(), Problem> {
    let [_, (key, span)] = set.path.as_slice() else {
        let span = 0..set.path.last().map_or(0, |(_, span)| span.end);
        return Err(problem(&set.text, "wanted `pipeline.seed` or `pipeline.name`", span, "not a key", FORM));
    };
    let start = set.place.value.start;
    let value = value_of(set.text.get(set.place.value.clone()).unwrap_or_default())
        .unwrap_or_else(|_| Spanned::new(0..0, DeValue::Boolean(false)));
    let here = |wrong: Problem| {
        let span = wrong.span.start + start..wrong.span.end + start;
        wrong.at((Origin::Argument(set.text.clone()), span))
    };
    match key.as_str() {
        "seed" => config.seed = pipeline::seed(&value).map_err(here)?,
        "name" => config.name = pipeline::name(&value).map_err(here)?,
        other => {
            let help = did_you_mean(other, "key", pipeline::KEYS.into_iter());
            let message = format!("[pipeline] has no key `{other}`");
            return Err(problem(&set.text, &message, span.clone(), "unknown key", &help));
        }
    }
    Ok(())
}

/// The steps of a dotted key such as `fit.order`, as TOML reads it.
pub(super) fn steps(key: &str) -> Option<Vec<String>> {
    let line = format!("{key}=");
    let path = path(&line, key.len()).ok()?;
    Some(path.into_iter().map(|(step, _)| step).collect())
}

/// A path as a dotted key.
pub(super) fn dotted(path: &[(String, Range<usize>)]) -> String {
    let bare =
        |step: &str| !step.is_empty() && step.chars().all(|c| c.is_ascii_alphanumeric() || matches!(c, '_' | '-'));
    let step = |(step, _): &(String, _)| if bare(step) { step.clone() } else { format!("{step:?}") };
    path.iter().map(step).collect::<Vec<String>>().join(".")
}

/// Where the first `=` outside quotes lies.
fn equals_sign(text: &str) -> Option<usize> {
    let mut quote = None;
    for (place, c) in text.char_indices() {
        match (c, quote) {
            ('"' | '\'', None) => quote = Some(c),
            (c, Some(open)) if c == open => quote = None,
            ('=', None) => return Some(place),
            _ => {}
        }
    }
    None
}

/// The dotted key before the `=`, as TOML reads it.
fn path(text: &str, equals: usize) -> Result<Vec<(String, Range<usize>)>, Problem> {
    let wrong = |span| problem(text, "found no dotted key before the `=`", span, "wanted ID.PARAM", FORM);
    let key = &text[..equals];
    let line = format!("{key}=0");
    if key.contains(['\n', '\r', '#', '[', '{']) {
        return Err(wrong(0..equals));
    }
    let root = DeTable::parse(&line).map_err(|_| wrong(0..equals))?.into_inner();
    let (mut path, mut table) = (Vec::new(), &root);
    while let Some((key, value)) = table.iter().next() {
        path.push((key.get_ref().to_string(), key.span()));
        match value.get_ref().as_table() {
            Some(inner) => table = inner,
            None => break,
        }
    }
    if path.is_empty() { Err(wrong(0..equals)) } else { Ok(path) }
}

/// The value without white space around it, and how much was before it.
fn trimmed(text: &str) -> (&str, usize) {
    let rest = text.trim_start();
    (rest.trim_end(), text.len() - rest.len())
}

/// The value as TOML reads it; what is no TOML, and does not begin as quoted text, a list or a table, is text as it
/// stands. Errors: those of TOML.
fn value_of(rest: &str) -> Result<Spanned<DeValue<'_>>, toml::de::Error> {
    let bare = !rest.is_empty() && !rest.starts_with(['"', '\'', '[', '{']) && !rest.contains(char::is_control);
    match DeValue::parse(rest) {
        Err(_) if bare => Ok(Spanned::new(0..rest.len(), DeValue::String(rest.into()))),
        parsed => parsed,
    }
}

fn value_help(rest: &str) -> String {
    if rest.is_empty() {
        return FORM.to_owned();
    }
    "VALUE is TOML or bare text; lists of texts take quotes, as in `--set 'ID.PARAM=[\"a\", \"b\"]'`".to_owned()
}

fn problem(text: &str, message: &str, span: Range<usize>, label: &str, help: &str) -> Problem {
    Problem::new(message, span.clone(), label).at((Origin::Argument(text.to_owned()), span)).help(help)
}
