//! Plugins that break the protocol: each is reported by name with what is wrong, and costs nothing else.

use std::path::Path;
use std::time::{Duration, Instant};

use afmid_pipeline::plugin::{Plugins, Rule, check};
use tempfile::tempdir;

use super::support::{config, execute, plan, python, script};

/// The script, and what the conformance test says of it.
const BROKEN: [(&str, &str); 20] = [
    ("accepts_everything", "accepts the parameter `a_parameter_that_nobody_knows`"),
    ("banner", "does not begin with a handshake"),
    // its line is seen after the answer or in place of the next one, as the machine happens to schedule it: both errors
    // show it
    ("chatty", "done!"),
    ("crash", "ended (exit status: 3) during `run`"),
    ("deaf", "did not end"),
    ("endless_line", "wrote a line of more than 16 MiB"),
    ("future", "speaks the versions 7 to 9 of the protocol, this program 1 to 1"),
    ("garbage", "wrote something else than an answer"),
    ("hang", "said nothing in time during `run`"),
    ("huge_claim", "more than 2 GiB in one answer"),
    ("huge_file", "is in a file of"),
    ("loose_schema", "additionalProperties"),
    ("missing_output", "did not make the output `out`, which it declares"),
    ("not_finite", "wanted finite numbers"),
    ("not_deterministic", "made something else from the same inputs"),
    ("silent", "said nothing in time before its handshake"),
    ("undeclared_output", "made the output `extra`, which it does not declare"),
    ("unknown_keyword", "keyword"),
    ("wrong_id", "wanted the id"),
    ("wrong_length", "wanted 3"),
];

fn tried(name: &str) -> Vec<(String, Result<String, String>)> {
    let command = [python(), script(name)];
    let checks = check(&Plugins::new(Rule::All, None), &command, Path::new("."), 10.0);
    checks.into_iter().map(|check| (check.name.to_owned(), check.outcome)).collect()
}

#[test]
fn the_conformance_test_names_what_is_wrong() {
    let one = |(name, wanted): &(&str, &str)| {
        let file = format!("{name}.py");
        let checks = tried(&format!("broken/{file}"));
        let failed: Vec<&String> = checks.iter().filter_map(|(_, outcome)| outcome.as_ref().err()).collect();
        let Some(message) = failed.first() else { return Some(format!("{name} passes")) };
        let right = message.contains(wanted) && message.contains(&file) && message.contains("help: ");
        (!right).then(|| format!("{name}: wanted `{wanted}`, found: {message}"))
    };
    let wrong: Vec<String> = std::thread::scope(|scope| {
        let tries: Vec<_> = BROKEN.iter().map(|broken| scope.spawn(|| one(broken))).collect();
        tries.into_iter().filter_map(|tried| tried.join().unwrap()).collect()
    });
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn a_good_plugin_passes() {
    for (name, outcome) in tried("echo.py") {
        assert!(outcome.is_ok(), "{name}: {outcome:?}");
    }
}

#[test]
fn a_run_with_a_broken_plugin_fails_alone() {
    for name in ["crash", "hang", "wrong_length", "huge_claim", "garbage"] {
        let folder = tempdir().unwrap();
        let script = script(&format!("broken/{name}.py"));
        let stages = "[[stage]]\nid = \"all\"\nuses = \"test.all\"\n[[stage]]\nid = \"bad\"\nuses = \"exec:mine\"\n";
        let plan = match plan(folder.path(), &config(&script, 3.0, stages)) {
            Ok(plan) => plan,
            // reported before anything runs
            Err(problems) => {
                assert!(problems.iter().any(|problem| problem.message.contains("`mine`")), "{name}: {problems:?}");
                continue;
            }
        };
        let errors = execute(folder.path(), &plan).unwrap_err();
        let [error] = &errors[..] else { panic!("{name}: {errors:?}") };
        assert_eq!(error.id, "bad", "{name}");
        assert!(error.to_string().contains("the plugin `mine`"), "{name}: {error}");
        // the other stage was finished and kept
        let kept = std::fs::read_dir(folder.path().join("cache")).unwrap().flatten();
        assert_eq!(kept.filter(|entry| entry.path().extension().is_some_and(|end| end == "h5")).count(), 1, "{name}");
    }
}

#[test]
fn a_time_limit_ends_a_plugin_with_what_it_started() {
    let folder = tempdir().unwrap();
    let stages = "[[stage]]\nid = \"bad\"\nuses = \"exec:mine\"\n";
    let plan = plan(folder.path(), &config(&script("orphan.py"), 3.0, stages)).unwrap();
    let errors = execute(folder.path(), &plan).unwrap_err();
    let message = errors[0].to_string();
    let child =
        message.split("child ").nth(1).and_then(|rest| rest.split_whitespace().next()).expect("its stderr is shown");
    let state = Path::new("/proc").join(child).join("stat");
    let gone = || std::fs::read_to_string(&state).map_or(true, |stat| stat.contains(") Z "));
    let clock = Instant::now();
    while !gone() && clock.elapsed() < Duration::from_secs(5) {
        std::thread::sleep(Duration::from_millis(20));
    }
    assert!(gone(), "process {child} lives on");
}
