//! Patterns of files end, whatever links and folders they lead into.

use std::ffi::OsStr;
use std::fs;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::symlink;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use super::common::{afmid, command, shown};
use super::small::{CONFIG, folder};

/// What every command keeps to on a folder made to do harm (SECURITY.md).
const MOST_TIME: Duration = Duration::from_secs(5);

/// Runs the program, which must end in time; its exit code and what it said.
fn ended(here: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let mut command = command(here, arguments);
    let mut child = command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("afmid starts");
    let clock = Instant::now();
    while child.try_wait().expect("the child is there").is_none() {
        if clock.elapsed() > MOST_TIME {
            child.kill().expect("it can be stopped");
            panic!("afmid {arguments:?} still runs after {MOST_TIME:?}");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = child.wait_with_output().expect("what it said");
    let said = [output.stdout, output.stderr].concat();
    (output.status.code(), String::from_utf8_lossy(&said).into_owned())
}

/// Links of a folder to itself are not followed; parts of a pattern that mean the same folders find each file once.
#[test]
fn two_stars_do_not_follow_links_to_folders() {
    let place = folder(2, 20_000);
    let here = place.path();
    fs::create_dir(here.join("archive/later")).expect("a folder");
    fs::rename(here.join("archive/r1.h5"), here.join("archive/later/r1.h5")).expect("moved");
    for link in ["archive/one", "archive/two", "archive/later/up"] {
        symlink(if link.ends_with("up") { ".." } else { "." }, here.join(link)).expect("a link");
    }
    symlink("archive", here.join("link")).expect("a link");
    let set = |pattern: &str| format!("records.files=['{pattern}']");
    let many = format!("archive/{}*.h5", "**/".repeat(20));
    let between = "archive/**/later/**/*.h5".to_owned();
    for (number, (pattern, records)) in [
        ("archive/**/*.h5".to_owned(), 2),
        (many, 2),
        ("link/**/*.h5".to_owned(), 2),
        ("archive/*.h5".to_owned(), 1),
        ("archive/one/*.h5".to_owned(), 1),
        (between, 1),
    ]
    .into_iter()
    .enumerate()
    {
        let result = format!("r{number}.h5");
        let config = ["--set", &set(&pattern), "--cache", "cache"];
        let (code, said) = ended(here, &[&["explain", CONFIG][..], &config].concat());
        assert_eq!(code, Some(0), "{pattern}: {said}");
        let (code, said) = ended(here, &[&["run", CONFIG, "-o", &result][..], &config].concat());
        assert_eq!(code, Some(0), "{pattern}: {said}");
        assert_eq!(shown(here, &result, "records.summary")["records"], records, "{pattern}");
    }
}

/// Two stars in the place of one change nothing but the folders that are looked into.
#[test]
fn the_order_of_files_is_that_of_their_names() {
    let place = folder(3, 20_000);
    let here = place.path();
    fs::rename(here.join("archive/r2.h5"), here.join("archive/r10.h5")).expect("renamed");
    let records = |pattern: &str, result: &str| {
        afmid(here, &["run", CONFIG, "-o", result, "--set", &format!("records.files=['{pattern}']")]);
        super::small::differences(&here.join("one.h5"), &here.join(result))
    };
    assert!(records("archive/*.h5", "one.h5").is_empty());
    let found = records("archive/**/*.h5", "two.h5");
    let but_for_the_pattern: Vec<&String> = found.iter().filter(|text| !text.contains("files")).collect();
    assert!(but_for_the_pattern.is_empty(), "{found:?}");
}

/// `*` follows links: two of them in one folder are two folders more for each `*`.
#[test]
fn a_pattern_into_very_many_folders_is_refused_with_what_to_do() {
    let place = folder(1, 20_000);
    let here = place.path();
    ["one", "two"].iter().for_each(|link| symlink(".", here.join("archive").join(link)).expect("a link"));
    let pattern = format!("archive/{}*.h5", "*/".repeat(17));
    let set = format!("records.files=['{pattern}']");
    for arguments in [&["explain", CONFIG][..], &["run", CONFIG, "-o", "x.h5"]] {
        let (code, said) = ended(here, &[arguments, &["--set", &set, "--cache", "cache"]].concat());
        let problem = format!("the pattern `{pattern}` leads into more than 50000 folders");
        assert!(said.contains(&problem), "{said}");
        let refused = code == Some(1) && said.contains("begin the pattern further down");
        // `explain` says of each stage what hinders it
        assert!(refused || arguments[0] == "explain", "{said}");
    }
}

/// Names of files are bytes: one that is no UTF-8 beside the records is passed over.
#[test]
fn a_name_that_is_no_utf_8_is_no_failure() {
    let place = folder(1, 20_000);
    let here = place.path();
    fs::write(here.join("archive").join(OsStr::from_bytes(b"notes\xff.txt")), "no record").expect("a file");
    for pattern in ["archive/*.h5", "archive/**/*.h5"] {
        let set = format!("records.files=['{pattern}']");
        let (code, said) = ended(here, &["run", CONFIG, "-o", "x.h5", "--set", &set, "--cache", "cache"]);
        assert_eq!(code, Some(0), "{said}");
        assert_eq!(shown(here, "x.h5", "records.summary")["records"], 1);
    }
}
