//! One stage: provenance and what it made.

use afmid_pipeline::{Artifact, RunResult, StageRecord};
use serde_json::Value;

use super::array::array_view;
use super::attribute_facts;
use super::document::document_view;
use super::model::model_view;
use super::recording::recording_view;
use super::table::{ROWS, table_view};
use crate::printable::few;
use crate::report::figure::{Figure, slug};
use crate::report::number::{bytes, duration};
use crate::report::view::{ArtifactView, Fact, Head, StageView, TableView};

/// Everything about a stage. Figures come beside, by position of their artifact: the page decides which fit.
pub(crate) fn stage_view(run: &RunResult, stage: &StageRecord) -> (StageView, Vec<Option<Figure>>) {
    let timing = run.info.stages.iter().find(|(id, _, _)| *id == stage.id);
    let mut facts = vec![Fact::new("key", stage.key.clone())];
    if let Some(seed) = stage.seed {
        facts.push(Fact::new("seed", seed.to_string()));
    }
    for (port, source, output) in &stage.wires {
        facts.push(Fact::new(&format!("input {port}"), format!("{source}.{output}")));
    }
    let (mut artifacts, mut figures) = (Vec::new(), Vec::new());
    for (port, artifact) in stage.result.outputs.iter() {
        let (view, figure) = artifact_view(&format!("stage-{}--{}", slug(&stage.id), slug(port)), artifact);
        artifacts.push(ArtifactView { port: port.to_owned(), shape: artifact.shape().name().to_owned(), ..view });
        figures.push(figure);
    }
    let view = StageView {
        id: stage.id.clone(),
        uses: stage.uses.clone(),
        version: stage.version,
        seconds: timing.map(|(_, seconds, _)| duration(*seconds)).unwrap_or_default(),
        cached: timing.is_some_and(|(_, _, cached)| *cached),
        facts,
        params: serde_json::to_string_pretty(&stated(&stage.params)).unwrap_or_default(),
        warnings: few(&stage.result.warnings),
        warned: stage.result.warnings.len(),
        sources: sources(stage),
        artifacts,
    };
    (view, figures)
}

/// Parameters without those that are empty.
fn stated(params: &Value) -> Value {
    let empty = |value: &Value| match value {
        Value::Null => true,
        Value::String(text) => text.is_empty(),
        Value::Array(list) => list.is_empty(),
        _ => false,
    };
    match params {
        Value::Object(all) => {
            all.iter().filter(|(_, value)| !empty(value)).map(|(k, v)| (k.clone(), v.clone())).collect()
        }
        other => other.clone(),
    }
}

fn artifact_view(id: &str, artifact: &Artifact) -> (ArtifactView, Option<Figure>) {
    match artifact {
        Artifact::Recording(recording) => (recording_view(recording), None),
        Artifact::Array(array) => array_view(id, array),
        Artifact::Table(table) => {
            let facts = attribute_facts(&table.attributes).collect();
            (ArtifactView { facts, tables: vec![table_view("", table, ROWS)], ..ArtifactView::default() }, None)
        }
        Artifact::StateSpace(model) => model_view(id, model),
        Artifact::Document(document) => {
            let (facts, tables) = document_view(&document.0);
            (ArtifactView { facts, tables, ..ArtifactView::default() }, None)
        }
    }
}

/// Files with their hashes: all of them, this is where numbers are traced to.
fn sources(stage: &StageRecord) -> TableView {
    let heads = vec![Head::text("file"), Head::number("size", ""), Head::text("BLAKE3")];
    let mut table = TableView::new("Files read", heads);
    for source in &stage.sources {
        table.rows.push(vec![source.path.clone(), bytes(source.size), source.blake3.clone()]);
    }
    // a page of 5 MB holds some thousands of paths beside its figures
    table.truncated(2_000, stage.sources.len())
}
