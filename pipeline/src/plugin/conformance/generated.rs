//! Inputs for a plugin that ships no examples, and inputs out of its examples.

use std::collections::BTreeMap;
use std::path::Path;

use serde_json::Value;

use crate::artifact::{Array, Axis, Document, Matrix, Shape, Shaped, StateSpace, Table};
use crate::outcome::{PortSpec, Ports};
use crate::plugin::describe::Plugin;
use crate::plugin::exchange::{Wanted, take};
use crate::plugin::message::Sent;
use crate::recording::Recording;

/// What a plugin is tried with.
pub(super) struct Trial {
    /// What it is called.
    pub(super) title: String,
    /// Its parameters, without defaults.
    pub(super) parameters: Value,
    /// Its inputs.
    pub(super) inputs: Ports,
}

/// The plugin's own examples, or one made of nothing but its ports' shapes. Errors: an example that cannot be read.
pub(super) fn trials(plugin: &Plugin) -> Result<Vec<Trial>, String> {
    if plugin.examples.is_empty() {
        let mut inputs = Ports::new();
        plugin.spec.inputs.iter().for_each(|port| inputs.insert(port.name, generated(port)));
        let (title, parameters) = ("generated inputs".to_owned(), Value::Object(serde_json::Map::new()));
        return Ok(vec![Trial { title, parameters, inputs }]);
    }
    plugin
        .examples
        .iter()
        .map(|example| {
            let inputs =
                own(plugin, &example.inputs).map_err(|wrong| format!("example `{}`: {wrong}", example.title))?;
            Ok(Trial { title: example.title.clone(), parameters: Value::Object(example.parameters.clone()), inputs })
        })
        .collect()
}

fn own(plugin: &Plugin, sent: &BTreeMap<String, Sent>) -> Result<Ports, String> {
    let mut inputs = Ports::new();
    for (name, sent) in sent {
        let port = plugin.spec.inputs.iter().find(|port| port.name == name);
        let port = port.ok_or_else(|| format!("there is no input `{name}`"))?;
        let value = serde_json::to_value(sent).map_err(|error| error.to_string())?;
        let wanted = Wanted { shape: port.shape, finite: false };
        // its numbers stand in the line: no file goes with an example
        let artifact = take(&value, Path::new(""), wanted).map_err(|wrong| format!("`{name}` {wrong}"))?;
        inputs.insert(name, artifact);
    }
    match plugin.spec.inputs.iter().find(|port| !port.optional && inputs.artifact(port.name).is_none()) {
        Some(port) => Err(format!("it lacks the input `{}`", port.name)),
        None => Ok(inputs),
    }
}

/// An artifact of a port's shape, of 64 samples or rows, the same every time.
fn generated(port: &PortSpec) -> crate::artifact::Artifact {
    let wave =
        |count: u32| (0..count).map(|n| (f64::from(n) * 0.3).sin() + 0.01 * f64::from(n % 7)).collect::<Vec<f64>>();
    let times = || (0..64).map(|n| f64::from(n) * 1e-6).collect::<Vec<f64>>();
    match port.shape {
        Shape::Array => {
            let array = Array::over(vec![Axis::new("time", "s", "time", times())]);
            array.with("value", "V", "a generated wave", &["time"], wave(64)).wrap()
        }
        Shape::Table => Table::new().with("value", "V", "a generated wave", wave(64)).wrap(),
        Shape::StateSpace => {
            let one = |value: f64| Matrix { rows: 1, columns: 1, values: vec![value] };
            let (a, b, c, d, k) = (one(0.5), one(1.0), one(1.0), one(0.0), one(0.1));
            StateSpace { a, b, c, d, k, x0: vec![0.0], sample_time_s: 1e-6, ..StateSpace::default() }.wrap()
        }
        Shape::Document => Document(serde_json::json!({ "value": 1.5 })).wrap(),
        Shape::Recording => Recording::default().wrap(),
    }
}
