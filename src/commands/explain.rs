//! `afmid explain`: which stages would run, and why.

use std::collections::HashMap;

use afmid_pipeline::cache::{Cache, arithmetic};
use afmid_pipeline::graph::Stages;
use afmid_pipeline::runner::{Decision, Explanation, Surroundings, explain};
use afmid_pipeline::{InputFiles, Node, Plan};
use serde_json::{Value, json};

use super::load::load;
use super::run::{PROGRAM, open_cache};
use crate::cli::ExplainArgs;
use crate::failure::Failure;
use crate::output::print;
use crate::printable::one_line;
use crate::show::{change_json, change_text, grid, pretty};
use crate::sweep::point;

/// Changes that are listed for one stage; `--json` has all.
const MOST: usize = 8;

/// Says on stdout what a run would do with each stage.
pub fn run(args: &ExplainArgs, stages: &dyn Stages) -> Result<(), Failure> {
    let plan = load(&args.config.config, &args.config.set, stages)?;
    let cache = open_cache(args.cache.as_deref());
    let (files, arithmetic) = (cache.input_files(false), arithmetic());
    let with = Explained { cache: &cache, files: &files, arithmetic: &arithmetic };
    if let Some(count) = plan.points() {
        return points(&plan, count, &with, args.json);
    }
    let rows = with.rows(&plan);
    if args.json {
        return print(&pretty(&json!({ "stages": rows.iter().map(as_json).collect::<Vec<_>>() }))?);
    }
    let mut table = vec![["stage", "would", "because", "key"].map(str::to_owned).to_vec()];
    rows.iter().for_each(|row| table.extend(as_text(row)));
    print(&(grid(&table) + &unseen(&plan)))
}

/// What keys do not see, for people; nothing where they see all.
fn unseen(plan: &Plan) -> String {
    let note = |node: &Node| format!("note: stage {} ({}): {UNSEEN}\n", one_line(&node.id), one_line(&node.uses));
    plan.nodes.iter().filter(|node| is_plugin(&node.uses)).map(note).collect()
}

/// What keys of plugins do not see.
const UNSEEN: &str = "the key holds its program, all arguments, the variables of [plugins] and the files among them; \
    what these import is not seen";

fn is_plugin(uses: &str) -> bool {
    uses.starts_with("exec:")
}

/// What plans are explained with.
struct Explained<'a> {
    cache: &'a Cache,
    files: &'a InputFiles,
    arithmetic: &'a str,
}

impl Explained<'_> {
    fn rows(&self, plan: &Plan) -> Vec<Explanation> {
        let Self { cache, files, arithmetic } = *self;
        explain(plan, &Surroundings { base: plan.config.base(), program: PROGRAM, arithmetic, files }, cache)
    }
}

/// What a run of a sweep would do: a stage has a row per group of points that share its result.
fn points(plan: &Plan, count: usize, with: &Explained, json: bool) -> Result<(), Failure> {
    let mut groups: Vec<Vec<Group>> = plan.nodes.iter().map(|_| Vec::new()).collect();
    let mut places: HashMap<(usize, Option<String>, String), usize> = HashMap::new();
    for index in 0..count {
        let point = plan.point(index).map_err(|problems| {
            Failure::failed(problems.iter().map(ToString::to_string).collect::<Vec<_>>().join("; "), None)
        })?;
        for (node, (row, groups)) in with.rows(&point).into_iter().zip(&mut groups).enumerate() {
            let key = (node, row.key.clone(), format!("{:?}", row.decision));
            match places.get(&key).and_then(|place| groups.get_mut(*place)) {
                Some(group) => group.points.push(index),
                None => {
                    places.insert(key, groups.len());
                    groups.push(Group { row, points: vec![index] });
                }
            }
        }
    }
    if json {
        let points = (0..count).map(|index| {
            let values: serde_json::Map<String, Value> = plan.values(index).into_iter().collect();
            json!({ "point": point::name(index), "values": values })
        });
        let stages = groups.iter().flatten().map(|group| {
            let mut row = as_json(&group.row);
            row["points"] = group.points.iter().map(|&index| point::name(index)).collect();
            row
        });
        let (points, stages): (Vec<Value>, Vec<Value>) = (points.collect(), stages.collect());
        return print(&pretty(&json!({ "points": points, "stages": stages }))?);
    }
    let mut table = vec![["stage", "points", "would", "because", "key"].map(str::to_owned).to_vec()];
    for group in groups.iter().flatten() {
        for (number, mut row) in as_text(&group.row).into_iter().enumerate() {
            row.insert(1, if number == 0 { ranges(&group.points, count) } else { String::new() });
            table.push(row);
        }
    }
    print(&(grid(&table) + &unseen(plan)))
}

/// Points that share a stage's result.
struct Group {
    row: Explanation,
    /// From 0, ascending.
    points: Vec<usize>,
}

/// `all`, or numbers from 1 such as `1-3, 7`.
fn ranges(points: &[usize], count: usize) -> String {
    if points.len() == count {
        return "all".to_owned();
    }
    let mut runs: Vec<(usize, usize)> = Vec::new();
    for &point in points {
        match runs.last_mut().filter(|(_, last)| last + 1 == point) {
            Some((_, last)) => *last = point,
            None => runs.push((point, point)),
        }
    }
    let range = |(first, last): &(usize, usize)| match first == last {
        true => format!("{}", first + 1),
        false => format!("{}-{}", first + 1, last + 1),
    };
    runs.iter().map(range).collect::<Vec<_>>().join(", ")
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
    let mut reasons: Vec<String> = nearest.changes.iter().take(MOST).map(change_text).collect();
    match nearest.changes.len() {
        0 => reasons.push("its result is gone from the cache".to_owned()),
        all if all > MOST => reasons.push(format!("and {} more: see --json", all - MOST)),
        _ => {}
    }
    reasons
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
        "unseen": is_plugin(&row.uses).then_some(UNSEEN),
        "compared_with": nearest,
        "changes": changes.collect::<Vec<_>>(),
    })
}

#[cfg(test)]
mod tests {
    use super::ranges;

    #[test]
    fn points_are_given_as_ranges_from_one() {
        assert_eq!(ranges(&[0, 1, 2], 3), "all");
        assert_eq!(ranges(&[0, 1, 4, 6, 7], 9), "1-2, 5, 7-8");
    }
}
