//! FIFOs, devices, sizes of configs, numbers of problems.

use std::fs;
use std::os::unix::net::UnixListener;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use super::common::{command, config};

/// No command waits: opening a FIFO would, for ever.
fn ends(folder: &Path, arguments: &[&str]) -> Output {
    let mut child = command(folder, arguments);
    let mut child =
        child.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("afmid starts");
    let clock = Instant::now();
    while child.try_wait().expect("the child is there").is_none() {
        if clock.elapsed() > Duration::from_secs(20) {
            child.kill().expect("it can be stopped");
            panic!("afmid {arguments:?} does not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    child.wait_with_output().expect("it has ended")
}

#[test]
fn what_is_no_regular_file_is_refused_before_it_is_opened() {
    let folder = tempfile::tempdir().expect("a folder");
    let made = Command::new("mkfifo").arg(folder.path().join("fifo")).status().expect("mkfifo is there");
    assert!(made.success());
    let _socket = UnixListener::bind(folder.path().join("socket")).expect("a socket");
    std::os::unix::fs::symlink("fifo", folder.path().join("link")).expect("a link");
    fs::write(folder.path().join("data.toml"), "[pipeline]\nname = \"a\"\nseed = 1\n[[stage]]\nid = \"records\"\nuses = \"io.records\"\nparams = { files = [\"x.h5\"] }\n").expect("a config");
    for odd in ["fifo", "socket", "link", "/dev/zero"] {
        let columns = format!(
            "[pipeline]\nname = \"a\"\nseed = 1\n[[stage]]\nid = \"data\"\nuses = \"io.columns\"\n\
             params = {{ file = {odd:?}, sample_rate_hz = 1.0 }}\n"
        );
        fs::write(folder.path().join("columns.toml"), columns).expect("a config");
        let commands: &[&[&str]] = &[
            &["inspect", odd],
            &["show", odd],
            &["report", odd, "-o", "page.html"],
            &["diff", odd, odd],
            &["trace", odd],
            &["rerun", odd],
            &["export", odd, "data", "-o", "model.json"],
            &["export-crate", odd, "-o", "crate"],
            &["check", odd],
            &["check", "--json", odd],
            &["graph", odd],
            &["explain", odd, "--cache", "cache"],
            &["run", odd, "-o", "a.h5", "--cache", "cache"],
            &["run", "data.toml", odd, "-o", "a.h5", "--cache", "cache"],
            &["run", "columns.toml", "-o", "a.h5", "--cache", "cache"],
            &["batch", "data.toml", "--manifest", odd, "-o", "batch", "--cache", "cache"],
            &["new", "pipeline", odd, "-o", "new.toml"],
        ];
        for arguments in commands {
            let Output { status, stderr, .. } = ends(folder.path(), arguments);
            let message = String::from_utf8_lossy(&stderr);
            assert!(matches!(status.code(), Some(1 | 2)), "afmid {arguments:?}: {status}\n{message}");
        }
        let output = ends(folder.path(), &["check", odd]);
        let message = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(message.contains("a regular file was wanted"), "{message}");
    }
}

#[test]
fn a_ledger_entry_that_is_a_fifo_is_no_entry() {
    let folder = tempfile::tempdir().expect("a folder");
    fs::create_dir_all(folder.path().join("out/ledger")).expect("a folder");
    fs::create_dir(folder.path().join("set")).expect("a folder");
    let made = Command::new("mkfifo").arg(folder.path().join("out/ledger/set.json")).status().expect("mkfifo is there");
    assert!(made.success());
    let config = config("free-lever.toml");
    let Output { status, .. } =
        ends(folder.path(), &["batch", &config, "set", "-o", "out", "--collect", "--cache", "cache"]);
    assert_eq!(status.code(), Some(3));
}

#[test]
fn a_config_has_at_most_8_mib() {
    let folder = tempfile::tempdir().expect("a folder");
    let head = "[pipeline]\nname = \"a\"\nseed = 1\n[[stage]]\nid = \"a\"\nuses = \"io.columns\"\n\
        params = { file = \"x\" }\n# ";
    let with = |bytes: usize| {
        fs::write(folder.path().join("a.toml"), head.to_owned() + &"x".repeat(bytes - head.len())).expect("a config");
        let Output { status, stderr, .. } = ends(folder.path(), &["check", "a.toml"]);
        (status.code(), String::from_utf8_lossy(&stderr).into_owned())
    };
    assert_eq!(with(8 << 20).0, Some(0));
    let (code, message) = with((8 << 20) + 1);
    assert!(code == Some(2) && message.contains("more than the 8388608 bytes"), "{message}");
}

#[test]
fn at_most_a_hundred_problems_are_printed() {
    let folder = tempfile::tempdir().expect("a folder");
    let stages: String = (0..1234).map(|n| format!("[[stage]]\nid = \"a{n}\"\nuses = \"io.nothing\"\n")).collect();
    fs::write(folder.path().join("a.toml"), format!("[pipeline]\nname = \"a\"\nseed = 1\n{stages}")).expect("a config");
    let output = ends(folder.path(), &["check", "a.toml"]);
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(text.matches("there is no stage named").count(), 100);
    assert!(text.contains("and 1134 more") && text.contains("1234 problems"), "{}", &text[text.len() - 300..]);
    // the last one is reported at its line
    assert!(text.contains("[a.toml:303:8]"), "{text}");
    let output = ends(folder.path(), &["check", "--json", "a.toml"]);
    let json: serde_json::Value = serde_json::from_slice(&output.stdout).expect("JSON");
    assert_eq!(json[0]["problems"].as_array().map(Vec::len), Some(100));
    assert_eq!(json[0]["more_problems"], 1134);
}

/// What is kept about input files between runs is a file of the cache like any other: nobody waits for one that is none.
#[test]
fn a_file_of_stamps_that_is_a_fifo_is_passed_over() {
    let place = super::small::folder(2, 20_000);
    let here = place.path();
    // files that were just written are not stamped
    std::thread::sleep(Duration::from_millis(2200));
    let run = ["run", super::small::CONFIG, "-o", "a.h5", "--cache", "cache"];
    assert!(ends(here, &run).status.success());
    let stamps: Vec<_> = fs::read_dir(here.join("cache/stamps")).expect("stamps").flatten().collect();
    assert!(!stamps.is_empty());
    for stamp in &stamps {
        fs::remove_file(stamp.path()).expect("removed");
        assert!(Command::new("mkfifo").arg(stamp.path()).status().expect("mkfifo is there").success());
    }
    for arguments in [&run[..], &["explain", super::small::CONFIG, "--cache", "cache"], &["gc", "--cache", "cache"]] {
        let output = ends(here, arguments);
        assert!(output.status.success(), "{arguments:?}: {}", String::from_utf8_lossy(&output.stderr));
    }
}

/// Lists of what was written to a folder, and files that are known by what they say.
#[test]
fn a_fifo_in_a_folder_that_is_filled_is_neither_waited_for_nor_replaced() {
    let place = super::small::folder(1, 20_000);
    let here = place.path();
    assert!(ends(here, &["run", super::small::CONFIG, "-o", "a.h5", "--cache", "cache"]).status.success());
    let cases: &[(&str, &str, &[&str])] = &[
        ("man", ".afmid-files", &["man", "man"]),
        ("man", "afmid.1", &["man", "man"]),
        ("figures", ".afmid-files", &["report", "a.h5", "-o", "a.html", "--figures", "figures"]),
        ("crate", "ro-crate-metadata.json", &["export-crate", "a.h5", "-o", "crate"]),
        ("out/ledger", "archive.json", &["batch", super::small::CONFIG, "archive", "-o", "out", "--cache", "cache"]),
    ];
    for (folder, name, arguments) in cases {
        let path = here.join(folder).join(name);
        fs::create_dir_all(here.join(folder)).expect("a folder");
        assert!(Command::new("mkfifo").arg(&path).status().expect("mkfifo is there").success());
        let Output { status, stderr, .. } = ends(here, arguments);
        let message = String::from_utf8_lossy(&stderr);
        assert!(matches!(status.code(), Some(1..=3)), "afmid {arguments:?}: {status}\n{message}");
        assert!(!fs::symlink_metadata(&path).expect("it is there").is_file(), "{} is still a FIFO", path.display());
        fs::remove_file(&path).expect("removed");
    }
}

/// A plugin that warns `count` times.
fn loud(count: usize) -> String {
    let describe = r#"{"id":1,"result":{"name":"loud","version":"1","summary":"s","source":"none","inputs":[],"outputs":[{"name":"document","shape":"document"}],"parameters":{"type":"object","properties":{},"additionalProperties":false},"deterministic":true,"seeded":false}}"#;
    format!(
        "#!/bin/sh\n\
         echo '{{\"afmid_stage\":1,\"protocol\":{{\"min\":1,\"max\":1}},\"name\":\"loud\",\"version\":\"1\"}}'\n\
         while read -r line; do\n\
         id=$(printf %s \"$line\" | sed 's/.*\"id\": *\\([0-9]*\\).*/\\1/')\n\
         case \"$line\" in\n\
         *describe*) echo '{describe}' | sed \"s/\\\"id\\\":1/\\\"id\\\":$id/\";;\n\
         *shutdown*) exit 0;;\n\
         *) printf '{{\"id\":%s,\"result\":{{\"outputs\":{{\"document\":{{\"shape\":\"document\",\"value\":1}}}},\"warnings\":[' \"$id\"\n\
         seq -s , 1 {count} | sed 's/[0-9][0-9]*/\"warning &\"/g' | tr -d '\\n'\n\
         printf ']}}}}\\n';;\n\
         esac\ndone\n"
    )
}

#[test]
fn the_first_of_very_many_warnings_are_shown_and_a_limit_is_kept() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    fs::write(
        here.join("c.toml"),
        "[pipeline]\nname = \"a\"\nseed = 1\n\n[plugins]\nloud = \"sh loud.sh\"\n\n\
         [[stage]]\nid = \"x\"\nuses = \"exec:loud\"\n",
    )
    .expect("a config");
    let run = ["run", "c.toml", "-o", "a.h5", "--cache", "cache", "--allow-plugins"];
    for (count, kept) in [(100, 100), (100_000, 10_001)] {
        fs::write(here.join("loud.sh"), loud(count)).expect("a script");
        let Output { status, stdout, stderr } = ends(here, &run);
        let said = String::from_utf8_lossy(&[stdout, stderr].concat()).into_owned();
        assert!(status.success(), "{said}");
        assert!(said.contains("warning 20\n") && !said.contains("warning 21\n"), "{said}");
        assert!(said.contains(&format!("and {} more", kept - 20)), "{said}");
        for arguments in [&["show", "a.h5"][..], &["show", "a.h5", "x"]] {
            let shown = String::from_utf8_lossy(&ends(here, arguments).stdout).into_owned();
            assert!(shown.contains("warning 20\n") && shown.lines().count() < 60, "{arguments:?}: {shown}");
        }
        // more than a pipe holds
        let json = command(here, &["show", "a.h5", "--json"]).output().expect("afmid starts").stdout;
        let json: serde_json::Value = serde_json::from_slice(&json).expect("JSON");
        let all = json["stages"][0]["warnings"].as_array().expect("warnings").clone();
        assert_eq!(all.len(), kept);
        if kept < count {
            assert!(all[kept - 1].as_str().is_some_and(|last| last.contains("90000 more")), "{}", all[kept - 1]);
        }
        assert!(ends(here, &["report", "a.h5", "-o", "a.html"]).status.success());
        let page = fs::read_to_string(here.join("a.html")).expect("a page");
        assert!(page.matches("warning 1").count() < 50, "the page has them all");
    }
}

#[test]
fn notes_beside_recordings_are_listed_and_no_failure() {
    let place = super::small::folder(2, 20_000);
    let here = place.path();
    for (name, text) in [("README", "about these files\n"), ("notes.md", "# Notes\n"), ("x.txt", "some words\n")] {
        fs::write(here.join("archive").join(name), text).expect("a note");
    }
    let Output { status, stdout, stderr } = ends(here, &["inspect", "archive"]);
    let shown = String::from_utf8_lossy(&stdout).into_owned();
    assert_eq!(status.code(), Some(0), "{shown}{}", String::from_utf8_lossy(&stderr));
    assert!(shown.contains("no recording") && shown.contains("README"), "{shown}");
    let Output { status, stdout, .. } = ends(here, &["inspect", "archive", "--json"]);
    let json: serde_json::Value = serde_json::from_slice(&stdout).expect("JSON");
    let of = |name: &str| {
        let mut files = json["files"].as_array().expect("files").iter();
        files.find(|file| file["file"].as_str().is_some_and(|file| file.ends_with(name))).expect("the file").clone()
    };
    assert_eq!(status.code(), Some(0));
    assert_eq!((&of("README")["no_recording"], &of("r0.h5")["no_recording"]), (&true.into(), &false.into()));
    assert!(of("README")["error"].is_object());
    // named by itself, or a recording that is damaged
    assert_eq!(ends(here, &["inspect", "archive/README"]).status.code(), Some(1));
    let whole = fs::read(here.join("archive/r0.h5")).expect("a record");
    for damaged in [&whole[..whole.len() / 2], b""] {
        fs::write(here.join("archive/cut.h5"), damaged).expect("written");
        let Output { status, stderr, .. } = ends(here, &["inspect", "archive"]);
        let said = String::from_utf8_lossy(&stderr).into_owned();
        assert!(status.code() == Some(1) && said.contains("1 of 6 files"), "{said}");
    }
}

const SIMULATED: &str = r#"[pipeline]
name = "simulated"
seed = 3

[[stage]]
id = "archive"
uses = "simulate.afm"
params = { out = "archive", records = 2, samples = 600000, ramp_hz = 6.0, snap_offs = 2, margin_samples = 30000, seed = 5 }
"#;

const RINGDOWN: &str = r#"[pipeline]
name = "ringdown"
seed = 3

[[stage]]
id = "records"
uses = "io.records"
params = { files = ["archive/*.h5"] }

[[stage]]
id = "events"
uses = "events.correlation"
inputs = { records = "records" }
params = { kind = "snap-off" }

[[stage]]
id = "ringdown"
uses = "model.ringdown"
inputs = { ensemble = "events.ensemble" }
"#;

/// A limit of the address space, as clusters set it: of what is reserved little is ever used. Products of matrices reserve
/// twice the machine's largest cache, which counts beyond the 32 MiB of a common server.
#[test]
fn small_inputs_need_little_address_space() {
    let folder = tempfile::tempdir().expect("a folder");
    let here = folder.path();
    fs::write(here.join("simulated.toml"), SIMULATED).expect("a config");
    fs::write(here.join("ringdown.toml"), RINGDOWN).expect("a config");
    let commands: &[&[&str]] = &[
        &["run", "simulated.toml", "-o", "s.h5", "--fresh", "--cache", "cache"],
        &["check", "ringdown.toml"],
        &["inspect", "archive"],
        &["run", "ringdown.toml", "-o", "r.h5", "--fresh", "--cache", "cache"],
        &["show", "r.h5"],
        &["report", "r.h5", "-o", "r.html"],
        &["diff", "r.h5", "r.h5"],
        &["batch", "ringdown.toml", "archive", "-o", "out", "--cache", "cache"],
    ];
    let cache = fs::read_to_string("/sys/devices/system/cpu/cpu0/cache/index3/size").unwrap_or_default();
    let cache_kb: u64 = cache.trim().strip_suffix('K').and_then(|kb| kb.parse().ok()).unwrap_or(32_768);
    let run = |limit_kb: u64, arguments: &[&str]| {
        let mut limited = Command::new("sh");
        limited.current_dir(here).args(["-c", "ulimit -v $1; shift; exec \"$@\"", "sh", &limit_kb.to_string()]);
        limited.arg(env!("CARGO_BIN_EXE_afmid")).args(arguments);
        limited.output().expect("a shell")
    };
    for limit_kb in [500_000, 300_000].map(|limit_kb| limit_kb + 2 * cache_kb.saturating_sub(32_768)) {
        for arguments in commands {
            let Output { status, stderr, .. } = run(limit_kb, arguments);
            let said = String::from_utf8_lossy(&stderr);
            assert!(status.success(), "afmid {arguments:?} in {limit_kb} kB: {status}\n{said}");
        }
    }
    // where there is no room for a single product: the program itself takes less than half of the smallest such cache
    if cache_kb >= 200_000 {
        let Output { status, stderr, .. } = run(2 * cache_kb, &["inspect", "archive"]);
        let said = String::from_utf8_lossy(&stderr);
        assert!(status.code() == Some(1) && said.contains("twice this machine's largest cache"), "{status} {said}");
    }
}
