//! From a config and a registry to a checked, ordered graph.

use std::sync::Arc;

use serde_json::Value;

use super::{Stages, order, sweep, wiring};
use crate::config::{Config, Problem, Ranges, StageDecl, instantiate, most_helped, nearest};
use crate::stage::{DynStage, Entry};

/// A checked graph: what the runner runs. Cloning is cheap: stages are shared.
#[derive(Clone)]
pub struct Plan {
    /// The stages in topological order; among those that are ready, in the order of the config.
    pub nodes: Vec<Node>,
    /// The config that it was made from.
    pub config: Config,
}

/// A stage of a graph.
#[derive(Clone)]
pub struct Node {
    /// Its id.
    pub id: String,
    /// Its name in the registry.
    pub uses: String,
    /// Its row of the registry.
    pub entry: Entry,
    /// The stage.
    pub stage: Arc<dyn DynStage>,
    /// All its parameters, defaults filled in.
    pub params: Value,
    /// Its wires, in the order of its input ports.
    pub inputs: Vec<Wire>,
}

/// A wire: an input port and the output that it takes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Wire {
    /// The input port.
    pub port: &'static str,
    /// Index of the node that makes it.
    pub node: usize,
    /// That node's output port.
    pub output: &'static str,
}

impl Plan {
    /// The pipeline's name.
    pub fn name(&self) -> &str {
        &self.config.name
    }

    /// The pipeline's seed.
    pub fn seed(&self) -> u64 {
        self.config.seed
    }

    /// The config, byte for byte as it was read.
    pub fn config_text(&self) -> &str {
        &self.config.text
    }

    /// The node with this id.
    pub fn node(&self, id: &str) -> Option<&Node> {
        self.nodes.iter().find(|node| node.id == id)
    }

    /// The nodes whose ports nobody knows yet: plugins that were never asked to describe themselves. Their wires are
    /// not checked, and they do not run.
    pub fn not_described(&self) -> impl Iterator<Item = &Node> {
        self.nodes.iter().filter(|node| !node.entry.is_described())
    }
}

impl std::fmt::Debug for Plan {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Plan").field("name", &self.config.name).field("nodes", &self.nodes).finish()
    }
}

impl std::fmt::Debug for Node {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { id, uses, params, inputs, .. } = self;
        f.debug_struct("Node")
            .field("id", id)
            .field("uses", uses)
            .field("params", params)
            .field("inputs", inputs)
            .finish()
    }
}

/// Reads a config, applies `--set` arguments and plans it with the stages that `stages` knows, such as a registry.
/// Errors: everything that can be wrong without opening data, at once, in the order of the text.
pub fn load(file: &str, text: &str, arguments: &[String], stages: &dyn Stages) -> Result<Plan, Vec<Problem>> {
    let (config, mut problems, usable) = Config::read(file, text, arguments);
    let plan = if usable { try_plan(config, stages, &mut problems) } else { None };
    settle(plan, problems, arguments)
}

/// Plans a config: stages, parameters, wires, cycles. Errors: all that is wrong, at once, in the order of the text.
pub fn plan(config: Config, stages: &dyn Stages) -> Result<Plan, Vec<Problem>> {
    let mut problems = Vec::new();
    let arguments = config.overrides.clone();
    let plan = try_plan(config, stages, &mut problems);
    settle(plan, problems, &arguments)
}

fn settle(plan: Option<Plan>, mut problems: Vec<Problem>, arguments: &[String]) -> Result<Plan, Vec<Problem>> {
    Problem::sort(&mut problems, arguments);
    match plan {
        Some(plan) if problems.is_empty() => Ok(plan),
        _ => Err(problems),
    }
}

fn try_plan(config: Config, known: &dyn Stages, problems: &mut Vec<Problem>) -> Option<Plan> {
    let mut unknown = 0;
    let entries: Vec<Option<Entry>> =
        config.stages.iter().map(|stage| find(stage, &config, known, &mut unknown, problems)).collect();
    let mut ranges = Ranges::default();
    let stages: Vec<_> = config
        .stages
        .iter()
        .zip(&entries)
        .map(|(decl, entry)| match instantiate(decl, entry.as_ref().filter(|_| decl.params_read)?, &mut ranges) {
            Ok(stage) => Some(stage),
            Err(wrong) => {
                problems.extend(wrong);
                None
            }
        })
        .collect();
    sweep::check(&config, &entries, &mut ranges, problems);
    let wires = wiring::connect(&config.stages, &entries, problems);
    let order = order::topological(&config.stages, &wires, problems)?;
    let mut places = vec![None; order.len()];
    order.iter().enumerate().for_each(|(place, &index)| places[index] = Some(place));
    let mut parts: Vec<_> = stages.into_iter().zip(wires).map(Some).collect();
    let mut nodes = Vec::with_capacity(order.len());
    for &index in &order {
        let (stage, wires) = parts.get_mut(index)?.take()?;
        let (stage, params) = stage?;
        let (decl, entry) = (&config.stages[index], entries[index]?);
        let inputs = wires
            .iter()
            .filter_map(|wire| Some(Wire { node: *places.get(wire.node)?.as_ref()?, ..wire.wire() }))
            .collect();
        nodes.push(Node { id: decl.id.clone(), uses: decl.uses.clone(), entry, stage: stage.into(), params, inputs });
    }
    Some(Plan { nodes, config })
}

fn find(
    decl: &StageDecl,
    config: &Config,
    known: &dyn Stages,
    unknown: &mut usize,
    problems: &mut Vec<Problem>,
) -> Option<Entry> {
    if decl.uses.is_empty() {
        return None;
    }
    let registry = known.registry();
    if let Some(entry) = registry.find(&decl.uses) {
        return Some(*entry);
    }
    let found = match decl.uses.strip_prefix("exec:") {
        Some(name) => known.process(decl, name, config),
        None => {
            *unknown += 1;
            // the first ones, which are printed, get better help
            let names = registry
                .entries()
                .iter()
                .map(|entry| entry.spec.name)
                .filter(|_| *unknown <= most_helped(registry.entries().len()));
            let nearest = nearest(&decl.uses, names);
            let help = match nearest {
                Some(name) => format!("did you mean `{name}`?"),
                None => "`afmid stages` lists all stages".to_owned(),
            };
            let message = format!("there is no stage named `{}`", decl.uses);
            Err(Problem::new(message, decl.uses_span.clone(), "unknown stage").help(help))
        }
    };
    found.map_err(|problem| problems.push(problem)).ok()
}
