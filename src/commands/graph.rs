//! `afmid graph`: the graph of a config as text, Mermaid or DOT.

use afmid_pipeline::Plan;
use afmid_pipeline::graph::{Format, Node, Stages};
use serde_json::{Map, Value, json};

use super::check::not_checked;
use super::load::load;
use crate::cli::{ConfigArgs, GraphFormat};
use crate::failure::Failure;
use crate::output::print;
use crate::show::pretty;

/// Draws the graph on stdout.
pub fn run(config: &ConfigArgs, format: GraphFormat, stages: &dyn Stages) -> Result<(), Failure> {
    let plan = load(&config.config, &config.set, stages)?;
    print(&match format {
        GraphFormat::Text => plan.render(Format::Text) + &not_checked(&plan),
        GraphFormat::Mermaid => plan.render(Format::Mermaid),
        GraphFormat::Dot => plan.render(Format::Dot),
        GraphFormat::Json => pretty(&as_json(&plan))?,
    })
}

/// The stages in topological order, each with the outputs that its inputs take: `STAGE.OUTPUT`.
fn as_json(plan: &Plan) -> Value {
    let stage = |node: &Node| {
        let inputs: Map<String, Value> = node
            .inputs
            .iter()
            .map(|wire| (wire.port.to_owned(), json!(format!("{}.{}", plan.nodes[wire.node].id, wire.output))))
            .collect();
        json!({ "id": node.id, "uses": node.uses, "ports_checked": node.entry.is_described(), "inputs": inputs })
    };
    json!({ "pipeline": plan.name(), "stages": plan.nodes.iter().map(stage).collect::<Vec<_>>() })
}
