//! Where results come from: differences, traces, repetitions, crates, and what the cache keeps.

use std::fs::{self, File};
use std::path::Path;
use std::process::Output;
use std::time::{Duration, SystemTime};

use crate::common::{afmid, command, config, files, python_bin, simulated};
use afmid_pipeline::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};
use serde_json::Value;

fn run(folder: &Path, arguments: &[&str]) -> Output {
    command(folder, arguments).output().expect("afmid starts")
}

fn code(output: &Output) -> i32 {
    output.status.code().expect("it ended by itself")
}

fn stdout(output: &Output) -> String {
    String::from_utf8_lossy(&output.stdout).into_owned()
}

fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

fn json(folder: &Path, arguments: &[&str]) -> Value {
    serde_json::from_str(&afmid(folder, arguments)).expect("JSON alone on stdout")
}

/// A record of 2000 codes that depend on `number`.
fn record(path: &Path, number: i16) {
    let channel = NativeChannel {
        location: "deflection".to_owned(),
        codes: Codes::Int16((0..2000).map(|k: i16| k.wrapping_mul(7919 + number) % 1000).collect()),
        unit: "V".to_owned(),
        scale_factor: 1e-3,
        add_offset: 0.0,
        long_name: "deflection".to_owned(),
    };
    let record =
        NativeRecord { sample_rate_hz: 5e6, started_at: "2005-03-01T10:00:00Z".to_owned(), channels: vec![channel] };
    write_native(path, &record, RecordStorage::Raw).expect("a record");
}

const COUNT: &str = "[pipeline]\nname = \"count\"\n[[stage]]\nid = \"records\"\nuses = \"io.records\"\n\
    params = { files = [\"data/*.h5\"] }\n[[stage]]\nid = \"census\"\nuses = \"io.census\"\n\
    inputs = { records = \"records\" }\n";

/// Three records in `data`, a config that counts their samples, and its result `a.h5`.
fn counted() -> tempfile::TempDir {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    fs::create_dir(here.join("data")).expect("a folder");
    (1..=3).for_each(|number| record(&here.join(format!("data/record_{number}.h5")), number));
    fs::write(here.join("count.toml"), COUNT).expect("a config");
    afmid(here, &["run", "count.toml", "--cache", "cache", "-o", "a.h5"]);
    scratch
}

fn set_age(path: &Path, days: u64) {
    let time = SystemTime::now() - Duration::from_secs(days * 24 * 3600);
    File::options().write(true).open(path).expect("a file").set_modified(time).expect("its time");
}

/// The cache's results.
fn results(cache: &Path) -> Vec<std::path::PathBuf> {
    let entries = fs::read_dir(cache).expect("the cache").map(|entry| entry.expect("an entry").path());
    entries.filter(|path| path.extension().is_some_and(|extension| extension == "h5")).collect()
}

#[test]
fn gc_frees_what_was_not_used_and_nothing_that_is_not_its_own() {
    let scratch = counted();
    let here = scratch.path();
    afmid(here, &["run", "count.toml", "--cache", "cache", "-o", "b.h5", "--set", "census.min_bandwidth_share=0.03"]);
    let cache = here.join("cache");
    fs::write(cache.join("thesis.h5"), "three years").expect("a file");
    assert_eq!(results(&cache).len(), 3, "two results and a thesis");
    results(&cache).iter().for_each(|path| set_age(path, 40));
    // used again: the last to go
    afmid(here, &["run", "count.toml", "--cache", "cache", "-o", "a.h5"]);

    let output = afmid(here, &["gc", "--cache", "cache"]);
    assert!(output.contains("freed nothing") && output.contains("left   2 results, "), "{output}");
    assert!(output.contains("1 result, ") && output.contains("`--older-than 30d` frees them"), "{output}");
    let dry = json(here, &["gc", "--cache", "cache", "--older-than", "30d", "--dry-run", "--json"]);
    assert_eq!((&dry["dry_run"], &dry["freed"]["files"]), (&Value::from(true), &Value::from(1)), "{dry}");
    assert_eq!(results(&cache).len(), 3);
    let freed = json(here, &["gc", "--cache", "cache", "--older-than", "30d", "--json"]);
    assert_eq!(freed["removed"][0]["why"], "older than the limit", "{freed}");
    assert_eq!((results(&cache).len(), &freed["left"]["results"]["files"]), (2, &Value::from(1)));
    let explained = afmid(here, &["explain", "count.toml", "--cache", "cache"]);
    assert!(explained.contains("be reused"), "{explained}");

    afmid(here, &["gc", "--cache", "cache", "--max-size", "0"]);
    assert_eq!(fs::read_to_string(cache.join("thesis.h5")).expect("the thesis"), "three years");
    assert_eq!(fs::read_dir(&cache).expect("the cache").count(), 1, "results go with what lies beside them");
    afmid(here, &["run", "count.toml", "--cache", "cache", "-o", "c.h5"]);
    assert!(json(here, &["diff", "a.h5", "c.h5", "--json"])["equal"].as_bool() == Some(true));

    let none = json(here, &["gc", "--cache", "nowhere", "--json"]);
    assert_eq!(none["left"]["results"]["files"], 0);
    assert!(!here.join("nowhere").exists());
    for wrong in [["--older-than", "30"], ["--older-than", "soon"], ["--max-size", "20 potatoes"]] {
        let output = run(here, &[&["gc", "--cache", "cache"], &wrong[..]].concat());
        assert_eq!((code(&output), stdout(&output)), (2, String::new()), "{wrong:?}");
    }
}

