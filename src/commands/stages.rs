//! `afmid stages`: the registry's own documentation.

use afmid_pipeline::config::nearest;
use afmid_pipeline::reference::{Examples, page};
use afmid_pipeline::{Entry, Registry};

use afmid_pipeline::PortSpec;
use afmid_pipeline::schemars::SchemaGenerator;
use serde_json::{Value, json};

use crate::failure::Failure;
use crate::output::print;
use crate::show::pretty;

/// Lists all stages, or prints the page of one.
pub fn run(name: Option<&str>, as_json: bool, registry: &Registry) -> Result<(), Failure> {
    let Some(name) = name else {
        if as_json {
            return print(&pretty(&registry.entries().iter().map(described).collect::<Vec<_>>())?);
        }
        let width = registry.entries().iter().map(|entry| entry.spec.name.len()).max().unwrap_or(0);
        let line = |entry: &Entry| format!("{:width$}  {}\n", entry.spec.name, entry.spec.summary);
        return print(&registry.entries().iter().map(line).collect::<String>());
    };
    let Some(entry) = registry.find(name) else {
        let nearest = nearest(name, registry.entries().iter().map(|entry| entry.spec.name));
        let help =
            nearest.map_or("`afmid stages` lists all".to_owned(), |nearest| format!("did you mean `{nearest}`?"));
        return Err(Failure::usage(format!("there is no stage named `{name}`"), Some(help)));
    };
    if as_json {
        return print(&pretty(&described(entry))?);
    }
    print(&page(entry, Examples::Shown).map_err(|error| Failure::failed(error, None))?)
}

fn described(entry: &Entry) -> Value {
    let spec = entry.spec;
    let port = |port: &PortSpec| {
        json!({
            "name": port.name,
            "shape": port.shape.name(),
            "tag": port.tag,
            "optional": port.optional,
            "meaning": port.doc,
        })
    };
    let ports = |ports: &[PortSpec]| ports.iter().map(port).collect::<Vec<Value>>();
    json!({
        "name": spec.name,
        "version": spec.version,
        "summary": spec.summary,
        "source": spec.source,
        "inputs": ports(spec.inputs),
        "outputs": ports(spec.outputs),
        "seeded": spec.seeded,
        "parameters": entry.schema(&mut SchemaGenerator::default()),
    })
}
