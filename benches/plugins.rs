//! What a stage in another language costs beside its own work: an array there and back, in a process that is already
//! running.
//! `with_echo` less `without` less `echo_alone`, which is the plugin's own reading, writing and answering.
//!
//! Wants the Python of `make test-deps`.

use std::io::{BufRead, BufReader, Lines, Write};
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};

use afmid_pipeline::cache::Cache;
use afmid_pipeline::plugin::{AllStages, Plugins, Rule};
use afmid_pipeline::runner::{Options, Quiet, run};
use afmid_pipeline::{
    Array, Axis, Caching, Context, Entry, Example, Plan, Port, Ports, Registry, Spec, Stage, StageError, graph,
    schemars, serde,
};
use criterion::{Criterion, criterion_group, criterion_main};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};
use serde_json::json;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");
const SAMPLES: usize = 8192;
const ARRAY: Port<Array> = Port::new("array", "", "three signals");

/// Three signals of a window's length.
#[derive(Debug, Default, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default, crate = "afmid_pipeline::serde")]
#[schemars(crate = "afmid_pipeline::schemars")]
struct Signals {
    /// Changes nothing.
    nothing: u32,
}

impl Stage for Signals {
    const SPEC: Spec = Spec {
        name: "bench.signals",
        version: 1,
        summary: "three signals",
        inputs: &[],
        outputs: &[ARRAY.spec()],
        caching: Caching::Always,
        seeded: false,
        source: "",
    };

    fn run(&self, _inputs: &Ports, _cx: &Context) -> Result<Ports, StageError> {
        let time: Vec<f64> = (0..SAMPLES).map(|k| 2e-7 * k as f64).collect();
        let wave = |f: f64| time.iter().map(|t| (f * t).sin()).collect::<Vec<f64>>();
        let waves = [1e5, 2e5, 3e5].map(wave);
        let array = Array::over(vec![Axis::new("time", "s", "time", time)]);
        let names = ["a", "b", "c"].into_iter().zip(waves);
        Ok(Ports::new()
            .with(&ARRAY, names.fold(array, |array, (name, wave)| array.with(name, "V", name, &["time"], wave))))
    }

    fn examples() -> Vec<Example> {
        Vec::new()
    }
}

fn plan(folder: &Path, plugin: bool) -> Plan {
    let python = Path::new(ROOT).join(".tools/bin/python");
    assert!(python.exists(), "{} is missing: run `make test-deps`", python.display());
    // not deterministic: nothing of it is put into the cache
    let script = folder.join("echo.py");
    let echo = std::fs::read_to_string(Path::new(ROOT).join("tests/plugins/echo.py")).expect("the plugin");
    let echo = echo.replace("Path(__file__).resolve().parents[2]", &format!("Path({ROOT:?})"));
    std::fs::write(&script, echo.replace("seeded=True", "deterministic=False")).expect("a script");
    let mut text = format!("[pipeline]\nname = \"b\"\n[plugins]\necho = {{ command = [{python:?}, {script:?}] }}\n");
    text.push_str("[[stage]]\nid = \"signals\"\nuses = \"bench.signals\"\n");
    if plugin {
        text.push_str("[[stage]]\nid = \"echo\"\nuses = \"exec:echo\"\ninputs = { array = \"signals\" }\n");
    }
    let registry = Registry::new().with(&[Entry::of::<Signals>()]).expect("one name");
    // its processes wait for the runs
    let plugins = Box::leak(Box::new(Plugins::new(Rule::All, None)));
    let file = folder.join("b.toml").display().to_string();
    graph::load(&file, &text, &[], &AllStages { registry: &registry, plugins }).expect("a right config")
}

/// The plugin's own work: the same request again and again, sent to it without afmid, its input file ready.
struct Alone {
    child: Child,
    lines: Lines<BufReader<ChildStdout>>,
    request: String,
}

impl Alone {
    fn start(folder: &Path) -> Self {
        let (input, output) = (folder.join("in.h5"), folder.join("out.h5"));
        let python = Path::new(ROOT).join(".tools/bin/python");
        let names = ["time", "a", "b", "c"];
        let made = format!(
            "import h5py, numpy\nwith h5py.File({input:?}, 'w') as f:\n    for name in {names:?}: f[name] = numpy.arange({SAMPLES}) * 1.5"
        );
        assert!(Command::new(&python).args(["-c", &made]).status().expect("python starts").success());
        let mut child = Command::new(&python)
            .arg(folder.join("echo.py"))
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .expect("python starts");
        let lines = BufReader::new(child.stdout.take().expect("a pipe")).lines();
        let axis = json!({ "name": "time", "unit": "s", "long_name": "", "length": SAMPLES, "values": "/time" });
        let variable = |name: &str| json!({ "name": name, "unit": "V", "long_name": "", "dims": ["time"], "kind": "real", "values": format!("/{name}") });
        let variables: Vec<_> = names[1..].iter().map(|name| variable(name)).collect();
        let array =
            json!({ "shape": "array", "file": input, "axes": [axis], "variables": variables, "attributes": {} });
        let parameters = json!({ "scale": 1.0, "steps": 0, "mode": "plain", "table": "" });
        let params = json!({ "parameters": parameters, "seed": null, "base": folder, "inputs": { "array": array }, "output": output });
        let request = json!({ "id": 1, "method": "run", "params": params }).to_string();
        let mut alone = Self { child, lines, request };
        assert!(alone.line().contains("afmid_stage"), "a handshake");
        alone
    }

    fn line(&mut self) -> String {
        self.lines.next().expect("a line").expect("text")
    }

    fn ask(&mut self) {
        let input = self.child.stdin.as_mut().expect("a pipe");
        writeln!(input, "{}", self.request).expect("it reads");
        let answer = self.line();
        assert!(answer.contains("outputs"), "{answer}");
    }
}

impl Drop for Alone {
    fn drop(&mut self) {
        // it ends when its input does
        drop(self.child.stdin.take());
        let _ = self.child.wait();
    }
}

fn overhead(c: &mut Criterion) {
    let folder = tempfile::tempdir().expect("a folder");
    let cache = Cache::open(&folder.path().join("cache"));
    let mut group = c.benchmark_group("exec");
    for (name, plugin) in [("without", false), ("with_echo", true)] {
        let plan = plan(folder.path(), plugin);
        let program = "bench".to_owned();
        let options = Options {
            base: folder.path().to_owned(),
            cache: &cache,
            files: cache.input_files(false),
            fresh: true,
            program,
            overrides: Vec::new(),
            observer: &Quiet,
        };
        group.bench_function(name, |b| b.iter(|| run(&plan, &options).expect("it runs")));
    }
    let mut alone = Alone::start(folder.path());
    group.bench_function("echo_alone", |b| b.iter(|| alone.ask()));
    group.finish();
}

criterion_group! { name = benches; config = Criterion::default().sample_size(20); targets = overhead }
criterion_main!(benches);
