//! `afmid graph`: the graph of a config as text, Mermaid or DOT.

use afmid_pipeline::Registry;
use afmid_pipeline::graph::Format;

use super::load::load;
use crate::cli::{ConfigArgs, GraphFormat};
use crate::failure::Failure;
use crate::output::print;

/// Draws the graph on stdout.
pub fn run(config: &ConfigArgs, format: GraphFormat, registry: &Registry) -> Result<(), Failure> {
    let plan = load(&config.config, &config.set, registry)?;
    let format = match format {
        GraphFormat::Text => Format::Text,
        GraphFormat::Mermaid => Format::Mermaid,
        GraphFormat::Dot => Format::Dot,
    };
    print(&plan.render(format))
}
