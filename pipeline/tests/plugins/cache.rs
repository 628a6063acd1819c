//! What makes a plugin run again, and how often it is started.

use std::path::Path;

use afmid_pipeline::RunResult;
use serde_json::Value;
use tempfile::tempdir;

use super::exchange::about;
use super::support::{ROOT, config, execute, plan};

const ONE: &str = "[[stage]]\nid = \"one\"\nuses = \"exec:mine\"\nparams = { table = \"table.txt\" }\n";

/// The echo plugin with something replaced, in the folder.
fn put(folder: &Path, from: &str, to: &str) {
    let text = std::fs::read_to_string(Path::new(ROOT).join("tests/plugins/echo.py")).unwrap();
    let text = text.replace("Path(__file__).resolve().parents[2]", &format!("Path({ROOT:?})"));
    assert!(text.contains(from), "{from}");
    std::fs::write(folder.join("echo.py"), text.replace(from, to)).unwrap();
}

fn run(folder: &Path, stages: &str) -> RunResult {
    execute(folder, &plan(folder, &config("echo.py", 60.0, stages)).unwrap()).unwrap()
}

fn cached(run: &RunResult) -> Vec<bool> {
    run.info.stages.iter().map(|(_, _, cached)| *cached).collect()
}

#[test]
fn it_runs_again_when_its_script_or_a_file_of_its_parameters_changes() {
    let folder = tempdir().unwrap();
    let folder = folder.path();
    put(folder, "scale", "scale");
    std::fs::write(folder.join("table.txt"), "1").unwrap();
    assert_eq!(cached(&run(folder, ONE)), [false]);
    assert_eq!(cached(&run(folder, ONE)), [true]);
    std::fs::write(folder.join("table.txt"), "2").unwrap();
    assert_eq!(cached(&run(folder, ONE)), [false]);
    put(folder, "multiplies nothing", "multiplies nothing at all");
    assert_eq!(cached(&run(folder, ONE)), [false]);
    assert_eq!(cached(&run(folder, ONE)), [true]);
}

#[test]
fn one_that_is_not_deterministic_runs_every_time() {
    let folder = tempdir().unwrap();
    put(folder.path(), "seeded=True", "deterministic=False");
    std::fs::write(folder.path().join("table.txt"), "1").unwrap();
    for _ in 0..2 {
        let run = run(folder.path(), ONE);
        assert_eq!(cached(&run), [false]);
        assert_eq!(about(&run, "one")["seed"], Value::Null);
    }
}

#[test]
fn a_process_is_reused_and_what_it_says_is_kept() {
    let folder = tempdir().unwrap();
    put(folder.path(), "scale", "scale");
    let stage = |id: &str| {
        format!("[[stage]]\nid = \"{id}\"\nuses = \"exec:mine\"\nparams = {{ mode = \"loud\", steps = 3 }}\n")
    };
    let pool = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
    let run = pool.install(|| run(folder.path(), &format!("{}{}", stage("one"), stage("two"))));
    let [one, two] = ["one", "two"].map(|id| about(&run, id)["pid"].clone());
    assert_eq!(one, two);
    let said: Vec<(&str, &str)> = run.info.logs.iter().map(|(id, text)| (id.as_str(), text.trim())).collect();
    assert_eq!(said.iter().map(|(id, _)| *id).collect::<Vec<_>>(), ["one", "two"]);
    // this test has no host that would confine it
    let expected = |text: &str| text.starts_with("[afmid] not enforced") && text.ends_with("\nthis goes to stderr");
    assert!(said.iter().all(|(_, text)| expected(text)), "{said:?}");
    assert!(run.stages.iter().all(|stage| stage.result.warnings == ["it was loud"]));
}
