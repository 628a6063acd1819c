//! No command replaces or removes a file that afmid did not write.

use std::collections::BTreeMap;
use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::time::{Duration, SystemTime};

use super::common::{afmid, command};
use super::small::{CONFIG, folder, record, run};

const SIMULATE: &str = r#"[pipeline]
name = "archive"
seed = 3

[[stage]]
id = "archive"
uses = "simulate.afm"
params = { out = "simulated", records = 2, samples = 60000, ramp_hz = 60.0, snap_offs = 2, margin_samples = 3000, seed = 5 }
"#;

/// Every file below a folder but caches, and its bytes.
fn files(folder: &Path) -> BTreeMap<PathBuf, Vec<u8>> {
    let mut all = BTreeMap::new();
    for path in fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path()) {
        match path.is_dir() {
            true if path.ends_with("cache") => {}
            true => all.extend(files(&path)),
            false => {
                let bytes = fs::read(&path).expect("bytes");
                all.insert(path, bytes);
            }
        }
    }
    all
}

/// Runs a command that must refuse; what it says.
fn fails(here: &Path, arguments: &[&str]) -> String {
    let output = command(here, arguments).output().expect("afmid starts");
    let message = [output.stdout, output.stderr].concat();
    let message = String::from_utf8_lossy(&message).into_owned();
    assert!(matches!(output.status.code(), Some(1..=3)), "afmid {arguments:?}: {}\n{message}", output.status);
    message
}

/// Runs a command that must refuse, and changes no file of those that are there.
fn refused(here: &Path, arguments: &[&str]) -> String {
    let before = files(here);
    let message = fails(here, arguments);
    let after = files(here);
    for (path, bytes) in &before {
        assert!(after.get(path) == Some(bytes), "afmid {arguments:?} changed {}: {message}", path.display());
    }
    message
}

/// Puts other bytes where something lies, has the command refuse it, and lets it go on when they are gone. Then edits
/// what afmid wrote: it stays, too.
fn kept(here: &Path, place: &str, arguments: &[&str]) {
    let path = here.join(place);
    fs::create_dir_all(path.parent().expect("a folder")).expect("a folder");
    for others in [&b"<!DOCTYPE html>\n<html>mine</html>\n"[..], b"1,2,3\n", b"{\"mine\": 1}\n", b"\x89PNG\r\n\x1a\n"] {
        fs::write(&path, others).expect("written");
        let message = fails(here, arguments);
        assert!(fs::read(&path).expect("bytes") == others, "afmid {arguments:?} replaced {place}: {message}");
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        assert!(message.contains(&name), "it says which: {message}");
    }
    fs::remove_file(&path).expect("removed");
    afmid(here, arguments);
    let whole = fs::read(&path).expect("it was written");
    // over what it wrote itself
    afmid(here, arguments);
    let mut edited = whole.clone();
    let middle = whole.len() / 2;
    edited[middle] ^= 1;
    fs::write(&path, &edited).expect("written");
    let message = fails(here, arguments);
    assert!(fs::read(&path).expect("bytes") == edited && message.contains("changed since"), "{place}: {message}");
    fs::write(&path, &whole).expect("written");
    afmid(here, arguments);
    fs::write(&path, "").expect("written");
    afmid(here, arguments);
}

#[test]
fn a_simulation_keeps_the_measurements_of_its_folder() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    fs::write(here.join("sim.toml"), SIMULATE).expect("the config");
    fs::create_dir(here.join("simulated")).expect("a folder");
    // a measurement that happens to have the name
    record(&here.join("simulated/record_0000.h5"), 5000, 1);
    let arguments = ["run", "sim.toml", "-o", "s.h5", "--cache", "cache"];
    let message = refused(here, &arguments);
    assert!(
        message.contains("record_0000.h5") && message.contains("did not write it") && message.contains("help"),
        "{message}"
    );
    fs::remove_file(here.join("simulated/record_0000.h5")).expect("removed");
    afmid(here, &arguments);
    afmid(here, &arguments);
    // one that somebody edited
    let path = here.join("simulated/record_0001.h5");
    let whole = fs::read(&path).expect("a record");
    let mut edited = whole.clone();
    edited[whole.len() / 2] ^= 1;
    fs::write(&path, &edited).expect("written");
    let message = refused(here, &arguments);
    assert!(message.contains("record_0001.h5") && message.contains("changed since"), "{message}");
    fs::write(&path, &whole).expect("written");
    let truth = here.join("simulated.truth.json");
    let text = fs::read_to_string(&truth).expect("the truth");
    fs::write(&truth, text.replace("60000", "60001")).expect("written");
    assert!(refused(here, &arguments).contains("truth.json"));
    fs::write(&truth, "my notes").expect("written");
    assert!(refused(here, &arguments).contains("truth.json"));
    fs::write(&truth, text).expect("written");
    // a name with a dot in it keeps all of it
    afmid(here, &["run", "sim.toml", "-o", "t.h5", "--cache", "cache", "--set", "archive.out='lever.2005'"]);
    assert!(here.join("lever.2005.truth.json").exists());
    // another archive over the own one
    afmid(here, &[&arguments[..], &["--set", "archive.seed=6"]].concat());
    afmid(here, &arguments);
    assert!(fs::read(&path).expect("a record") == whole, "the same archive again");
}

