//! Nothing that a file says reaches a terminal or a table raw.

use std::path::Path;
use std::process::Output;

use afmid_pipeline::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};
use afmid_pipeline::store::write_result;
use afmid_pipeline::{Array, Axis, Document, Ports, RunInfo, RunResult, Shaped, StageRecord, StageResult, Table};
use serde_json::json;

use super::leftovers::Place;

/// Renames the window, erases the screen, turns text round, ends the paragraph, has no width.
const EVIL: &str =
    "\u{1b}]0;x\u{7}\u{9b}2J\u{202e}\u{2066}\u{61c}\u{200f}\u{2028}\u{7f}\u{8}\u{200b}\u{2060}\u{feff}\u{ad}";

/// Whether text holds something that acts on a terminal; written a second time here, byte by byte.
fn acting(bytes: &[u8]) -> Option<usize> {
    let at = |k: usize| bytes.get(k).copied().unwrap_or(0);
    (0..bytes.len()).find(|&k| match at(k) {
        b'\n' | b'\t' => false,
        0..=0x1f | 0x7f => true,
        // U+0080 to U+009F, U+00AD
        0xc2 => matches!(at(k + 1), 0x80..=0x9f | 0xad),
        // U+061C
        0xd8 => at(k + 1) == 0x9c,
        // U+200B to U+200F, U+2028 to U+202E; U+2060 to U+206F
        0xe2 => match at(k + 1) {
            0x80 => matches!(at(k + 2), 0x8b..=0x8f | 0xa8..=0xae),
            0x81 => matches!(at(k + 2), 0xa0..=0xaf),
            _ => false,
        },
        // U+FEFF
        0xef => (at(k + 1), at(k + 2)) == (0xbb, 0xbf),
        // no UTF-8 at all
        0x80..=0xc1 | 0xf5.. => k == 0 || at(k - 1) < 0x80,
        _ => false,
    })
}

#[track_caller]
fn assert_harmless(what: &str, bytes: &[u8]) {
    if let Some(at) = acting(bytes) {
        let near = String::from_utf8_lossy(&bytes[at.saturating_sub(80)..bytes.len().min(at + 40)]).into_owned();
        panic!("{what}: byte {at} is {:#x} in {near:?}", bytes[at]);
    }
}

/// Runs the program; what it prints is harmless and shows `wanted` as an escape, if anything is wanted.
#[track_caller]
fn harmless(place: &Place, arguments: &[&str], wanted: &str) -> Output {
    let output = place.command(arguments).output().expect("afmid starts");
    for (name, bytes) in [("stdout", &output.stdout), ("stderr", &output.stderr)] {
        assert_harmless(&format!("{name} of {arguments:?}"), bytes);
    }
    let all = String::from_utf8_lossy(&[&output.stdout[..], &output.stderr].concat()).into_owned();
    assert!(all.contains(wanted), "{arguments:?} does not show what the file says: {all}");
    output
}

fn record(path: &Path) {
    let channel = NativeChannel {
        location: format!("deflection{EVIL}"),
        codes: Codes::Int16((0..3000i16).map(|k| k.wrapping_mul(7919) % 1000).collect()),
        unit: format!("V{EVIL}"),
        scale_factor: 1e-3,
        add_offset: 0.0,
        long_name: format!("long{EVIL}"),
    };
    let record =
        NativeRecord { sample_rate_hz: 5e6, started_at: "2005-03-01T10:00:00Z".to_owned(), channels: vec![channel] };
    write_native(path, &record, RecordStorage::Raw).expect("a record");
}

/// TOML's and JSON's escapes of the same.
fn escaped(text: &str) -> String {
    let one = |c: char| if c.is_ascii_graphic() { c.to_string() } else { format!("\\u{:04X}", u32::from(c)) };
    text.chars().map(one).collect()
}

fn census(files: &str) -> String {
    let evil = escaped(EVIL);
    format!(
        "[pipeline]\nname = \"census{evil}\"\n\n[[stage]]\nid = \"records\"\nuses = \"io.records\"\n\
         params = {{ files = [\"{files}\"], channel = \"deflection{evil}\" }}\n\n\
         [[stage]]\nid = \"census\"\nuses = \"io.census\"\ninputs = {{ records = \"records\" }}\n"
    )
}

