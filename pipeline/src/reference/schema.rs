//! JSON Schema of a whole config.

use serde_json::{Map, Value, json};

use crate::config::{DEFAULT_TIMEOUT_S, RESERVED_ID};
use crate::outcome::PortSpec;
use crate::stage::{Entry, Registry};

/// JSON Schema (draft 7, which all editors know) of a config with these stages.
///
/// Method: `uses` selects the stage by `if`/`then`, so that a wrong parameter is reported at its place and for its
/// stage alone;
/// the same definitions are listed once more under an `anyOf` that is always true, because editors complete from
/// `anyOf` and don't look into `then`.
pub fn config_schema(registry: &Registry) -> Value {
    let mut generator = schemars::generate::SchemaSettings::draft07().into_generator();
    let mut stages = Map::new();
    for entry in registry.entries() {
        let params = entry.schema(&mut generator).to_value();
        stages.insert(definition(entry), stage(entry, params));
    }
    let mut definitions = generator.take_definitions(true);
    definitions.extend(stages);
    json!({
        "$schema": "http://json-schema.org/draft-07/schema#",
        "title": "afmid config",
        "description": "A pipeline: stages, wired by their ports.",
        "type": "object",
        "additionalProperties": false,
        "required": ["pipeline", "stage"],
        "properties": {
            "pipeline": {
                "description": "The pipeline as a whole.",
                "type": "object",
                "additionalProperties": false,
                "required": ["name"],
                "properties": {
                    "name": { "description": "Its name, shown with the results.", "type": "string", "minLength": 1 },
                    "seed": {
                        "description": "The seed of everything random (0 by default).",
                        "type": "integer", "minimum": 0, "default": 0
                    }
                }
            },
            "stage": {
                "description": "The stages, in any order: wires decide what runs first.",
                "type": "array",
                "minItems": 1,
                "items": any_stage(registry)
            },
            "sweep": {
                "description": "Parameters to run through, as STAGE.PARAM = [values]; several: their grid, the last one fastest.",
                "type": "object",
                "additionalProperties": {
                    "anyOf": [{ "type": "array", "minItems": 1 }, { "type": "object" }]
                }
            },
            "plugins": plugins()
        },
        "definitions": definitions
    })
}

fn any_stage(registry: &Registry) -> Value {
    let names: Vec<&str> = registry.entries().iter().map(|entry| entry.spec.name).collect();
    let reference = |entry: &Entry| json!({ "$ref": format!("#/definitions/{}", definition(entry)) });
    let rule = |entry: &Entry| {
        json!({
            "if": { "properties": { "uses": { "const": entry.spec.name } }, "required": ["uses"] },
            "then": reference(entry)
        })
    };
    let mut choices: Vec<Value> = registry.entries().iter().map(reference).collect();
    choices.push(json!({ "$comment": "always true: these are for completion, the rules above decide" }));
    json!({
        "type": "object",
        "required": ["id", "uses"],
        "properties": {
            "id": id(),
            "uses": {
                "description": "The stage's name in the registry, or `exec:NAME`: a plugin of [plugins] or on the PATH.",
                "anyOf": [{ "enum": names }, { "type": "string", "pattern": "^exec:[a-z][a-z0-9_-]*$" }]
            },
            "inputs": { "description": "Wires: port = \"stage id\" or \"stage id.port\".", "type": "object" },
            "params": { "description": "The parameters of the stage.", "type": "object" }
        },
        "additionalProperties": false,
        "allOf": registry.entries().iter().map(rule).collect::<Vec<_>>(),
        "anyOf": choices
    })
}

fn stage(entry: &Entry, mut params: Value) -> Value {
    let spec = entry.spec;
    let inputs: Map<String, Value> = spec.inputs.iter().map(|port| (port.name.to_owned(), input(port))).collect();
    let wanted: Vec<&str> = spec.inputs.iter().filter(|port| !port.optional).map(|port| port.name).collect();
    let mut required = vec!["id", "uses"];
    if !wanted.is_empty() {
        required.push("inputs");
    }
    if params["required"].as_array().is_some_and(|names| !names.is_empty()) {
        required.push("params");
    }
    if let Some(params) = params.as_object_mut() {
        params.remove("$schema");
        params.remove("title");
        params.insert("description".to_owned(), format!("Parameters of {}.", spec.name).into());
    }
    json!({
        "description": spec.summary,
        "type": "object",
        "required": required,
        "properties": {
            "id": id(),
            "uses": { "description": spec.summary, "const": spec.name },
            "inputs": {
                "description": "Wires: port = \"stage id\" or \"stage id.port\".",
                "type": "object",
                "additionalProperties": false,
                "required": wanted,
                "properties": inputs
            },
            "params": params
        },
        "additionalProperties": false
    })
}

/// Commands of stages that run as processes of their own; what they are is known when they are asked.
fn plugins() -> Value {
    let command = json!({
        "anyOf": [
            { "description": "Program and arguments, at white space.", "type": "string", "minLength": 1 },
            { "description": "Program and arguments.", "type": "array", "minItems": 1, "items": { "type": "string" } }
        ]
    });
    let long = json!({
        "type": "object",
        "additionalProperties": false,
        "required": ["command"],
        "properties": {
            "command": command,
            "confined": {
                "description": "Whether it may write to its own temporary folder alone, and use no TCP (Linux).",
                "type": "boolean", "default": true
            },
            "environment": {
                "description": "Variables of its environment; they are part of the cache key.", "type": "object",
                "propertyNames": { "pattern": "^[^=]+$" }, "additionalProperties": { "type": "string" }
            },
            "timeout_s": {
                "description": "How long one request may take.",
                "type": "number", "exclusiveMinimum": 0, "maximum": 604_800,
                "default": DEFAULT_TIMEOUT_S
            }
        }
    });
    json!({
        "description": "Commands of plugins: NAME = \"python3 my_stage.py\" is run by `uses = \"exec:NAME\"`; paths from the config's folder.",
        "type": "object",
        "propertyNames": { "pattern": "^[a-z][a-z0-9_-]*$" },
        "additionalProperties": { "anyOf": [command, long] }
    })
}

fn id() -> Value {
    json!({
        "description": "Its id, unique; results are stored and shown under it.",
        "type": "string",
        "pattern": "^[a-z0-9_-]+$",
        "not": { "const": RESERVED_ID }
    })
}

fn input(port: &PortSpec) -> Value {
    let tag = if port.tag.is_empty() { String::new() } else { format!(" tagged {}", port.tag) };
    json!({
        "description": format!("{} ({}{tag})", port.doc, port.shape.name()),
        "type": "string",
        "pattern": "^[a-z0-9_-]+(\\.[A-Za-z0-9_-]+)?$"
    })
}

fn definition(entry: &Entry) -> String {
    format!("stage-{}", entry.spec.name)
}
