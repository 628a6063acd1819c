//! The ways in which bytes of others enter, as functions of bytes: what the fuzz targets call and `corpus.rs` replays
//! (`fuzz/Cargo.toml` has this file as its library). Each returns whatever the bytes are; it panics where a promise is
//! broken.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::LazyLock;

use afmid::doors;
use afmid_pipeline::outcome::PortSpec;
use afmid_pipeline::recording::{
    Contents, How, Parts, RawBinary, Reading, Source, Wanted, formats, open_contents, open_native, open_records,
    read_responses,
};
use afmid_pipeline::store::StageIdentity;
use afmid_pipeline::{InputFiles, Registry, Shape, plugin};

/// A way in.
struct Entrance {
    /// Its name: that of the fuzz target and of its folder in `fuzz/corpus`.
    name: &'static str,
    enter: fn(&[u8]),
}

/// Those beside the readers of single formats.
const OTHERS: &[Entrance] = &[
    Entrance { name: "responses", enter: responses },
    Entrance { name: "raw_binary", enter: raw_binary },
    Entrance { name: "native_record", enter: native_record },
    Entrance { name: "foreign_hdf5", enter: foreign_hdf5 },
    Entrance { name: "inspect", enter: inspect },
    Entrance { name: "stage_file", enter: stage_file },
    Entrance { name: "result_file", enter: result_file },
    Entrance { name: "config", enter: config },
    Entrance { name: "set_argument", enter: set_argument },
    Entrance { name: "plugin_lines", enter: plugin_lines },
];

/// The names of all entrances: the formats, whose readers are asked whatever the first bytes say, and the others.
pub fn entrances() -> Vec<&'static str> {
    formats().iter().map(|known| known.row.name).chain(OTHERS.iter().map(|entrance| entrance.name)).collect()
}

/// Takes bytes in by the entrance `name`.
///
/// # Panics
/// There is no such entrance; a promise is broken.
pub fn enter(name: &str, bytes: &[u8]) {
    match OTHERS.iter().find(|entrance| entrance.name == name) {
        Some(entrance) => (entrance.enter)(bytes),
        None => reader(name, bytes),
    }
}

/// Samples read of one file: more is the same code again.
const MOST_SAMPLES: usize = 1 << 20;

/// Channels read of one file.
const MOST_CHANNELS: usize = 64;

/// The folder of this process.
static FOLDER: LazyLock<PathBuf> = LazyLock::new(|| {
    let folder = std::env::temp_dir().join(format!("afmid-entrances-{}", std::process::id()));
    fs::create_dir_all(&folder).expect("a temporary folder");
    folder
});

/// Removes what this process left in the temporary folder.
pub fn tidy() {
    // a folder that is not there is as good
    let _ = fs::remove_dir_all(&*FOLDER);
}

/// A file with these bytes. Removed first: what was known of the last one does not hold for this one.
fn file(name: &str, bytes: &[u8]) -> PathBuf {
    let thread = format!("{:?}", std::thread::current().id());
    let number: String = thread.chars().filter(char::is_ascii_digit).collect();
    let path = FOLDER.join(format!("{number}-{name}"));
    // the first file has none before it
    let _ = fs::remove_file(&path);
    fs::write(&path, bytes).expect("the temporary folder takes a file");
    path
}

/// One format's reader, whatever the first bytes say.
fn reader(format: &str, bytes: &[u8]) {
    let known = formats().iter().find(|known| known.row.name == format).expect("an entrance of this name");
    let path = file(&format!("input.{format}"), bytes);
    let head = &bytes[..bytes.len().min(4096)];
    let recognised = known.recognises(head, &path);
    if let Some(contents) = opened(known.open(&path)) {
        assert!(recognised || !contents.format.is_empty(), "{format}: a format without a name");
        read_all(&contents);
    }
}

