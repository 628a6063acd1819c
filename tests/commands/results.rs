//! What people read of results: tables, differences, folders of results.

use std::path::Path;

use super::modes::{table, two_modes};
use crate::common::{afmid, command};

/// Exit code and what is said on stderr.
fn refused(here: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let output = command(here, arguments).output().expect("afmid starts");
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// Two folders of two hits each, in files of their own.
fn folders(here: &Path) {
    for (folder, seeds) in [("one", [1, 2]), ("two", [3, 4])] {
        std::fs::create_dir(here.join(folder)).expect("a folder");
        for seed in seeds {
            table(here, &format!("{folder}/hit_{seed}.csv"), "acceleration (m/s^2)", &two_modes(seed));
        }
    }
}

#[test]
fn a_run_is_called_as_its_config_and_its_modes_are_shown_alone() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    folders(here);
    afmid(here, &["new", "pipeline", "one", "-o", "made/first.v2.toml"]);
    let said = afmid(here, &["run", "made/first.v2.toml", "--cache", "cache"]);
    assert!(said.starts_with("first.v2.h5: ") && here.join("first.v2.h5").is_file(), "{said}");

    // of other files: what was there is gone, which is said
    let arguments = ["run", "made/first.v2.toml", "two", "--cache", "cache"];
    assert!(
        crate::common::said(here, &arguments)[1].contains("first.v2.h5 was the result of another config or of other")
    );
    let again = crate::common::said(here, &["run", "made/first.v2.toml", "--cache", "cache", "-o", "first.v2.h5"]);
    assert!(again[1].contains("it is replaced"), "{again:?}");
    let (code, message) = refused(here, &["run", "made/first.v2.toml", "--cache", "cache", "-o", "none/"]);
    assert!(code == Some(2) && message.contains("none/ is a folder, wanted a file"), "{message}");

    let alone = afmid(here, &["show", "first.v2.h5", "modes"]);
    assert!(alone.contains("modes (table)\nfrequency_hz [Hz]"), "{alone}");
    assert!(!alone.contains("summary (document)") && alone.contains("afmid show first.v2.h5 modes --all"), "{alone}");
    let all = afmid(here, &["show", "first.v2.h5", "modes", "--all"]);
    assert!(all.contains("summary (document)") && all.contains("hits (table)") && !all.contains("--all"), "{all}");
    assert!(!all.contains("-0\n"), "a wander of nothing has no sign: {all}");

    let rows = afmid(here, &["show", "first.v2.h5", "modes", "--csv"]);
    let mut lines = rows.lines();
    assert!(lines.next().is_some_and(|head| head.starts_with("frequency_hz,frequency_std_hz,")), "{rows}");
    let first: f64 = lines.next().and_then(|row| row.split(',').next()?.parse().ok()).expect("a number");
    assert!((first - 40.0).abs() < 0.01 && lines.count() == 1, "{rows}");
    let hits = afmid(here, &["show", "first.v2.h5", "modes.hits", "--csv"]);
    assert_eq!(hits.lines().count(), 1 + 2 * 2, "a header, two hits of two modes: {hits}");
    for (wrong, said) in [
        (&["show", "first.v2.h5", "modes.shapes", "--csv"][..], "is of shape array, wanted a table"),
        (&["show", "first.v2.h5", "--csv"], "<ID>"),
        (&["show", "first.v2.h5", "modes", "--csv", "--json"], "cannot be used with"),
    ] {
        let (code, message) = refused(here, wrong);
        assert!(code == Some(2) && message.contains(said), "{wrong:?}: {message}");
    }
}

#[test]
fn differences_begin_with_the_modes() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    folders(here);
    for name in ["one", "two"] {
        afmid(here, &["modes", name, "--cache", "cache", "-o", &format!("{name}.h5")]);
    }
    let text = afmid(here, &["diff", "one.h5", "two.h5"]);
    let lines: Vec<&str> = text.lines().collect();
    assert!(lines[0].starts_with("mode  result") && lines[0].contains("in errors"), "{text}");
    // two modes of two results each, far fewer lines than there are datasets
    assert!(lines[1].contains("one.h5") && lines[2].contains("two.h5") && lines.len() < 40, "{text}");
    assert!(text.contains("one.h5 and two.h5 differ") && !text.contains("relative"), "{text}");
    assert!(afmid(here, &["diff", "one.h5", "two.h5", "--all"]).contains("relative"));
}

