//! Round trips, damage, comparison, other readers.

use std::fmt::Debug;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;

use num_complex::Complex64;

use super::fixture::{identity, run_result, stage_result};
use super::*;
use crate::artifact::{Array, Artifact, Axis, Document, Shape, Table};
use crate::files::fixture::Folder;
use crate::outcome::{PortSpec, Ports, RunInfo, StageResult};
use crate::recording::InputFiles;

/// NaN-proof equality: the debug text tells every bit but a NaN's, which no stage uses.
fn same(a: &impl Debug, b: &impl Debug) {
    let (a, b) = (format!("{a:?}"), format!("{b:?}"));
    let differ = a.bytes().zip(b.bytes()).position(|(x, y)| x != y);
    let at = |text: &str| text.chars().skip(differ.unwrap_or(0).saturating_sub(60)).take(120).collect::<String>();
    assert!(a == b, "\n{}\n{}", at(&a), at(&b));
}

#[test]
fn all_shapes_survive_a_stage_file() {
    let folder = Folder::new("stage");
    let path = folder.file("a.h5");
    let result = stage_result();
    write_stage(&path, &identity("k"), &result).unwrap();
    same(&read_stage(&path, &identity("k"), &InputFiles::new()).unwrap(), &result);
}

#[test]
fn all_shapes_survive_a_result_file() {
    let folder = Folder::new("result");
    let path = folder.file("a.h5");
    let run = run_result();
    write_result(&path, &run).unwrap();
    same(&read_result(&path).unwrap(), &run);
}

/// A linear congruential generator: random enough to vary sizes and bits.
struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        self.0 ^ (self.0 >> 29)
    }

    fn below(&mut self, limit: usize) -> usize {
        (self.next() >> 33) as usize % limit
    }

    /// Any bit pattern but signalling NaNs, whose bits processors may change.
    fn number(&mut self) -> f64 {
        let value = f64::from_bits(self.next());
        if value.is_nan() { f64::NAN } else { value }
    }

    fn text(&mut self) -> String {
        let alphabet = ['a', 'Z', '0', ' ', '\n', '"', '\\', 'ü', '漢', '🙂', '\u{7f}', '/'];
        let length = [0, 1, 5, 300][self.below(4)];
        (0..length).map(|_| alphabet[self.below(alphabet.len())]).collect()
    }
}

fn random_result(random: &mut Random) -> StageResult {
    let lengths = [random.below(4), random.below(40)];
    let axes = ["row", "time"].iter().zip(lengths).map(|(name, length)| {
        Axis::new(name, &random.text(), &random.text(), (0..length).map(|_| random.number()).collect())
    });
    let mut array = Array::over(axes.collect());
    for (index, dims) in [&["row", "time"][..], &["time"], &["row"], &[], &["time", "row"]].iter().enumerate() {
        let count = dims.iter().map(|dim| lengths[usize::from(*dim == "time")]).product();
        let (name, unit) = (format!("v{index}"), random.text());
        array = match random.below(3) {
            0 => array.with(&name, &unit, "", dims, (0..count).map(|_| random.number()).collect::<Vec<f64>>()),
            1 => array.with(&name, &unit, "", dims, (0..count).map(|_| random.next() as i64).collect::<Vec<i64>>()),
            _ => {
                let values = (0..count).map(|_| Complex64::new(random.number(), random.number()));
                array.with(&name, &unit, " (real part)", dims, values.collect::<Vec<_>>())
            }
        };
    }
    array = array
        .attribute("", random.number())
        .attribute(&random.text().replace('/', "|"), random.text())
        .attribute("units", random.next() as i64)
        .attribute("time_indices", random.below(2) == 0);
    let rows = random.below(30);
    let table = Table::new()
        .with("text", "", "", (0..rows).map(|_| random.text()).collect::<Vec<_>>())
        .with("flag", "", "", (0..rows).map(|_| random.below(2) == 0).collect::<Vec<_>>())
        .with("real", "", "", (0..rows).map(|_| random.number()).collect::<Vec<_>>())
        .with("row", "", "", (0..rows).map(|_| random.next() as i64).collect::<Vec<_>>());
    let numbers: Vec<f64> = (0..rows).map(|_| f64::from_bits(random.next())).filter(|x| x.is_finite()).collect();
    let mut outputs = Ports::new();
    outputs.insert("array", Artifact::Array(Arc::new(array)));
    outputs.insert("table", Artifact::Table(Arc::new(table)));
    outputs.insert("document", Artifact::Document(Arc::new(Document(serde_json::json!(numbers)))));
    StageResult { outputs, warnings: (0..random.below(3)).map(|_| random.text()).collect() }
}

