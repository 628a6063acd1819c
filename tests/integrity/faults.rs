//! Full disks, read-only folders, clocks that go backwards, two runs and `gc` on one cache.

use std::fs::File;
use std::path::PathBuf;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, SystemTime};

use super::common::{config, files, sets, simulated};
use super::leftovers::{Place, below, count};

/// The file system that a test wants, made by the ways that a machine may allow.
pub struct Mounts {
    /// What goes before `sh -c`.
    private: Option<&'static [&'static str]>,
}

impl Mounts {
    /// Tries a namespace of mounts of its own: as any user, then as root.
    pub fn new() -> Self {
        let ways: [&'static [&'static str]; 2] = [&["unshare", "--map-root-user", "--mount"], &["unshare", "--mount"]];
        let works = |way: &&&'static [&'static str]| {
            let mut command = Command::new(way[0]);
            command.args(&way[1..]).args(["sh", "-c", "mount -t tmpfs -o size=64k none /mnt"]);
            command.stderr(Stdio::null()).status().is_ok_and(|status| status.success())
        };
        Self { private: ways.iter().find(works).copied() }
    }

    /// Runs afmid with `mount` (a shell command) done before it, where that is possible: none if it is not.
    fn run(&self, place: &Place, mount: &str, arguments: &[&str]) -> Option<Output> {
        let script = format!(
            "{mount} || exit 99; \"$0\" \"$@\"; code=$?; echo left: $(ls -A cache disk 2>/dev/null) >&2; exit $code"
        );
        self.shell(place, &script, arguments)
    }

    /// Runs a script, whose `$0` is afmid, where something can be mounted; it exits with 99 where a mount fails.
    pub fn script(&self, place: &Place, script: &str) -> Option<Output> {
        self.shell(place, script, &[])
    }

    fn shell(&self, place: &Place, script: &str, arguments: &[&str]) -> Option<Output> {
        let way = self.private?;
        let mut command = Command::new(way[0]);
        command.current_dir(place.folder()).env("TMPDIR", place.path("tmp")).env("AFMID_CACHE", place.path("cache"));
        command.args(&way[1..]).args(["sh", "-c", script, env!("CARGO_BIN_EXE_afmid")]).args(arguments);
        let output = command.output().expect("unshare starts");
        assert_ne!(output.status.code(), Some(99), "{}", stderr(&output));
        Some(output)
    }
}

/// What a program said on stderr.
pub fn stderr(output: &Output) -> String {
    String::from_utf8_lossy(&output.stderr).into_owned()
}

/// A place with a data set and a config that counts its samples.
fn census() -> Place {
    let place = Place::new();
    std::fs::write(place.path("census.toml"), sets::CENSUS).expect("a config");
    sets::write_set(&place.path("set"), 3, 3000);
    place
}

const RUN: [&str; 6] = ["run", "census.toml", "--set", "records.files=['set']", "-o", "out.h5"];

#[track_caller]
fn assert_warned_once(output: &Output, said: &str) {
    let message = stderr(output);
    assert_eq!(output.status.code(), Some(0), "{message}");
    assert_eq!(message.matches("warning: ").count(), 1, "{message}");
    assert!(message.contains("cannot be written") && message.contains(said) && message.contains("help: "), "{message}");
}

#[test]
fn a_cache_that_is_a_file_warns_once_and_the_run_goes_on() {
    let place = census();
    let whole = place.command(&RUN).output().expect("afmid starts");
    assert!(whole.status.success(), "{}", stderr(&whole));
    std::fs::rename(place.path("out.h5"), place.path("whole.h5")).expect("renamed");
    std::fs::remove_dir_all(place.path("cache")).expect("removed");
    std::fs::write(place.path("cache"), "mine").expect("a file");
    assert_warned_once(&place.command(&RUN).output().expect("afmid starts"), "cache");
    let differences = afmid_pipeline::store::compare(&place.path("whole.h5"), &place.path("out.h5"));
    assert_eq!(differences.expect("two results"), []);
    assert_eq!(std::fs::read(place.path("cache")).expect("the file"), b"mine");
    let batch = place.command(&["batch", "census.toml", "set", "-o", "sets"]).output().expect("afmid starts");
    assert_warned_once(&batch, "cache");
}

