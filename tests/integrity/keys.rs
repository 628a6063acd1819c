//! What a key knows: processor, build, the whole command of a plugin.

use std::fs;
use std::path::Path;
use std::process::Command;

use afmid_pipeline::cache::{Cache, Origin, arithmetic};
use afmid_pipeline::graph::load;
use afmid_pipeline::runner::{Change, Decision, Explanation, Surroundings, explain};
use serde_json::Value;

use super::common::{afmid, path_with, python_bin};
use super::small::{CONFIG, cached, folder, run};

/// What a run on a processor, or of a build, with this arithmetic would do.
fn explained(here: &Path, arithmetic: &str) -> Vec<Explanation> {
    let text = fs::read_to_string(here.join(CONFIG)).expect("the config");
    let registry = afmid::registry().expect("stages");
    let plan = load(&here.join(CONFIG).display().to_string(), &text, &[], &registry).expect("a config");
    let cache = Cache::open(&here.join("cache"));
    let files = cache.input_files(false);
    explain(&plan, &Surroundings { base: here, program: "afmid test", arithmetic, files: &files }, &cache)
}

#[test]
fn what_another_processor_or_build_computed_is_not_reused() {
    let scratch = folder(1, 20_000);
    let here = scratch.path();
    assert_eq!(run(here, "a.h5", "cache", &[]).code, Some(0));
    let own = arithmetic();
    let kept = |rows: &[Explanation]| rows.iter().filter(|row| row.decision == Decision::Reuse).count();
    // this test was built as the program was
    assert_eq!(kept(&explained(here, &own)), 3);
    let (level, checks) = if cfg!(debug_assertions) { ("checked", "unchecked") } else { ("unchecked", "checked") };
    let others = [
        own.replacen(level, checks, 1),
        own.replacen("opt-level ", "opt-level 1", 1),
        own.replacen("rustc 1.", "rustc 2.", 1),
        own.replacen('[', "[another ", 1),
        own.replacen("functions ", "functions 0", 1),
    ];
    for other in &others {
        assert_ne!(*other, own);
        let rows = explained(here, other);
        assert_eq!(kept(&rows), 0, "{other}");
        let changes = rows.iter().filter_map(|row| row.nearest.as_ref()).flat_map(|nearest| &nearest.changes);
        let changed =
            changes.filter(|change| matches!(change, Change::Arithmetic { was, is } if *was == own && is == other));
        assert_eq!(changed.count(), 3, "each stage says so: {rows:?}");
    }
}

#[test]
fn explain_says_which_processor_or_build_made_what_is_there() {
    let scratch = folder(1, 20_000);
    let here = scratch.path();
    assert_eq!(run(here, "a.h5", "cache", &[]).code, Some(0));
    // as if a node with other vector units had made it
    for path in cached(&here.join("cache"), "json") {
        let mut origin: Origin = serde_json::from_slice(&fs::read(&path).expect("bytes")).expect("an origin");
        assert_eq!(origin.arithmetic, arithmetic(), "the cache states it");
        let other = origin.key.chars().rev().collect::<String>();
        (origin.key, origin.arithmetic) = (other.clone(), "x86_64 [sse4.1]".to_owned());
        let to = here.join("cache").join(&other);
        fs::write(to.with_extension("json"), serde_json::to_vec(&origin).expect("JSON")).expect("written");
        fs::rename(path.with_extension("h5"), to.with_extension("h5")).expect("renamed");
        fs::remove_file(path).expect("removed");
    }
    let output = afmid(here, &["explain", CONFIG, "--cache", "cache"]);
    assert_eq!(output.matches("processor or build was x86_64 [sse4.1], is").count(), 3, "{output}");
    let json: serde_json::Value =
        serde_json::from_str(&afmid(here, &["explain", CONFIG, "--cache", "cache", "--json"])).expect("JSON");
    assert!(json.to_string().contains("\"arithmetic\""), "{json}");
    let ran = run(here, "b.h5", "cache", &[]);
    assert!(ran.code == Some(0) && !ran.stdout.contains("reused"), "{ran:?}");
}

