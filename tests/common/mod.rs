//! What the tests of whole runs share: the program, an archive to run it on, and the truth to compare with.

#![allow(dead_code, reason = "each test binary uses a part of it")]

pub mod sets;

use std::ffi::OsString;
use std::path::{Path, PathBuf};
use std::process::{Command, Output};

use serde_json::Value;

/// The folder of the package.
pub const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// An archive of force curves with its truth.
pub struct Archive {
    /// Its folder.
    pub folder: PathBuf,
    /// Frequencies, quality factors, contact and numbers of events.
    pub truth: Truth,
    /// Whether it is simulated in place of a recording that is not here.
    pub stand_in: bool,
}

/// What the archive holds.
#[derive(Debug, Clone)]
pub struct Truth {
    pub frequency_hz: Vec<f64>,
    pub quality_factor: Vec<f64>,
    pub contact_stiffness_n_per_m: f64,
    pub snap_offs: u64,
    pub snap_ins: u64,
}

/// The folder of the Python that `make test-deps` installs, with h5py and the other readers.
pub fn python_bin() -> PathBuf {
    let tools = Path::new(ROOT).join(".tools");
    // `make deps` installs a Python too, but none of them: the file is written when all are there
    assert!(tools.join("readers").exists(), "{} has no readers of results: run `make test-deps`", tools.display());
    tools.join("bin")
}

/// Exports the mode shapes of a result and compares them, as pyuff reads them, with what `show` states.
pub fn shapes_read_by_pyuff(folder: &Path, result: &str) -> String {
    let file = afmid(folder, &["export", result, "--shapes", "uff"]);
    std::fs::write(folder.join("modes.json"), shown(folder, result, "modes").to_string()).expect("a summary");
    let script = Path::new(ROOT).join("tests/uff_shapes.py");
    let python = Command::new(python_bin().join("python"))
        .arg(script)
        .arg(file.trim())
        .arg("modes.json")
        .current_dir(folder)
        .output();
    let Output { status, stdout, stderr } = python.expect("python starts");
    assert!(status.success(), "{}", String::from_utf8_lossy(&stderr));
    String::from_utf8_lossy(&stdout).into_owned()
}

/// The search path of programs, with these folders first.
pub fn path_with(first: &[PathBuf]) -> OsString {
    let path = std::env::var_os("PATH").unwrap_or_default();
    std::env::join_paths(first.iter().cloned().chain(std::env::split_paths(&path))).expect("a PATH")
}

/// How often a test draws: `few` in every run of the tests, `all` where the variable `AFMID_ACCURACY` is set
/// (`make accuracy`, before a release).
pub fn few_or_all<T>(few: T, all: T) -> T {
    if std::env::var_os("AFMID_ACCURACY").is_some() { all } else { few }
}

/// The program with arguments, in a folder.
pub fn command(folder: &Path, arguments: &[&str]) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_afmid"));
    command.current_dir(folder).args(arguments);
    command
}

/// Runs the program and insists on exit code 0. Returns what it printed.
pub fn afmid(folder: &Path, arguments: &[&str]) -> String {
    let Output { status, stdout, stderr } = command(folder, arguments).output().expect("afmid starts");
    assert!(status.success(), "afmid {arguments:?}: {status}\n{}", String::from_utf8_lossy(&stderr));
    String::from_utf8_lossy(&stdout).into_owned()
}

/// What it says on stdout and on stderr. Insists on exit code 0.
pub fn said(folder: &Path, arguments: &[&str]) -> [String; 2] {
    let output = command(folder, arguments).output().expect("afmid starts");
    let [stdout, stderr] = [output.stdout, output.stderr].map(|text| String::from_utf8_lossy(&text).into_owned());
    assert!(output.status.success(), "{arguments:?}: {stderr}");
    [stdout, stderr]
}

/// The absolute path of a shipped config.
pub fn config(name: &str) -> String {
    Path::new(ROOT).join("configs").join(name).display().to_string()
}

/// `afmid show RESULT ID --json`.
pub fn shown(folder: &Path, result: &str, id: &str) -> Value {
    serde_json::from_str(&afmid(folder, &["show", result, id, "--json"])).expect("JSON on stdout")
}