/// Without its list a folder's files may be another program's, whatever they look like: only the same bytes pass.
#[test]
fn a_simulation_without_its_list_replaces_nothing_that_is_not_the_same() {
    let scratch = tempfile::tempdir().expect("a folder");
    let here = scratch.path();
    fs::write(here.join("sim.toml"), SIMULATE).expect("the config");
    let arguments = ["run", "sim.toml", "-o", "s.h5", "--cache", "cache"];
    afmid(here, &arguments);
    let (list, path, truth) =
        (here.join("simulated/.afmid-files"), here.join("simulated/record_0001.h5"), here.join("simulated.truth.json"));
    let (whole, text) = (fs::read(&path).expect("a record"), fs::read(&truth).expect("the truth"));
    // a folder that was copied without its list
    fs::remove_file(&list).expect("the list");
    afmid(here, &[&arguments[..], &["--fresh"]].concat());
    assert!(list.exists() && fs::read(&path).expect("a record") == whole, "the same archive again");
    // of another seed: same names, starts and channels, as another simulator writes them
    for file in [&path, &truth] {
        fs::remove_file(&list).expect("the list");
        let other = [&arguments[..], &["--set", "archive.seed=6", "--set", "archive.out='other'", "--fresh"]].concat();
        afmid(here, &other);
        let name = if file == &truth { "other.truth.json".to_owned() } else { "other/record_0001.h5".to_owned() };
        fs::copy(here.join(name), file).expect("copied");
        let message = refused(here, &[&arguments[..], &["--fresh"]].concat());
        let named = file.file_name().expect("a name").to_string_lossy().into_owned();
        assert!(message.contains(&named) && message.contains("not replaced"), "{message}");
        fs::write(&path, &whole).expect("written");
        fs::write(&truth, &text).expect("written");
        let _ = fs::remove_file(&list);
        afmid(here, &[&arguments[..], &["--fresh"]].concat());
    }
    // one whose samples somebody edited, and notes
    for (file, others) in [(&path, &edited(&whole)[..]), (&truth, b"my notes")] {
        fs::remove_file(&list).expect("the list");
        fs::write(file, others).expect("written");
        refused(here, &[&arguments[..], &["--fresh"]].concat());
        fs::write(&path, &whole).expect("written");
        fs::write(&truth, &text).expect("written");
        let _ = fs::remove_file(&list);
        afmid(here, &[&arguments[..], &["--fresh"]].concat());
    }
}

/// The bytes with the middle one changed.
fn edited(whole: &[u8]) -> Vec<u8> {
    let mut edited = whole.to_vec();
    edited[whole.len() / 2] ^= 1;
    edited
}