#[test]
fn a_run_survives_a_cache_that_is_emptied_all_the_time() {
    let scratch = counted();
    let here = scratch.path();
    let stop = std::sync::atomic::AtomicBool::new(false);
    std::thread::scope(|scope| {
        scope.spawn(|| {
            while !stop.load(std::sync::atomic::Ordering::Relaxed) {
                afmid(here, &["gc", "--cache", "cache", "--max-size", "0"]);
            }
        });
        for _ in 0..20 {
            afmid(here, &["run", "count.toml", "--cache", "cache", "-o", "b.h5"]);
            assert_eq!(
                afmid_pipeline::store::compare(&here.join("a.h5"), &here.join("b.h5")).expect("two results"),
                []
            );
        }
        stop.store(true, std::sync::atomic::Ordering::Relaxed);
    });
}

#[test]
fn explain_names_the_parameter_the_file_and_the_input_that_changed() {
    let scratch = counted();
    let here = scratch.path();
    let explain =
        |arguments: &[&str]| afmid(here, &[&["explain", "count.toml", "--cache", "cache"], arguments].concat());
    assert!(explain(&[]).contains("be reused"), "{}", explain(&[]));
    let set = explain(&["--set", "census.min_bandwidth_share=0.03"]);
    assert!(set.contains("`min_bandwidth_share` was 0.02, is 0.03"), "{set}");
    let fewer = explain(&["--set", "records.files=['data/record_1.h5', 'data/record_2.h5']"]);
    assert!(fewer.contains("`records`: file `record_3.h5` is no longer read"), "{fewer}");

    record(&here.join("data/record_2.h5"), 9);
    let explained = json(here, &["explain", "count.toml", "--cache", "cache", "--json"]);
    let census = &explained["stages"][1];
    assert_eq!((&census["id"], &census["would"]), (&Value::from("census"), &Value::from("run")));
    assert_eq!(census["compared_with"]["pipeline"], "count");
    let change = &census["changes"][0];
    assert_eq!(
        (&change["kind"], &change["stage"], &change["name"]),
        (&"file".into(), &"records".into(), &"record_2.h5".into())
    );
    assert!(change["was"]["blake3"] != change["is"]["blake3"], "{change}");
    assert_eq!(census["changes"].as_array().map(Vec::len), Some(1), "{census}");

    let empty = afmid(here, &["explain", "count.toml", "--cache", "other"]);
    assert!(empty.contains("no earlier result of this stage is in the cache"), "{empty}");
    fs::remove_dir_all(here.join("data")).expect("no records");
    let unknown = explain(&[]);
    assert!(unknown.contains("be decided later"), "{unknown}");
}

