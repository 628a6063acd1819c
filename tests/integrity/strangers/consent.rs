//! A plugin starts after consent, given once for what it is.

use std::fs;
use std::os::unix::fs::PermissionsExt;
use std::path::PathBuf;
use std::process::Command;

use serde_json::json;

use super::super::common::python_bin;
use super::{CONFIG, Project, all};

#[test]
fn what_only_looks_starts_nothing() {
    let project = Project::new("");
    project.stdout(&["run", "c.toml", "--allow-plugins", "-o", "r.h5"]);
    let before = project.starts();
    assert!(before > 0, "it was started");
    for arguments in [
        &["check", "c.toml"][..],
        &["check", "c.toml", "--json"],
        &["graph", "c.toml"],
        &["graph", "c.toml", "--json"],
        &["explain", "c.toml"],
        &["explain", "c.toml", "--json"],
        &["schema"],
        &["stages"],
        &["show", "r.h5"],
        &["show", "r.h5", "one"],
        &["inspect", "r.h5"],
        &["report", "r.h5"],
        &["trace", "r.h5", "one.out.value[0]"],
        &["diff", "r.h5", "r.h5"],
        &["export-crate", "r.h5"],
        &["doctor"],
        &["gc", "--dry-run"],
        &["trust", "--list"],
    ] {
        // whether there is something to trace is not the question
        let output = project.run(arguments);
        assert!(matches!(output.status.code(), Some(0..=2)), "{arguments:?}: {}", all(&output));
        assert_eq!(project.starts(), before, "{arguments:?} started a plugin");
    }
}

#[test]
fn nothing_starts_before_consent_and_the_error_says_how_to_give_it() {
    let project = Project::new("");
    fs::create_dir(project.folder().join("set")).expect("a folder");
    project.put("set/a.h5", "");
    let records = format!(
        "{CONFIG}[[stage]]\nid = \"records\"\nuses = \"io.records\"\n\
         params = {{ files = [\"set/*.h5\"], channel = \"/d\" }}\n"
    );
    project.put("b.toml", &records);
    project.stdout(&["run", "c.toml", "--allow-plugins", "-o", "r.h5"]);
    let before = project.starts();
    assert!(before > 0, "it was started");
    for arguments in [
        &["run", "c.toml", "-o", "a.h5"][..],
        &["batch", "b.toml", "set", "-o", "sets"],
        &["rerun", "r.h5"],
        &["exam", "c.toml", "--seeds", "1"],
        &["submit", "slurm", "b.toml", "set", "--shards", "1", "-o", "jobs"],
    ] {
        let output = project.run(arguments);
        let message = all(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        for word in ["afmid trust", "--allow-plugins", "python3 mine.py", "`mine`"] {
            assert!(message.contains(word), "{arguments:?} lacks {word}: {message}");
        }
        assert_eq!(project.starts(), before, "{arguments:?} started a plugin");
    }
    assert!(!project.folder().join("a.h5").exists());
}

/// Runs a command before a pseudo-terminal that answers its question.
const TERMINAL: &str = r#"import os, pty, sys
child, terminal = pty.fork()
if child == 0:
    os.execv(sys.argv[2], sys.argv[2:])
said = b""
while True:
    try:
        more = os.read(terminal, 4096)
    except OSError:
        break
    if not more:
        break
    said += more
    if said.endswith(b"[y/N] "):
        os.write(terminal, sys.argv[1].encode() + b"\n")
print(said.decode())
sys.exit(os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]))
"#;

#[test]
fn on_a_terminal_a_question_lists_what_would_run_and_only_yes_is_yes() {
    let project = Project::new("");
    let asked = |answer: &str, arguments: &[&str]| {
        let afmid = project.command(arguments);
        let mut terminal = Command::new(python_bin().join("python3"));
        terminal.current_dir(project.folder()).args(["-c", TERMINAL, answer]).arg(afmid.get_program()).args(arguments);
        terminal.envs(afmid.get_envs().filter_map(|(name, value)| Some((name, value?))));
        terminal.output().expect("python3 starts")
    };
    for answer in ["n", "", "perhaps", "nyet y"] {
        let output = asked(answer, &["run", "c.toml", "-o", "a.h5"]);
        let said = all(&output);
        assert_eq!(output.status.code(), Some(2), "{answer}: {said}");
        assert_eq!(said.matches("[y/N]").count(), 1, "{answer}: {said}");
        for word in ["python3 mine.py", "blake3:", "afmid trust"] {
            assert!(said.contains(word), "{answer} lacks {word}: {said}");
        }
        assert_eq!(project.starts(), 0, "{answer} started it");
    }
    let output = asked("y", &["run", "c.toml", "-o", "a.h5"]);
    assert_eq!(output.status.code(), Some(0), "{}", all(&output));
    assert!(project.starts() > 0);
    // it was given once
    let again = project.run(&["run", "c.toml", "-o", "a.h5"]);
    assert_eq!(again.status.code(), Some(0), "{}", all(&again));
}