/// A line's end in a name adds no line of its own to a table or a list.
#[test]
fn a_name_of_two_lines_stays_one() {
    let place = Place::new();
    std::fs::create_dir(place.path("set")).expect("a folder");
    let name = "r\nFAKE  ringdown: yes.h5";
    record(&place.path("set").join(name));
    let text = "time,a\rFAKE (V)\n0,1\n1e-6,2\n2e-6,3\n";
    std::fs::write(place.path("set").join("t\nFAKE.csv"), text).expect("a table");
    let config = census(&escaped("set/r*.h5"));
    std::fs::write(place.path("c.toml"), config).expect("a config");
    let record = format!("set/{name}");
    for arguments in [
        &["run", "c.toml", "-o", "out.h5"][..],
        &["check", "c.toml"],
        &["inspect", "set"],
        &["inspect", &record],
        &["show", "out.h5"],
        &["show", "out.h5", "records"],
        &["trace", "out.h5", "census.records"],
        &["rerun", "out.h5"],
    ] {
        let output = place.command(arguments).output().expect("afmid starts");
        let [shown, said] = [output.stdout, output.stderr].map(|bytes| String::from_utf8_lossy(&bytes).into_owned());
        assert!(output.status.success() && !shown.is_empty(), "{arguments:?}: {shown}{said}");
        let forged = |text: &str| text.lines().any(|line| line.trim_start().starts_with("FAKE"));
        assert!(!forged(&shown) && !forged(&said), "{arguments:?}: {shown}{said}");
    }
    // what cannot be done is said in one line, too
    std::fs::write(place.path(&record), "no record").expect("another file");
    let odd = "nowhere\nFAKE.toml";
    std::fs::write(place.path("two\nFAKE.toml"), "[pipeline]\n").expect("a config");
    for arguments in [
        &["run", "c.toml", "-o", "out.h5"][..],
        &["trace", "out.h5", "census.records"],
        &["rerun", "out.h5"],
        &["check", odd],
        &["check", "two\nFAKE.toml"],
        &["show", odd],
        &["batch", "c.toml", "-o", "out", odd],
        &["run", "c.toml", "-o", "no\nFAKE/x.h5"],
    ] {
        let output = place.command(arguments).output().expect("afmid starts");
        let all = String::from_utf8_lossy(&[output.stdout, output.stderr].concat()).into_owned();
        let forged = all.lines().any(|line| line.trim_start().starts_with("FAKE"));
        assert!(!all.is_empty() && !forged, "{arguments:?}: {all}");
    }
}

