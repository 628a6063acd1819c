//! What a key knows: processor, build, the whole command of a plugin.

use std::fs;
use std::path::Path;
use std::process::Command;

use serde_json::Value;

use super::common::ROOT;

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
        let bin = Path::new(ROOT).join(".tools/bin");
        assert!(bin.join("python3").exists(), "{} has no python3: run `make test-deps`", bin.display());
        let path = std::env::var_os("PATH").unwrap_or_default();
        let path = std::env::join_paths([bin].into_iter().chain(std::env::split_paths(&path))).expect("a PATH");
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
    assert!(explained["stages"][0]["unseen"].as_str().is_some_and(|told| told.contains("import")), "{explained}");
}
