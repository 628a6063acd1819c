//! The `[[stage]]` tables.

use std::ops::Range;

use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::overrides::Override;
use super::place::Place;
use super::problem::{Origin, Problem};
use super::suggest::{did_you_mean, misspelt};
use super::value::{found, table};

/// A stage as a config declares it: not yet looked up, its parameters not yet read.
#[derive(Debug, Clone)]
pub struct StageDecl {
    /// Its id, unique; empty if it was missing.
    pub id: String,
    /// The stage's name in the registry; empty if it was missing.
    pub uses: String,
    /// Its wires, in the order of the text.
    pub inputs: Vec<Input>,
    /// Its parameters, with those of `--set`.
    pub params: toml::Table,
    /// Bytes of its header.
    pub header: Range<usize>,
    /// Bytes of the value of `id`; of the header if missing.
    pub id_span: Range<usize>,
    /// Bytes of the value of `uses`; of the header if missing.
    pub uses_span: Range<usize>,
    /// Bytes of the `inputs`; of the header if missing.
    pub inputs_span: Range<usize>,
    /// Where the parameters lie.
    pub params_place: Place,
    /// Whether `inputs` could be read.
    pub(crate) inputs_read: bool,
    /// Whether `params` could be read.
    pub(crate) params_read: bool,
    pub(super) overrides: Vec<Override>,
}

/// A wire as a config declares it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Input {
    /// The input port.
    pub port: String,
    /// `stage id` or `stage id.port`; empty if it was something else.
    pub target: String,
    /// Bytes of the port.
    pub port_span: Range<usize>,
    /// Bytes of the target.
    pub target_span: Range<usize>,
}

impl StageDecl {
    /// How messages call it.
    pub(crate) fn title(&self) -> String {
        if self.id.is_empty() { format!("stage `{}`", self.uses) } else { format!("stage `{}`", self.id) }
    }

    /// Where the parameter at `path` was written: its key if `key`, else its value; as far as the path leads.
    pub(crate) fn locate(&self, path: &[String], key: bool) -> (Origin, Range<usize>) {
        if let Some(place) = self.overrides.iter().rev().find_map(|set| set.locate(path, key)) {
            return place;
        }
        let (key_span, place, depth) = self.params_place.find(path);
        let span = if key && depth == path.len() { key_span } else { place.value.clone() };
        (Origin::Config, span)
    }

    /// What changed it, for messages: `--set` arguments, values of a sweep.
    pub(crate) fn changes(&self) -> Vec<String> {
        let named = |set: &Override| match set.is_argument() {
            true => format!("--set {}", set.text),
            false => format!("{} of [sweep]", set.text),
        };
        self.overrides.iter().map(named).collect()
    }
}

const KEYS: [&str; 4] = ["id", "uses", "inputs", "params"];

/// Reads one `[[stage]]` table, the `index`th.
pub(super) fn read(index: usize, stage: &Spanned<DeValue<'_>>, problems: &mut Vec<Problem>) -> Option<StageDecl> {
    let header = stage.span();
    let Some(entries) = stage.get_ref().as_table() else {
        let message = format!("stage {}: found {}, wanted a table", index + 1, found(stage.get_ref()));
        problems.push(Problem::new(message, header, "not a table").help("begin each stage with [[stage]]"));
        return None;
    };
    for (key, _) in entries.iter().filter(|(key, _)| !KEYS.contains(&key.get_ref().as_ref())) {
        let name = key.get_ref();
        let message = format!("a stage has no key `{name}`");
        let help = unknown_key_help(name);
        problems.push(Problem::new(message, key.span(), "unknown key").help(help));
    }
    let nth = format!("stage {}", index + 1);
    let (id, id_span) = text(entries, "id", &nth, &header, problems);
    let title = if id.is_empty() { nth } else { format!("stage `{id}`") };
    let (uses, uses_span) = text(entries, "uses", &title, &header, problems);
    let (inputs, inputs_span, inputs_read) = inputs(entries, &title, &header, problems);
    let before = problems.len();
    let (params, params_place) = params(entries, &title, &header, problems);
    let params_read = problems.len() == before && !(params.is_empty() && misspelt("params", &KEYS, entries));
    let overrides = Vec::new();
    Some(StageDecl {
        id,
        uses,
        inputs,
        params,
        header,
        id_span,
        uses_span,
        inputs_span,
        params_place,
        inputs_read,
        params_read,
        overrides,
    })
}