#[test]
fn diff_tells_parameters_files_and_results_apart() {
    let scratch = counted();
    let here = scratch.path();
    let diff = |b: &str| json(here, &["diff", "a.h5", b, "--json"]);
    afmid(here, &["run", "count.toml", "--cache", "other", "-o", "same.h5", "-j", "1"]);
    let same = diff("same.h5");
    assert_eq!(
        (&same["equal"], &same["results_equal"], &same["stages"]),
        (&true.into(), &true.into(), &Value::Array(vec![]))
    );
    assert_eq!(afmid(here, &["diff", "a.h5", "same.h5", "--exit-code"]), "a.h5 and same.h5 are equal\n");

    afmid(here, &["run", "count.toml", "--cache", "cache", "-o", "set.h5", "--set", "census.min_bandwidth_share=0.0"]);
    let set = diff("set.h5");
    assert_eq!((&set["equal"], &set["results_equal"]), (&false.into(), &true.into()), "{set}");
    let parameter = &set["stages"][0]["parameters"][0];
    assert_eq!(
        (&parameter["name"], &parameter["a"], &parameter["b"]),
        (&"min_bandwidth_share".into(), &0.02.into(), &0.0.into())
    );
    assert_eq!(set["run"][0]["name"], "overrides");
    let output = run(here, &["diff", "a.h5", "set.h5", "--exit-code"]);
    assert_eq!((code(&output), stderr(&output)), (1, String::new()));
    assert!(stdout(&output).contains("parameter min_bandwidth_share: 0.02 | 0.0"), "{}", stdout(&output));

    record(&here.join("data/record_2.h5"), 9);
    fs::remove_file(here.join("data/record_3.h5")).expect("a record");
    record(&here.join("data/record_4.h5"), 4);
    afmid(here, &["run", "count.toml", "--cache", "cache", "-o", "files.h5"]);
    let files = diff("files.h5");
    let records = &files["stages"][0]["files"];
    assert_eq!((&records["only_in_a"][0], &records["only_in_b"][0]), (&"record_3.h5".into(), &"record_4.h5".into()));
    assert_eq!(records["other_bytes"][0]["name"], "record_2.h5");
    let census = files["stages"].as_array().and_then(|stages| stages.iter().find(|stage| stage["id"] == "census"));
    let results = census.expect("the census differs")["results"].as_array().expect("results");
    let noise = results.iter().find(|result| result["dataset"].as_str().is_some_and(|name| name.contains("noise")));
    let noise = noise.unwrap_or_else(|| panic!("the noise differs: {results:?}"));
    assert!(noise["largest"].as_f64().is_some_and(|largest| largest > 0.0), "{noise}");
    let text = afmid(here, &["diff", "a.h5", "files.h5"]);
    assert!(text.contains("- file record_3.h5") && text.contains("other bytes: record_2.h5"), "{text}");
    assert!(text.contains("afmid diff a.h5 files.h5 --all") && !text.contains("largest"), "{text}");
    let text = afmid(here, &["diff", "a.h5", "files.h5", "--all"]);
    assert!(text.contains("file record_2.h5: other bytes") && text.contains("largest"), "{text}");

    fs::rename(here.join("data"), here.join("moved")).expect("a move");
    afmid(here, &["run", "count.toml", "--cache", "cache", "-o", "moved.h5", "--set", "records.files=['moved/*.h5']"]);
    let moved = json(here, &["diff", "files.h5", "moved.h5", "--json"]);
    assert_eq!((&moved["equal"], &moved["results_equal"]), (&false.into(), &true.into()), "{moved}");
    assert_eq!(moved["stages"][0]["files"]["moved"], 3);

    for wrong in [["diff", "a.h5", "nowhere.h5"], ["diff", "count.toml", "a.h5"]] {
        assert_eq!(code(&run(here, &wrong)), 2, "{wrong:?}");
    }
}

