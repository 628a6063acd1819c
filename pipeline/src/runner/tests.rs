//! The runner on stages whose numbers can be worked out by hand.

use std::path::Path;
use std::sync::atomic::{AtomicUsize, Ordering};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Decision, Options, Quiet, RunError, explain, run, run_to_file};
use crate::artifact::{Array, Axis};
use crate::cache::Cache;
use crate::error::StageError;
use crate::graph::{Plan, load};
use crate::outcome::{Port, Ports, RunResult};
use crate::stage::{Context, Entry, Example, Registry, Spec, Stage};
use crate::store::{compare, write_result};

const OUT: Port<Array> = Port::new("out", "series", "a series");
const IN: Port<Array> = Port::new("in", "series", "a series");

static SQUARES: AtomicUsize = AtomicUsize::new(0);

fn series(values: Vec<f64>) -> Array {
    let axis = Axis::new("n", "1", "index", (0..values.len()).map(|index| index as f64).collect());
    Array::over(vec![axis]).with("value", "1", "value", &["n"], values)
}

/// Counts up.
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Count {
    /// How far.
    to: usize,
}

impl Stage for Count {
    const SPEC: Spec = Spec {
        name: "test.count",
        version: 1,
        summary: "counts",
        inputs: &[],
        outputs: &[OUT.spec()],
        source: "",
        ..Spec::STORED
    };

    fn run(&self, _inputs: &Ports, cx: &Context) -> Result<Ports, StageError> {
        cx.warn(format!("counting to {}", self.to));
        Ok(Ports::new().with(&OUT, series((0..self.to).map(|n| n as f64).collect())))
    }

    fn examples() -> Vec<Example> {
        Vec::new()
    }
}

/// Squares, and refuses numbers above a limit.
#[derive(Debug, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
struct Square {
    /// The largest number that is squared.
    limit: f64,
}

impl Default for Square {
    fn default() -> Self {
        Self { limit: 1e9 }
    }
}

impl Stage for Square {
    const SPEC: Spec = Spec { name: "test.square", inputs: &[IN.spec()], ..Count::SPEC };

    fn run(&self, inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        SQUARES.fetch_add(1, Ordering::SeqCst);
        let values = inputs.get(&IN)?.real("value")?;
        match values.iter().find(|value| **value > self.limit) {
            Some(value) => Err(StageError::new(format!("found {value}, wanted at most {}", self.limit)).on("in")),
            None => Ok(Ports::new().with(&OUT, series(values.iter().map(|value| value * value).collect()))),
        }
    }

    fn examples() -> Vec<Example> {
        Vec::new()
    }
}

fn plan(count: usize, limit: f64) -> Plan {
    let text = format!(
        "[pipeline]\nname = \"squares\"\nseed = 1\n\
         [[stage]]\nid = \"count\"\nuses = \"test.count\"\nparams = {{ to = {count} }}\n\
         [[stage]]\nid = \"square\"\nuses = \"test.square\"\ninputs = {{ in = \"count\" }}\n\
         params = {{ limit = {limit:.1} }}\n"
    );
    let registry = Registry::new().with(&[Entry::of::<Count>(), Entry::of::<Square>()]).expect("two names");
    load("squares.toml", &text, &[], &registry).expect("a valid config")
}

fn options(cache: &Cache, fresh: bool) -> Options<'_> {
    let (base, program) = (Path::new(".").to_owned(), "afmid test".to_owned());
    Options { base, cache, files: cache.input_files(fresh), fresh, program, overrides: Vec::new(), observer: &Quiet }
}

fn execute(plan: &Plan, cache: &Cache, fresh: bool) -> Result<RunResult, Vec<RunError>> {
    run(plan, &options(cache, fresh))
}

fn explanations(plan: &Plan, cache: &Cache) -> Vec<super::Explanation> {
    let (files, arithmetic) = (cache.input_files(false), crate::cache::arithmetic());
    let (base, program) = (Path::new("."), "test");
    explain(plan, &super::Surroundings { base, program, arithmetic: &arithmetic, files: &files }, cache)
}

fn cached(result: &RunResult) -> Vec<bool> {
    result.info.stages.iter().map(|(_, _, cached)| *cached).collect()
}

// one test, because it counts how often a stage ran
#[test]
fn a_result_is_computed_once_and_again_only_when_something_changed() {
    let folder = tempfile::tempdir().expect("a folder");
    let cache = Cache::open(folder.path());
    let first = execute(&plan(4, 10.0), &cache, false).expect("runs");
    let out =
        first.stage("square").and_then(|stage| stage.result.outputs.find(&OUT).ok().flatten()).expect("an output");
    assert_eq!(out.real("value").expect("real"), [0.0, 1.0, 4.0, 9.0]);
    assert_eq!(first.stage("count").expect("count").result.warnings, ["counting to 4"]);
    assert_eq!(cached(&first), [false, false]);

    let again = execute(&plan(4, 10.0), &cache, false).expect("runs");
    assert_eq!(cached(&again), [true, true]);
    assert_eq!(
        again.stage("count").expect("count").result.warnings,
        ["counting to 4"],
        "warnings are part of the result"
    );
    assert_eq!(SQUARES.load(Ordering::SeqCst), 1);

    // a file that grows with the run holds what one written after it holds
    let (grown, after) = (folder.path().join("grown.h5"), folder.path().join("after.h5"));
    run_to_file(&plan(4, 10.0), &options(&cache, false), &grown).expect("runs");
    write_result(&after, &again).expect("written");
    assert_eq!(compare(&grown, &after).expect("both whole"), []);

    let other_limit = execute(&plan(4, 11.0), &cache, false).expect("runs");
    assert_eq!(cached(&other_limit), [true, false]);
    let other_count = plan(5, 10.0);
    let decisions: Vec<Decision> = explanations(&other_count, &cache).into_iter().map(|row| row.decision).collect();
    assert_eq!(decisions, [Decision::Run, Decision::Run]);
    assert_eq!(cached(&execute(&plan(4, 10.0), &cache, true).expect("runs")), [false, false], "--fresh");

    let errors = execute(&plan(5, 3.0), &cache, false).expect_err("4 is above 3");
    assert_eq!(errors.len(), 1);
    assert_eq!(errors[0].to_string(), "stage `square` (test.square), port `in`: found 4, wanted at most 3");
    let decisions: Vec<Decision> = explanations(&plan(5, 3.0), &cache).into_iter().map(|row| row.decision).collect();
    assert_eq!(decisions, [Decision::Reuse, Decision::Run], "what was finished before the failure is kept");
}