#[test]
fn ports_are_checked_after_consent_and_without_starting_anything() {
    let project = Project::new("");
    let wrong = CONFIG.to_owned()
        + "params = { gian = 2 }\n[[stage]]\nid = \"two\"\nuses = \"exec:mine\"\n\
            inputs = { table = \"one.nothing\" }\n";
    project.put("wrong.toml", &wrong);
    let before = project.stdout(&["check", "wrong.toml"]);
    assert!(before.contains("ports not checked") && before.contains("one") && before.contains("two"), "{before}");
    let before = project.json(&["check", "wrong.toml", "--json"]);
    assert_eq!((&before[0]["right"], &before[0]["ports_not_checked"]), (&json!(true), &json!(["one", "two"])));
    assert!(project.stdout(&["graph", "wrong.toml"]).contains("table <- one.nothing"));
    let explained = project.json(&["explain", "c.toml", "--json"]);
    assert_eq!(explained["stages"][0]["would"], "unknown", "{explained}");

    let listed = project.stdout(&["trust", "wrong.toml"]);
    let folder = project.folder().canonicalize().expect("a folder");
    for word in ["python3", "mine.py", &folder.display().to_string(), "blake3:", "stranger 1", "table", "out"] {
        assert!(listed.contains(word), "no {word} in {listed}");
    }
    assert_eq!(project.starts(), 1);
    let after = project.run(&["check", "wrong.toml"]);
    let message = all(&after);
    assert_eq!(after.status.code(), Some(2), "{message}");
    assert!(message.contains("no parameter `gian`") && message.contains("no output `nothing`"), "{message}");
    assert_eq!(project.json(&["check", "c.toml", "--json"])[0]["ports_not_checked"], json!([]));
    assert_eq!(project.json(&["explain", "c.toml", "--json"])["stages"][0]["would"], "run");
    assert_eq!(project.starts(), 1, "it was asked once");

    project.stdout(&["run", "c.toml", "-o", "a.h5"]);
    assert_eq!(project.json(&["explain", "c.toml", "--json"])["stages"][0]["would"], "reuse");
    let list = project.json(&["trust", "--list", "--json"]);
    assert_eq!(list["plugins"][0]["identity"], "stranger 1", "{list}");
    project.stdout(&["trust", "--revoke", "c.toml"]);
    assert_eq!(project.run(&["run", "c.toml", "-o", "a.h5"]).status.code(), Some(2));

    // what is there no more can be revoked, too
    project.stdout(&["trust", "c.toml"]);
    project.put("c.toml", &CONFIG.replace("python3 mine.py", "./gone mine.py"));
    let revoked = project.json(&["trust", "--revoke", "c.toml", "--json"]);
    assert_eq!(revoked["plugins"][0]["program"], serde_json::Value::Null, "{revoked}");
    assert_eq!(project.json(&["trust", "--list", "--json"])["plugins"], json!([]));
}

#[test]
fn a_changed_file_command_folder_or_variable_asks_again() {
    let project = Project::new("");
    project.stdout(&["trust", "c.toml"]);
    let runs = |config: &str| project.run(&["run", config, "-o", "a.h5"]).status.code();
    assert_eq!(runs("c.toml"), Some(0));
    for (name, command) in [
        ("other.toml", "\"python3 mine.py --more\""),
        ("fewer.toml", "\"python3 -B mine.py\""),
        ("with.toml", "{ command = \"python3 mine.py\", environment = { GAIN = \"2\" } }"),
    ] {
        project.put(name, &CONFIG.replace("\"python3 mine.py\"", command));
        let before = project.starts();
        assert_eq!((runs(name), project.starts()), (Some(2), before), "{command}");
    }
    // the same time limit or name are nobody's concern
    project.put(
        "same.toml",
        &CONFIG.replace("\"python3 mine.py\"", "{ command = [\"python3\", \"mine.py\"], timeout_s = 60 }"),
    );
    assert_eq!(runs("same.toml"), Some(0));
    let elsewhere = project.folder().join("elsewhere");
    fs::create_dir(&elsewhere).expect("a folder");
    for name in ["c.toml", "mine.py"] {
        fs::copy(project.folder().join(name), elsewhere.join(name)).expect("a copy");
    }
    assert_eq!(runs("elsewhere/c.toml"), Some(2), "another folder");
    let (text, before) = (fs::read_to_string(project.folder().join("mine.py")).expect("a script"), project.starts());
    project.put("mine.py", &(text.clone() + "# changed\n"));
    assert_eq!((runs("c.toml"), project.starts()), (Some(2), before));
    project.put("mine.py", &text);
    assert_eq!(runs("c.toml"), Some(0), "what was agreed to is the same again");
}