#[test]
fn random_artifacts_survive_bit_by_bit() {
    let folder = Folder::new("random");
    let output = |name, shape| PortSpec { name, shape, tag: "", optional: false, doc: "" };
    let outputs = [output("array", Shape::Array), output("table", Shape::Table), output("document", Shape::Document)];
    let identity = StageIdentity { outputs: &outputs, ..identity("k") };
    for seed in 0..60 {
        let result = random_result(&mut Random(seed));
        let path = folder.file(&format!("{seed}.h5"));
        write_stage(&path, &identity, &result).unwrap();
        same(&read_stage(&path, &identity, &InputFiles::new()).unwrap(), &result);
    }
}

#[test]
fn stages_and_artifacts_are_read_one_by_one() {
    let folder = Folder::new("lazy");
    let path = folder.file("a.h5");
    write_result(&path, &run_result()).unwrap();
    let file = ResultFile::open(&path).unwrap();
    let ids: Vec<&str> = file.stages().iter().map(|stage| stage.record.id.as_str()).collect();
    assert_eq!(ids, ["records", "free-lever_2", "run", "events"]);
    assert_eq!(file.run().config, run_result().config);
    let artifact = file.artifact("events", "summary").unwrap();
    same(&artifact, run_result().stages[3].result.outputs.artifact("summary").unwrap());
    let error = file.artifact("event", "summary").unwrap_err().to_string();
    assert!(error.contains("no stage `event`; there is: records, free-lever_2, run, events"), "{error}");
    let error = file.artifact("events", "sumary").unwrap_err().to_string();
    assert!(error.contains("no output `sumary`; it has: ensemble, "), "{error}");
}

#[test]
fn what_cannot_be_stored_is_an_error_that_says_so() {
    let folder = Folder::new("refused");
    let says = |artifact: Artifact, word: &str| {
        let path = folder.file("x.h5");
        let mut outputs = Ports::new();
        outputs.insert("port", artifact);
        let error = write_stage(&path, &identity("k"), &StageResult { outputs, warnings: Vec::new() }).unwrap_err();
        assert!(error.to_string().contains(word) && error.to_string().contains("port"), "{error}");
        std::fs::remove_file(&path).unwrap();
    };
    let array = |name: &str| Artifact::Array(Arc::new(Array::over(Vec::new()).with(name, "V", "", &[], vec![1.0])));
    says(array("a/b"), "cannot be the name");
    says(array(""), "cannot be the name");
    says(Artifact::Array(Arc::new(Array::over(Vec::new()))), "without a variable");
    let clash = Array::over(Vec::new()).with("x", "V", "", &[], vec![Complex64::new(1.0, 2.0)]).with(
        "x_real",
        "V",
        "",
        &[],
        vec![1.0],
    );
    says(Artifact::Array(Arc::new(clash)), "x_real");
    says(Artifact::Table(Arc::new(Table::new().with("a", "", "", vec!["nul \0".to_owned()]))), "NUL");
    let ragged = Table::new().with("a", "", "", vec![1.0]).with("b", "", "", vec![1.0, 2.0]);
    says(Artifact::Table(Arc::new(ragged)), "rows");
}

