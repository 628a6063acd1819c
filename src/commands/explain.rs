//! `afmid explain`: which stages would run, and why.

use afmid_pipeline::Registry;
use afmid_pipeline::runner::{Decision, Explanation, explain};
use serde_json::{Value, json};

use super::load::load;
use super::run::{PROGRAM, open_cache};
use crate::cli::ExplainArgs;
use crate::failure::Failure;
use crate::output::print;
use crate::show::{change_json, change_text, grid, pretty};

/// Changes that are told of one stage; `--json` has all.
const MOST: usize = 8;

/// Says on stdout what a run would do with each stage.
pub fn run(args: &ExplainArgs, registry: &Registry) -> Result<(), Failure> {
    let plan = load(&args.config.config, &args.config.set, registry)?;
    let cache = open_cache(args.cache.as_deref())?;
    let rows = explain(&plan, plan.config.base(), PROGRAM, &cache);
    if args.json {
        return print(&pretty(&json!({ "stages": rows.iter().map(as_json).collect::<Vec<_>>() }))?);
    }
    let mut table = vec![["stage", "would", "because", "key"].map(str::to_owned).to_vec()];
    rows.iter().for_each(|row| table.extend(as_text(row)));
    print(&grid(&table))
}

/// A row per reason.
fn as_text(row: &Explanation) -> Vec<Vec<String>> {
    let would = match row.decision {
        Decision::Reuse => "be reused",
        Decision::Run | Decision::Always => "run",
        Decision::Unknown(_) => "be decided later",
    };
    let key = row.key.as_ref().map_or_else(|| "-".to_owned(), |key| key.chars().take(16).collect());
    let mut reasons = reasons(row).into_iter();
    let first = vec![row.id.clone(), would.to_owned(), reasons.next().unwrap_or_default(), key];
    let more = reasons.map(|reason| vec![String::new(), String::new(), reason, String::new()]);
    std::iter::once(first).chain(more).collect()
}

fn reasons(row: &Explanation) -> Vec<String> {
    let nearest = match (&row.decision, &row.nearest) {
        (Decision::Reuse, _) => return vec!["its result is in the cache".to_owned()],
        (Decision::Always, _) => return vec!["it runs every time".to_owned()],
        (Decision::Unknown(why), _) => return vec![why.clone()],
        (Decision::Run, None) => return vec!["no earlier result of this stage is in the cache".to_owned()],
        (Decision::Run, Some(nearest)) => nearest,
    };
    let mut told: Vec<String> = nearest.changes.iter().take(MOST).map(change_text).collect();
    match nearest.changes.len() {
        0 => told.push("its result is gone from the cache".to_owned()),
        all if all > MOST => told.push(format!("and {} more: see --json", all - MOST)),
        _ => {}
    }
    told
}

fn as_json(row: &Explanation) -> Value {
    let would = match row.decision {
        Decision::Reuse => "reuse",
        Decision::Run | Decision::Always => "run",
        Decision::Unknown(_) => "unknown",
    };
    let nearest = row.nearest.as_ref().map(|nearest| {
        let origin = &nearest.origin;
        json!({ "key": origin.key, "pipeline": origin.pipeline, "id": origin.id, "program": origin.program })
    });
    let changes = row.nearest.iter().flat_map(|nearest| &nearest.changes).map(change_json);
    json!({
        "id": row.id,
        "uses": row.uses,
        "would": would,
        "because": reasons(row).join("; "),
        "key": row.key,
        "compared_with": nearest,
        "changes": changes.collect::<Vec<_>>(),
    })
}
