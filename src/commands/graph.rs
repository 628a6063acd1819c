//! `afmid graph`: the graph of a config as text, Mermaid or DOT.

use afmid_pipeline::graph::{Format, Node};
use afmid_pipeline::{Plan, Registry};
use serde_json::{Map, Value, json};

use super::load::load;
use crate::cli::{ConfigArgs, GraphFormat};
use crate::failure::Failure;
use crate::output::print;
use crate::show::pretty;

/// Draws the graph on stdout.
pub fn run(config: &ConfigArgs, format: GraphFormat, registry: &Registry) -> Result<(), Failure> {
    let plan = load(&config.config, &config.set, registry)?;
    print(&match format {
        GraphFormat::Text => plan.render(Format::Text),
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
        json!({ "id": node.id, "uses": node.uses, "inputs": inputs })
    };
    json!({ "pipeline": plan.name(), "stages": plan.nodes.iter().map(stage).collect::<Vec<_>>() })
}
