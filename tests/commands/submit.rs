//! `afmid submit slurm`: what it writes is what bash and sbatch read, whatever the names; the jobs together give the
//! table of one machine.
//!
//! Here sbatch is a script that writes down what it was given; tests/cluster/slurm.sh does the same on a real Slurm.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::PermissionsExt;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use crate::common::sets::Here;
use serde_json::Value;

/// An sbatch that keeps its arguments and its folder, and counts jobs from 41.
const SBATCH: &str = r#"#!/bin/bash
printf '%s\n' "$PWD" "$@" '' >>"$(dirname "$0")/calls"
n=$(cat "$(dirname "$0")/count" 2>/dev/null || echo 41)
echo $((n + 1)) >"$(dirname "$0")/count"
echo "lua: welcome" >&2
echo "$n;big"
"#;

fn executable(path: &Path, text: &str) {
    fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    fs::write(path, text).expect("a script");
    fs::set_permissions(path, fs::Permissions::from_mode(0o755)).expect("a script");
}

/// A command that finds this sbatch, or none.
fn with_path(mut command: Command, bin: Option<&Path>) -> Output {
    let path = bin.map_or("/nowhere".to_owned(), |bin| format!("{}:/usr/bin:/bin", bin.display()));
    command.env("PATH", path).output().expect("it starts")
}