#[test]
fn names_units_and_paths_of_recordings_are_shown_and_not_obeyed() {
    let place = Place::new();
    let (name, folder) = (format!("record{EVIL}.h5"), format!("set{EVIL}"));
    std::fs::create_dir(place.path(&folder)).expect("a folder");
    record(&place.path(&folder).join(&name));
    std::fs::write(
        place.path(&folder).join(format!("text{EVIL}.csv")),
        format!("time{EVIL},a{EVIL} (V)\n0,1\n1e-6,2\n2e-6,3\n"),
    )
    .expect("a table");
    std::fs::write(place.path(&folder).join(format!("odd{EVIL}.bin")), [7; 100]).expect("a file");
    let file = format!("{folder}/{name}");
    let shown = "\\x1b]0;x\\x07\\u{9b}2J\\u{202e}\\u{2066}\\u{61c}\\u{200f}\\u{2028}\\x7f\\x08";
    harmless(&place, &["inspect", &file], shown);
    harmless(&place, &["inspect", &folder], shown);
    let json = harmless(&place, &["inspect", &folder, "--json"], "\\u202e");
    assert!(String::from_utf8_lossy(&json.stdout).contains("\\u009b"));
    let value: serde_json::Value = serde_json::from_slice(&json.stdout).expect("JSON");
    assert!(value.to_string().contains('\u{202e}'), "JSON says what the file says");
    harmless(&place, &["new", "pipeline", &folder, "-o", &format!("new{EVIL}.toml")], "");

    let config = format!("census{EVIL}.toml");
    std::fs::write(place.path(&config), census(&escaped(&format!("{folder}/rec*.h5")))).expect("a config");
    harmless(&place, &["check", &config], shown);
    harmless(&place, &["check", &config, "--json"], "\\u202e");
    for format in ["text", "mermaid", "dot", "json"] {
        harmless(&place, &["graph", &config, "--format", format], "");
    }
    harmless(&place, &["explain", &config], "");
    let output = format!("out{EVIL}.h5");
    let run = harmless(&place, &["run", &config, "-o", &output], shown);
    assert!(run.status.success(), "{}", String::from_utf8_lossy(&run.stderr));
    harmless(&place, &["run", &config, "-o", &output, "--json"], "\\u202e");
    for arguments in [&["show", &output][..], &["show", &output, "records"], &["show", &output, "census"]] {
        harmless(&place, arguments, shown);
        // numbers alone are in the census's
        let named = if arguments.contains(&"census") { "" } else { "\\u202e" };
        harmless(&place, &[arguments, &["--json"]].concat(), named);
    }
    harmless(&place, &["trace", &output, "census.records"], "");
    harmless(&place, &["diff", &output, &output], "");
    harmless(&place, &["rerun", &output], shown);
    harmless(&place, &["export", &output, "--model", "json"], shown);
    harmless(&place, &["export-crate", &output], "");
    harmless(&place, &["report", &output, "-o", "page.html", "--figures", "figures"], "");
    assert_page(&place);
    harmless(&place, &["gc", "--cache", &format!("ca{EVIL}")], shown);
    harmless(&place, &["doctor", "--cache", &format!("ca{EVIL}")], shown);

    // what goes wrong
    let other = format!("{}\n[[stage]]\nid = \"x\"\nuses = \"no{}\"\n", census("none"), escaped(EVIL));
    std::fs::write(place.path(&config), other).expect("a config");
    harmless(&place, &["check", &config], shown);
    std::fs::write(place.path(&config), format!("[pipeline]\nname = \"a\"\n# {EVIL}\nx = 1\r\ny = '{EVIL}\n"))
        .expect("a config");
    harmless(&place, &["check", &config], "");
    harmless(&place, &["check", &config, "--json"], "");
    std::fs::write(place.path(&config), census(&escaped(&format!("nowhere{EVIL}/*.h5")))).expect("a config");
    harmless(&place, &["run", &config, "-o", &output], shown);
    harmless(&place, &["run", &config, "-o", &output, "--set", &format!("census.{EVIL}=1")], shown);
    for arguments in [
        &["show", EVIL][..],
        &["show", &output, EVIL],
        &["trace", &output, EVIL],
        &["report", &file],
        &["run", EVIL],
        &["stages", EVIL],
        &["causes", EVIL],
        &["inspect", EVIL],
        &["batch", &config, EVIL],
        &["run", &config, "-o", &format!("no{EVIL}/x.h5")],
    ] {
        harmless(&place, arguments, "\\x1b]0;x\\x07");
    }
    // what the command line's own parser leaves of it
    harmless(&place, &[EVIL], "\\u{202e}");
    harmless(&place, &["run", EVIL, "--no", EVIL], "");
}

#[test]
fn a_plugin_cannot_speak_to_the_terminal() {
    let place = Place::new();
    let script = format!("printf '%s' '{EVIL}' >&2; printf '%s\\n' '{EVIL}'; sleep 0.2");
    let output = harmless(&place, &["plugin", "check", "--", "sh", "-c", &script], "\\x1b]0;x\\x07");
    assert_eq!(output.status.code(), Some(1));
}

fn assert_page(place: &Place) {
    let page = std::fs::read(place.path("page.html")).expect("a page");
    assert_harmless("the page", &page);
    for entry in std::fs::read_dir(place.path("figures")).expect("figures").flatten() {
        assert_harmless(&entry.path().display().to_string(), &std::fs::read(entry.path()).expect("a figure"));
    }
}

#[test]
fn pages_and_figures_show_what_a_stranger_s_result_says() {
    let place = Place::new();
    let evil = |text: &str| format!("{text}{EVIL}");
    let mut outputs = Ports::new();
    let values: Vec<f64> = (0..100).map(|k| f64::from(k).sin()).collect();
    let axis = Axis::new("time", &evil("s"), &evil("time"), (0..100).map(f64::from).collect());
    let array = Array::over(vec![axis]).with("wave", &evil("V"), &evil("a wave"), &["time"], values);
    outputs.insert("wave", array.wrap());
    outputs.insert("table", Table::new().with("cell", &evil("m"), &evil("about"), vec![evil("x"), evil("y")]).wrap());
    outputs.insert("summary", Document(json!({ "note": evil("z"), "started_at": evil("s") })).wrap());
    let stage = StageRecord {
        id: "strange".to_owned(),
        uses: evil("test.strange"),
        version: 1,
        params: json!({ "text": evil("p") }),
        wires: Vec::new(),
        seed: None,
        key: "k".repeat(64),
        sources: Vec::new(),
        result: StageResult { outputs, warnings: vec![evil("careful")] },
    };
    let run = RunResult {
        name: evil("strange"),
        seed: 0,
        config: format!("[pipeline]\r\nname = \"x\" # {EVIL}\r\n"),
        overrides: vec![evil("a.b=")],
        program: evil("afmid"),
        stages: vec![stage],
        info: RunInfo { host: evil("host"), started_at: evil("now"), ..RunInfo::default() },
    };
    write_result(&place.path("strange.h5"), &run).expect("a result");
    harmless(&place, &["report", "strange.h5", "-o", "page.html", "--figures", "figures"], "");
    assert_page(&place);
    let page = std::fs::read_to_string(place.path("page.html")).expect("a page");
    for shown in ["careful\\x1b", "strange\\x1b", "V\\x1b", "x\\x1b"] {
        assert!(page.contains(shown), "the page does not show {shown}");
    }
    harmless(&place, &["show", "strange.h5"], "\\x1b]0;x");
    harmless(&place, &["show", "strange.h5", "strange"], "\\x1b]0;x");
    harmless(&place, &["show", "strange.h5", "strange", "--json"], "\\u001b]0;x");
}