/// `-o` into what is no folder is refused before anything runs, whatever the command.
#[test]
fn no_command_takes_a_file_for_the_folder_of_its_output() {
    let place = census();
    assert!(place.command(&RUN).output().expect("afmid starts").status.success());
    std::fs::write(
        place.path("swept.toml"),
        format!("{}\n[sweep]\ncensus.min_bandwidth_share = [0.01]\n", sets::CENSUS),
    )
    .expect("a config");
    std::fs::write(place.path("no"), "a file").expect("a file");
    let before = below(place.folder());
    for arguments in [
        &["run", "census.toml", "-o", "no/out.h5"][..],
        &["run", "swept.toml", "--set", "records.files=['set']", "-o", "no/points"],
        &["batch", "census.toml", "set", "-o", "no/sets"],
        &["submit", "slurm", "census.toml", "set", "--shards", "1", "-o", "no/sets"],
        &["report", "out.h5", "-o", "no/page.html"],
        &["report", "out.h5", "--figures", "no/figures"],
        &["rerun", "out.h5", "-o", "no/out.h5"],
        &["export-crate", "out.h5", "-o", "no/crate"],
        &["new", "pipeline", "set", "-o", "no/x.toml"],
        &["new", "stage", "x", "--python", "-o", "no/x"],
        &["exam", &config("diagnose.toml"), "--keep", "no/exam"],
    ] {
        let output = place.command(arguments).output().expect("afmid starts");
        let message = stderr(&output);
        assert_eq!(output.status.code(), Some(2), "{arguments:?}: {message}");
        assert!(
            (message.contains("no is a file, wanted a folder") || message.contains("cannot be a folder"))
                && message.contains("give another place with -o"),
            "{arguments:?}: {message}"
        );
        assert!(output.stdout.is_empty(), "{arguments:?} did something");
    }
    assert_eq!(below(place.folder()), before, "something ran");
}

/// Whether a text names a file `....tmp`; the folder of the test itself begins with these letters.
fn names_a_temporary(text: &str) -> bool {
    text.match_indices(".tmp")
        .any(|(at, found)| !text[at + found.len()..].starts_with(|c: char| c.is_ascii_alphanumeric()))
}

#[test]
fn a_full_cache_warns_once_and_windows_go_elsewhere() {
    let place = Place::new();
    // ten windows of 1 MB: more than stay in memory
    let archive = simulated(place.folder(), "archive", 10, 3);
    let text = format!(
        "[pipeline]\nname = \"windows\"\n[[stage]]\nid = \"records\"\nuses = \"io.records\"\n\
         params = {{ files = [\"{}/*.h5\"] }}\n\
         [[stage]]\nid = \"events\"\nuses = \"events.correlation\"\ninputs = {{ records = \"records\" }}\n\
         params = {{ kind = \"snap-off\", window_samples = 131072 }}\n",
        archive.folder.display()
    );
    std::fs::write(place.path("windows.toml"), text).expect("a config");
    let whole =
        place.command(&["run", "windows.toml", "-o", "whole.h5", "--cache", "other"]).output().expect("afmid starts");
    assert!(whole.status.success(), "{}", stderr(&whole));
    let run = ["run", "windows.toml", "-o", "out.h5"];
    match Mounts::new().run(&place, "mount -t tmpfs -o size=4m none cache", &run) {
        Some(output) => {
            println!("done: a cache on a full disk (tmpfs of 4 MB)");
            assert_warned_once(&output, "cache");
            assert!(!names_a_temporary(&stderr(&output)), "{}", stderr(&output));
            let differences = afmid_pipeline::store::compare(&place.path("whole.h5"), &place.path("out.h5"));
            assert_eq!(differences.expect("two results"), []);
        }
        None => println!("NOT DONE: a cache on a full disk, nothing can be mounted here"),
    }
    assert_eq!(place.leftovers(), Vec::<PathBuf>::new());
}

#[test]
fn a_result_on_a_full_disk_is_an_error_and_leaves_nothing() {
    let place = census();
    std::fs::create_dir(place.path("disk")).expect("a folder");
    let run = [&RUN[..4], &["-o", "disk/out.h5"]].concat();
    match Mounts::new().run(&place, "mount -t tmpfs -o size=8k none disk", &run) {
        Some(output) => {
            println!("done: a result on a full disk (tmpfs of 8 kB)");
            let message = stderr(&output);
            assert_eq!(output.status.code(), Some(1), "{message}");
            assert!(
                message.contains("error: ") && message.contains("disk/out.h5") && !names_a_temporary(&message),
                "{message}"
            );
        }
        None => println!("NOT DONE: a result on a full disk, nothing can be mounted here"),
    }
}

#[test]
fn a_cache_that_may_only_be_read_warns_once_and_serves() {
    let place = census();
    assert!(place.command(&RUN).output().expect("afmid starts").status.success());
    std::fs::remove_file(place.path("out.h5")).expect("removed");
    let read_only = "mount --bind cache cache && mount -o remount,bind,ro cache";
    let mounts = Mounts::new();
    let Some(reused) = mounts.run(&place, read_only, &RUN) else {
        return println!("NOT DONE: a cache that may only be read, nothing can be mounted here");
    };
    println!("done: a cache that may only be read (bind mount)");
    let message = stderr(&reused);
    assert!(reused.status.success() && message.contains("census: reused") && !message.contains("warning"), "{message}");
    let other = [&RUN[..], &["--set", "census.min_bandwidth_share=0.03"]].concat();
    assert_warned_once(&mounts.run(&place, read_only, &other).expect("as before"), "cache");
    // and a folder of results that may only be read: nothing runs
    let read_only = "mkdir -p disk && mount -t tmpfs none disk && mount -o remount,ro disk";
    let refused = [&RUN[..4], &["-o", "disk/out.h5"]].concat();
    let refused = mounts.run(&place, read_only, &refused).expect("as before");
    assert_eq!(refused.status.code(), Some(2), "{}", stderr(&refused));
    assert!(!stderr(&refused).contains("records: "), "{}", stderr(&refused));
}