/// Frequency responses of whatever the bytes are, packed or not: as many values as frequencies.
fn responses(bytes: &[u8]) {
    let head = &bytes[..bytes.len().min(4096)];
    let names = ["input.txt.gz", "input.uff", "input.mat", "input.csv"];
    let knows = |name: &&&str| formats().iter().any(|known| known.recognises(head, Path::new(name)));
    let packed = bytes.starts_with(b"\x1f\x8b");
    let name = names.iter().find(knows).filter(|_| !packed).unwrap_or(&names[0]);
    for parts in [None, Some(Parts::RealImaginary)] {
        match read_responses(&InputFiles::new(), &file(name, bytes), &Reading::of("auto", None), parts) {
            Ok(found) => found.iter().for_each(|response| {
                assert!(response.frequency_hz.is_sorted(), "frequencies that do not ascend");
                assert_eq!(response.values.len(), response.frequency_hz.len(), "other values than frequencies");
            }),
            Err(error) => assert!(!error.to_string().is_empty(), "refused without a reason"),
        }
    }
}

/// Samples that nobody describes; the first bytes are the description.
fn raw_binary(bytes: &[u8]) {
    let (head, data) = bytes.split_at(bytes.len().min(8));
    let digit = |at: usize| head.get(at).copied().unwrap_or_default();
    let types = ["int8", "uint8", "int16", "uint16", "int32", "uint32", "float32", "float64"];
    let described = serde_json::json!({
        "sample": types[usize::from(digit(0)) % types.len()],
        "big_endian": digit(1) % 2 == 1,
        "header_bytes": u64::from(digit(2)) << (digit(3) % 57),
        "channels": usize::from(digit(4)) * usize::from(digit(5)),
        "interleaved": digit(6) % 2 == 1,
    });
    let raw: RawBinary = serde_json::from_value(described).expect("a description");
    if let Some(contents) = opened(raw.open(&file("input.bin", data))) {
        read_all(&contents);
    }
}

/// A native record: its channels by name, as `io.records` asks for them.
fn native_record(bytes: &[u8]) {
    let path = file("record.h5", bytes);
    let wanted = [
        Wanted { role: "deflection", location: "/deflection", required: true },
        Wanted { role: "piezo", location: "/piezo", required: false },
    ];
    let files = InputFiles::new();
    if let Ok(record) = open_native(&files, &path, &wanted) {
        for channel in &record.channels {
            read(channel.source.as_ref(), channel.samples);
        }
    }
    let how = How { reading: Reading::default(), sample_rate_hz: Some(1e6), unit: Some("V".to_owned()) };
    for record in open_records(&files, &path, &wanted, &how).map(|opened| opened.records).unwrap_or_default() {
        for channel in &record.channels {
            read(channel.source.as_ref(), channel.samples);
        }
    }
}

/// An HDF5 file of another program.
fn foreign_hdf5(bytes: &[u8]) {
    let path = file("foreign.h5", bytes);
    if let Ok((_, contents)) = open_contents(&InputFiles::new(), &path, &Reading::of("hdf5", None)) {
        read_all(&contents);
    }
}

/// Any file that `afmid inspect` is given. The name goes with the bytes where a format looks at it.
fn inspect(bytes: &[u8]) {
    let head = &bytes[..bytes.len().min(4096)];
    let names =
        ["input", "input.npz", "input.jpk-force", "input.000", "input.uff", "input.mat", "input.ibw", "input.csv"];
    let knows = |name: &&&str| formats().iter().any(|known| known.recognises(head, Path::new(name)));
    let name = names.iter().find(knows).unwrap_or(&names[0]);
    assert!(!doors::say_of_recording(&file(name, bytes)).is_empty(), "inspect says nothing");
}

/// The stage that the corpus's stage files are of.
pub const IDENTITY: StageIdentity = StageIdentity {
    key: "c0ffee",
    stage: "corpus.stage",
    version: 1,
    outputs: &[
        port("array", Shape::Array),
        port("table", Shape::Table),
        port("model", Shape::StateSpace),
        port("document", Shape::Document),
        port("recording", Shape::Recording),
    ],
};

const fn port(name: &'static str, shape: Shape) -> PortSpec {
    PortSpec { name, shape, tag: "", optional: true, doc: "" }
}

/// A stage file that was changed and sealed again: the seal is no defence against a writer who knows how it is made.
fn stage_file(bytes: &[u8]) {
    let path = file("stage.h5", &sealed(bytes));
    let _ = doors::say_of_stage(&path, &IDENTITY);
}

