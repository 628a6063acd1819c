//! What a plugin gets and gives back, bit for bit; its parameters, checked like a built-in stage's.

use afmid_pipeline::{Problem, RunResult, Shape};
use serde_json::{Value, json};
use tempfile::tempdir;

use super::support::{config, execute, plan, script};

/// A stage that makes everything, and the plugin wired to it.
const STAGES: &str = r#"
[[stage]]
id = "all"
uses = "test.all"
[[stage]]
id = "back"
uses = "exec:mine"
inputs = { array = "all.array", table = "all.table", state_space = "all.state_space", document = "all.document", recording = "all.recording" }
"#;

pub fn output<'a>(run: &'a RunResult, id: &str, port: &str) -> &'a afmid_pipeline::Artifact {
    let stage = run.stages.iter().find(|stage| stage.id == id).expect("the stage");
    stage.result.outputs.artifact(port).expect("the output")
}

pub fn about(run: &RunResult, id: &str) -> Value {
    match output(run, id, "about") {
        afmid_pipeline::Artifact::Document(document) => document.0.clone(),
        other => panic!("a {}", other.shape().name()),
    }
}

#[test]
fn every_shape_comes_back_bit_for_bit() {
    let folder = tempdir().unwrap();
    let text = config(&script("echo.py"), 60.0, STAGES);
    let run = execute(folder.path(), &plan(folder.path(), &text).unwrap()).unwrap();
    for port in ["array", "table", "state_space", "document"] {
        // every digit that tells two numbers apart is printed, and NaN as NaN
        let [given, back] = ["all", "back"].map(|id| format!("{:?}", output(&run, id, port)));
        assert_eq!(given, back, "{port}");
    }
    let about = about(&run, "back");
    let path = folder.path().join("record.h5").canonicalize().unwrap();
    assert_eq!(about["records"], json!([[path, 5e6, "deflection", [2.0, 2.5]]]));
    assert!(about["seed"].as_u64().is_some_and(|seed| seed > 0 && seed < 1 << 53), "{about}");
    assert_eq!(about["parameters"], json!({ "scale": 1.0, "steps": 0, "mode": "plain", "table": "" }));
    assert_eq!(output(&run, "back", "about").shape(), Shape::Document);
}

fn problems(params: &str) -> (String, Vec<Problem>) {
    let folder = tempdir().unwrap();
    let stages = format!("{STAGES}params = {{ {params} }}\n");
    let text = config(&script("echo.py"), 60.0, &stages);
    let problems = plan(folder.path(), &text).err().unwrap_or_default();
    (text, problems)
}

#[test]
fn parameters_are_checked_with_their_place_before_anything_runs() {
    for (params, marked, message, help) in [
        ("scal = 2", "scal", "has no parameter `scal`", "`scale`"),
        ("scale = 11", "11", "`scale`", ""),
        ("scale = \"x\"", "\"x\"", "`scale`", ""),
        ("steps = 1.5", "1.5", "`steps`", ""),
        ("mode = \"quiet\"", "\"quiet\"", "`mode`", "plain"),
    ] {
        let (text, problems) = problems(params);
        let [problem] = &problems[..] else { panic!("{params}: {problems:?}") };
        assert_eq!(&text[problem.span.clone()], marked, "{params}: {}", problem.message);
        let all = format!("{} {}", problem.message, problem.help.clone().unwrap_or_default());
        assert!(problem.message.contains(message) && all.contains(help), "{params}: {all}");
    }
    let (_, none) = problems("scale = 2, mode = \"loud\", steps = 3");
    assert!(none.is_empty(), "{none:?}");
}

#[test]
fn a_plugin_that_is_not_there_is_reported_with_its_place() {
    let folder = tempdir().unwrap();
    let text =
        "[pipeline]\nname = \"x\"\n[plugins]\nmine = \"python3 a.py\"\n[[stage]]\nid = \"a\"\nuses = \"exec:mien\"\n";
    let problems = plan(folder.path(), text).unwrap_err();
    let [problem] = &problems[..] else { panic!("{problems:?}") };
    assert_eq!(&text[problem.span.clone()], "\"exec:mien\"");
    let all = format!("{} {}", problem.message, problem.help.clone().unwrap_or_default());
    assert!(["mien", "`mine`", "PATH"].iter().all(|word| all.contains(word)), "{all}");
}
