//! Batches: one bad data set stops no other, nothing is done twice, a kill loses nothing, shards add up.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

use crate::common;
use crate::common::sets::Here;
use afmid_pipeline::store::compare;

fn results_in(folder: &Path) -> usize {
    let entries = std::fs::read_dir(folder).expect("the cache");
    entries.filter(|entry| entry.as_ref().is_ok_and(|e| e.path().extension().is_some_and(|x| x == "h5"))).count()
}

#[test]
fn one_bad_set_stops_no_other_and_nothing_is_done_twice() {
    let here = Here::new();
    for (seed, name) in ["a", "b", "c"].into_iter().enumerate() {
        here.set(name, seed, 5000);
    }
    let bad = here.path("c/record_1.h5");
    let whole = std::fs::read(&bad).expect("a record");
    std::fs::write(&bad, &whole[..whole.len() / 2]).expect("a record cut short");
    let sets = ["census.toml", "c", "a", "b", "-o", "out", "--cache", "cache"];
    let (code, output) = here.batch_json(&sets);
    assert_eq!((code, &output["data_sets"], &output["ran"], &output["failed"]), (3, &3.into(), &3.into(), &1.into()));
    assert_eq!(output["failures"][0]["name"], "c");
    assert!(output["failures"][0]["error"].as_str().is_some_and(|error| error.contains("record_1.h5")), "{output}");
    assert!(here.path("out/a.h5").exists() && here.path("out/b.h5").exists() && !here.path("out/c.h5").exists());
    let table = std::fs::read_to_string(here.path("out/summary.csv")).expect("a table");
    let rows: Vec<&str> = table.lines().skip(1).collect();
    assert!(rows[0].starts_with("a,2001-03-01T10:00:00Z,done,0,"), "{table}");
    assert!(rows[2].starts_with("c,,failed,"), "{table}");

    let before = here.bytes("out");
    let (code, output) = here.batch_json(&sets);
    assert_eq!(
        (code, &output["ran"], &output["failed"]),
        (3, &0.into(), &1.into()),
        "what failed is reported, not run again"
    );
    assert_eq!(here.bytes("out"), before, "the second batch changed a file");
    let (code, output) = here.batch_json(&[&sets[..], &["--retry-failed"]].concat());
    assert_eq!((code, &output["ran"], &output["failed"]), (3, &1.into(), &1.into()));

    std::fs::write(&bad, &whole).expect("a whole record");
    let (code, output) = here.batch_json(&sets);
    assert_eq!((code, &output["ran"], &output["failed"]), (0, &1.into(), &0.into()), "it has changed: it is run again");
    std::fs::remove_file(here.path("out/a.h5")).expect("a result");
    let (_, output) = here.batch_json(&sets);
    assert_eq!(output["ran"], 1, "a result that is gone is made again");
}

#[test]
fn where_a_set_fails_it_is_said_what_is_kept_of_it() {
    let here = Here::new();
    here.set("a", 0, 3000);
    let config = std::fs::read_to_string(here.path("census.toml")).expect("a config");
    let events = "[[stage]]\nid = \"events\"\nuses = \"events.correlation\"\ninputs = { records = \"records\" }\n\
                  params = { kind = \"snap-off\", window_samples = 1024 }\n";
    std::fs::write(here.path("events.toml"), config + "\n" + events).expect("a config");
    let (code, output) = here.batch_json(&["events.toml", "a", "-o", "out", "--cache", "cache"]);
    let error = output["failures"][0]["error"].as_str().unwrap_or_default();
    let kept = "the stages that went through are in a.failed.h5, beside the results";
    assert!(code == 3 && error.contains("no usable event") && error.ends_with(kept), "{output}");
    let shown = common::afmid(here.path("out").as_path(), &["show", "a.failed.h5"]);
    assert!(shown.contains("census") && shown.contains("incomplete"), "{shown}");
    for table in ["out/summary.csv", "out/ledger/a.json"] {
        assert!(std::fs::read_to_string(here.path(table)).expect(table).contains(kept), "{table}");
    }
}

#[test]
fn a_changed_parameter_of_the_last_stage_costs_that_stage_alone() {
    let here = Here::new();
    for seed in 0..4 {
        here.set(&format!("set{seed}"), seed, 3000);
    }
    let sets = ["census.toml", "set0", "set1", "set2", "set3", "-o", "out", "--cache", "cache"];
    here.batch_json(&sets);
    let one = results_in(&here.path("cache"));
    let (code, output) = here.batch_json(&[&sets[..], &["--set", "census.min_bandwidth_share=0.05"]].concat());
    assert_eq!((code, &output["ran"]), (0, &4.into()));
    // one stage per set is kept in the cache
    assert_eq!((one, results_in(&here.path("cache"))), (4, 8));
}

