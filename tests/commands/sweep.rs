//! Sweeps: what is not swept is computed once, points are runs like others, one bad point stops no other.

use std::path::Path;

use crate::common::sets::{CENSUS, write_set};
use crate::common::{afmid, command, config, files, number, simulated};
use afmid_pipeline::store::compare;
use serde_json::Value;

/// Exit code, what `--json` printed, and stderr.
fn run_json(here: &Path, arguments: &[&str]) -> (i32, Value, String) {
    let output = command(here, &[arguments, &["--json"]].concat()).output().expect("afmid starts");
    let errors = String::from_utf8_lossy(&output.stderr).into_owned();
    let value = serde_json::from_slice(&output.stdout).unwrap_or_else(|_| panic!("{errors}"));
    (output.status.code().expect("it ended by itself"), value, errors)
}

/// Exit code and stderr; nothing on stdout.
fn refused(here: &Path, arguments: &[&str]) -> (i32, String) {
    let output = command(here, arguments).output().expect("afmid starts");
    assert!(output.stdout.is_empty(), "{arguments:?}");
    (output.status.code().expect("it ended by itself"), String::from_utf8_lossy(&output.stderr).into_owned())
}

/// How many stages of a point were computed, not reused.
fn computed(point: &Value) -> u64 {
    let count = |key: &str| point[key].as_u64().expect(key);
    count("stages") - count("reused")
}

#[test]
fn only_the_changed_branch_is_computed_and_points_are_runs_like_others() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let set = files(&simulated(here, "archive", 6, 5).folder);
    let sweep = config("sweep-order.toml");
    let run = ["run", &sweep, "--set", &set, "-o", "orders", "--cache", "cache"];
    let (code, first, errors) = run_json(here, &run);
    assert_eq!(code, 0, "{errors}");
    let points = first["points"].as_array().expect("points");
    let counts: Vec<u64> = points.iter().map(computed).collect();
    // all six; then the records, which are listed every time, the model and its modes
    assert_eq!((counts, &first["stages"]), (vec![6, 3, 3], &18.into()), "{first}");
    let orders: Vec<&Value> = points.iter().map(|point| &point["values"]["model.order"]).collect();
    assert_eq!(orders, [9, 11, 13]);

    for point in points {
        for (name, truth) in [("frequency_hz", 46.3e3), ("quality_factor", 40.8)] {
            let of = |suffix: &str| number(point, &format!("/found/modes/0/{suffix}"));
            let (found, std) = (of(name), of(&name.replace("_hz", "_std_hz").replace("factor", "factor_std")));
            // 4 standard errors, as of every run of this lever
            assert!((found - truth).abs() < 4.0 * std, "{name} {found} +- {std}, truth {truth}");
        }
    }
    let table = std::fs::read_to_string(here.join("orders/summary.csv")).expect("a table");
    let rows: Vec<Vec<&str>> = table.lines().map(|line| line.split(',').collect()).collect();
    assert_eq!(rows[0][..5], ["point", "model.order", "started_at", "status", "mode"]);
    let modes: usize = points.iter().map(|point| point["found"]["modes"].as_array().expect("modes").len()).sum();
    assert_eq!(rows.len() - 1, modes);
    assert_eq!((rows[1][0], rows[1][1]), ("point_00001", "9"));
    assert_eq!(rows.last().expect("a row")[..2], ["point_00003", "13"]);
    let shown = afmid(here, &["show", "orders/summary.h5", "summary"]);
    assert!(shown.contains("model.order") && shown.contains("point_00003"), "{shown}");

    // a point is what `--set` gives, and its file repeats it
    let single =
        ["run", &sweep, "--set", &set, "--set", "model.order=11", "-o", "one.h5", "--cache", "other", "-j", "1"];
    afmid(here, &single);
    let diff = |one: &str, other: &str| -> Value {
        serde_json::from_str(&afmid(here, &["diff", one, other, "--json"])).expect("JSON")
    };
    assert_eq!(diff("one.h5", "orders/point_00002.h5")["results_equal"], true);
    let differs = afmid(here, &["diff", "orders/point_00001.h5", "orders/point_00002.h5"]);
    assert!(differs.contains("parameter order: 9 | 11"), "{differs}");
    assert!(afmid(here, &["show", "orders/point_00003.h5", "modes"]).contains("frequency_hz"));
    let again = afmid(here, &["rerun", "orders/point_00003.h5", "--reuse", "--cache", "cache"]);
    assert!(again.contains("identical"), "{again}");

    // nothing is done twice; on one thread, with an empty cache, the same bits
    let bytes = |folder: &str, name: &str| std::fs::read(here.join(folder).join(name)).expect(name);
    let before = bytes("orders", "point_00002.h5");
    let (_, second, _) = run_json(here, &run);
    assert_eq!((&second["ran"], &second["failed"]), (&0.into(), &0.into()));
    assert!(before == bytes("orders", "point_00002.h5"), "it was written again");
    run_json(here, &["run", &sweep, "--set", &set, "-o", "thread", "--cache", "third", "-j", "1"]);
    for name in ["summary.csv", "summary.parquet", "summary.h5"] {
        assert!(bytes("orders", name) == bytes("thread", name), "{name} differs");
    }
    for name in ["point_00001.h5", "point_00002.h5", "point_00003.h5"] {
        let [one, other] = ["orders", "thread"].map(|folder| here.join(folder).join(name));
        assert_eq!(compare(&one, &other).expect("two results"), [], "{name}");
    }
}