#[test]
fn trace_goes_from_a_number_back_to_the_bytes() {
    let scratch = counted();
    let here = scratch.path();
    let traced = json(here, &["trace", "a.h5", "census.table[1].record", "--json"]);
    assert_eq!(
        (&traced["value"], &traced["dataset"]),
        (&"record_2.h5".into(), &"/entry/census/table/record".into()),
        "{traced}"
    );
    assert_eq!(traced["index"][0], 1);
    let stages = traced["stages"].as_array().expect("stages");
    assert_eq!((&stages[0]["id"], &stages[1]["id"]), (&"records".into(), &"census".into()));
    assert_eq!(stages[1]["inputs"][0]["stage"], "records");
    let now = |traced: &Value| {
        traced["stages"][0]["files"]
            .as_array()
            .expect("files")
            .iter()
            .map(|file| file["now"].clone())
            .collect::<Vec<_>>()
    };
    assert_eq!(now(&traced), ["same", "same", "same"]);

    // from another folder, after one record was changed and one removed
    record(&here.join("data/record_2.h5"), 9);
    fs::remove_file(here.join("data/record_3.h5")).expect("a record");
    let a = here.join("a.h5").display().to_string();
    let elsewhere = json(Path::new("/"), &["trace", &a, "census", "--json"]);
    assert_eq!(now(&elsewhere), ["same", "other bytes", "missing"]);
    let text = afmid(Path::new("/"), &["trace", &a, "records.records[0].size_bytes"]);
    assert!(text.contains("/entry/records/records/records/size[0]") && text.contains("record_3.h5"), "{text}");
    assert!(text.contains("there, same bytes") && text.contains("not there"), "{text}");

    for (path, help) in [
        ("sensus.table[0]", "did you mean `census`?"),
        ("census.tabel[0]", "did you mean `table`?"),
        ("census.table[0].recrod", "did you mean `record`?"),
        ("census.table[9]", "it has 3 elements"),
        ("census.table[", "write the stage's id"),
    ] {
        let output = run(here, &["trace", "a.h5", path]);
        assert_eq!((code(&output), stdout(&output)), (2, String::new()), "{path}");
        assert!(stderr(&output).contains(help), "{path}: {}", stderr(&output));
    }
}

#[test]
fn rerun_repeats_a_run_bit_for_bit_wherever_its_files_are_now() {
    let scratch = counted();
    let here = scratch.path();
    let before = fs::read(here.join("a.h5")).expect("the result");
    let output = afmid(here, &["rerun", "a.h5", "--cache", "again"]);
    assert!(output.contains("a.h5: identical, all "), "{output}");
    let away = tempfile::tempdir().expect("a folder");
    let a = here.join("a.h5").display().to_string();
    let repeated = json(away.path(), &["rerun", &a, "--cache", "c", "-o", "b.h5", "--json"]);
    assert_eq!((&repeated["verdict"], &repeated["output"]), (&"identical".into(), &"b.h5".into()), "{repeated}");
    // and the repetition can be repeated
    assert_eq!(
        json(here, &["rerun", &away.path().join("b.h5").display().to_string(), "--cache", "again", "--json"])["verdict"],
        "identical"
    );

    fs::write(here.join("data/record_0.h5"), "not one of them").expect("a file");
    assert!(
        afmid(here, &["rerun", "a.h5", "--cache", "again"]).contains("identical"),
        "files that came later are left alone"
    );
    fs::create_dir_all(here.join("moved/2005")).expect("a folder");
    fs::rename(here.join("data/record_2.h5"), here.join("moved/2005/record_2.h5")).expect("a move");
    record(&here.join("data/record_3.h5"), 9);
    let output = run(here, &["rerun", "a.h5", "--cache", "again"]);
    assert_eq!((code(&output), stdout(&output)), (1, String::new()));
    let said = stderr(&output);
    assert!(said.contains("record_2.h5: not there") && said.contains("record_3.h5: other bytes"), "{said}");
    assert!(!said.contains("record_1.h5") && said.contains("--data FOLDER") && !said.contains("census"), "{said}");
    record(&here.join("moved/record_3.h5"), 3);
    let found = afmid(here, &["rerun", "a.h5", "--cache", "again", "--data", "moved"]);
    assert!(found.contains("identical"), "{found}");
    assert_eq!(fs::read(here.join("a.h5")).expect("the result"), before);

    let over = run(here, &["rerun", "a.h5", "--cache", "again", "--data", "moved", "-o", "a.h5"]);
    assert_eq!(code(&over), 2, "{}", stderr(&over));
}

