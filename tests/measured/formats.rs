//! The same archive in other formats gives the same events and modes; `afmid inspect` tells what files hold.

use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use crate::common::{self, ROOT, afmid, command, config, numbers, shown, simulated};
use afmid_pipeline::Record;
use afmid_pipeline::recording::{InputFiles, Wanted, open_native};
use serde_json::Value;

/// Files of the archive: enough for an average on each half.
const RECORDS: u64 = 4;

/// How a native record is written in another format, and the parameters that reading it needs.
struct Written {
    ending: &'static str,
    channel: &'static str,
    piezo: &'static str,
    parameters: &'static [&'static str],
    bytes: fn(&Record) -> Vec<u8>,
}

const WRITERS: [Written; 4] = [
    Written { ending: "tdms", channel: "/AFM/deflection", piezo: "/AFM/piezo", parameters: &[], bytes: tdms },
    Written {
        ending: "npy",
        channel: "/array[0]",
        piezo: "/array[1]",
        parameters: &["sample_rate_hz=5e6", "unit='V'"],
        bytes: npy,
    },
    Written { ending: "csv", channel: "deflection", piezo: "piezo", parameters: &[], bytes: csv },
    Written { ending: "mat", channel: "/deflection", piezo: "/piezo", parameters: &["unit='V'"], bytes: mat },
];

fn values(record: &Record) -> [Vec<f64>; 2] {
    record
        .channels
        .iter()
        .map(|channel| channel.read(0, channel.samples).unwrap())
        .collect::<Vec<_>>()
        .try_into()
        .unwrap()
}

/// One segment of little-endian float64, the rate in `wf_increment`, as LabVIEW writes it.
fn tdms(record: &Record) -> Vec<u8> {
    let text = |text: &str| [&(text.len() as u32).to_le_bytes()[..], text.as_bytes()].concat();
    let property = |name: &str, kind: u32, value: &[u8]| [&text(name)[..], &kind.to_le_bytes(), value].concat();
    let values = values(record);
    let mut metadata = 4_u32.to_le_bytes().to_vec();
    for path in ["/", "/'AFM'"] {
        metadata.extend([&text(path)[..], &u32::MAX.to_le_bytes(), &0_u32.to_le_bytes()].concat());
    }
    for (name, values) in ["deflection", "piezo"].iter().zip(&values) {
        metadata.extend(text(&format!("/'AFM'/'{name}'")));
        // index: length, float64, one dimension, count
        metadata.extend([20_u32, 10, 1].iter().flat_map(|word| word.to_le_bytes()));
        metadata.extend((values.len() as u64).to_le_bytes());
        metadata.extend(2_u32.to_le_bytes());
        metadata.extend(property("wf_increment", 10, &(1.0 / record.sample_rate_hz).to_le_bytes()));
        metadata.extend(property("unit_string", 0x20, &text("V")));
    }
    let raw: Vec<u8> = values.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
    // metadata, raw data, new object list; version 4713
    let mut bytes = [b"TDSm".as_slice(), &0xe_u32.to_le_bytes(), &4713_u32.to_le_bytes()].concat();
    bytes.extend(((metadata.len() + raw.len()) as u64).to_le_bytes());
    bytes.extend((metadata.len() as u64).to_le_bytes());
    [bytes, metadata, raw].concat()
}

/// Two rows, as `numpy.save(np.array([deflection, piezo]))`.
fn npy(record: &Record) -> Vec<u8> {
    let values = values(record);
    let shape = values[0].len();
    let mut header = format!("{{'descr': '<f8', 'fortran_order': False, 'shape': (2, {shape}), }}");
    // the data begin at a multiple of 64 bytes
    while !(10 + header.len() + 1).is_multiple_of(64) {
        header.push(' ');
    }
    header.push('\n');
    let mut bytes = b"\x93NUMPY\x01\x00".to_vec();
    bytes.extend((header.len() as u16).to_le_bytes());
    bytes.extend(header.as_bytes());
    bytes.extend(values.iter().flatten().flat_map(|value| value.to_le_bytes()));
    bytes
}

