//! What a result file holds.

use afmid_pipeline::store::{PortSummary, ResultFile, StageSummary};
use afmid_pipeline::{StageRecord, Unfinished};
use serde_json::{Value, json};

use super::grid::grid;
use crate::printable::{few, one_line};

/// The run, its stages with their artifacts, and all warnings; before these `found`, what the run is about.
pub fn overview_text(file: &ResultFile, found: &str) -> String {
    let run = file.run();
    let info = &run.info;
    let mut text = format!("{} (seed {}), {}", one_line(&run.name), run.seed, one_line(&run.program));
    if !info.started_at.is_empty() {
        let (when, seconds, host, threads) =
            (one_line(&info.started_at), info.seconds, one_line(&info.host), info.threads);
        text.push_str(&format!(", {when}, {seconds:.2} s on {threads} threads of {host}"));
    }
    text.push_str("\n\n");
    text.push_str(found);
    let mut rows = vec![["stage", "uses", "artifacts"].map(str::to_owned).to_vec()];
    for stage in file.stages() {
        let ports: Vec<String> =
            stage.ports.iter().map(|port| format!("{} ({})", port.name, port.shape.name())).collect();
        rows.push(vec![stage.record.id.clone(), stage.record.uses.clone(), ports.join(", ")]);
    }
    text.push_str(&grid(&rows));
    text.push_str(&incomplete(&info.unfinished));
    let warnings: Vec<String> = file.stages().iter().flat_map(warnings).collect();
    if !warnings.is_empty() {
        text.push_str(&format!("\nwarnings\n{}", warnings.concat()));
    }
    text
}

/// Which stages of a run have no result, and why; empty for one that went through.
pub fn incomplete(unfinished: &[Unfinished]) -> String {
    let line = |stage: &Unfinished| match &stage.reason {
        Some(reason) => format!("  {} ({}) failed: {}\n", stage.id, stage.uses, one_line(reason)),
        None => format!("  {} ({}) was not run: something that it needs has no result\n", stage.id, stage.uses),
    };
    match unfinished {
        [] => String::new(),
        _ => format!("\nincomplete: the run failed\n{}", unfinished.iter().map(line).collect::<String>()),
    }
}

fn warnings(stage: &StageSummary) -> Vec<String> {
    let record = &stage.record;
    few(&record.result.warnings).iter().map(|warning| format!("  {}: {warning}\n", one_line(&record.id))).collect()
}

/// The same for scripts.
pub fn overview_json(file: &ResultFile) -> Value {
    let run = file.run();
    let artifact = |port: &PortSummary| json!({ "port": port.name, "shape": port.shape.name() });
    let unfinished = |stage: &Unfinished| json!({ "id": stage.id, "uses": stage.uses, "reason": stage.reason });
    let stage = |stage: &StageSummary| {
        let record = &stage.record;
        json!({
            "id": record.id,
            "uses": record.uses,
            "version": record.version,
            "artifacts": stage.ports.iter().map(artifact).collect::<Vec<_>>(),
            "warnings": record.result.warnings,
        })
    };
    json!({
        "name": run.name,
        "seed": run.seed,
        "program": run.program,
        "overrides": run.overrides,
        "stages": file.stages().iter().map(stage).collect::<Vec<_>>(),
        "complete": run.info.unfinished.is_empty(),
        "unfinished": run.info.unfinished.iter().map(unfinished).collect::<Vec<_>>(),
    })
}

/// What a stage was, before its artifacts: name, version, wires, warnings.
pub fn stage_head(record: &StageRecord) -> String {
    let mut text = format!("{}: {} version {}\n", one_line(&record.id), one_line(&record.uses), record.version);
    for (port, stage, output) in &record.wires {
        text.push_str(&format!("  {}\n", one_line(&format!("{port} <- {stage}.{output}"))));
    }
    for warning in few(&record.result.warnings) {
        text.push_str(&format!("  warning: {warning}\n"));
    }
    text
}