#[test]
fn rerun_of_a_simulation_leaves_the_archive_alone_and_a_changed_result_is_seen() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let archive = simulated(here, "archive", 2, 5);
    let file = archive.folder.join("record_0000.h5");
    let kept = fs::metadata(&file).and_then(|metadata| metadata.modified()).expect("a record");
    let output = afmid(here, &["rerun", "archive.h5", "--cache", "cache"]);
    assert!(output.contains("identical"), "{output}");
    assert_eq!(fs::metadata(&file).and_then(|metadata| metadata.modified()).expect("a record"), kept);

    // a result of another program: one number of the truth is another
    let mut other = afmid_pipeline::store::read_result(&here.join("archive.h5")).expect("a result");
    let stage = other.stages.first_mut().expect("a stage");
    stage.result.outputs.insert("truth", nudged(stage.result.outputs.artifact("truth").expect("the truth")));
    afmid_pipeline::store::write_result(&here.join("other.h5"), &other).expect("a result");
    let output = run(here, &["rerun", "other.h5", "--cache", "cache"]);
    assert_eq!(code(&output), 1, "{}", stderr(&output));
    assert!(stdout(&output).contains("other.h5: differs in 1 dataset of"), "{}", stdout(&output));
}

/// The same with its first real number 1 % larger.
fn nudged(artifact: &afmid_pipeline::Artifact) -> afmid_pipeline::Artifact {
    use afmid_pipeline::artifact::ColumnValues;
    use afmid_pipeline::{Artifact, Values};
    match artifact {
        Artifact::Table(table) => {
            let mut table = table.as_ref().clone();
            let real = table.columns.iter_mut().find_map(|column| match &mut column.values {
                ColumnValues::Real(values) => values.iter_mut().find(|value| value.is_finite() && **value != 0.0),
                _ => None,
            });
            *real.expect("a number") *= 1.01;
            Artifact::Table(table.into())
        }
        Artifact::Array(array) => {
            let mut array = array.as_ref().clone();
            let real = array.variables.iter_mut().find_map(|variable| match &mut variable.values {
                Values::Real(values) => values.iter_mut().find(|value| value.is_finite() && **value != 0.0),
                _ => None,
            });
            *real.expect("a number") *= 1.01;
            Artifact::Array(array.into())
        }
        Artifact::Document(document) => {
            let mut document = document.as_ref().clone();
            assert!(nudge(&mut document.0), "a number");
            Artifact::Document(document.into())
        }
        other => panic!("no numbers in a {}", other.shape().name()),
    }
}

fn nudge(value: &mut Value) -> bool {
    match value {
        Value::Number(number) if number.is_f64() && number.as_f64() != Some(0.0) => {
            *value = Value::from(number.as_f64().unwrap_or(1.0) * 1.01);
            true
        }
        Value::Object(entries) => entries.values_mut().any(nudge),
        Value::Array(values) => values.iter_mut().any(nudge),
        _ => false,
    }
}

#[test]
fn a_modal_frequency_is_traced_compared_in_its_errors_and_repeated() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    let archive = simulated(here, "archive", 4, 6);
    let (config, set) = (config("ringdown.toml"), files(&archive.folder));
    let run = |name: &str, extra: &[&str]| {
        afmid(here, &[&["run", &config, "--set", &set, "-o", name, "--cache", "cache"], extra].concat());
    };
    run("a.h5", &[]);
    let shown = json(here, &["show", "a.h5", "modes", "--json"]);
    let traced = json(here, &["trace", "a.h5", "modes[0].frequency_hz", "--json"]);
    assert_eq!(traced["value"], shown["modes"][0]["frequency_hz"]);
    assert_eq!(traced["standard_error"], shown["modes"][0]["frequency_std_hz"]);
    assert_eq!(
        (&traced["path"], &traced["dataset"]),
        (&"modes.modes[0].frequency_hz".into(), &"/entry/modes/summary/data".into())
    );
    assert_eq!(traced["pointer"], "/modes/0/frequency_hz");
    assert_eq!(traced["stages"][0]["files"].as_array().map(Vec::len), Some(4));
    let full = json(here, &["trace", "a.h5", "modes.modes[0].frequency_hz", "--json"]);
    assert_eq!(full, traced);

    run("b.h5", &["--set", "events.window_samples=4096"]);
    let diff = json(here, &["diff", "a.h5", "b.h5", "--json"]);
    let modes = diff["stages"].as_array().and_then(|stages| stages.iter().find(|stage| stage["id"] == "modes"));
    let results = modes.expect("the modes differ")["results"].as_array().expect("results").clone();
    let summary = results.iter().find(|result| result["output"] == "summary").expect("the summary differs");
    // half the window: other numbers of the same modes, some errors apart at most
    if let Some(errors) = summary["in_errors"].as_f64() {
        assert!(errors > 0.0 && errors < 100.0, "{summary}");
    }
    assert!(results.iter().any(|result| result["in_errors"].is_f64()), "{results:?}");

    assert_eq!(json(here, &["rerun", "a.h5", "--cache", "cache", "--json", "-j", "1"])["verdict"], "identical");
    let reused = json(here, &["rerun", "a.h5", "--cache", "cache", "--json", "--reuse"]);
    assert_eq!(reused["verdict"], "identical");
}

