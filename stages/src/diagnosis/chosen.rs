//! Which causes of the catalogue a diagnosis tries.

use afmid_pipeline::config::nearest;
use afmid_pipeline::{Faults, StageError};

use crate::causes::catalogue;

/// Whether a cause may be named: one of `candidates`, where there are any, and none of `without`.
pub(super) fn wanted(id: &str, candidates: &[String], without: &[String]) -> bool {
    (candidates.is_empty() || candidates.iter().any(|wanted| wanted == id))
        && !without.iter().any(|banned| banned == id)
}

/// Faults: an id that is no cause, or is in both lists.
pub(super) fn check_ids(candidates: &[String], without: &[String], faults: &mut Faults) {
    let all = catalogue();
    let known: Vec<&str> = all.iter().map(|cause| cause.about().id).collect();
    for (list, ids) in [("candidates", candidates), ("without", without)] {
        for id in ids.iter().filter(|id| !known.contains(&id.as_str())) {
            let help = match nearest(id, known.iter().copied()) {
                Some(name) => format!("did you mean `{name}`?"),
                None => "`afmid causes` lists them".to_owned(),
            };
            faults.add(StageError::new(format!("`{list}` names `{id}`, which is no cause")).help(help));
        }
    }
    if let Some(id) = candidates.iter().find(|id| without.contains(id)) {
        faults.add(StageError::new(format!("`{id}` is in `candidates` and in `without`")).help("leave it out of one"));
    }
}