/// What `trust` lists is what somebody agrees to: two commands that look alike must not be two.
#[test]
fn consent_is_asked_for_what_is_seen() {
    let place = Place::new();
    let hidden = "a\u{202e}b\u{200b}c\u{2060}\u{feff}\u{ad}";
    let config = format!(
        "[pipeline]\nname = \"a\"\n\n[plugins]\n\
         one = {{ command = [\"sh\", \"-c\", \"exit 1\", \"{0}\"], environment = {{ X = \"{0}\" }} }}\n\n\
         [[stage]]\nid = \"x\"\nuses = \"exec:one\"\n",
        escaped(hidden)
    );
    let folder = format!("set{hidden}");
    std::fs::create_dir(place.path(&folder)).expect("a folder");
    std::fs::write(place.path(&folder).join("c.toml"), config).expect("a config");
    let file = format!("{folder}/c.toml");
    // as the bytes that bash reads
    let shown = "a\\xe2\\x80\\xaeb\\xe2\\x80\\x8bc";
    for arguments in [&["trust", &file][..], &["run", &file, "-o", "x.h5"]] {
        let mut command = place.command(arguments);
        let output = command.env("AFMID_TRUST", place.path("trust")).output().expect("afmid starts");
        let all = [output.stdout, output.stderr].concat();
        assert_harmless(&format!("{arguments:?}"), &all);
        let all = String::from_utf8_lossy(&all).into_owned();
        assert!(all.contains(if arguments[0] == "trust" { shown } else { "\\u{202e}" }), "{arguments:?}: {all}");
    }
    harmless(&place, &["trust", &file, "--json"], "\\u202e");
}

#[test]
fn tables_of_a_batch_show_names_and_do_not_obey_them() {
    let place = Place::new();
    let name = "l\u{202e}ever\u{200b}";
    std::fs::write(place.path("census.toml"), super::common::sets::CENSUS).expect("a config");
    super::common::sets::write_set(&place.path("sets").join(name), 1, 3000);
    let set = format!("sets/{name}");
    harmless(&place, &["batch", "census.toml", "-o", "out", &set], "\\u{202e}");
    for table in ["summary.csv", "trends.csv"] {
        assert_harmless(table, &std::fs::read(place.path("out").join(table)).expect("a table"));
    }
    let table = std::fs::read_to_string(place.path("out/summary.csv")).expect("a table");
    assert!(table.contains("l\\u{202e}ever\\u{200b},"), "{table}");
}

#[test]
fn a_spreadsheet_finds_no_formula_in_a_batch_s_table() {
    let place = Place::new();
    std::fs::write(place.path("census.toml"), super::common::sets::CENSUS).expect("a config");
    for (name, samples) in [("=1+1", 3000), ("+x", 3000), ("-2", 3000), ("@y", 3000)] {
        super::common::sets::write_set(&place.path("sets").join(name), 1, samples);
    }
    let sets = ["=1+1", "+x", "-2", "@y"].map(|name| format!("sets/{name}"));
    let sets: Vec<&str> = sets.iter().map(String::as_str).collect();
    let output =
        place.command(&[&["batch", "census.toml", "-o", "out"][..], &sets].concat()).output().expect("afmid starts");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let table = std::fs::read_to_string(place.path("out/summary.csv")).expect("a table");
    let first: Vec<&str> = table.lines().skip(1).filter_map(|line| line.split(',').next()).collect();
    assert_eq!(first, ["'+x", "-2", "'=1+1", "'@y"], "{table}");
}