/// A plugin that gives back its arguments and a variable; it can be run as a script, a module or a line of code.
const ECHO: &str = r#"import json, os, sys
describe = {"name": "echo", "version": "1", "summary": "gives back its arguments", "inputs": [], "outputs": [{"name": "out", "shape": "document"}],
            "parameters": {"type": "object", "additionalProperties": False, "properties": {}}, "deterministic": True, "seeded": False}
say = lambda message: print(json.dumps(message), flush=True)
say({"afmid_stage": 1, "protocol": {"min": 1, "max": 1}, "name": "echo", "version": "1"})
for line in sys.stdin:
    request = json.loads(line)
    if request["method"] == "describe": say({"id": request["id"], "result": describe})
    elif request["method"] == "run":
        value = {"said": sys.argv[1:] + [os.environ.get("ORDER", "")]}
        say({"id": request["id"], "result": {"outputs": {"out": {"shape": "document", "value": value}}}})
    else: break
"#;

#[test]
fn every_argument_and_variable_of_a_plugin_is_in_the_key_and_explain_says_what_is_not() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    fs::write(here.join("arg.py"), ECHO).expect("a script");
    fs::write(here.join("data.txt"), "one").expect("a file");
    let afmid = |arguments: &[&str]| -> Value {
        let path = path_with(&[python_bin()]);
        let mut command = Command::new(env!("CARGO_BIN_EXE_afmid"));
        command.current_dir(here).args(arguments).env("PATH", path).env("PYTHONDONTWRITEBYTECODE", "1");
        command.env("AFMID_CACHE", here.join("cache")).env("AFMID_TRUST", here.join("trust"));
        let output = command.output().expect("afmid starts");
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
        serde_json::from_slice(&output.stdout).expect("JSON")
    };
    let run = |command: &str| {
        let config = format!(
            "[pipeline]\nname = \"a\"\n[plugins]\narg = {command}\n[[stage]]\nid = \"one\"\nuses = \"exec:arg\"\n"
        );
        fs::write(here.join("a.toml"), config).expect("a config");
        afmid(&["run", "a.toml", "--allow-plugins", "-o", "a.h5", "--json"])["reused"].as_u64().expect("a count")
    };
    let code = |order: u32| {
        let text = format!("{ECHO}order = {order}\n");
        format!("{{ command = [\"python3\", \"-c\", {}] }}", Value::String(text))
    };
    let commands = [
        "\"python3 arg.py --order=9\"".to_owned(),
        "\"python3 arg.py --order=11\"".to_owned(),
        "\"python3 arg.py --order 11\"".to_owned(),
        "\"python3 -m arg --order=9\"".to_owned(),
        "\"python3 -m arg --order=11\"".to_owned(),
        "\"python3 arg.py --data=data.txt\"".to_owned(),
        "{ command = \"python3 arg.py\", environment = { ORDER = \"9\" } }".to_owned(),
        "{ command = \"python3 arg.py\", environment = { ORDER = \"11\" } }".to_owned(),
        "{ command = \"python3 arg.py\", environment = { OTHER = \"11\" } }".to_owned(),
        code(9),
        code(11),
    ];
    for command in &commands {
        assert_eq!(run(command), 0, "{command} is another one than those before");
    }
    for command in &commands {
        assert_eq!(run(command), 1, "{command} was run before");
    }
    // the file that an option names
    fs::write(here.join("data.txt"), "two").expect("a file");
    assert_eq!(run(&commands[5]), 0);
    afmid(&["trust", "a.toml", "--json"]);
    let explained = afmid(&["explain", "a.toml", "--json"]);
    assert_eq!(explained["stages"][0]["would"], "reuse", "{explained}");
    assert!(explained["stages"][0]["unseen"].as_str().is_some_and(|text| text.contains("import")), "{explained}");
}