#[test]
fn results_pages_models_and_figures_replace_their_own_kind_only_and_none_that_was_edited() {
    let scratch = folder(2, 20_000);
    let here = scratch.path();
    kept(here, "out.h5", &["run", CONFIG, "-o", "out.h5", "--cache", "cache"]);
    // a measurement, and an HDF5 file of anybody
    record(&here.join("mine.h5"), 3000, 9);
    assert!(refused(here, &["run", CONFIG, "-o", "mine.h5", "--cache", "cache"]).contains("a native record"));
    kept(here, "page.html", &["report", "out.h5", "-o", "page.html"]);
    kept(here, "again.h5", &["rerun", "out.h5", "-o", "again.h5", "--cache", "cache"]);
    afmid(here, &["export-crate", "out.h5", "-o", "crate", "--with-data"]);
    kept(here, "crate/config.toml", &["export-crate", "out.h5", "-o", "crate", "--with-data"]);
    kept(here, "crate/inputs/r0.h5", &["export-crate", "out.h5", "-o", "crate", "--with-data"]);
    kept(here, "man/afmid-run.1", &["man", "man"]);
    let drawn = tempfile::tempdir().expect("a folder");
    let pictures = drawn.path().display().to_string();
    afmid(here, &["report", "out.h5", "-o", "page.html", "--figures", &pictures, "--png"]);
    let mut names: Vec<String> = fs::read_dir(drawn.path())
        .expect("a folder")
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| !name.starts_with('.'))
        .collect();
    names.sort();
    for ending in [".png", ".svg"] {
        let name = names.iter().find(|name| name.ends_with(ending)).expect("a figure");
        let draw = ["report", "out.h5", "-o", "page.html", "--figures", "figures", "--png"];
        kept(here, &format!("figures/{name}"), &draw);
    }
    fs::write(here.join("new.toml"), "mine").expect("written");
    refused(here, &["new", "pipeline", "archive", "-o", "new.toml"]);
    // a page whose mark is gone may have been edited
    let page = fs::read_to_string(here.join("page.html")).expect("a page");
    let at = page.rfind("afmid BLAKE3 ").expect("its mark");
    fs::write(here.join("page.html"), format!("{}{}", &page[..at], &page[at + 13..])).expect("written");
    assert!(refused(here, &["report", "out.h5", "-o", "page.html"]).contains("states no hash"));
    // the name of a link
    std::os::unix::fs::symlink("out.h5", here.join("link.h5")).expect("a link");
    assert!(refused(here, &["run", CONFIG, "-o", "link.h5", "--cache", "cache"]).contains("symbolic link"));
}

#[test]
fn a_file_that_appears_while_a_run_goes_on_stays() {
    let scratch = folder(1, 4_000_000);
    let here = scratch.path();
    for before in [None, Some("earlier")] {
        let place = here.join("out.h5");
        let _ = fs::remove_file(&place);
        if before.is_some() {
            afmid(here, &["run", CONFIG, "-o", "out.h5", "--cache", "cache"]);
        }
        let mut command = command(here, &["run", CONFIG, "-o", "out.h5", "--fresh", "--cache", "cache"]);
        let child = command.stderr(std::process::Stdio::piped()).spawn().expect("afmid starts");
        let begun = || {
            let entries = fs::read_dir(here).expect("the folder").flatten();
            entries.filter_map(|entry| entry.file_name().into_string().ok()).any(|name| name.starts_with(".out.h5."))
        };
        let clock = std::time::Instant::now();
        while !begun() && clock.elapsed() < Duration::from_secs(30) {
            std::thread::sleep(Duration::from_millis(1));
        }
        fs::write(&place, "my notes").expect("written");
        let output = child.wait_with_output().expect("it ends");
        let error = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(1), "{before:?}: {error}");
        assert!(error.contains("out.h5") && error.contains("meanwhile"), "{before:?}: {error}");
        assert_eq!(fs::read_to_string(&place).expect("the notes"), "my notes");
    }
}

#[test]
fn batches_and_sweeps_keep_tables_results_and_ledgers_of_others() {
    let scratch = folder(1, 20_000);
    let here = scratch.path();
    let batch = ["batch", CONFIG, "archive", "-o", "out", "--cache", "cache"];
    for place in ["summary.csv", "summary.parquet", "trends.csv", "summary.h5"] {
        kept(here, &format!("out/{place}"), &batch);
    }
    // the result of a data set that must be run again
    let again = [&batch[..], &["--fresh"]].concat();
    kept(here, "out/archive.h5", &again);
    fs::write(here.join("out/ledger/archive.json"), "{\"mine\": 1}").expect("written");
    assert!(fails(here, &again).contains("archive.json"));
    assert_eq!(fs::read(here.join("out/ledger/archive.json")).expect("bytes"), b"{\"mine\": 1}");
    let sweep = format!(
        "{}\n[sweep]\n\"overview.stretches\" = [40, 50]\n",
        fs::read_to_string(here.join(CONFIG)).expect("text")
    );
    fs::write(here.join("sweep.toml"), sweep).expect("the config");
    let run = ["run", "sweep.toml", "-o", "points", "--cache", "cache"];
    for place in ["summary.csv", "summary.parquet", "summary.h5"] {
        kept(here, &format!("points/{place}"), &run);
    }
    // a batch does not take the place of a sweep
    assert!(
        refused(here, &["batch", CONFIG, "archive", "-o", "points", "--cache", "cache"])
            .contains("no table of a batch")
    );
    let submit = ["submit", "slurm", CONFIG, "archive", "--shards", "1", "-o", "jobs", "--cache", "cache"];
    for place in ["submit.sh", "manifest.jsonl", "config.toml"] {
        kept(here, &format!("jobs/slurm/{place}"), &submit);
    }
}