#[test]
fn shards_add_up_to_the_same_table_byte_for_byte() {
    let here = Here::new();
    let names: Vec<String> = (0..9).map(|seed| format!("set{seed}")).collect();
    names.iter().enumerate().for_each(|(seed, name)| here.set(name, seed, 2000));
    let lines = names.iter().map(|name| format!("{{\"name\": \"{name}\", \"files\": [\"{name}/*.h5\"]}}\n"));
    std::fs::write(here.path("m.jsonl"), lines.collect::<String>()).expect("a manifest");
    let whole = ["census.toml", "--manifest", "m.jsonl", "-o", "whole", "--cache", "cache"];
    assert_eq!(here.batch_json(&whole).0, 0);
    let parts = ["census.toml", "--manifest", "m.jsonl", "-o", "parts", "--cache", "other", "-j", "1"];
    let (code, output) = here.batch_json(&[&parts[..], &["--collect"]].concat());
    assert_eq!((code, &output["failed"]), (3, &9.into()), "nothing has been run yet");
    let mut ran = 0;
    // a shard twice: two machines may do the same one
    for shard in ["3/3", "1/3", "2/3", "1/3"] {
        let (code, output) = here.batch_json(&[&parts[..], &["--shard", shard]].concat());
        assert_eq!(code, 0);
        ran += output["ran"].as_u64().expect("a number");
    }
    assert_eq!(ran, 9);
    assert_eq!(here.batch_json(&[&parts[..], &["--collect"]].concat()).0, 0);
    for file in ["summary.csv", "summary.parquet", "summary.h5", "trends.csv"] {
        let [one, other] = ["whole", "parts"].map(|folder| std::fs::read(here.path(folder).join(file)).expect(file));
        assert!(one == other, "{file} differs");
        assert!(!one.is_empty(), "{file} is empty");
    }
    let mut shown = Command::new(env!("CARGO_BIN_EXE_afmid"));
    let shown = shown.current_dir(here.folder()).args(["show", "parts/summary.h5", "summary"]).output();
    let shown = shown.expect("afmid starts");
    assert!(shown.status.success() && String::from_utf8_lossy(&shown.stdout).contains("set8"), "{shown:?}");
    // what has changed since its run is not passed off as its result
    here.set("set4", 77, 2000);
    let (code, output) = here.batch_json(&[&parts[..], &["--collect"]].concat());
    assert_eq!((code, &output["failed"], &output["failures"][0]["name"]), (3, &1.into(), &"set4".into()));
    assert!(output["failures"][0]["error"].as_str().expect("a reason").contains("have changed"), "{output}");
    assert_eq!(here.batch_json(&parts).0, 0);
    std::fs::remove_file(here.path("parts/set2.h5")).expect("a result");
    let (code, output) = here.batch_json(&[&parts[..], &["--collect"]].concat());
    assert_eq!((code, &output["failures"][0]["name"]), (3, &"set2".into()), "{output}");
}

#[test]
fn what_is_wrong_is_reported_before_anything_runs() {
    let here = Here::new();
    here.set("a", 0, 2000);
    std::fs::create_dir_all(here.path("deep")).expect("a folder");
    here.set("deep/a", 1, 2000);
    std::fs::write(here.path("m.jsonl"), "{\"name\": \"x\", \"fils\": []}\n[]\n").expect("a manifest");
    for (arguments, words) in [
        (&["census.toml"][..], &["no data sets"][..]),
        (&["census.toml", "a", "deep/a"], &["two data sets", "`a`"]),
        (&["census.toml", "nowhere", "census.toml"], &["nowhere is not there", "census.toml is a config"]),
        (&["census.toml", "--manifest", "m.jsonl"], &["m.jsonl:1", "did you mean `files`", "m.jsonl:2"]),
        (&["census.toml", "a", "--shard", "4/3"], &["4/3"]),
        (&["census.toml", "a", "--set", "census.nonsense=1"], &["nonsense"]),
        (&["missing.toml", "a"], &["missing.toml"]),
    ] {
        let output = here.batch(&[arguments, &["-o", "out", "--cache", "cache"]].concat());
        let errors = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {errors}");
        assert!(output.stdout.is_empty(), "{arguments:?}");
        for word in words {
            assert!(errors.contains(word), "{word:?} in {errors}");
        }
        assert!(!here.path("out/a.h5").exists());
    }
}

