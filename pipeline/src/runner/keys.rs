//! Content addresses: what a stage's result depends on.

use std::path::Path;

use rayon::prelude::*;

use super::result::SourceFile;
use crate::cache::{Cache, KeyParts, key};
use crate::error::StageError;
use crate::graph::{Node, Plan};
use crate::recording::hash_file;
use crate::stage::Caching;

/// The seed of a stage: the pipeline's seed and the stage's id, mixed by BLAKE3, so that stages draw independent numbers and
/// adding a stage changes no other's.
pub fn stage_seed(pipeline_seed: u64, id: &str) -> u64 {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&pipeline_seed.to_le_bytes()).update(id.as_bytes());
    let mut bytes = [0; 8];
    bytes.copy_from_slice(&hasher.finalize().as_bytes()[..8]);
    u64::from_le_bytes(bytes)
}

/// What a run of a node would depend on.
#[derive(Debug, Clone)]
pub struct StagePlan {
    /// Content address of its result.
    pub key: String,
    /// Seed, if it draws random numbers.
    pub seed: Option<u64>,
    /// The files that it reads.
    pub sources: Vec<SourceFile>,
}

/// Works out a node's key from its parameters, its files and the keys of what it needs.
pub(super) fn plan_node(
    plan: &Plan,
    node: &Node,
    base: &Path,
    upstream: &dyn Fn(usize) -> Option<String>,
) -> Result<StagePlan, StageError> {
    let spec = node.stage.spec();
    let sources = node.stage.sources(base)?.par_iter().map(|path| source_file(path)).collect::<Result<Vec<_>, _>>();
    let sources = sources?;
    let seed = spec.seeded.then(|| stage_seed(plan.seed(), &node.id));
    let mut wires = Vec::new();
    for wire in &node.inputs {
        let missing = || StageError::new(format!("port `{}`: its source has no key yet", wire.port));
        wires.push((wire.port.to_owned(), upstream(wire.node).ok_or_else(missing)?, wire.output.to_owned()));
    }
    wires.sort();
    let key = key(&KeyParts {
        stage: spec.name,
        version: spec.version,
        params: &node.params,
        location_params: node.stage.location_params(),
        depends_on: &node.stage.depends_on(),
        seed,
        sources: &sources,
        upstream: &wires,
    });
    Ok(StagePlan { key, seed, sources })
}

fn source_file(path: &Path) -> Result<SourceFile, StageError> {
    let size = std::fs::metadata(path)
        .map_err(|error| StageError::new(format!("the file cannot be looked at: {error}")).at(path))?
        .len();
    Ok(SourceFile { path: path.display().to_string(), size, blake3: hash_file(path)? })
}

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

/// Says for each stage of a plan whether it would run, in order, without running anything.
pub fn explain(plan: &Plan, base: &Path, cache: &Cache) -> Vec<(String, Option<String>, Decision)> {
    let mut keys: Vec<Option<String>> = Vec::new();
    let mut rows = Vec::new();
    for node in &plan.nodes {
        let planned = plan_node(plan, node, base, &|index| keys.get(index).cloned().flatten());
        let (key, decision) = match planned {
            Err(error) => (None, Decision::Unknown(error.to_string())),
            Ok(planned) if node.stage.spec().caching == Caching::Always => (Some(planned.key), Decision::Always),
            Ok(planned) if cache.contains(&planned.key) => (Some(planned.key), Decision::Reuse),
            Ok(planned) => (Some(planned.key), Decision::Run),
        };
        keys.push(key.clone());
        rows.push((node.id.clone(), key, decision));
    }
    rows
}
