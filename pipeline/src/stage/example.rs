//! Running a stage's examples, each in a folder of its own.

use tempfile::TempDir;

use super::{Bounds, Context, DynStage, Entry, Example, NoProgress};
use crate::outcome::Ports;

/// The seed of every example.
const SEED: u64 = 1;

/// Runs an example in a folder of its own, which is removed again: its outputs. Errors: why it does not run.
pub fn run_example(entry: &Entry, example: &Example) -> Result<Ports, String> {
    run_in_folder(instance(entry, example)?.as_ref(), &example_inputs(entry, example)?)
}

/// An example's inputs: those that the stage declares, as in a run.
pub(crate) fn example_inputs(entry: &Entry, example: &Example) -> Result<Ports, String> {
    let given = (example.inputs)().map_err(|error| format!("inputs: {error}"))?;
    let mut inputs = Ports::new();
    for (name, artifact) in given.iter().filter(|(name, _)| entry.spec.inputs.iter().any(|port| port.name == *name)) {
        inputs.insert(name, artifact.clone());
    }
    Ok(inputs)
}

/// The stage with the example's parameters. Errors: what is wrong with them.
pub(crate) fn instance(entry: &Entry, example: &Example) -> Result<Box<dyn DynStage>, String> {
    let params: toml::Table = example.params.parse().map_err(|error| format!("params are not TOML: {error}"))?;
    let stage = entry.parse(params.clone()).map_err(|error| format!("params: at {}: {error}", error.path))?;
    if let Some(wrong) = Bounds::of(entry).check(&params).first() {
        return Err(format!("params: `{}` {}", wrong.path.join("."), wrong.message));
    }
    match stage.faults().first() {
        Some(error) => Err(format!("params: {error}")),
        None => Ok(stage),
    }
}

/// Runs a stage in a folder that is removed again. Errors: those of the stage.
pub(crate) fn run_in_folder(stage: &dyn DynStage, inputs: &Ports) -> Result<Ports, String> {
    let folder = TempDir::with_prefix("afmid-example-").map_err(|error| format!("no temporary folder: {error}"))?;
    stage.run(inputs, &Context::new(folder.path(), SEED, &NoProgress)).map_err(|error| error.to_string())
}
