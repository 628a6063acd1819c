use std::fs;
use std::sync::Mutex;

use crate::artifact::{Array, Artifact, Axis, RowWriter, Shape, Values};
use crate::error::StageError;
use crate::outcome::{PortSpec, Ports, StageResult, difference};
use crate::recording::InputFiles;
use crate::rows::rows_per_block;
use crate::rows::*;
use crate::store::{StageIdentity, read_stage, write_stage};

const IDENTITY: StageIdentity<'static> = StageIdentity {
    key: "k",
    stage: "test.rows",
    version: 1,
    outputs: &[PortSpec { name: "ensemble", shape: Shape::Array, tag: "", optional: false, doc: "" }],
};

fn folder() -> tempfile::TempDir {
    tempfile::tempdir().unwrap()
}

/// Numbers with every kind of bits: signs of zero, subnormals, infinities among them.
fn row(number: usize, length: usize) -> Vec<f64> {
    let odd = [-0.0, f64::MIN_POSITIVE / 3.0, f64::INFINITY, f64::NAN];
    (0..length).map(|k| if k < 4 { odd[(k + number) % 4] } else { (number * length + k) as f64 / 7.0 }).collect()
}

fn written(scratch: &Scratch, rows: usize, length: usize) -> Values {
    let mut writer = RowWriter::new(scratch.clone(), length);
    for number in 0..rows {
        assert_eq!(writer.push(&row(number, length)).unwrap(), number);
    }
    writer.finish()
}

fn bits(values: &[f64]) -> Vec<u64> {
    values.iter().map(|value| value.to_bits()).collect()
}

#[test]
fn rows_come_back_bit_for_bit_from_memory_and_from_a_file() {
    let folder = folder();
    let scratch = Scratch::beside(&folder.path().join("x.h5"));
    let whole: Vec<f64> = (0..9).flat_map(|number| row(number, 50)).collect();
    // nine rows of 400 bytes: at the limit, one byte below it, and no room at all
    for (limit, in_file) in [(3600, false), (3599, true), (0, true)] {
        let values = written(&scratch.clone().with_limit_bytes(limit), 9, 50);
        assert_eq!(matches!(values, Values::Stored(_)), in_file, "{limit}");
        assert_eq!(values.len(), 450);
        let view = values.rows(50).unwrap();
        let mut into = vec![0.0; 50];
        view.read(7, &mut into).unwrap();
        assert_eq!(bits(&into), bits(&row(7, 50)));
        assert_eq!(view.borrowed(7).is_some(), !in_file);
        assert_eq!(bits(values.real().unwrap().unwrap()), bits(&whole));
        // now that somebody has asked for all, rows are borrowed
        assert_eq!(bits(view.borrowed(8).unwrap()), bits(&row(8, 50)));
        assert!(view.borrowed(9).is_none());
        assert!(view.read(9, &mut into).is_err() && view.read(0, &mut into[..49]).is_err());
        assert!(values.rows(49).is_none());
    }
}

#[test]
fn a_file_of_rows_has_no_name_so_that_a_kill_leaves_nothing() {
    let folder = folder();
    let scratch = Scratch::beside(&folder.path().join("made").join("x.h5")).with_limit_bytes(0);
    let mut writer = RowWriter::new(scratch, 10);
    writer.push(&row(0, 10)).unwrap();
    let left = || fs::read_dir(folder.path().join("made")).unwrap().count();
    assert_eq!(left(), 0, "while rows are written");
    let values = writer.finish();
    assert_eq!(left(), 0, "while rows are read");
    assert_eq!(bits(values.real().unwrap().unwrap()), bits(&row(0, 10)));
}

#[test]
fn rows_go_elsewhere_where_a_folder_cannot_be_made_and_a_row_of_another_length_is_an_error() {
    let folder = folder();
    fs::write(folder.path().join("file"), "").unwrap();
    let scratch = Scratch::beside(&folder.path().join("file").join("x.h5")).with_limit_bytes(0);
    // a cache that cannot be written stops no run
    let mut writer = RowWriter::new(scratch.clone(), 10);
    writer.push(&row(0, 10)).unwrap();
    assert!(matches!(writer.finish(), Values::Stored(rows) if bits(rows.whole().unwrap()) == bits(&row(0, 10))));
    let error = RowWriter::new(scratch, 10).push(&row(0, 11)).unwrap_err();
    assert_eq!(error.to_string(), "a row has 11 values, the others 10");
}

/// Counts the rows that are read one by one.
struct Counted {
    rows: usize,
    length: usize,
    reads: Mutex<Vec<usize>>,
}

impl RowSource for Counted {
    fn rows(&self) -> usize {
        self.rows
    }
    fn row_length(&self) -> usize {
        self.length
    }
    fn borrowed(&self, _row: usize) -> Option<&[f64]> {
        None
    }
    fn read(&self, row: usize, into: &mut [f64]) -> Result<(), StageError> {
        self.reads.lock().unwrap().push(row);
        into.fill(row as f64);
        Ok(())
    }
}

