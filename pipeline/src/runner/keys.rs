//! Content addresses: what a stage's result depends on.

use std::path::Path;

use rayon::prelude::*;

use super::error::RunError;
use crate::cache::{KeyParts, Origin, OriginFile, OriginInput, key};
use crate::error::StageError;
use crate::graph::{Node, Plan};
use crate::outcome::SourceFile;
use crate::recording::{HashedFile, InputFiles};
use crate::stage::Caching;
use crate::store::FORMAT_VERSION;

/// The seed of a stage: the pipeline's seed and the stage's id, mixed by BLAKE3, so that stages draw independent
/// numbers and adding a stage changes no other's.
pub fn stage_seed(pipeline_seed: u64, id: &str) -> u64 {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&pipeline_seed.to_le_bytes()).update(id.as_bytes());
    let mut bytes = [0; 8];
    bytes.copy_from_slice(&hasher.finalize().as_bytes()[..8]);
    u64::from_le_bytes(bytes)
}

/// What keys are made from beside the plan.
#[derive(Debug, Clone, Copy)]
pub struct Surroundings<'a> {
    /// The folder where relative paths of parameters begin.
    pub base: &'a Path,
    /// The program and its version, for the record.
    pub program: &'a str,
    /// What of processor and build may change last bits: [`crate::cache::arithmetic`].
    pub arithmetic: &'a str,
    /// Hashes of input files.
    pub files: &'a InputFiles,
}

/// What a run of a node would depend on.
#[derive(Debug, Clone)]
pub(super) struct StagePlan {
    /// Content address of its result.
    pub key: String,
    /// Seed, if it draws random numbers.
    pub seed: Option<u64>,
    /// The files that it reads.
    pub sources: Vec<SourceFile>,
    /// The same, in the state in which they were hashed.
    pub hashed: Vec<HashedFile>,
    /// The same in words, for the cache.
    pub origin: Origin,
}

/// Works out a node's key from its parameters, its files and the keys of what it needs. `upstream` gives the origin of
/// a node's result.
pub(super) fn plan_node<'a>(
    plan: &Plan,
    node: &Node,
    around: &Surroundings,
    upstream: &dyn Fn(usize) -> Option<&'a Origin>,
) -> Result<StagePlan, StageError> {
    let spec = node.stage.spec();
    let paths = node.stage.sources(around.base, around.files)?;
    let hashed = paths.par_iter().map(|path| around.files.hashed(path)).collect::<Result<Vec<_>, _>>()?;
    let sources: Vec<SourceFile> = paths.iter().zip(&hashed).map(|(path, file)| source_file(path, file)).collect();
    let seed = spec.seeded.then(|| stage_seed(plan.seed(), &node.id));
    let (inputs, depends_on) = (inputs(plan, node, upstream)?, node.stage.depends_on());
    let mut wires: Vec<(String, String, String)> =
        inputs.iter().map(|input| (input.port.clone(), input.key.clone(), input.output.clone())).collect();
    wires.sort();
    let key = key(&KeyParts {
        stage: spec.name,
        version: spec.version,
        params: &node.params,
        location_params: node.stage.location_params(),
        depends_on: &depends_on,
        arithmetic: around.arithmetic,
        seed,
        sources: &sources,
        upstream: &wires,
    });
    let origin = Origin {
        key: key.clone(),
        format: FORMAT_VERSION,
        uses: spec.name.to_owned(),
        version: spec.version,
        params: node.params.clone(),
        location_params: node.stage.location_params().iter().map(|&name| name.to_owned()).collect(),
        depends_on,
        arithmetic: around.arithmetic.to_owned(),
        seed,
        files: sources.iter().map(origin_file).collect(),
        inputs,
        pipeline: plan.name().to_owned(),
        id: node.id.clone(),
        program: around.program.to_owned(),
    };
    Ok(StagePlan { key, seed, sources, hashed, origin })
}

/// What a whole run depends on.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct RunKey {
    /// One hash of the content addresses of all stages.
    pub key: String,
    /// The files that its stages read, in the order of the stages: what the hash was made from.
    pub sources: Vec<SourceFile>,
}

/// Whether a run would give the same results again, without running anything. The last bits, which processors may
/// change, do not count: nodes of a cluster agree.
///
/// Errors: a stage whose files cannot be listed or read.
pub fn run_key(plan: &Plan, around: &Surroundings) -> Result<RunKey, RunError> {
    let around = Surroundings { arithmetic: "", ..*around };
    let mut sources = Vec::new();
    let mut origins: Vec<Origin> = Vec::with_capacity(plan.nodes.len());
    for node in &plan.nodes {
        let planned = plan_node(plan, node, &around, &|index| origins.get(index));
        let failed = |error| RunError { id: node.id.clone(), uses: node.uses.clone(), error: Box::new(error) };
        let planned = planned.map_err(failed)?;
        sources.extend(planned.sources);
        origins.push(planned.origin);
    }
    let mut hasher = blake3::Hasher::new();
    let mut all: Vec<String> = origins.iter().map(|origin| format!("{}={}\n", origin.id, origin.key)).collect();
    all.sort_unstable();
    all.iter().for_each(|one| {
        hasher.update(one.as_bytes());
    });
    Ok(RunKey { key: hasher.finalize().to_hex().to_string(), sources })
}

fn inputs<'a>(
    plan: &Plan,
    node: &Node,
    upstream: &dyn Fn(usize) -> Option<&'a Origin>,
) -> Result<Vec<OriginInput>, StageError> {
    let input = |wire: &crate::graph::Wire| {
        let missing = || StageError::new(format!("port `{}`: its source has no key yet", wire.port));
        let origin = upstream(wire.node).ok_or_else(missing)?;
        let kept = plan.nodes[wire.node].stage.spec().caching == Caching::Stored;
        Ok(OriginInput {
            port: wire.port.to_owned(),
            stage: origin.id.clone(),
            output: wire.output.to_owned(),
            key: origin.key.clone(),
            origin: (!kept).then(|| Box::new(origin.clone())),
        })
    };
    node.inputs.iter().map(input).collect()
}

fn origin_file(file: &SourceFile) -> OriginFile {
    let name = file.path.rsplit(['/', '\\']).next().unwrap_or_default().to_owned();
    OriginFile { name, size: file.size, blake3: file.blake3.clone() }
}

fn source_file(path: &Path, file: &HashedFile) -> SourceFile {
    SourceFile { path: path.display().to_string(), size: file.size(), blake3: file.blake3.clone() }
}
