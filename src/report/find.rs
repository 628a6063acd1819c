//! Finding artifacts by what they are: shapes, variables and the stages that they came from.

use afmid_pipeline::{Array, Axis, RunResult, Shaped, StageRecord};

/// An artifact with the stage and port that it came from.
#[derive(Debug)]
pub(crate) struct Found<'a, T> {
    pub stage: &'a StageRecord,
    pub port: &'a str,
    pub value: &'a T,
}

impl<T> Clone for Found<'_, T> {
    fn clone(&self) -> Self {
        *self
    }
}

impl<T> Copy for Found<'_, T> {}

/// All artifacts of shape `T`, in the order of the run.
pub(crate) fn all<T: Shaped>(run: &RunResult) -> impl Iterator<Item = Found<'_, T>> {
    run.stages.iter().flat_map(|stage| {
        stage
            .result
            .outputs
            .iter()
            .filter_map(move |(port, artifact)| T::peek(artifact).map(|value| Found { stage, port, value }))
    })
}

/// Whether `stage` reads, directly or not, what `source` made.
pub(crate) fn depends_on(run: &RunResult, stage: &StageRecord, source: &str) -> bool {
    let mut seen: Vec<&str> = Vec::new();
    let mut next = vec![stage];
    while let Some(stage) = next.pop() {
        for (_, upstream, _) in &stage.wires {
            if upstream == source {
                return true;
            }
            if !seen.contains(&upstream.as_str()) {
                seen.push(upstream);
                next.extend(run.stage(upstream));
            }
        }
    }
    false
}

/// The axis of a frequency response or spectrum.
pub(crate) fn frequency_axis(array: &Array) -> Option<&Axis> {
    array.axes.iter().find(|axis| axis.unit == "Hz")
}

/// The axis of a signal in time.
pub(crate) fn time_axis(array: &Array) -> Option<&Axis> {
    array.axes.iter().find(|axis| axis.unit == "s")
}

/// The values of a real variable over exactly this axis.
pub(crate) fn real_over<'a>(array: &'a Array, name: &str, axis: &Axis) -> Option<&'a [f64]> {
    let variable = array.variables.iter().find(|variable| variable.name == name)?;
    let values = variable.values.real().filter(|_| variable.dims == [axis.name.as_str()])?.ok()?;
    (values.len() == axis.values.len()).then_some(values)
}

/// The unit of a variable; `1` if there is no such variable.
pub(crate) fn unit_of<'a>(array: &'a Array, name: &str) -> &'a str {
    array.variables.iter().find(|variable| variable.name == name).map_or("1", |variable| &variable.unit)
}

/// Whether this is aligned events over event and time.
pub(crate) fn is_ensemble(found: &Found<'_, Array>) -> bool {
    found.value.variable("signal").is_ok_and(|signal| signal.dims == ["event", "time"])
        && time_axis(found.value).is_some()
}