/// Times to the 10th of a microsecond, which are exact at 5 MS/s; values with all their digits.
fn csv(record: &Record) -> Vec<u8> {
    let [deflection, piezo] = values(record);
    let mut text = "Time (s),deflection (V),piezo (V)\n".to_owned();
    for (sample, (deflection, piezo)) in deflection.iter().zip(&piezo).enumerate() {
        writeln!(text, "{:.7},{deflection},{piezo}", sample as f64 / record.sample_rate_hz).unwrap();
    }
    text.into_bytes()
}

/// MATLAB 4: a header of five words, the name, the numbers; the rate is the variable `fs`.
fn mat(record: &Record) -> Vec<u8> {
    let [deflection, piezo] = values(record);
    let variable = |name: &str, values: &[f64]| {
        let header = [0, values.len() as u32, 1, 0, name.len() as u32 + 1];
        let mut bytes: Vec<u8> = header.iter().flat_map(|word| word.to_le_bytes()).collect();
        bytes.extend([name.as_bytes(), &[0]].concat());
        bytes.extend(values.iter().flat_map(|value| value.to_le_bytes()));
        bytes
    };
    [variable("deflection", &deflection), variable("piezo", &piezo), variable("fs", &[record.sample_rate_hz])].concat()
}

fn native_files(folder: &Path) -> Vec<PathBuf> {
    let mut files: Vec<PathBuf> = std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    files.retain(|file| file.extension().is_some_and(|ending| ending == "h5"));
    files.sort();
    files
}

/// Runs the free lever on a folder and returns events and modes.
fn run(here: &Path, name: &str, set: &[String]) -> (Value, Value) {
    let result = format!("{name}-result.h5");
    let config = config("free-lever.toml");
    let mut arguments = vec!["run", &config, "-o", &result, "--cache", "cache"];
    arguments.extend(set.iter().flat_map(|set| ["--set", set.as_str()]));
    afmid(here, &arguments);
    (shown(here, &result, "events"), shown(here, &result, "modes"))
}

#[test]
fn an_archive_in_another_format_gives_the_same_events_and_modes() {
    let scratch = tempfile::tempdir().unwrap();
    let here = scratch.path();
    let archive = simulated(here, "archive", RECORDS, 5);
    let native = run(here, "native", &[common::files(&archive.folder)]);
    assert_eq!(native.0["events"]["found"], RECORDS, "{}", native.0);
    for writer in &WRITERS {
        let folder = here.join(writer.ending);
        std::fs::create_dir(&folder).unwrap();
        for file in native_files(&archive.folder) {
            let wanted = ["deflection", "piezo"].map(|role| Wanted { role, location: role, required: true });
            let record = open_native(&InputFiles::new(), &file, &wanted).unwrap();
            let name = file.with_extension(writer.ending);
            std::fs::write(folder.join(name.file_name().unwrap()), (writer.bytes)(&record)).unwrap();
        }
        let mut set = vec![
            format!("records.files=['{}']", folder.display()),
            format!("records.channel='{}'", writer.channel),
            format!("records.piezo_channel='{}'", writer.piezo),
        ];
        set.extend(writer.parameters.iter().map(|parameter| format!("records.{parameter}")));
        let other = run(here, writer.ending, &set);
        assert_eq!(other.0["events"]["found"], native.0["events"]["found"], "{}", writer.ending);
        same_modes(writer.ending, &native.1, &other.1);
        // large files of text and doubles are not kept for the next format
        std::fs::remove_dir_all(folder).unwrap();
    }
}

/// Frequencies and quality factors agree far within their errors: codes and doubles round differently in the last bits
/// alone, and the fit ends where its steps are below 1e-9 or so of a standard error.
fn same_modes(name: &str, native: &Value, other: &Value) {
    let modes = |value: &Value| value["modes"].as_array().unwrap().clone();
    let (native, other) = (modes(native), modes(other));
    assert_eq!(native.len(), other.len(), "{name}");
    assert!(!native.is_empty());
    for (a, b) in native.iter().zip(&other) {
        for key in ["frequency_hz", "quality_factor"] {
            let (a, b) =
                (numbers(&Value::from(vec![a[key].clone()]))[0], numbers(&Value::from(vec![b[key].clone()]))[0]);
            assert!((a / b - 1.0).abs() < 1e-6, "{name}: {key} {a} and {b}");
        }
    }
}