/// Words of the paper's lever, in small letters: pages of other measurements have none.
const OF_THE_LEVER: [&str; 10] = [
    "lever",
    "rupture",
    "deflection",
    "static share",
    "one at rest",
    "fig. ",
    "not in this run",
    "piezo",
    "snap",
    "t₀",
];

/// The page of a result that is no lever's, without style, script and config; it must have no word of the lever.
pub fn measured_page(folder: &Path, result: &str) -> String {
    afmid(folder, &["report", result, "-o", "measured.html"]);
    let page = std::fs::read_to_string(folder.join("measured.html")).expect("a page");
    let (_, rest) = page.split_once("</style>").expect("the end of the style");
    let (shown, _) = rest.split_once("<section id=\"config\">").expect("the config");
    let small = shown.to_lowercase();
    for word in OF_THE_LEVER {
        let near = small.split_once(word).map(|(before, _)| before.chars().rev().take(80).collect::<String>());
        let near = near.map(|near| near.chars().rev().collect::<String>());
        assert_eq!(near, None, "{result}: `{word}` on the page, after this");
    }
    shown.to_owned()
}

/// `records.files` set to the HDF5 files of a folder.
pub fn files(folder: &Path) -> String {
    format!("records.files=['{}/*.h5']", folder.display())
}

/// The recorded archive `lever-a`, or a stand-in that afmid's own simulator makes below `scratch`, counted in the
/// output.
pub fn lever_a(scratch: &Path) -> Archive {
    let data = std::env::var_os("AFMID_DATA").map_or_else(|| Path::new(ROOT).join("../shared/data"), PathBuf::from);
    let folder = data.join("afm/lever-a");
    let truth = std::fs::read_to_string(data.join("afm/lever-a.truth.json"));
    if let (true, Ok(truth)) = (folder.is_dir(), truth) {
        let json: Value = serde_json::from_str(&truth).expect("the truth is JSON");
        let events = json["events"].as_array().expect("events per record");
        let count = |kind: f64| {
            events.iter().flat_map(|record| record.as_array()).flatten().filter(|event| event[1] == kind).count()
        };
        let truth = Truth {
            frequency_hz: numbers(&json["truth"]["f"]),
            quality_factor: numbers(&json["truth"]["Q"]),
            contact_stiffness_n_per_m: number(&json, "/truth/k_contact"),
            snap_offs: count(2.0) as u64,
            snap_ins: count(1.0) as u64,
        };
        return Archive { folder, truth, stand_in: false };
    }
    println!("stand-in: 1 archive simulated in place of lever-a");
    Archive { stand_in: true, ..simulated(scratch, "stand-in", 24, 77) }
}

/// An archive of `records` files of 0.9 MS, one snap-off and one snap-in in each.
pub fn simulated(scratch: &Path, name: &str, records: u64, seed: u64) -> Archive {
    let folder = scratch.join(name);
    let set = |parameter: &str, value: &str| ["--set".to_owned(), format!("archive.{parameter}={value}")];
    let mut arguments = vec!["run".to_owned(), config("simulate-demo.toml"), "-o".to_owned(), format!("{name}.h5")];
    arguments.extend(set("out", &format!("'{}'", folder.display())));
    for parameter in ["records", "snap_offs", "snap_ins"] {
        arguments.extend(set(parameter, &records.to_string()));
    }
    arguments.extend(["--set".to_owned(), format!("pipeline.seed={seed}")]);
    arguments.extend(["--cache".to_owned(), "cache".to_owned()]);
    afmid(scratch, &arguments.iter().map(String::as_str).collect::<Vec<&str>>());
    let truth = Truth {
        frequency_hz: vec![46.3e3, 247.4e3, 580.8e3, 1051.2e3],
        quality_factor: vec![40.8, 193.2, 358.0, 503.8],
        contact_stiffness_n_per_m: 60.0,
        snap_offs: records,
        snap_ins: records,
    };
    Archive { folder, truth, stand_in: false }
}

/// A list of numbers.
pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().into_iter().flatten().filter_map(Value::as_f64).collect()
}

/// A number of a document; panics with its path if it is missing or null.
pub fn number(value: &Value, pointer: &str) -> f64 {
    value.pointer(pointer).and_then(Value::as_f64).unwrap_or_else(|| panic!("no number at {pointer} in {value}"))
}