fn unknown_key_help(name: &str) -> String {
    match super::nearest(name, KEYS) {
        Some(key) => format!("did you mean `{key}`?"),
        None => format!("parameters go into `params = {{ {name} = ... }}`, wires into `inputs`"),
    }
}

fn text(
    entries: &DeTable<'_>,
    key: &str,
    title: &str,
    header: &Range<usize>,
    problems: &mut Vec<Problem>,
) -> (String, Range<usize>) {
    let Some(value) = entries.get(key) else {
        if misspelt(key, &KEYS, entries) {
            return (String::new(), header.clone());
        }
        let example = if key == "id" { "id = \"events\"" } else { "uses = \"events.correlation\"" };
        let problem = Problem::new(format!("{title} has no `{key}`"), header.clone(), format!("lacks `{key}`"));
        problems.push(problem.help(format!("add a line such as `{example}`")));
        return (String::new(), header.clone());
    };
    match value.get_ref().as_str() {
        Some(text) if !text.is_empty() => (text.to_owned(), value.span()),
        _ => {
            let message = format!("`{key}` of {title}: found {}, wanted text", found(value.get_ref()));
            problems.push(Problem::new(message, value.span(), "wanted text"));
            (String::new(), value.span())
        }
    }
}

fn inputs(
    entries: &DeTable<'_>,
    title: &str,
    header: &Range<usize>,
    problems: &mut Vec<Problem>,
) -> (Vec<Input>, Range<usize>, bool) {
    let Some(value) = entries.get("inputs") else {
        return (Vec::new(), header.clone(), !misspelt("inputs", &KEYS, entries));
    };
    let Some(wires) = value.get_ref().as_table() else {
        let message = format!("`inputs` of {title}: found {}, wanted a table", found(value.get_ref()));
        let help = "write `inputs = { port = \"stage id\" }`";
        problems.push(Problem::new(message, value.span(), "wanted a table").help(help));
        return (Vec::new(), value.span(), false);
    };
    let mut inputs: Vec<Input> = wires.iter().map(|(port, target)| input(port, target, title, problems)).collect();
    inputs.sort_by_key(|input| input.port_span.start);
    (inputs, value.span(), true)
}

fn input(
    port: &Spanned<std::borrow::Cow<'_, str>>,
    target: &Spanned<DeValue<'_>>,
    title: &str,
    problems: &mut Vec<Problem>,
) -> Input {
    let (name, port_span, target_span) = (port.get_ref().to_string(), port.span(), target.span());
    let problem = match target.get_ref() {
        DeValue::String(text) if !text.is_empty() => {
            return Input { port: name, target: text.to_string(), port_span, target_span };
        }
        DeValue::Array(wires) if wires.len() > 1 => {
            let message = format!("port `{name}` of {title} is wired {} times", wires.len());
            Problem::new(message, target.span(), "wanted one wire").help("a port takes one wire: remove the others")
        }
        other => {
            let message = format!("port `{name}` of {title}: found {}, wanted the id of a stage", found(other));
            Problem::new(message, target.span(), "not a wire").help("write `\"stage id\"` or `\"stage id.port\"`")
        }
    };
    problems.push(problem);
    Input { port: name, target: String::new(), port_span, target_span }
}

fn params(
    entries: &DeTable<'_>,
    title: &str,
    header: &Range<usize>,
    problems: &mut Vec<Problem>,
) -> (toml::Table, Place) {
    let Some(value) = entries.get("params") else {
        return (toml::Table::new(), Place::empty(header.clone()));
    };
    match value.get_ref().as_table() {
        Some(params) => (table(params, problems), Place::of(value, 0)),
        None => {
            let message = format!("`params` of {title}: found {}, wanted a table", found(value.get_ref()));
            let help = "write `params = { name = value }`";
            problems.push(Problem::new(message, value.span(), "wanted a table").help(help));
            (toml::Table::new(), Place::empty(value.span()))
        }
    }
}

/// The stage with this id, or what to say if there is none.
pub(super) fn find<'a>(stages: &'a mut [StageDecl], id: &str) -> Result<&'a mut StageDecl, String> {
    match stages.iter().position(|stage| stage.id == id) {
        Some(index) => Ok(&mut stages[index]),
        None => Err(did_you_mean(id, "stage", stages.iter().map(|stage| stage.id.as_str()))),
    }
}