#[test]
fn a_folder_that_python_runs_belongs_to_consent_and_key() {
    let project = Project::new("");
    fs::create_dir(project.folder().join("package")).expect("a folder");
    project.put("package/__main__.py", &project.plugin(""));
    project.put("package/part.py", "x = 1\n");
    project.put("p.toml", &CONFIG.replace("mine.py", "package"));
    let listed = project.stdout(&["trust", "p.toml"]);
    assert!(listed.contains("package/__main__.py blake3:") && listed.contains("package/part.py blake3:"), "{listed}");
    let runs = || project.run(&["run", "p.toml", "-o", "a.h5"]).status.code();
    assert_eq!((runs(), runs()), (Some(0), Some(0)));
    project.put("package/part.py", "x = 2\n");
    let before = project.starts();
    assert_eq!((runs(), project.starts()), (Some(2), before), "a part of it is another");
}

#[test]
fn damaged_consent_is_none_and_lies_with_the_user_alone() {
    let project = Project::new("");
    project.stdout(&["trust", "c.toml"]);
    let entries: Vec<PathBuf> =
        fs::read_dir(project.trust()).expect("the folder").flatten().map(|entry| entry.path()).collect();
    let [entry] = &entries[..] else { panic!("{entries:?}") };
    assert_eq!(fs::metadata(project.trust()).expect("the folder").permissions().mode() & 0o077, 0);
    let (whole, before) = (fs::read(entry).expect("consent"), project.starts());
    let refused = |bytes: &[u8], what: &str| {
        fs::write(entry, bytes).expect("written");
        let output = project.run(&["run", "c.toml", "-o", "a.h5"]);
        assert_eq!((output.status.code(), project.starts()), (Some(2), before), "{what}: {}", all(&output));
    };
    for at in (0..whole.len()).step_by(whole.len() / 7) {
        let mut flipped = whole.clone();
        flipped[at] ^= 1;
        refused(&flipped, &format!("byte {at}"));
    }
    refused(&whole[..whole.len() / 2], "cut short");
    refused(b"", "empty");
    fs::write(entry, &whole).expect("written");
    project.stdout(&["run", "c.toml", "-o", "a.h5"]);
    // another plugin's consent under this one's name, and one that the project brings along
    project.put("c.toml", &CONFIG.replace("mine.py", "mine.py --more"));
    let other = project.json(&["trust", "c.toml", "--json"])["plugins"][0]["seal"].as_str().expect("a seal").to_owned();
    fs::copy(entry, project.trust().join(other)).expect("a copy");
    assert_eq!(project.run(&["run", "c.toml", "-o", "a.h5"]).status.code(), Some(2));
    let own = project.folder().join(".local/share/afmid/trust");
    fs::create_dir_all(&own).expect("a folder");
    fs::copy(entry, own.join(entry.file_name().expect("a name"))).expect("a copy");
    fs::remove_dir_all(project.trust()).expect("removed");
    project.put("c.toml", CONFIG);
    assert_eq!(project.run(&["run", "c.toml", "-o", "a.h5"]).status.code(), Some(2));
}

#[test]
fn jobs_of_a_submission_get_the_plugins_that_were_agreed_to_and_no_others() {
    let project = Project::new("");
    fs::create_dir(project.folder().join("set")).expect("a folder");
    project.put("set/a.h5", "no record");
    let records = format!(
        "{CONFIG}[[stage]]\nid = \"records\"\nuses = \"io.records\"\n\
         params = {{ files = [\"set/*.h5\"], channel = \"/d\" }}\n"
    );
    project.put("b.toml", &records);
    let submit = ["submit", "slurm", "b.toml", "set", "--shards", "1", "-o", "jobs"];
    project.stdout(&["trust", "b.toml"]);
    let before = project.starts();
    project.stdout(&submit);
    assert_eq!(project.starts(), before, "a submission starts nothing");
    // a node has no consent of its own
    fs::remove_dir_all(project.trust()).expect("removed");
    let script = fs::read_to_string(project.folder().join("jobs/slurm/array.sbatch")).expect("a script");
    assert!(script.contains("--agreed-plugins"), "{script}");
    let work = || {
        let job = project.command(&[]);
        let mut shell = Command::new("bash");
        shell.args(["jobs/slurm/array.sbatch"]).current_dir(project.folder()).env("SLURM_ARRAY_TASK_ID", "1");
        for (name, value) in job.get_envs() {
            shell.env(name, value.expect("a value"));
        }
        shell.output().expect("bash starts")
    };
    let done = work();
    assert_eq!(done.status.code(), Some(0), "{}", all(&done));
    // its record cannot be read: the plugin has run all the same
    assert!(project.starts() > before, "{}", all(&done));
    let text = fs::read_to_string(project.folder().join("mine.py")).expect("a script");
    project.put("mine.py", &(text + "# changed\n"));
    let before = project.starts();
    let refused = work();
    assert_eq!((refused.status.code(), project.starts()), (Some(2), before), "{}", all(&refused));
}
