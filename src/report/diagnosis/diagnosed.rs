//! What a stage says of a diagnosis: its answer and the arrays beside it.

use afmid_pipeline::{Array, Document, RunResult, Shaped, StageRecord, Table};
use afmid_stages::diagnosis::Diagnosis;

use crate::report::figure::slug;
use crate::report::find::{all, real_over};

/// A diagnosis with the stage that made it.
pub(super) struct Diagnosed<'a> {
    pub stage: &'a StageRecord,
    pub answer: Diagnosis,
}

/// All diagnoses of a run: documents that read as one.
pub(super) fn diagnoses(run: &RunResult) -> Vec<Diagnosed<'_>> {
    all::<Document>(run)
        .filter(|found| found.value.0.get("verdict").is_some())
        .filter_map(|found| {
            let answer = serde_json::from_value(found.value.0.clone()).ok()?;
            Some(Diagnosed { stage: found.stage, answer })
        })
        .collect()
}

impl<'a> Diagnosed<'a> {
    /// A curve of the stage: coordinates and values of a real variable over one axis.
    pub fn curve(&self, axis: &str, variable: &str) -> Option<Curve<'a>> {
        self.outputs::<Array>().find_map(|array| {
            let along = array.axis(axis).ok()?;
            let y = real_over(array, variable, along)?;
            let unit = &array.variable(variable).ok()?.unit;
            (!y.is_empty()).then_some(Curve { x: &along.values, y, unit, x_unit: &along.unit })
        })
    }

    /// A table of the stage that has this column.
    pub fn table(&self, column: &str) -> Option<&'a Table> {
        self.outputs::<Table>().find(|table| table.columns.iter().any(|c| c.name == column))
    }

    /// Whether the models differ: something has been added to the linear one.
    pub fn extended(&self) -> bool {
        self.answer.ladder.len() > 1
    }

    /// The stage's id as part of the ids of figures.
    pub fn slug(&self) -> String {
        slug(&self.stage.id)
    }

    fn outputs<T: Shaped>(&self) -> impl Iterator<Item = &'a T> + use<'a, T> {
        let stage = self.stage;
        stage.result.outputs.iter().filter_map(|(_, artifact)| T::peek(artifact))
    }
}

/// A curve with its units.
#[derive(Clone, Copy)]
pub(super) struct Curve<'a> {
    pub x: &'a [f64],
    pub y: &'a [f64],
    pub unit: &'a str,
    pub x_unit: &'a str,
}

impl<'a> Curve<'a> {
    /// The part with coordinates between two limits.
    pub fn between(self, low: f64, high: f64) -> Self {
        let first = self.x.partition_point(|x| *x < low);
        let end = self.x.partition_point(|x| *x <= high).max(first);
        let part = |values: &'a [f64]| values.get(first..end).unwrap_or(&[]);
        Self { x: part(self.x), y: part(self.y), ..self }
    }
}