/// Two records in `a`; in `b` one of them is cut short.
fn census(here: &Path, sweep: &str) {
    write_set(&here.join("a"), 0, 3000);
    write_set(&here.join("b"), 1, 3000);
    let cut = here.join("b/record_1.h5");
    let whole = std::fs::read(&cut).expect("a record");
    std::fs::write(&cut, &whole[..whole.len() / 2]).expect("a record cut short");
    std::fs::write(here.join("census.toml"), format!("{}[sweep]\n{sweep}", CENSUS.replace("nowhere/*", "a/*")))
        .expect("a config");
}

const RUN: [&str; 6] = ["run", "census.toml", "-o", "out", "--cache", "cache"];

#[test]
fn one_bad_point_stops_no_other() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    census(here, "records.files = [[\"b/*.h5\"], [\"a/*.h5\"]]\n\"census.min_bandwidth_share\" = [0.02, 0.05]\n");
    std::fs::create_dir_all(here.join("out/point_00004.h5")).expect("a folder in the way");
    std::fs::write(here.join("out/point_00003.h5"), "notes of somebody").expect("a file in the way");
    let (code, all, errors) = run_json(here, &RUN);
    assert_eq!((code, &all["failed"], all["points"].as_array().map(Vec::len)), (3, &4.into(), Some(4)), "{errors}");
    assert!(errors.contains("4 of 4 points failed"), "{errors}");
    let error = |point: usize| all["points"][point]["error"].as_str().unwrap_or_default().to_owned();
    assert!(error(0).contains("record_1.h5") && error(1).contains("record_1.h5"), "{all}");
    assert!(error(2).contains("point_00003.h5") && error(3).contains("point_00004.h5"), "{all}");
    assert!(all["points"][0]["found"]["numbers"].is_object(), "keys are never missing: {all}");
    let kept = std::fs::read_to_string(here.join("out/point_00003.h5")).expect("the notes");
    assert_eq!(kept, "notes of somebody");
    std::fs::remove_file(here.join("out/point_00003.h5")).expect("the notes");

    let (code, all, _) = run_json(here, &RUN);
    assert_eq!((code, &all["failed"], &all["ran"]), (3, &3.into(), &4.into()), "what failed is tried again");
    assert_eq!(all["points"][2]["values"]["records.files"], serde_json::json!(["a/*.h5"]));
    assert_eq!(all["points"][2]["file"], "out/point_00003.h5");
    let table = std::fs::read_to_string(here.join("out/summary.csv")).expect("a table");
    let rows: Vec<&str> = table.lines().collect();
    assert!(rows[0].starts_with("point,records.files,census.min_bandwidth_share,"), "{table}");
    assert!(rows[2].starts_with("point_00002,\"[\"\"b/*.h5\"\"]\",0.05,,failed,0,"), "{table}");
    assert!(rows[3].starts_with("point_00003,\"[\"\"a/*.h5\"\"]\",0.02,"), "{table}");
}