/// A file that grows beyond the limit of its size is an error of the write; the signal that comes with it ends nothing.
#[test]
fn a_limit_of_file_sizes_is_an_error_like_a_full_disk() {
    let place = census();
    let limited = |limit: &str, arguments: &[&str]| {
        let mut command = Command::new("sh");
        command.current_dir(place.folder()).env("TMPDIR", place.path("tmp")).env("AFMID_CACHE", place.path("cache"));
        command
            .args(["-c", &format!("ulimit -f {limit}; exec \"$0\" \"$@\""), env!("CARGO_BIN_EXE_afmid")])
            .args(arguments);
        command.output().expect("sh starts")
    };
    // blocks of 512 bytes: nothing that a run writes is as small
    let output = limited("8", &RUN);
    let message = stderr(&output);
    assert_eq!(output.status.code(), Some(1), "{:?} {message}", output.status);
    assert!(message.contains("error: ") && message.contains("out.h5"), "{message}");
    assert!(!place.path("out.h5").exists());
    assert_eq!(place.leftovers(), Vec::<PathBuf>::new());
    // what goes to stdout, too
    let mut command = Command::new("sh");
    command.current_dir(place.folder());
    command.args(["-c", "ulimit -f 8; exec \"$0\" schema >schema.json", env!("CARGO_BIN_EXE_afmid")]);
    let output = command.output().expect("sh starts");
    assert_eq!(output.status.code(), Some(1), "{:?} {}", output.status, stderr(&output));
    assert!(stderr(&output).contains("stdout cannot be written"), "{}", stderr(&output));
    // and without a limit all is well
    assert_eq!(limited("unlimited", &RUN).status.code(), Some(0));
}

#[test]
fn files_of_the_future_are_files_like_others() {
    let place = census();
    assert!(place.command(&RUN).output().expect("afmid starts").status.success());
    let future = SystemTime::now() + Duration::from_secs(400 * 24 * 3600);
    let later = |path: &PathBuf| File::options().write(true).open(path).and_then(|file| file.set_modified(future));
    for path in below(&place.path("cache")).iter().chain(&below(&place.path("set"))).filter(|path| path.is_file()) {
        later(path).expect("another time");
    }
    let message = stderr(&place.command(&RUN).output().expect("afmid starts"));
    assert!(message.contains("census: reused") && !message.contains("warning"), "{message}");
    let gc = |arguments: &[&str]| {
        let output = place.command(&[&["gc", "--json"], arguments].concat()).output().expect("afmid starts");
        assert!(output.status.success(), "{}", stderr(&output));
        serde_json::from_slice::<serde_json::Value>(&output.stdout).expect("JSON")
    };
    for path in below(&place.path("cache")).iter().filter(|path| path.is_file()) {
        later(path).expect("another time");
    }
    // of no age
    assert_eq!(gc(&["--older-than", "1h"])["left"]["results"]["files"], 1);
    assert_eq!(gc(&["--max-size", "0"])["left"]["results"]["files"], 0);
    // a record that is changed and keeps a time to come
    sets::write_set(&place.path("set"), 4, 3000);
    below(&place.path("set")).iter().for_each(|path| later(path).expect("another time"));
    let message = stderr(&place.command(&RUN).output().expect("afmid starts"));
    assert!(!message.contains("reused"), "{message}");
    assert_eq!(count(&place.path("cache"), ".h5"), 1);
}

#[test]
fn two_runs_and_gc_share_a_cache() {
    let place = Place::new();
    let archive = simulated(place.folder(), "archive", 4, 4);
    let (config, set) = (config("free-lever.toml"), files(&archive.folder));
    let run = |out: &str| {
        let mut command = place.command(&["run", &config, "--set", &set, "-o", out]);
        command.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("afmid starts")
    };
    let whole = place.command(&["run", &config, "--set", &set, "-o", "whole.h5", "--cache", "other"]).output();
    assert!(whole.expect("afmid starts").status.success());
    for round in 0..3 {
        let names = [format!("a{round}.h5"), format!("b{round}.h5")];
        let mut runs = names.clone().map(|name| run(&name));
        let mut freed = 0;
        while runs.iter_mut().any(|run| run.try_wait().expect("a child").is_none()) {
            let gc = place.command(&["gc", "--max-size", "0"]).output().expect("afmid starts");
            assert!(gc.status.success(), "{}", stderr(&gc));
            freed += 1;
        }
        assert!(freed > 0, "gc had no time");
        for (child, name) in runs.into_iter().zip(names) {
            let output = child.wait_with_output().expect("it ends");
            let message = stderr(&output);
            assert!(output.status.success() && !message.contains("warning: the cache"), "{message}");
            let differences = afmid_pipeline::store::compare(&place.path("whole.h5"), &place.path(&name));
            assert_eq!(differences.expect("two results"), []);
        }
    }
    assert_eq!(place.leftovers(), Vec::<PathBuf>::new());
}
