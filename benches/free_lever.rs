//! The whole lean main job, cold: `cargo bench --bench free_lever`.
//!
//! `configs/free-lever.toml` on the archive lever-a (24 records of 0.9 MS, gzip) with an empty cache each time, all
//! intermediates stored and synced; where lever-a is not there, on 24 simulated records, and the name of the benchmark
//! says so.

use std::path::{Path, PathBuf};
use std::time::Duration;

use afmid_pipeline::cache::Cache;
use afmid_pipeline::runner::{Options, Quiet, run};
use afmid_pipeline::store::write_result;
use afmid_pipeline::{Plan, graph};
use criterion::{Criterion, SamplingMode};

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

fn main() {
    let scratch = tempfile::tempdir().expect("a folder");
    let recorded = Path::new(ROOT).join("../shared/data/afm/lever-a");
    let (name, folder) = match recorded.is_dir() {
        true => ("lever-a", recorded),
        false => ("24 simulated records (lever-a is not here)", simulated(scratch.path())),
    };
    let job = plan("free-lever.toml", &[format!("records.files=['{}/*.h5']", folder.display())]);
    let mut criterion = Criterion::default().configure_from_args();
    let mut group = criterion.benchmark_group("free-lever.toml");
    group.sample_size(10).sampling_mode(SamplingMode::Flat).warm_up_time(Duration::from_millis(500));
    group.measurement_time(Duration::from_secs(10));
    group.bench_function(name, |bench| bench.iter(|| execute(&job, scratch.path())));
    group.finish();
    criterion.final_summary();
}

fn plan(config: &str, arguments: &[String]) -> Plan {
    let path = Path::new(ROOT).join("configs").join(config);
    let text = std::fs::read_to_string(&path).expect("a shipped config");
    let registry = afmid::registry().expect("names are unique");
    graph::load(&path.display().to_string(), &text, arguments, &registry).expect("a right config")
}

/// One run with an empty cache, its result file written.
fn execute(plan: &Plan, scratch: &Path) {
    let folder = tempfile::tempdir_in(scratch).expect("a folder");
    let cache = Cache::open(&folder.path().join("cache"));
    let base = Path::new(ROOT).join("configs");
    let program = "bench".to_owned();
    let options = Options {
        base,
        cache: &cache,
        files: cache.input_files(false),
        fresh: false,
        program,
        overrides: Vec::new(),
        observer: &Quiet,
    };
    let result = run(plan, &options).expect("it runs");
    write_result(&folder.path().join("result.h5"), &result).expect("it is written");
}

fn simulated(scratch: &Path) -> PathBuf {
    let folder = scratch.join("archive");
    let set = |name: &str, value: &str| format!("archive.{name}={value}");
    let mut arguments = vec![set("out", &format!("'{}'", folder.display()))];
    arguments.extend(["records", "snap_offs", "snap_ins"].map(|name| set(name, "24")));
    execute(&plan("simulate-demo.toml", &arguments), scratch);
    folder
}