/// A result file that was changed and sealed again; its `diff` is with a whole one.
fn result_file(bytes: &[u8]) {
    static WHOLE: &[u8] = include_bytes!("../../fuzz/corpus/result_file/whole.h5");
    let whole = file("whole.h5", &sealed(WHOLE));
    let path = file("result.h5", &sealed(bytes));
    let _ = doors::say_of_result(&path, &whole);
}

/// Bytes with the seal that fits them, in place of one that may be there.
fn sealed(bytes: &[u8]) -> Vec<u8> {
    const MAGIC: &[u8] = b"\nafmid seal, BLAKE3 of all bytes before this line: ";
    let before = bytes.len().saturating_sub(MAGIC.len() + 64 + 1);
    let end = if bytes[before..].starts_with(MAGIC) { before } else { bytes.len() };
    let body = &bytes[..end];
    [body, MAGIC, blake3::hash(body).to_hex().as_bytes(), b"\n"].concat()
}

/// The built-in stages.
static STAGES: LazyLock<Registry> =
    LazyLock::new(|| afmid::registry().expect("the built-in stages have names of their own"));

/// A config, as `check` and `graph` read it. Starts no process.
fn config(bytes: &[u8]) {
    // a file that is no text is refused before
    if let Ok(text) = std::str::from_utf8(bytes) {
        doors::say_of_config(text, &[], &STAGES);
    }
}

/// Arguments of `--set`, a line each, on a small config.
fn set_argument(bytes: &[u8]) {
    const CONFIG: &str = r#"
[pipeline]
name = "small"

[[stage]]
id = "records"
uses = "io.records"
params = { files = ["*.h5"], channel = "/deflection" }

[[stage]]
id = "events"
uses = "events.correlation"
inputs = { records = "records" }

[sweep]
events.window_samples = [4096, 8192]
"#;
    if let Ok(text) = std::str::from_utf8(bytes) {
        let set: Vec<String> = text.split('\n').take(16).map(str::to_owned).collect();
        doors::say_of_config(CONFIG, &set, &STAGES);
    }
}

/// What a plugin writes to its stdout: handshake, description, an answer. Its output file is not there.
fn plugin_lines(bytes: &[u8]) {
    let folder: &Path = &FOLDER;
    match plugin::hear(bytes, &folder.join("no-output.h5")) {
        Ok((outputs, _)) => outputs.iter().for_each(|(name, artifact)| {
            assert!(artifact.validate().is_ok(), "{name}: accepted although it does not fit together");
        }),
        Err(why) => assert!(!why.is_empty(), "refused without a reason"),
    }
}

/// What was opened. An error says why.
fn opened<E: std::fmt::Display>(outcome: Result<Contents, E>) -> Option<Contents> {
    match outcome {
        Ok(contents) => Some(contents),
        Err(error) => {
            assert!(!error.to_string().is_empty(), "refused without a reason");
            None
        }
    }
}

/// Reads what a file holds, and sees that it holds what it lists.
fn read_all(contents: &Contents) {
    let mut left = MOST_SAMPLES;
    for channel in contents.channels.iter().take(MOST_CHANNELS) {
        let gaps = &channel.gaps;
        assert!(gaps.is_sorted() && gaps.last().is_none_or(|&gap| gap < channel.samples), "gaps beyond the samples");
        read(channel.source.as_ref(), channel.samples.min(left));
        left = left.saturating_sub(channel.samples);
        // the end, and what lies beyond it
        let _ = channel.source.read(channel.samples.saturating_sub(1), 1);
        assert!(channel.source.read(channel.samples, 1).is_err(), "a sample behind the last one");
        assert!(channel.source.read(usize::MAX, 2).is_err(), "a sample behind all numbers");
    }
}

/// Reads samples from the first on: as many as were asked for, the same again from the middle.
fn read(source: &dyn Source, samples: usize) {
    let samples = samples.min(MOST_SAMPLES);
    let Ok(whole) = source.read(0, samples) else { return };
    let values = whole.widened();
    assert_eq!(values.len(), samples, "other samples than were asked for");
    if let Ok(half) = source.read(samples / 2, samples - samples / 2) {
        let same = half
            .widened()
            .iter()
            .map(|value| value.to_bits())
            .eq(values[samples / 2..].iter().map(|value| value.to_bits()));
        assert!(same, "other values from the middle on");
    }
}