#[test]
fn no_block_is_larger_than_the_bound_and_every_chosen_row_is_read_once() {
    for length in [1 << 12, 1 << 17, BLOCK_BYTES] {
        let source = Counted { rows: 2000, length, reads: Mutex::default() };
        // backwards, every third, over several blocks
        let most = rows_per_block(length, BLOCK_BYTES);
        let chosen: Vec<usize> = (0..2000).rev().step_by(3).take(2 * most + 1).collect();
        let mut seen = Vec::new();
        in_blocks(&source, &chosen, |first, block| -> Result<(), StageError> {
            assert_eq!(first, seen.len());
            let bytes: usize = block.iter().map(|row| size_of_val(*row)).sum();
            assert!(bytes <= BLOCK_BYTES || block.len() == 1, "{bytes} bytes");
            seen.extend(block.iter().map(|row| row[length - 1] as usize));
            Ok(())
        })
        .unwrap();
        assert_eq!(seen, chosen);
        let mut reads = source.reads.into_inner().unwrap();
        reads.sort_unstable_by(|a, b| b.cmp(a));
        assert_eq!(reads, chosen);
    }
}

fn stage_of(signal: Values, rows: usize, length: usize) -> StageResult {
    let axes = vec![
        Axis::new("event", "1", "event", (0..rows).map(|k| k as f64).collect()),
        Axis::new("time", "s", "time", (0..length).map(|k| k as f64).collect()),
    ];
    let array = Array::over(axes).with("signal", "V", "signal", &["event", "time"], signal);
    let mut outputs = Ports::new();
    outputs.insert("ensemble", Artifact::Array(std::sync::Arc::new(array)));
    StageResult { outputs, warnings: Vec::new() }
}

fn signal(result: &StageResult) -> &Values {
    match result.outputs.artifact("ensemble") {
        Some(Artifact::Array(array)) => &array.variable("signal").unwrap().values,
        other => panic!("{other:?}"),
    }
}

#[test]
fn stage_files_are_the_same_bytes_wherever_the_rows_lay_and_are_read_where_they_lie() {
    let folder = folder();
    let scratch = Scratch::beside(&folder.path().join("x.h5"));
    // 8.4 MB: beyond the limit of memory, three blocks
    let (rows, length) = (260, 4050);
    let of = |limit| stage_of(written(&scratch.clone().with_limit_bytes(limit), rows, length), rows, length);
    let (memory, file) = (of(usize::MAX), of(0));
    assert!(matches!((signal(&memory), signal(&file)), (Values::Real(_), Values::Stored(_))));
    assert_eq!(difference(&memory.outputs, &file.outputs), None);
    let [a, b] = ["a.h5", "b.h5"].map(|name| folder.path().join(name));
    write_stage(&a, &IDENTITY, &memory).unwrap();
    write_stage(&b, &IDENTITY, &file).unwrap();
    assert!(fs::read(&a).unwrap() == fs::read(&b).unwrap(), "the files differ");

    let back = read_stage(&a, &IDENTITY, &InputFiles::new()).unwrap();
    let Values::Stored(stored) = signal(&back) else { panic!("all of it is in memory") };
    // as another process may do at any moment
    fs::remove_file(&a).unwrap();
    assert_eq!(difference(&memory.outputs, &back.outputs), None);
    assert_eq!(bits(stored.whole().unwrap()), bits(signal(&memory).real().unwrap().unwrap()));
}

#[test]
fn small_variables_are_read_into_memory() {
    let folder = folder();
    let path = folder.path().join("a.h5");
    write_stage(&path, &IDENTITY, &stage_of(written(&Scratch::default(), 100, 1000), 100, 1000)).unwrap();
    assert!(matches!(signal(&read_stage(&path, &IDENTITY, &InputFiles::new()).unwrap()), Values::Real(_)));
}

#[test]
fn a_file_that_is_cut_short_while_it_is_in_use_is_reported() {
    let folder = folder();
    let path = folder.path().join("a.h5");
    let (rows, length) = (260, 4050);
    write_stage(&path, &IDENTITY, &stage_of(written(&Scratch::default(), rows, length), rows, length)).unwrap();
    let back = read_stage(&path, &IDENTITY, &InputFiles::new()).unwrap();
    fs::OpenOptions::new().write(true).open(&path).unwrap().set_len(4_000_000).unwrap();
    let view = signal(&back).rows(length).unwrap();
    let mut into = vec![0.0; length];
    view.read(0, &mut into).unwrap();
    let error = view.read(rows - 1, &mut into).unwrap_err();
    assert!(error.to_string().contains("cut short") && error.to_string().contains("a.h5"), "{error}");
    assert!(signal(&back).real().unwrap().is_err());
    // and a result file is not written from it
    let error = write_stage(&folder.path().join("b.h5"), &IDENTITY, &back).unwrap_err();
    assert!(error.to_string().contains("cut short"), "{error}");
}
