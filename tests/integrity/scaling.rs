//! Work grows in proportion to the number of items.
//!
//! Eight times as many items take less than 8^1.5 times as long: work in proportion takes 8 times, that of pairs 64
//! times. A busy machine gets three tries.

use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::time::Instant;

use super::common::command;

const FEW: usize = 1000;
const MANY: usize = 8 * FEW;

/// Seconds of one command, whatever its exit code.
fn seconds(folder: &Path, arguments: &[&str]) -> f64 {
    let clock = Instant::now();
    let mut command = command(folder, arguments);
    let status = command.stdout(Stdio::null()).stderr(Stdio::null()).status().expect("afmid starts");
    assert!(status.code().is_some_and(|code| code != 101), "afmid {arguments:?}: {status}");
    clock.elapsed().as_secs_f64()
}

/// Makes items with `make` in two folders and measures `arguments` in both.
fn in_proportion(what: &str, arguments: &[&str], make: impl Fn(&Path, usize)) {
    let folders = [FEW, MANY].map(|count| {
        let folder = tempfile::tempdir().expect("a folder");
        make(folder.path(), count);
        folder
    });
    let most = 8_f64.powf(1.5);
    let ratio = (0..3)
        .map(|_| {
            // the shortest of two: what else runs only adds
            let [few, many] = [0, 1].map(|index: usize| {
                let once = || seconds(folders[index].path(), arguments);
                once().min(once())
            });
            many / few
        })
        .find(|ratio| *ratio < most);
    assert!(ratio.is_some(), "{what}: {MANY} items take more than {most:.0} times as long as {FEW}");
}

fn config(stages: &str) -> String {
    format!("[pipeline]\nname = \"a\"\nseed = 1\n{stages}")
}

const RAW: &str =
    "format = \"raw\", raw = { sample = \"int16\" }, channel = \"/channel[0]\", sample_rate_hz = 1e6, unit = \"V\"";

fn records(folder: &Path, count: usize) {
    fs::create_dir(folder.join("raw")).expect("a folder");
    for number in 0..count {
        fs::write(folder.join(format!("raw/r{number}.bin")), [number as u8, 1, 2, 3, 4, 5, 6, 7]).expect("a record");
    }
    let stage =
        format!("[[stage]]\nid = \"records\"\nuses = \"io.records\"\nparams = {{ files = [\"raw/*.bin\"], {RAW} }}\n");
    fs::write(folder.join("a.toml"), config(&stage)).expect("a config");
}

#[test]
fn records_of_a_pattern() {
    in_proportion("explain", &["explain", "a.toml", "--cache", "cache"], records);
    in_proportion("run", &["run", "a.toml", "-o", "a.h5", "--cache", "cache"], records);
}

#[test]
fn stages_of_a_config_right_and_wrong() {
    let write = |folder: &Path, stages: String| fs::write(folder.join("a.toml"), config(&stages)).expect("a config");
    let check = ["check", "a.toml"];
    in_proportion("right stages", &check, |folder, count| {
        let stage = |n| {
            format!(
                "[[stage]]\nid = \"c{n}\"\nuses = \"io.census\"\ninputs = {{ records = \"r{n}.records\" }}\n[[stage]]\n\
                 id = \"r{n}\"\nuses = \"io.records\"\nparams = {{ files = [\"x\"] }}\n"
            )
        };
        write(folder, (0..count / 2).map(stage).collect());
    });
    in_proportion("unknown stages", &check, |folder, count| {
        write(folder, (0..count).map(|n| format!("[[stage]]\nid = \"s{n}\"\nuses = \"io.recods\"\n")).collect());
    });
    in_proportion("unknown and missing wires", &check, |folder, count| {
        let stage = |n| {
            let wire = if n % 2 == 0 { format!("inputs = {{ records = \"nothing{n}\" }}\n") } else { String::new() };
            format!("[[stage]]\nid = \"s{n}\"\nuses = \"io.census\"\n{wire}")
        };
        write(folder, (0..count).map(stage).collect());
    });
    in_proportion("ids used twice", &check, |folder, count| {
        let stage =
            |n| format!("[[stage]]\nid = \"s{}\"\nuses = \"io.records\"\nparams = {{ files = [\"x\"] }}\n", n / 2);
        write(folder, (0..count).map(stage).collect());
    });
    in_proportion("circles", &check, |folder, count| {
        let stage = |n: usize| {
            format!("[[stage]]\nid = \"s{n}\"\nuses = \"spectrum.smoothing\"\ninputs = {{ etfe = \"s{}\" }}\n", n ^ 1)
        };
        write(folder, (0..count).map(stage).collect());
    });
}

/// A cache of results that differ in one parameter from what would run, by their origins alone.
fn cache(folder: &Path, count: usize) {
    fs::create_dir(folder.join("cache")).expect("a folder");
    let stages: String = (0..count)
        .map(|n| format!("[[stage]]\nid = \"c{n}\"\nuses = \"io.census\"\ninputs = {{ records = \"r.records\" }}\n"))
        .collect();
    fs::write(folder.join("r.bin"), [0; 64]).expect("a record");
    let source = format!("[[stage]]\nid = \"r\"\nuses = \"io.records\"\nparams = {{ files = [\"r.bin\"], {RAW} }}\n");
    fs::write(folder.join("a.toml"), config(&(source + &stages))).expect("a config");
    for n in 0..count {
        let key = blake3::hash(&n.to_le_bytes()).to_hex();
        let origin = serde_json::json!({
            "key": key.as_str(), "format": 1, "uses": "io.census", "version": 1, "params": {}, "location_params": [], "depends_on": [],
            "arithmetic": "", "seed": null, "files": [], "inputs": [], "pipeline": "b", "id": format!("c{n}"), "program": ""
        });
        fs::write(folder.join(format!("cache/{key}.json")), origin.to_string()).expect("an origin");
        fs::write(folder.join(format!("cache/{key}.h5")), "x").expect("a result");
    }
}

#[test]
fn results_in_a_cache() {
    in_proportion("explain beside other results", &["explain", "a.toml", "--cache", "cache"], cache);
    in_proportion("gc", &["gc", "--dry-run", "--older-than", "1d", "--cache", "cache"], cache);
}

#[test]
fn entries_of_a_ledger() {
    in_proportion(
        "collect",
        &["batch", "a.toml", "--manifest", "sets.jsonl", "-o", "out", "--collect", "--cache", "cache"],
        |folder, count| {
            records(folder, count);
            fs::create_dir_all(folder.join("out/ledger")).expect("a folder");
            let sets: String =
                (0..count).map(|n| format!("{{\"name\": \"s{n}\", \"files\": [\"raw/r{n}.bin\"]}}\n")).collect();
            fs::write(folder.join("sets.jsonl"), sets).expect("a manifest");
            for n in 0..count {
                let entry = serde_json::json!({
                    "version": 1, "name": format!("s{n}"), "key": "k", "result_bytes": null, "error": "no", "found": { "started_at": null,
                    "verdict": null, "causes": null, "fit_identification_percent": null, "fit_held_out_percent": null, "stiffness_n_per_m": null,
                    "stiffness_std_n_per_m": null, "modes": [] }
                });
                fs::write(folder.join(format!("out/ledger/s{n}.json")), entry.to_string()).expect("an entry");
            }
        },
    );
}