#[test]
fn commands_for_one_set_of_parameters_say_so_and_the_others_count_points() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    census(here, "census.min_bandwidth_share = [0.02, 0.05]\ncensus.sentinels = [[], [0.0]]\n");
    let (code, said) = refused(here, &["batch", "census.toml", "a", "-o", "sets", "--cache", "cache"]);
    assert!(code == 2 && said.contains("[sweep]") && said.contains("a batch runs one set"), "{said}");
    let set = ["--set", "census.sentinels=[]", "--set", "census.min_bandwidth_share=0.1"];
    afmid(here, &[&["batch", "census.toml", "a", "-o", "sets", "--cache", "cache"], &set[..]].concat());
    let (code, said) = refused(here, &["run", "census.toml", "-o", "a.h5", "--cache", "cache"]);
    assert!(code == 2 && said.contains("`-o a`"), "{said}");
    let (code, said) = refused(here, &["run", "census.toml", "-o", "sets", "--cache", "cache"]);
    assert!(code == 2 && said.contains("no table of a sweep"), "{said}");
    assert_eq!(afmid(here, &["check", "census.toml"]), "census.toml: right, 2 stages, every point of a sweep of 4\n");
    assert!(afmid(here, &["graph", "census.toml"]).contains("sweep: 4 points, the same graph in each"));

    let explain = ["explain", "census.toml", "--cache", "cache"];
    let before = afmid(here, &explain);
    assert_eq!(before.lines().filter(|line| line.starts_with("census ")).count(), 4, "{before}");
    assert!(before.lines().any(|line| line.starts_with("records  all ")), "{before}");
    // the second of the swept parameters as an argument: two points are left
    let (code, all, _) = run_json(here, &[&RUN[..], &set[..2]].concat());
    assert_eq!((code, all["points"].as_array().map(Vec::len)), (0, Some(2)));
    let after: Value = serde_json::from_str(&afmid(here, &[&explain[..], &["--json"]].concat())).expect("JSON");
    let would: Vec<(&str, &Value)> = after["stages"]
        .as_array()
        .expect("stages")
        .iter()
        .map(|row| (row["would"].as_str().expect("a word"), &row["points"][0]))
        .collect();
    let names = ["point_00001", "point_00001", "point_00002", "point_00003", "point_00004"].map(Value::from);
    let expected = ["run", "reuse", "run", "reuse", "run"];
    assert_eq!(would, expected.into_iter().zip(&names).collect::<Vec<_>>(), "{after}");
    assert_eq!(
        after["points"][1]["values"],
        serde_json::json!({"census.min_bandwidth_share": 0.02, "census.sentinels": [0.0]})
    );
}

#[test]
fn what_is_wrong_with_a_value_is_reported_at_its_place_before_anything_runs() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    census(
        here,
        "census.min_bandwidth_share = [0.02, \"much\"]\ncensuss.sentinels = [[]]\n\"census.sentinls\" = [[], [0.0]]\n",
    );
    for arguments in [&RUN[..], &["check", "census.toml"], &["explain", "census.toml"], &["graph", "census.toml"]] {
        let (code, said) = refused(here, arguments);
        assert_eq!(code, 2, "{said}");
        for word in ["\"much\"", "did you mean `census`?", "did you mean `sentinels`?", "census.toml:16:", "3 problems"]
        {
            assert!(said.contains(word), "{word} in {said}");
        }
    }
    assert!(!here.join("out").exists() || std::fs::read_dir(here.join("out")).expect("a folder").next().is_none());
}