#[test]
fn comparison_finds_each_difference_and_leaves_the_run_out() {
    let folder = Folder::new("compare");
    let (first, second) = (folder.file("a.h5"), folder.file("b.h5"));
    write_result(&first, &run_result()).unwrap();
    let mut run = run_result();
    run.info = RunInfo { host: "elsewhere".to_owned(), seconds: 99.0, ..RunInfo::default() };
    write_result(&second, &run).unwrap();
    assert_eq!(compare(&first, &second).unwrap(), []);
    std::fs::remove_file(&second).unwrap();

    run.seed = 2;
    let Some(Artifact::Array(array)) = run.stages[3].result.outputs.artifact("ensemble") else { panic!() };
    let mut array = Array::clone(array);
    if let crate::artifact::Values::Real(values) = &mut array.variables[1].values {
        values[2] = 0.0; // was -0.0
    }
    array.attributes.remove("empty");
    run.stages[3].result.outputs.insert("ensemble", Artifact::Array(Arc::new(array)));
    run.stages[0].result.warnings.pop();
    write_result(&second, &run).unwrap();
    let found = compare(&first, &second).unwrap();
    let places: Vec<&str> = found.iter().map(|difference| difference.place.as_str()).collect();
    assert_eq!(
        places,
        [
            "/entry/events/ensemble@empty",
            "/entry/events/ensemble@afmid_layout",
            "/entry/events/ensemble/mean",
            "/entry/pipeline/seed",
            "/entry/records/provenance/warnings",
        ]
    );
    assert_eq!(found[2].what, "1 of 5 values differ, first at 2: -0.0 and 0.0");
}

#[test]
fn a_damaged_or_foreign_result_file_is_an_error_never_a_panic() {
    let folder = Folder::new("broken");
    let (whole, path) = (folder.file("whole.h5"), folder.file("x.h5"));
    write_result(&whole, &run_result()).unwrap();
    let bytes = std::fs::read(&whole).unwrap();
    let error = read_result(&folder.file("none.h5")).unwrap_err().to_string();
    assert!(error.contains("none.h5") && error.contains("No such file"), "{error}");
    std::fs::write(&path, &bytes[..bytes.len() / 2]).unwrap();
    let error = read_result(&path).unwrap_err().to_string();
    assert!(error.contains("cut short") && error.contains("x.h5"), "{error}");
    std::fs::write(&path, b"[pipeline]").unwrap();
    assert!(read_result(&path).unwrap_err().to_string().contains("not a file of afmid's"));
    let mut random = Random(7);
    for _ in 0..100 {
        let mut damaged = bytes.clone();
        damaged[random.below(bytes.len())] ^= 1 << random.below(8);
        std::fs::write(&path, &damaged).unwrap();
        let (read, compared) = (read_result(&path).unwrap_err(), compare(&whole, &path).unwrap_err());
        assert!(read.file == path && compared.file == path, "{read} {compared}");
        assert!(read.help.is_some());
    }
}

#[test]
fn another_version_and_another_kind_are_refused() {
    let folder = Folder::new("version");
    let path = folder.file("a.h5");
    write_result(&path, &run_result()).unwrap();
    {
        let file = hdf5::File::open_rw(&path).unwrap();
        file.attr("afmid_format_version").unwrap().write_scalar(&99_u32).unwrap();
    }
    let error = read_result(&path).unwrap_err().to_string();
    assert!(error.contains("changed by another program"), "{error}");
    super::seal::seal(&path).unwrap();
    let error = read_result(&path).unwrap_err();
    assert!(error.to_string().contains("found format version 99, wanted 2") && error.help.is_some(), "{error}");
    let stage = folder.file("stage.h5");
    write_stage(&stage, &identity("k"), &stage_result()).unwrap();
    let error = read_result(&stage).unwrap_err().to_string();
    assert!(error.contains("found an afmid stage file, wanted a result file"), "{error}");
    assert!(read_stage(&path, &identity("k"), &InputFiles::new()).is_err());
}

/// The same script checks results of real runs; here it sees every shape, empty ones included.
#[test]
fn h5py_xarray_and_nxcheck_read_a_result_file() {
    let folder = Folder::new("readers");
    let path = folder.file("result.h5");
    write_result(&path, &run_result()).unwrap();
    let root = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("..");
    let python = root.join(".tools/bin/python");
    assert!(Path::new(&python).exists(), "the readers are missing: run `make test-deps`");
    let output = Command::new(python).arg(root.join("tests/store_readers.py")).arg(&path).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    assert!(output.status.success(), "{}{}", text(&output.stdout), text(&output.stderr));
}