/// A number that no process has: `pid_max` is at most 2^22.
const NOBODY: u32 = 4_194_999;

/// Writes a file that nobody has touched for three days.
fn aged(path: &Path) {
    fs::write(path, "x").expect("written");
    let then = SystemTime::now() - Duration::from_secs(3 * 24 * 3600);
    File::options().write(true).open(path).and_then(|file| file.set_modified(then)).expect("a time");
}

/// The part of temporary names that means this machine, from the name of a file that a killed run left.
fn host_of(here: &Path) -> String {
    for _ in 0..200 {
        let mut child = command(here, &["run", CONFIG, "-o", "killed.h5", "--cache", "killed", "--fresh"])
            .stdout(std::process::Stdio::null())
            .stderr(std::process::Stdio::null())
            .spawn()
            .expect("afmid starts");
        for _ in 0..400 {
            let name = fs::read_dir(here).expect("a folder").find_map(|entry| {
                let name = entry.ok()?.file_name().into_string().ok()?;
                (name.starts_with(".killed.h5.") && name.ends_with(".tmp")).then_some(name)
            });
            if let Some(name) = name {
                let _ = child.kill();
                child.wait().expect("it is gone");
                return name[".killed.h5.".len()..].split('.').next().expect("a host").to_owned();
            }
            if child.try_wait().expect("known").is_some() {
                break;
            }
            std::thread::sleep(Duration::from_micros(100));
        }
        let _ = child.kill();
        child.wait().expect("it is gone");
    }
    panic!("no run was caught with its temporary file");
}

#[test]
fn temporary_files_of_others_and_of_the_living_stay_and_those_of_the_dead_go_everywhere() {
    let scratch = folder(2, 2_000_000);
    let here = scratch.path();
    fs::write(here.join("sim.toml"), SIMULATE).expect("the config");
    let host = host_of(here);
    let key = "0123456789abcdef".repeat(4);
    let living = std::process::id();
    let places = ["", "cache", "cache/stamps", "out", "out/ledger", "simulated", "figures"];
    let target = |place: &str| match place {
        "" => "r.h5".to_owned(),
        "cache" => format!("{key}.h5"),
        "cache/stamps" => key.clone(),
        "out" => "archive.h5".to_owned(),
        "out/ledger" => "archive.json".to_owned(),
        "simulated" => "record_0000.h5".to_owned(),
        _ => "figure-2.svg".to_owned(),
    };
    let (mut stay, mut go) = (Vec::new(), Vec::new());
    for place in places {
        let (folder, name) = (here.join(place), target(place));
        fs::create_dir_all(&folder).expect("a folder");
        stay.push(folder.join(".notes.tmp"));
        stay.push(folder.join(format!(".{name}.mine.tmp")));
        stay.push(folder.join(format!(".{name}.{host}.{living}.7.tmp")));
        stay.push(folder.join(format!("{name}.tmp")));
        go.push(folder.join(format!(".{name}.{host}.{NOBODY}-12.3.tmp")));
        go.push(folder.join(format!(".{name}.{host}.{NOBODY}.3.tmp")));
        go.push(folder.join(format!(".{name}.ba9876543210.12-34.3.tmp")));
        // the number of a living process that was started at another time
        go.push(folder.join(format!(".{name}.{host}.{living}-1.3.tmp")));
    }
    stay.iter().chain(&go).for_each(|path| aged(path));
    afmid(here, &["run", CONFIG, "-o", "r.h5", "--cache", "cache"]);
    afmid(here, &["run", "sim.toml", "-o", "s.h5", "--cache", "cache"]);
    afmid(here, &["batch", CONFIG, "archive", "-o", "out", "--cache", "cache"]);
    afmid(here, &["report", "r.h5", "-o", "r.html", "--figures", "figures"]);
    for path in &stay {
        assert!(path.exists(), "{} is another's", path.display());
    }
    for path in &go {
        assert!(!path.exists(), "{} has no owner", path.display());
    }
    // `gc` knows the same
    let left =
        [format!("cache/.{key}.json.{host}.{NOBODY}-1.0.tmp"), format!("cache/stamps/.{key}.{host}.{NOBODY}.0.tmp")];
    left.iter().for_each(|name| aged(&here.join(name)));
    afmid(here, &["gc", "--cache", "cache"]);
    assert!(left.iter().all(|name| !here.join(name).exists()));
    assert!(stay.iter().all(|path| path.exists()));
    assert_eq!(run(here, "r.h5", "cache", &[]).code, Some(0));
}
