//! A stage's examples run, and what they make is what the stage declares.

use crate::error::StageError;
use crate::outcome::{PortSpec, Ports, difference};
use crate::stage::{DynStage, Entry, Example, example_inputs, instance, run_example, run_in_folder};

/// Checks that there is an example, that each runs with the declared ports and makes the declared ports, and that the
/// truth comes out.
pub fn examples_hold(entry: &Entry) -> Vec<String> {
    of_each_example(entry, |example| holds(entry, example).map(drop))
}

/// The same, run on one thread, and that a second run, on four threads, gives the same bits.
pub fn examples_hold_and_repeat(entry: &Entry) -> Vec<String> {
    of_each_example(entry, |example| {
        let one = on_threads(1, || holds(entry, example))?;
        let four = on_threads(4, || run_example(entry, example))?;
        match difference(&one, &four) {
            Some(place) => Err(format!("other numbers the second time, on four threads: {place}")),
            None => Ok(()),
        }
    })
}

fn of_each_example(entry: &Entry, check: impl Fn(&Example) -> Result<(), String>) -> Vec<String> {
    let examples = entry.examples();
    if examples.is_empty() {
        return vec!["there is no example".to_owned()];
    }
    let wrong = |example: &Example| check(example).err().map(|why| format!("example {:?}: {why}", example.title));
    examples.iter().filter_map(wrong).collect()
}

/// Checks that a parameter nobody knows is refused by its name.
pub fn unknown_key_refused(entry: &Entry) -> Vec<String> {
    const KEY: &str = "a_parameter_that_nobody_knows";
    let mut violations = Vec::new();
    for example in entry.examples() {
        let Ok(mut params) = example.params.parse::<toml::Table>() else { continue };
        params.insert(KEY.to_owned(), toml::Value::Boolean(true));
        match entry.parse(params) {
            Err(error) if error.message.contains(KEY) => {}
            Err(error) => violations.push(format!("an unknown parameter is refused without its name: {error}")),
            Ok(_) => violations.push("an unknown parameter is accepted: add `deny_unknown_fields`".to_owned()),
        }
    }
    violations
}

/// What an example makes, once it is what the stage declares and the truth.
fn holds(entry: &Entry, example: &Example) -> Result<Ports, String> {
    let inputs = example_inputs(entry, example)?;
    as_declared("input", entry.spec.inputs, &inputs)?;
    let stage = instance(entry, example)?;
    resolved_parameters_are_parameters(entry, stage.as_ref())?;
    let outputs = run_in_folder(stage.as_ref(), &inputs)?;
    as_declared("output", entry.spec.outputs, &outputs)?;
    (example.expect)(&outputs).map(|_| outputs)
}

/// Every artifact is on a declared port, has its shape and is whole; every required port has one.
fn as_declared(what: &str, ports: &[PortSpec], have: &Ports) -> Result<(), String> {
    for (name, artifact) in have.iter() {
        let Some(port) = ports.iter().find(|port| port.name == name) else {
            return Err(format!("the {what} `{name}` is not declared"));
        };
        if artifact.shape() != port.shape {
            let (found, wanted) = (artifact.shape().name(), port.shape.name());
            return Err(format!("the {what} `{name}` is declared as a {wanted}, it is a {found}"));
        }
        artifact.validate().map_err(|error: StageError| format!("the {what} `{name}`: {error}"))?;
    }
    match ports.iter().find(|port| !port.optional && have.artifact(port.name).is_none()) {
        Some(port) => Err(format!("the {what} `{}` is declared and not there", port.name)),
        None => Ok(()),
    }
}

/// What a result records as parameters must make the same stage again.
fn resolved_parameters_are_parameters(entry: &Entry, stage: &dyn DynStage) -> Result<(), String> {
    let resolved = stage.params().map_err(|error| error.to_string())?;
    let table = toml::Table::try_from(without_nulls(resolved.clone())).map_err(|error| format!("params: {error}"))?;
    let again = entry.parse(table).map_err(|error| format!("its own parameters are refused: {error}"))?;
    let again = again.params().map_err(|error| error.to_string())?;
    if again == resolved { Ok(()) } else { Err(format!("parameters change when read again: {resolved} to {again}")) }
}

/// TOML knows no null: a parameter that is none is left out.
fn without_nulls(value: serde_json::Value) -> serde_json::Value {
    use serde_json::Value;
    match value {
        Value::Object(entries) => {
            let entries = entries.into_iter().filter(|(_, value)| !value.is_null());
            Value::Object(entries.map(|(key, value)| (key, without_nulls(value))).collect())
        }
        Value::Array(values) => Value::Array(values.into_iter().map(without_nulls).collect()),
        scalar => scalar,
    }
}

fn on_threads<T: Send>(threads: usize, work: impl FnOnce() -> Result<T, String> + Send) -> Result<T, String> {
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| error.to_string())?;
    pool.install(work)
}