fn inspected(here: &Path, arguments: &[&str]) -> (Option<i32>, String, String) {
    let output = command(here, &[&["inspect"], arguments].concat()).output().expect("afmid starts");
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code(), text(&output.stdout), text(&output.stderr))
}

#[test]
fn inspect_tells_all_files_and_then_fails_if_one_could_not_be_read() {
    let scratch = tempfile::tempdir().unwrap();
    let here = scratch.path();
    // a ring of 50 kHz from sample 1000 on
    let ring = |k: usize| {
        let t = k as f64 - 1000.0;
        if t < 0.0 { 0.0 } else { (-t / 300.0).exp() * (t * 0.0628).sin() }
    };
    let row = |k: usize| format!("{:.7},{:.4},{}\n", k as f64 / 5e6, ring(k) + (k * 7919 % 64) as f64 * 1e-4, k);
    let text: String = (0..3000).map(row).collect();
    std::fs::write(here.join("fast.csv"), format!("Time (s),Deflection (V),n\n{text}")).unwrap();
    std::fs::write(here.join("noise.bin"), [7_u8; 64]).unwrap();
    let (code, out, err) = inspected(here, &["fast.csv", "noise.bin", "nowhere.tdms"]);
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("2 of 3 files could not be read"), "{err}");
    for words in
        ["Deflection  ", "ringdown: yes; Deflection: ", "uses = \"io.records\"", "noise.bin", "refused", "nowhere.tdms"]
    {
        assert!(out.contains(words), "{words:?} is not in\n{out}");
    }
    // the stage that it shows is one that runs
    let (code, out, _) = inspected(here, &["fast.csv", "--json"]);
    assert_eq!(code, Some(0));
    let json: Value = serde_json::from_str(&out).unwrap();
    let file = &json["files"][0];
    assert_eq!(file["ringdown"]["verdict"], "yes");
    assert_eq!((&file["channels"][0]["samples"], &file["channels"][0]["sample_rate_hz"]), (&3000.into(), &5e6.into()));
    assert_eq!((&file["channels"][0]["unit"], &file["channels"][1]["unit"]), (&"V".into(), &Value::Null));
    assert_eq!((&file["error"], &file["started_at"]), (&Value::Null, &Value::Null));
    let stage = file["stage"].as_str().unwrap();
    std::fs::write(here.join("one.toml"), format!("[pipeline]\nname = \"one\"\nseed = 1\n\n{stage}")).unwrap();
    afmid(here, &["run", "one.toml", "--cache", "cache"]);
    assert_eq!(shown(here, "one.h5", "records")["samples"], 3000);
}

#[test]
fn inspect_of_a_folder_is_a_line_for_those_alike_and_their_reason_once() {
    let scratch = tempfile::tempdir().unwrap();
    let here = scratch.path();
    std::fs::create_dir(here.join("many")).unwrap();
    for name in ["r10.csv", "r9.csv"] {
        std::fs::write(here.join("many").join(name), "Time (s),a (V)\n0.0,1\n0.1,2\n0.2,3\n").unwrap();
    }
    let (code, out, err) = inspected(here, &["many"]);
    assert_eq!(code, Some(0), "{err}");
    let lines: Vec<&str> = out.lines().collect();
    assert_eq!(lines.len(), 5, "{out}");
    assert!(lines[2].starts_with("r9.csv ... r10.csv (2 files)"), "{out}");
    assert!(lines[4].starts_with("r9.csv and 1 more: 3 samples"), "{out}");
    let data = std::env::var_os("AFMID_DATA").map_or_else(|| Path::new(ROOT).join("../shared/data"), PathBuf::from);
    let native = data.join("afm/lever-a/record_0000.h5");
    if native.is_file() {
        let (code, out, _) = inspected(here, &[&native.to_string_lossy(), "--json"]);
        let json: Value = serde_json::from_str(&out).unwrap();
        assert_eq!((code, &json["files"][0]["ringdown"]["channel"]), (Some(0), &"/deflection".into()), "{out}");
    } else {
        println!("stand-in: 1 recorded file not inspected, {} is missing", native.display());
    }
}
