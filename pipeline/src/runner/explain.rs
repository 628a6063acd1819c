//! What a run would do with each stage, and why.

use std::cmp::Reverse;
use std::collections::HashMap;
use std::time::SystemTime;

use super::changes::{Change, changes};
use super::keys::{Surroundings, plan_node};
use crate::cache::{Cache, Origin};
use crate::graph::{Node, Plan};
use crate::stage::Caching;

/// What a run would do with a stage, and why.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Decision {
    /// Its result is in the cache.
    Reuse,
    /// It would run: no result lies under its key.
    Run,
    /// It runs every time: it lists or writes files.
    Always,
    /// Its files or its inputs are not there to be looked at.
    Unknown(String),
}

/// A stage of a plan, what a run would do with it, and why.
#[derive(Debug, Clone)]
pub struct Explanation {
    /// The stage's id.
    pub id: String,
    /// Its name in the registry.
    pub uses: String,
    /// Content address of its result, if it is known.
    pub key: Option<String>,
    /// What a run would do.
    pub decision: Decision,
    /// The nearest earlier result of the same stage, if it would run and there is one.
    pub nearest: Option<Nearest>,
}

/// An earlier result of the same stage.
#[derive(Debug, Clone)]
pub struct Nearest {
    /// Where it comes from.
    pub origin: Origin,
    /// What has changed since. None: only the result is gone.
    pub changes: Vec<Change>,
}

/// Says for each stage of a plan whether it would run, and what has changed since its nearest earlier result, without
/// running anything.
pub fn explain(plan: &Plan, around: &Surroundings, cache: &Cache) -> Vec<Explanation> {
    let mut origins: Vec<Option<Origin>> = Vec::new();
    let mut rows = Vec::new();
    let mut earlier: Option<Earlier> = None;
    for node in &plan.nodes {
        let planned = plan_node(plan, node, around, &|index| origins.get(index).and_then(Option::as_ref));
        let (origin, decision) = match planned {
            Err(error) => (None, Decision::Unknown(error.to_string())),
            Ok(planned) => {
                let decision = decide(node, &planned.key, cache);
                (Some(planned.origin), decision)
            }
        };
        // listed once, and only if something would run
        let nearest = origin
            .as_ref()
            .filter(|_| decision == Decision::Run)
            .and_then(|origin| nearest(origin, earlier.get_or_insert_with(|| Earlier::of(cache.origins())), cache));
        let key = origin.as_ref().map(|origin| origin.key.clone());
        rows.push(Explanation { id: node.id.clone(), uses: node.uses.clone(), key, decision, nearest });
        origins.push(origin);
    }
    rows
}

fn decide(node: &Node, key: &str, cache: &Cache) -> Decision {
    match node.stage.spec().caching {
        Caching::Always => Decision::Always,
        Caching::Stored if cache.contains(key) => Decision::Reuse,
        Caching::Stored => Decision::Run,
    }
}

/// Earlier results, each list with the last used first.
#[derive(Default)]
struct Earlier {
    all: Vec<(Origin, SystemTime)>,
    /// By the stage's name, pipeline and id.
    same: HashMap<(String, String, String), Vec<usize>>,
    /// By the stage's name.
    stage: HashMap<String, Vec<usize>>,
}

/// Earlier results that a stage is compared with, the last used ones: each comparison takes time in proportion to the
/// files.
const MOST_COMPARED: usize = 32;

impl Earlier {
    fn of(mut all: Vec<(Origin, SystemTime)>) -> Self {
        all.sort_by(|a, b| (Reverse(a.1), &a.0.key).cmp(&(Reverse(b.1), &b.0.key)));
        let mut earlier = Self::default();
        for (place, (origin, _)) in all.iter().enumerate() {
            let Origin { uses, pipeline, id, .. } = origin;
            earlier.same.entry((uses.clone(), pipeline.clone(), id.clone())).or_default().push(place);
            earlier.stage.entry(uses.clone()).or_default().push(place);
        }
        Self { all, ..earlier }
    }

    /// Those that may be nearest: of the same id and pipeline if there is one.
    fn candidates(&self, origin: &Origin) -> impl Iterator<Item = &(Origin, SystemTime)> {
        let same = self.same.get(&(origin.uses.clone(), origin.pipeline.clone(), origin.id.clone()));
        let places = same.or_else(|| self.stage.get(&origin.uses)).map_or(&[][..], Vec::as_slice);
        places.iter().take(MOST_COMPARED).filter_map(|&place| self.all.get(place))
    }
}

/// The earlier result of the same stage that is most like it: of the same id and pipeline if there is one, with the
/// fewest changes, last used; of many the last used [`MOST_COMPARED`] are looked at.
fn nearest(origin: &Origin, earlier: &Earlier, cache: &Cache) -> Option<Nearest> {
    if let Some(gone) = cache.origin(&origin.key) {
        return Some(Nearest { origin: gone, changes: Vec::new() });
    }
    earlier
        .candidates(origin)
        .map(|(other, used)| {
            let changes = changes(other, origin);
            ((changes.len(), Reverse(*used)), other, changes)
        })
        .min_by(|a, b| (&a.0, &a.1.key).cmp(&(&b.0, &b.1.key)))
        .map(|(_, other, changes)| Nearest { origin: other.clone(), changes })
}