fn submit(folder: &Path, bin: Option<&Path>, arguments: &[&OsStr]) -> Output {
    let mut command = Command::new(env!("CARGO_BIN_EXE_afmid"));
    command.current_dir(folder).args(["submit", "slurm"]).args(arguments);
    with_path(command, bin)
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn words<'a>(words: &'a [&'a str]) -> Vec<&'a OsStr> {
    words.iter().map(OsStr::new).collect()
}

/// Runs a job's script as Slurm would: from its text, not its place.
fn job(script: &Path, task: Option<u64>) -> Output {
    let mut command = Command::new("bash");
    command.arg("-c").arg(OsStr::from_bytes(&fs::read(script).expect("a script"))).current_dir("/");
    let task = task.map(|task| task.to_string()).unwrap_or_default();
    command.envs([("SLURM_ARRAY_JOB_ID", "41"), ("SLURM_ARRAY_TASK_ID", &task), ("SLURM_JOB_ID", "42")]);
    command.output().expect("bash starts")
}

/// Nine data sets, the third of them bad, and their manifest.
fn nine(here: &Here) {
    let names: Vec<String> = (0..9).map(|seed| format!("set{seed}")).collect();
    names.iter().enumerate().for_each(|(seed, name)| here.set(name, seed, 2000));
    fs::write(here.path("set2/record_0.h5"), "no record").expect("a file");
    let line = |name: &String| {
        let set = if name == "set5" { ", \"set\": {\"census.min_bandwidth_share\": 0.05}" } else { "" };
        format!("{{\"name\": \"{name}\", \"files\": [\"{name}/*.h5\"]{set}}}\n")
    };
    fs::write(here.path("m.jsonl"), names.iter().map(line).collect::<String>()).expect("a manifest");
}

#[test]
fn jobs_in_hostile_folders_give_the_table_of_one_machine() {
    let here = Here::new();
    nine(&here);
    let whole = here.batch(&[
        "census.toml",
        "--manifest",
        "m.jsonl",
        "-o",
        "whole",
        "--cache",
        "cache",
        "--set",
        "census.sentinels=[-7.0, 3.0]",
    ]);
    assert_eq!(whole.status.code(), Some(3), "{}", text(&whole.stderr));
    let bin = here.path("bin");
    executable(&bin.join("sbatch"), SBATCH);
    let hostile: [&[u8]; 4] = [
        b"plain",
        b"two words, it's \"quoted\" #1 %j 100%",
        b"$(touch BAD) `touch BAD` $HOME ~ * ? [a] {b,c} ! & ; | < > ( ) =",
        b"-back\\slash\ttab\nand line",
    ];
    for (round, name) in hostile.iter().enumerate() {
        let name = OsStr::from_bytes(name);
        let folder: PathBuf = here.path(&format!("round{round}")).join(name);
        fs::create_dir_all(&folder).expect("a folder");
        fs::copy(here.path("census.toml"), folder.join(name)).expect("a config");
        let (config, out, cache) = (folder.join(name), folder.join("out"), folder.join("cache"));
        let mut arguments = vec![config.as_os_str()];
        arguments.extend(words(&[
            "--manifest",
            "m.jsonl",
            "--shards",
            "4",
            "--set",
            "census.sentinels=[-7.0, 3.0]",
            "--json",
            "-o",
        ]));
        arguments.extend([out.as_os_str(), OsStr::new("--cache"), cache.as_os_str()]);
        let output = submit(here.folder(), None, &arguments);
        assert!(output.status.success(), "{name:?}: {}", text(&output.stderr));
        let printed: Value = serde_json::from_slice(&output.stdout).expect("JSON alone");
        assert_eq!(
            (&printed["data_sets"], &printed["shards"], &printed["array"]),
            (&9.into(), &4.into(), &Value::Null)
        );

        let scripts = out.join("slurm");
        for script in ["array.sbatch", "collect.sbatch", "submit.sh"] {
            let check = Command::new("bash").arg("-n").arg(scripts.join(script)).output().expect("bash starts");
            assert!(check.status.success() && check.stderr.is_empty(), "{name:?}, {script}: {}", text(&check.stderr));
        }
        let mut sent = Command::new("bash");
        sent.arg(scripts.join("submit.sh")).current_dir("/");
        let sent = with_path(sent, Some(&bin));
        assert!(sent.status.success(), "{name:?}: {}", text(&sent.stderr));

        let array = fs::read_to_string(scripts.join("array.sbatch")).expect("text");
        let tasks = array.lines().find_map(|line| line.strip_prefix("#SBATCH --array=")).expect("an array");
        for task in tasks.split(',').flat_map(|part| {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            first.parse::<u64>().expect("a number")..=last.parse().expect("a number")
        }) {
            let output = job(&scripts.join("array.sbatch"), Some(task));
            assert!(output.status.success(), "{name:?}, task {task}: {}{}", text(&output.stdout), text(&output.stderr));
        }
        let output = job(&scripts.join("collect.sbatch"), None);
        assert_eq!(output.status.code(), Some(3), "{name:?}: a data set is bad, and the collecting job tells");
        for table in ["summary.csv", "summary.parquet", "summary.h5", "trends.csv"] {
            let [one, other] =
                [here.path("whole"), out.clone()].map(|folder| fs::read(folder.join(table)).expect(table));
            assert!(one == other, "{name:?}: {table} differs");
        }
        assert!(cache.is_dir(), "{name:?}: the cache lies elsewhere");
        assert!(!here.path("BAD").exists() && !Path::new("/BAD").exists());
    }
    let calls = fs::read(bin.join("calls")).expect("calls");
    assert!(text(&calls).contains("--parsable\n--dependency=afterany:47\ncollect.sbatch\n"), "{}", text(&calls));
}

#[test]
fn jobs_are_sent_and_their_numbers_printed() {
    let here = Here::new();
    nine(&here);
    let bin = here.path("bin");
    executable(&bin.join("sbatch"), SBATCH);
    let arguments = [
        "census.toml",
        "--manifest",
        "m.jsonl",
        "--shards",
        "3",
        "-o",
        "out",
        "--partition",
        "main,long",
        "--time",
        "1-02:00:00",
        "--memory",
        "4G",
        "--cpus",
        "2",
        "--account",
        "lab",
        "--sbatch",
        "--nice=100",
        "--sbatch=--comment=it's a # \\ b",
        "--retry-failed",
        "--send",
    ];
    let output = submit(here.folder(), Some(&bin), &words(&[&arguments[..], &["--json"]].concat()));
    assert!(output.status.success(), "{}", text(&output.stderr));
    assert!(text(&output.stderr).contains("lua: welcome"), "what sbatch says is passed on");
    let printed: Value = serde_json::from_slice(&output.stdout).expect("JSON alone");
    assert_eq!((&printed["array"], &printed["collect"]), (&"41".into(), &"42".into()));
    let calls = fs::read_to_string(bin.join("calls")).expect("calls");
    let folder = here.path("out/slurm").canonicalize().expect("a folder");
    let folder = folder.display();
    assert_eq!(
        calls,
        format!(
            "{folder}\n--parsable\narray.sbatch\n\n{folder}\n--parsable\n--dependency=afterany:41\ncollect.sbatch\n\n"
        )
    );
    for (script, cpus) in [("array.sbatch", 2), ("collect.sbatch", 1)] {
        let text = fs::read_to_string(here.path("out/slurm").join(script)).expect("a script");
        let cpus = format!("--cpus-per-task={cpus}");
        for option in [
            "--partition=main,long",
            "--time=1-02:00:00",
            "--mem=4G",
            "--account=lab",
            "--nice=100",
            "--requeue",
            &cpus,
        ] {
            assert!(text.contains(&format!("#SBATCH {option}\n")), "{option} in {text}");
        }
        assert!(text.contains("#SBATCH '--comment=it'\\''s a # \\\\ b'\n"), "{text}");
        assert_eq!(text.contains("--retry-failed"), script == "array.sbatch");
    }
    let output = submit(here.folder(), Some(&bin), &words(&arguments));
    assert!(text(&output.stdout).contains("array 43, after it 44"), "{}", text(&output.stdout));
}

#[test]
fn the_refusal_of_a_cluster_is_reported_as_it_is() {
    let here = Here::new();
    here.set("a", 0, 2000);
    let arguments = words(&["census.toml", "a", "--shards", "2", "-o", "out", "--send", "--json"]);
    let output = submit(here.folder(), None, &arguments);
    let message = text(&output.stderr);
    assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0), "{message}");
    assert!(message.contains("sbatch is not on the PATH") && message.contains("out/slurm/submit.sh"), "{message}");
    assert!(here.path("out/slurm/submit.sh").exists(), "the jobs are written all the same");

    let refusals = [
        ("echo 'sbatch: error: invalid partition' >&2; exit 1", vec!["refused array.sbatch", "invalid partition"]),
        ("echo Submitted batch job 12", vec!["no job number", "squeue"]),
        (
            "case \"$*\" in *after*) echo no >&2; exit 1;; esac; echo 7",
            vec!["refused collect.sbatch", "job 7", "scancel 7"],
        ),
    ];
    for (number, (script, words)) in refusals.into_iter().enumerate() {
        let bin = here.path(&format!("bin{number}"));
        executable(&bin.join("sbatch"), &format!("#!/bin/bash\n{script}\n"));
        let output = submit(here.folder(), Some(&bin), &arguments);
        let message = text(&output.stderr);
        assert_eq!((output.status.code(), output.stdout.len()), (Some(1), 0), "{message}");
        for word in words {
            assert!(message.contains(word), "{word:?} in {message}");
        }
    }
}