#[test]
fn a_batch_takes_what_new_pipeline_wrote_and_files_and_its_folder_is_shown() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    folders(here);
    afmid(here, &["new", "pipeline", "one", "-o", "modes.toml"]);
    let said = afmid(here, &["batch", "modes.toml", "one", "two/hit_3.csv", "--cache", "cache", "-o", "sets"]);
    let first: Vec<&str> = said.lines().take(3).collect();
    assert!(first[0].starts_with("data_set  mode") && first[0].contains("damping_ratio"), "{said}");
    assert!(first[1].starts_with("hit_3") && said.contains("\none "), "{said}");
    for name in ["sets/hit_3.h5", "sets/one.h5", "sets/summary.csv"] {
        assert!(here.join(name).is_file(), "{name}");
    }
    let summary = std::fs::read_to_string(here.join("sets/summary.csv")).expect("a table");
    let head = summary.lines().next().unwrap_or_default();
    for column in ["damping_ratio", "damping_ratio_std", "verdict", "warnings", "first_warning"] {
        assert!(head.split(',').any(|own| own == column), "{column}: {head}");
    }
    // the same again loses nothing; another config and another set of that name do
    let again = |arguments: &[&str]| {
        let more = [&["batch"], arguments, &["--cache", "cache", "-o", "sets"]].concat();
        let output = command(here, &more).output().expect("afmid starts");
        assert!(output.status.success(), "{output:?}");
        String::from_utf8_lossy(&output.stderr).into_owned()
    };
    let said = again(&["modes.toml", "one", "two/hit_3.csv"]);
    assert!(!said.contains("replaced") && !said.contains("left there"), "{said}");
    let said = again(&["modes.toml", "one", "--set", "pipeline.seed=7"]);
    assert!(said.contains("1 result in sets was of another config or of other files: is replaced"), "{said}");
    assert!(said.contains("1 result in sets of data sets that this batch has not"), "{said}");
    again(&["modes.toml", "one", "two/hit_3.csv"]);
    // the folder stands for its summary
    assert!(afmid(here, &["show", "sets"]).contains("summary.modes (table)"));
    let page = afmid(here, &["report", "sets", "--title", "Two <days>"]);
    assert_eq!(page, "sets/summary.html\n");
    let page = std::fs::read_to_string(here.join("sets/summary.html")).expect("a page");
    assert!(page.contains("<title>Two &lt;days&gt;"), "{}", &page[..600]);
    let (code, message) = refused(here, &["show", "one"]);
    assert!(code == Some(2) && message.contains("is a folder"), "{message}");
}

#[test]
fn a_batch_of_inputs_and_outputs_puts_each_file_in_the_place_of_the_one() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let system = |seed: u64| {
        let force = super::begin::white(seed, 3000);
        let mut motion = vec![0.0; 3000];
        for k in 2..3000 {
            motion[k] = 1.6 * motion[k - 1] - 0.9 * motion[k - 2] + force[k - 1];
        }
        let rows = force.iter().zip(&motion).map(|(u, y)| format!("{u:.6},{y:.6}\n")).collect::<String>();
        format!("u (N),y (m)\n{rows}")
    };
    for name in ["a", "b"] {
        std::fs::write(here.join(format!("{name}.csv")), system(name.len() as u64 + u64::from(name == "b")))
            .expect("a file");
    }
    let pipeline =
        ["new", "pipeline", "a.csv", "--rate", "100", "--input", "u", "--goal", "input-output", "-o", "io.toml"];
    afmid(here, &pipeline);
    let said = afmid(here, &["batch", "io.toml", "a.csv", "b.csv", "--cache", "cache"]);
    assert!(here.join("io/a.h5").is_file() && here.join("io/b.h5").is_file(), "{said}");
    let frequency = |row: &str| -> Option<f64> { row.split_whitespace().nth(2)?.split('(').next()?.parse().ok() };
    // poles of 0.8 +- 0.51i: 9.04 Hz at 100 Hz
    for row in said.lines().skip(1).take(2) {
        assert!(frequency(row).is_some_and(|hz| (hz - 9.04).abs() < 0.2), "{said}");
    }
    let again = afmid(here, &["run", "io.toml", "b.csv", "--cache", "cache", "-o", "again.h5"]);
    assert!(again.contains("again.h5") && again.contains("reused"), "{again}");
}

#[test]
fn a_workbook_is_called_one() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    std::fs::write(here.join("hits.xlsx"), b"PK\x03\x04\x14\0\0\0 and more").expect("a file");
    let (code, message) = refused(here, &["new", "pipeline", "hits.xlsx"]);
    assert!(code == Some(2) && message.contains("a workbook of Excel") && message.contains("as CSV"), "{message}");
}