#[test]
fn the_same_shard_twice_at_once_leaves_whole_results_and_a_whole_ledger() {
    let here = Here::new();
    let names: Vec<String> = (0..10).map(|seed| format!("set{seed}")).collect();
    names.iter().enumerate().for_each(|(seed, name)| here.set(name, seed, 20_000));
    std::fs::write(here.path("set3/record_0.h5"), "no record").expect("a file");
    let arguments = |out: &'static str, cache: &'static str| -> Vec<&str> {
        let sets = names.iter().map(String::as_str);
        ["census.toml"].into_iter().chain(sets).chain(["-o", out, "--cache", cache, "-j", "2"]).collect()
    };
    assert_eq!(here.batch_json(&arguments("whole", "whole-cache")).0, 3);
    // with one cache for both, and with one each, as on two nodes
    for caches in [["cache", "cache"], ["cache-1", "cache-2"]] {
        for folder in ["out", "cache"] {
            let _ = std::fs::remove_dir_all(here.path(folder));
        }
        let both = caches.map(|cache| {
            let mut command = here.command(&[&arguments("out", cache)[..], &["--shard", "1/1"]].concat());
            command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("afmid starts")
        });
        for mut one in both {
            assert_eq!(one.wait().expect("it ends").code(), Some(3));
        }
        let left = here.bytes("out").into_keys().filter(|path| path.extension().is_some_and(|end| end == "tmp"));
        assert_eq!(left.count(), 0, "temporary files are left");
        let (code, output) = here.batch_json(&arguments("out", caches[0]));
        assert_eq!(
            (code, &output["ran"], &output["failed"]),
            (3, &0.into(), &1.into()),
            "{caches:?}: the ledger does not fit"
        );
        for name in names.iter().filter(|name| *name != "set3") {
            let [one, other] = ["whole", "out"].map(|folder| here.path(folder).join(format!("{name}.h5")));
            assert_eq!(compare(&one, &other).expect("two results"), [], "{caches:?}, {name}");
        }
        for table in ["summary.csv", "summary.parquet", "summary.h5", "trends.csv"] {
            let [one, other] =
                ["whole", "out"].map(|folder| std::fs::read(here.path(folder).join(table)).expect(table));
            assert!(one == other, "{caches:?}: {table} differs");
        }
    }
}

/// Kills: a few here, `AFMID_KILLS=20` of them for the whole demonstration.
#[test]
fn a_killed_batch_goes_on_where_it_stopped() {
    let kills: u32 = std::env::var("AFMID_KILLS").ok().and_then(|n| n.parse().ok()).unwrap_or(4);
    let here = Here::new();
    let names: Vec<String> = (0..12).map(|seed| format!("set{seed:02}")).collect();
    names.iter().enumerate().for_each(|(seed, name)| here.set(name, seed, 60_000));
    let arguments = |out: &'static str, cache: &'static str| -> Vec<&str> {
        let sets = names.iter().map(String::as_str);
        ["census.toml"].into_iter().chain(sets).chain(["-o", out, "--cache", cache, "-j", "2"]).collect()
    };
    let clock = Instant::now();
    assert_eq!(here.batch_json(&arguments("whole", "whole-cache")).0, 0);
    let whole = clock.elapsed();
    let (mut random, mut interrupted) = (0x2545_f491_4f6c_dd1d_u64, 0);
    for round in 0..kills {
        for folder in ["out", "cache"] {
            let _ = std::fs::remove_dir_all(here.path(folder));
        }
        let mut child = here.command(&arguments("out", "cache"));
        let mut child = child.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("afmid starts");
        // xorshift: moments within an undisturbed batch
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        std::thread::sleep(whole.mul_f64((random >> 11) as f64 / (1u64 << 53) as f64).max(Duration::from_millis(2)));
        let _ = child.kill();
        child.wait().expect("it is gone");
        let ended = |name: &String| here.path("out/ledger").join(format!("{name}.json")).exists();
        let finished = names.iter().filter(|name| ended(name)).count();
        interrupted += usize::from(finished < names.len());
        let (code, output) = here.batch_json(&arguments("out", "cache"));
        assert_eq!((code, &output["ran"]), (0, &(names.len() - finished).into()), "round {round}");
        for name in &names {
            let [one, other] = ["whole", "out"].map(|folder| here.path(folder).join(format!("{name}.h5")));
            assert_eq!(compare(&one, &other).expect("two results"), [], "round {round}, {name}");
        }
        for table in ["summary.csv", "summary.parquet", "summary.h5"] {
            let [one, other] =
                ["whole", "out"].map(|folder| std::fs::read(here.path(folder).join(table)).expect(table));
            assert!(one == other, "round {round}: {table} differs");
        }
    }
    assert!(interrupted > 0, "no kill came before the end: the test showed nothing");
}