#[test]
fn what_is_wrong_is_reported_before_anything_is_written() {
    let here = Here::new();
    here.set("a", 0, 2000);
    fs::write(here.path("file"), "x").expect("a file");
    let no_text = [
        OsStr::new("census.toml"),
        OsStr::new("a"),
        OsStr::new("--shards=1"),
        OsStr::new("-o"),
        OsStr::from_bytes(b"x\xff"),
    ];
    let output = submit(here.folder(), None, &no_text);
    assert!(
        output.status.code() == Some(2) && text(&output.stderr).contains("is not UTF-8"),
        "{}",
        text(&output.stderr)
    );
    for (arguments, words) in [
        (&["census.toml", "-o", "out", "--shards", "2"][..], &["no data sets"][..]),
        (&["census.toml", "a", "-o", "out"], &["--shards"]),
        (&["census.toml", "a", "-o", "out", "--shards", "0"], &["--shards"]),
        (&["census.toml", "a", "--shards", "2"], &["--output"]),
        (&["census.toml", "a", "-o", "out", "--shards", "2", "--set", "census.nonsense=1"], &["nonsense"]),
        (&["missing.toml", "a", "-o", "out", "--shards", "2"], &["missing.toml"]),
        (&["census.toml", "a", "-o", "file", "--shards", "2"], &["file"]),
        (&["census.toml", "a", "-o", "out", "--shards", "2", "--time", "1 h"], &["--time", "wanted letters"]),
        (&["census.toml", "a", "-o", "out", "--shards", "2", "--sbatch=--array=1"], &["--array", "set by afmid"]),
    ] {
        let output = submit(here.folder(), None, &self::words(arguments));
        let message = text(&output.stderr);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(output.stdout.is_empty() && !here.path("out").exists(), "{arguments:?}");
        for word in words {
            assert!(message.contains(word), "{word:?} in {message}");
        }
    }
}

#[test]
fn a_config_that_has_changed_since_stops_the_jobs() {
    let here = Here::new();
    here.set("a", 0, 2000);
    assert!(submit(here.folder(), None, &words(&["census.toml", "a", "--shards", "1", "-o", "out"])).status.success());
    let config = fs::read_to_string(here.path("census.toml")).expect("a config");
    fs::write(here.path("census.toml"), config + "params = { min_bandwidth_share = 0.05 }\n").expect("a config");
    for (script, task) in [("array.sbatch", Some(1)), ("collect.sbatch", None)] {
        let output = job(&here.path("out/slurm").join(script), task);
        assert_eq!(output.status.code(), Some(2), "{script}");
        assert!(text(&output.stderr).contains("has changed since it was submitted"), "{}", text(&output.stderr));
    }
    assert!(!here.path("out/a.h5").exists());
}

#[test]
fn the_examples_of_the_help_work() {
    let here = Here::new();
    for (seed, name) in ["lever-1", "lever-2"].into_iter().enumerate() {
        here.set(name, seed, 2000);
    }
    fs::rename(here.path("census.toml"), here.path("ringdown.toml")).expect("a config");
    fs::write(here.path("levers.jsonl"), "{\"name\": \"lever-1\", \"files\": [\"lever-1\"]}\n").expect("a manifest");
    let bin = here.path("bin");
    executable(&bin.join("sbatch"), SBATCH);
    let help = text(&submit(here.folder(), None, &words(&["--help"])).stdout);
    let examples: Vec<&str> = help.lines().filter_map(|line| line.strip_prefix("  afmid submit slurm ")).collect();
    assert_eq!(examples.len(), 3, "{help}");
    for example in examples {
        let output = submit(here.folder(), Some(&bin), &example.split_whitespace().map(OsStr::new).collect::<Vec<_>>());
        assert!(output.status.success(), "{example}: {}", text(&output.stderr));
    }
}
