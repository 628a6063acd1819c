//! Wires: which output goes into which input.

use std::cell::Cell;
use std::collections::HashMap;
use std::ops::Range;

use super::plan;
use crate::config::{Input, Problem, StageDecl, did_you_mean, list, most_helped, nearest};
use crate::outcome::PortSpec;
use crate::stage::Entry;

/// A wire between declarations, with its place in the text.
#[derive(Debug, Clone)]
pub(super) struct Wire {
    pub port: &'static str,
    /// Index of the declaration that makes it.
    pub node: usize,
    pub output: &'static str,
    pub span: Range<usize>,
}

impl Wire {
    pub(super) fn wire(&self) -> plan::Wire {
        plan::Wire { port: self.port, node: self.node, output: self.output }
    }
}

/// The wires of every stage, in the order of its input ports. What cannot be connected is a problem; nothing is said of
/// stages that could not be looked up.
pub(super) fn connect(decls: &[StageDecl], entries: &[Option<Entry>], problems: &mut Vec<Problem>) -> Vec<Vec<Wire>> {
    // of two stages with one id, which is reported elsewhere, the first
    let mut places = HashMap::with_capacity(decls.len());
    decls.iter().enumerate().for_each(|(place, decl)| {
        places.entry(decl.id.as_str()).or_insert(place);
    });
    let board = Board { decls, entries, places, helped: Cell::new(0) };
    decls
        .iter()
        .zip(entries)
        .map(|(decl, entry)| match entry {
            Some(entry) => board.inputs(decl, entry, problems),
            None => Vec::new(),
        })
        .collect()
}

/// Stands for an output that is not known before a plugin has described itself.
const NOT_KNOWN: &str = "?";

struct Board<'a> {
    decls: &'a [StageDecl],
    entries: &'a [Option<Entry>],
    /// Of the stages, by their ids.
    places: HashMap<&'a str, usize>,
    /// Problems that came with a look at all stages.
    helped: Cell<usize>,
}