#[test]
fn a_crate_is_one_for_its_own_tools_and_the_same_each_time() {
    let scratch = counted();
    let here = scratch.path();
    let export = |arguments: &[&str]| afmid(here, &[&["export-crate", "a.h5"], arguments].concat());
    let output = export(&[]);
    assert!(output.starts_with("a-crate: result, config, 3 inputs by their hashes"), "{output}");
    let text =
        |folder: &str| fs::read_to_string(here.join(folder).join("ro-crate-metadata.json")).expect("the metadata");
    let first = text("a-crate");
    export(&[]);
    assert_eq!(text("a-crate"), first, "again, over itself");
    export(&[
        "-o",
        "full",
        "--with-data",
        "--agent",
        "A. Nobody",
        "--agent-id",
        "https://orcid.org/0000-0000-0000-0000",
    ]);
    assert_eq!(fs::read_to_string(here.join("full/config.toml")).expect("the config"), COUNT);
    for number in 1..=3 {
        let (copy, own) = (format!("full/inputs/record_{number}.h5"), format!("data/record_{number}.h5"));
        assert_eq!(fs::read(here.join(copy)).expect("a copy"), fs::read(here.join(own)).expect("a record"));
    }
    // every entity that is referred to is there, and every file of the crate
    for folder in ["a-crate", "full"] {
        let json: Value = serde_json::from_str(&text(folder)).expect("JSON");
        let graph = json["@graph"].as_array().expect("a graph");
        let entity = |id: &str| graph.iter().find(|entity| entity["@id"] == id).unwrap_or_else(|| panic!("no {id}"));
        for part in entity("./")["hasPart"].as_array().expect("parts") {
            let id = part["@id"].as_str().expect("an id");
            assert_eq!(entity(id)["@type"], "File");
            assert!(id.starts_with("ni:///sha-256;") || here.join(folder).join(id).is_file(), "{id}");
        }
        let action = entity("#run");
        assert_eq!(action["result"][0]["@id"], "a.h5");
        assert_eq!(action["object"].as_array().map(Vec::len), Some(4), "the config and three records");
        assert_eq!(entity(action["instrument"]["@id"].as_str().expect("an id"))["@type"], "SoftwareApplication");
        assert_eq!(action["agent"].is_object(), folder == "full");
        report(&here.join(folder));
    }
    fs::write(here.join("notes.txt"), "mine").expect("a file");
    let output = run(here, &["export-crate", "a.h5", "-o", "."]);
    assert_eq!(code(&output), 2, "a folder that holds other things: {}", stderr(&output));
    fs::remove_file(here.join("data/record_2.h5")).expect("a record");
    let gone = run(here, &["export-crate", "a.h5", "-o", "gone", "--with-data"]);
    assert_eq!(code(&gone), 1);
    assert!(stderr(&gone).contains("1 of 3 inputs are not there") && !here.join("gone").exists(), "{}", stderr(&gone));
    assert!(export(&["-o", "gone"]).contains("1 of them not there any more"));
    report(&here.join("gone"));
}

/// `runcrate report` reads the crate and finds the run in it.
fn report(folder: &Path) {
    let runcrate = python_bin().join("runcrate");
    let output = std::process::Command::new(runcrate).arg("report").arg(folder).output().expect("runcrate starts");
    let (text, said) = (stdout(&output), stderr(&output));
    assert!(output.status.success(), "{text}\n{said}");
    assert!(text.contains("action: #run") && text.contains("instrument: #afmid-"), "{text}");
}
