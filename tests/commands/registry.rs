//! One loop over the registry instead of boilerplate per stage.

use std::collections::BTreeSet;

use afmid_pipeline::conformance::{documented, examples_hold_and_repeat, unknown_key_refused};
use afmid_pipeline::reference::config_schema;
use afmid_pipeline::{Entry, Registry};
use serde_json::{Value, json};

fn registry() -> Registry {
    afmid_stages::registry().expect("names are unique")
}

/// Runs a check on every stage and prints all that is wrong.
fn every_stage(check: fn(&Entry) -> Vec<String>) {
    let registry = registry();
    let violations: Vec<String> = registry
        .entries()
        .iter()
        .flat_map(|entry| check(entry).into_iter().map(|violation| format!("{}: {violation}", entry.spec.name)))
        .collect();
    assert!(!registry.entries().is_empty(), "the registry is empty");
    assert!(violations.is_empty(), "\n{}", violations.join("\n"));
}

#[test]
fn every_stage_is_documented_under_its_headings() {
    every_stage(documented);
}

#[test]
fn every_example_gives_the_known_truth_and_the_same_bits_twice_on_any_number_of_threads() {
    every_stage(examples_hold_and_repeat);
}

#[test]
fn every_stage_refuses_an_unknown_parameter_by_name() {
    every_stage(unknown_key_refused);
}

#[test]
fn every_input_can_be_fed_by_some_stage() {
    let registry = registry();
    let outputs = || registry.entries().iter().flat_map(|entry| entry.spec.outputs);
    let hungry: Vec<String> = registry
        .entries()
        .iter()
        .flat_map(|entry| entry.spec.inputs.iter().map(move |input| (entry, input)))
        .filter(|(_, input)| {
            !outputs().any(|output| output.shape == input.shape && (input.tag.is_empty() || input.tag == output.tag))
        })
        .map(|(entry, input)| format!("{}.{} ({}, `{}`)", entry.spec.name, input.name, input.shape.name(), input.tag))
        .collect();
    assert!(hungry.is_empty(), "nothing makes what these inputs want: {}", hungry.join(", "));
}

/// A config with one stage, its parameters those of an example.
fn config(entry: &Entry, params: Value) -> Value {
    let inputs: serde_json::Map<String, Value> =
        entry.spec.inputs.iter().map(|port| (port.name.to_owned(), "other".into())).collect();
    let stage = json!({ "id": "a", "uses": entry.spec.name, "inputs": inputs, "params": params });
    json!({ "pipeline": { "name": "x", "seed": 1 }, "stage": [stage] })
}

#[test]
fn the_schema_accepts_every_example_and_refuses_an_unknown_parameter() {
    let registry = registry();
    let schema = config_schema(&registry);
    let validator = jsonschema::draft7::new(&schema).expect("the schema is a JSON Schema");
    let mut wrong = Vec::new();
    for entry in registry.entries() {
        for example in entry.examples() {
            let params: afmid_pipeline::toml::Table = example.params.parse().expect("an example is TOML");
            let mut params = serde_json::to_value(params).expect("TOML fits into JSON");
            let errors: BTreeSet<String> = validator
                .iter_errors(&config(entry, params.clone()))
                .map(|error| format!("{}: {}: {error}", entry.spec.name, error.instance_path()))
                .collect();
            wrong.extend(errors);
            params["a_parameter_that_nobody_knows"] = true.into();
            if validator.is_valid(&config(entry, params)) {
                wrong.push(format!("{}: the schema accepts an unknown parameter", entry.spec.name));
            }
        }
    }
    assert!(wrong.is_empty(), "\n{}", wrong.join("\n"));
}

#[test]
fn the_schema_refuses_what_a_config_must_not_hold() {
    let schema = config_schema(&registry());
    let validator = jsonschema::draft7::new(&schema).expect("the schema is a JSON Schema");
    let pipeline = json!({ "name": "x" });
    for wrong in [
        json!({}),
        json!({ "pipeline": pipeline, "stage": [] }),
        json!({ "pipeline": pipeline, "stage": [{ "id": "a", "uses": "no.stage" }] }),
        json!({ "pipeline": pipeline, "stage": [{ "id": "a" }] }),
        json!({ "pipeline": { "name": "x", "sed": 1 }, "stage": [{ "id": "a", "uses": "io.records" }] }),
        json!({ "pipeline": pipeline, "stage": [{ "id": "pipeline", "uses": "io.records" }] }),
    ] {
        assert!(!validator.is_valid(&wrong), "{wrong}");
    }
}