impl Board<'_> {
    /// Whether a problem comes with a look at all stages: the first ones do.
    fn helps(&self) -> bool {
        self.helped.set(self.helped.get() + 1);
        self.helped.get() <= most_helped(self.decls.len())
    }

    fn inputs(&self, decl: &StageDecl, entry: &Entry, problems: &mut Vec<Problem>) -> Vec<Wire> {
        let ports = entry.spec.inputs;
        let names = || ports.iter().map(|port| port.name);
        let mut misspelt = Vec::new();
        for input in decl.inputs.iter().filter(|input| ports.iter().all(|port| port.name != input.port)) {
            let message = format!("{} (`{}`) has no input `{}`", decl.title(), entry.spec.name, input.port);
            let help = did_you_mean(&input.port, "input", names());
            misspelt.extend(nearest(&input.port, names()));
            problems.push(Problem::new(message, input.port_span.clone(), "unknown port").help(help));
        }
        let mut wires = Vec::new();
        for port in ports {
            match decl.inputs.iter().find(|input| input.port == port.name) {
                Some(input) => match self.resolve((decl, entry), input, port) {
                    Ok(wire) => wires.extend(wire),
                    Err(problem) => problems.push(problem),
                },
                None if port.optional || !decl.inputs_read || misspelt.contains(&port.name) => {}
                None => problems.push(self.missing(decl, entry, port)),
            }
        }
        wires
    }

    /// The output that an input names; nothing if that was said already (its stage is unknown, the wire is none).
    fn resolve(
        &self,
        (reader, own): (&StageDecl, &Entry),
        input: &Input,
        port: &PortSpec,
    ) -> Result<Option<Wire>, Problem> {
        if input.target.is_empty() {
            return Ok(None);
        }
        let (id, output) = match input.target.split_once('.') {
            Some((id, output)) => (id, Some(output)),
            None => (input.target.as_str(), None),
        };
        let wrong = |message: String, label: &str| Problem::new(message, input.target_span.clone(), label);
        let Some(&node) = self.places.get(id) else {
            let ids = self.decls.iter().map(|decl| decl.id.as_str()).filter(|id| !id.is_empty());
            let help = self.helps().then(|| did_you_mean(id, "stage", ids));
            return Err(wrong(format!("input `{}`: there is no stage with the id `{id}`", port.name), "unknown id")
                .maybe_help(help));
        };
        let Some(entry) = &self.entries[node] else { return Ok(None) };
        let outputs = entry.spec.outputs;
        let made = |output| Ok(Some(Wire { port: port.name, node, output, span: input.target_span.clone() }));
        // nothing is known of its outputs but the names that the config gives them
        if !entry.is_described() {
            let named = output.and_then(|name| outputs.iter().find(|output| output.name == name));
            return made(named.map_or(NOT_KNOWN, |output| output.name));
        }
        let takes_any = !own.is_described();
        let chosen = match output {
            Some(name) => outputs.iter().find(|output| output.name == name).ok_or_else(|| {
                let help = did_you_mean(name, "output", outputs.iter().map(|output| output.name));
                wrong(format!("stage `{id}` (`{}`) has no output `{name}`", entry.spec.name), "unknown port").help(help)
            })?,
            None if takes_any => return made(if let [one] = outputs { one.name } else { NOT_KNOWN }),
            None => sole(id, outputs, port).map_err(|(message, label, help)| wrong(message, label).maybe_help(help))?,
        };
        if !takes_any && !fits(chosen, port) {
            let message =
                format!("`{id}.{}` is {}, input `{}` wants {}", chosen.name, kind(chosen), port.name, kind(port));
            return Err(wrong(message, "does not fit").maybe_help(self.fitting_help(reader, port)));
        }
        made(chosen.name)
    }

    fn missing(&self, decl: &StageDecl, entry: &Entry, port: &PortSpec) -> Problem {
        let message = format!("input `{}` of {} (`{}`) is not wired", port.name, decl.title(), entry.spec.name);
        let label = format!("lacks `{}`", port.name);
        if !self.helps() {
            return Problem::new(message, decl.inputs_span.clone(), label);
        }
        let help = match self.fitting(decl, port).as_slice() {
            [] => format!("it wants {} ({}); no stage of this config makes one", kind(port), port.doc),
            [one] => format!("write `inputs = {{ {} = \"{one}\" }}`", port.name),
            many => format!("it wants {}: {}", kind(port), list(many.iter().map(String::as_str))),
        };
        Problem::new(message, decl.inputs_span.clone(), label).help(help)
    }

    fn fitting_help(&self, reader: &StageDecl, port: &PortSpec) -> Option<String> {
        let fitting = if self.helps() { self.fitting(reader, port) } else { Vec::new() };
        (!fitting.is_empty()).then(|| format!("these fit: {}", list(fitting.iter().map(String::as_str))))
    }

    /// All outputs of other stages that fit a port, as `id.port`.
    fn fitting(&self, reader: &StageDecl, port: &PortSpec) -> Vec<String> {
        let other = |decl: &StageDecl| !decl.id.is_empty() && decl.id != reader.id;
        let stages = self.decls.iter().zip(self.entries).filter(|(decl, _)| other(decl));
        stages
            .filter_map(|(decl, entry)| Some((decl, entry.as_ref().filter(|entry| entry.is_described())?)))
            .flat_map(|(decl, entry)| {
                let outputs = entry.spec.outputs.iter().filter(|output| fits(output, port));
                outputs.map(|output| format!("{}.{}", decl.id, output.name))
            })
            .collect()
    }
}

/// The only output that fits a port. Errors: none, or several.
fn sole<'a>(
    id: &str,
    outputs: &'a [PortSpec],
    port: &PortSpec,
) -> Result<&'a PortSpec, (String, &'static str, Option<String>)> {
    let fitting: Vec<&PortSpec> = outputs.iter().filter(|output| fits(output, port)).collect();
    match fitting.as_slice() {
        [one] => Ok(one),
        [] => {
            let made: Vec<String> =
                outputs.iter().map(|output| format!("`{}` is {}", output.name, kind(output))).collect();
            let help = if made.is_empty() { "it makes nothing".to_owned() } else { made.join("; ") };
            let message = format!("stage `{id}` makes nothing that fits input `{}`: wanted {}", port.name, kind(port));
            Err((message, "does not fit", Some(help)))
        }
        many => {
            let names: Vec<String> = many.iter().map(|output| format!("{id}.{}", output.name)).collect();
            let message = format!("stage `{id}` makes {} outputs that fit input `{}`", many.len(), port.name);
            Err((message, "ambiguous", Some(format!("name one: {}", list(names.iter().map(String::as_str))))))
        }
    }
}

/// Whether an output may go into an input: the same shape, and the same meaning unless the input takes any.
fn fits(output: &PortSpec, input: &PortSpec) -> bool {
    output.shape == input.shape && (input.tag.is_empty() || input.tag == output.tag)
}

/// Shape and meaning, for messages.
fn kind(port: &PortSpec) -> String {
    let article = if port.shape.name().starts_with('a') { "an" } else { "a" };
    match port.tag {
        "" => format!("{article} {}", port.shape.name()),
        tag => format!("{article} {} tagged `{tag}`", port.shape.name()),
    }
}
