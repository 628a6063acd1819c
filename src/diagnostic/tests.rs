//! Diagnostics as people see them: `tests/diagnostics/NAME.toml` gives `NAME.txt` (`UPDATE_EXPECTED=1` writes them
//! again).

use std::fs;
use std::path::Path;

use afmid_pipeline::graph::load;
use miette::GraphicalTheme;
use proptest::prelude::*;

use super::render_with;

#[path = "../../pipeline/tests/check/stages.rs"]
mod stages;

fn rendered(file: &str, text: &str, arguments: &[String]) -> String {
    match load(file, text, arguments, &stages::registry()) {
        Ok(_) => String::new(),
        Err(problems) => render_with(file, text, &problems, GraphicalTheme::unicode_nocolor()),
    }
}

/// `# --set ...` lines at the top of a case are its arguments.
fn arguments(text: &str) -> Vec<String> {
    text.lines().filter_map(|line| line.strip_prefix("# --set ")).map(str::to_owned).collect()
}

#[test]
fn every_kind_of_problem_reads_as_expected() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/diagnostics");
    let mut cases: Vec<_> =
        fs::read_dir(&folder).expect("the folder").map(|entry| entry.expect("an entry").path()).collect();
    cases.retain(|path| path.extension().is_some_and(|extension| extension == "toml"));
    cases.sort();
    assert!(cases.len() >= 10, "{cases:?}");
    let mut changed = Vec::new();
    for case in cases {
        let text = fs::read_to_string(&case).expect("a case");
        let name = case.file_name().expect("a name").to_string_lossy().into_owned();
        let found = rendered(&name, &text, &arguments(&text));
        let expected = case.with_extension("txt");
        if std::env::var_os("UPDATE_EXPECTED").is_some() {
            fs::write(&expected, &found).expect("the expected text");
        }
        if fs::read_to_string(&expected).unwrap_or_default() != found {
            changed.push(format!("{name} gives:\n{found}"));
        }
    }
    assert!(changed.is_empty(), "{}", changed.join("\n"));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 128, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn any_problem_can_be_rendered(text in "[\\[\\]{}=\",.#' \\n\\r\\ta-z0-9é日]{0,80}", argument in "[a-c=.\"\\[é\\n]{0,9}") {
        let text = format!("[pipeline]\nname = \"x\"\n[[stage]]\nid = \"a\"\nuses = \"test.sine\"\n{text}");
        let out = rendered("x.toml", &text, &[argument]);
        prop_assert!(out.is_empty() || out.contains("problem"));
    }
}
