//! The ids of stages.

use std::collections::HashSet;

use super::problem::Problem;
use super::stage::StageDecl;

/// The id that means the `[pipeline]` table in `--set`.
pub(crate) const RESERVED_ID: &str = "pipeline";

/// Checks that every id is well-formed and used once. A stage without an id was reported when it was read.
pub(super) fn check(stages: &[StageDecl], problems: &mut Vec<Problem>) {
    let mut before = HashSet::new();
    for stage in stages.iter().filter(|stage| !stage.id.is_empty()) {
        let first = before.insert(stage.id.as_str());
        let (id, span) = (&stage.id, stage.id_span.clone());
        if let Some(wrong) = id.chars().find(|&c| !matches!(c, 'a'..='z' | '0'..='9' | '_' | '-')) {
            let help = format!("results are stored under it: write `{}`, for instance", mended(id));
            let message = format!("stage id {id:?}: found {wrong:?}, wanted only a-z, 0-9, `_` and `-`");
            problems.push(Problem::new(message, span, "not an id").help(help));
        } else if id == RESERVED_ID {
            let message = format!("stage id `{id}` is reserved: `--set` means the `[pipeline]` table by it");
            problems.push(Problem::new(message, span, "reserved").help("choose another id"));
        } else if !first {
            let message = format!("stage id `{id}` is used twice");
            problems.push(Problem::new(message, span, "used before").help("results are stored under it: rename one"));
        }
    }
}

fn mended(id: &str) -> String {
    let keep = |c: char| if matches!(c, 'a'..='z' | '0'..='9' | '_' | '-') { c } else { '-' };
    id.to_lowercase().chars().map(keep).collect()
}
