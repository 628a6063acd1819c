//! Ensembles that are too large for memory: the same bits, and no more of them read at once than a block.
use std::sync::Mutex;

use afmid_pipeline::artifact::RowWriter;
use afmid_pipeline::outcome::difference;
use afmid_pipeline::rows::{RowSource, Scratch};
use afmid_pipeline::{Array, Artifact, Context, Ports, Stage, StageError, Values};

use super::*;
use crate::fixture::white_noise;

/// The example's ensemble, its rows in memory or in a file.
fn ensemble(limit_bytes: usize) -> Array {
    let mut array = example::ensemble();
    let mut writer = RowWriter::new(Scratch::default().with_limit_bytes(limit_bytes), 4096);
    for row in array.real("signal").unwrap().chunks(4096) {
        writer.push(row).unwrap();
    }
    array.variables[0].values = writer.finish();
    array
}

fn outputs(stage: &impl Stage, ensemble: Array, threads: usize) -> Ports {
    let mut ports = Ports::new();
    ports.insert("ensemble", Artifact::Array(std::sync::Arc::new(ensemble)));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
    pool.install(|| stage.run(&ports, &Context::alone(7))).unwrap()
}

#[test]
fn averages_and_drift_have_the_same_bits_from_memory_and_from_a_file() {
    let (memory, file) = (ensemble(usize::MAX), ensemble(0));
    assert!(matches!((&memory.variables[0].values, &file.variables[0].values), (Values::Real(_), Values::Stored(_))));
    let (average, drift) = (
        Average::default(),
        Drift { settings: DriftSettings { groups: 3, ..DriftSettings::default() }, ..Drift::default() },
    );
    for threads in [1, 4] {
        assert_eq!(difference(&outputs(&average, memory.clone(), 1), &outputs(&average, file.clone(), threads)), None);
        assert_eq!(difference(&outputs(&drift, memory.clone(), 1), &outputs(&drift, file.clone(), threads)), None);
    }
    let rows = file.rows("signal").unwrap();
    assert!(rows.borrowed(0).is_none(), "a stage asked for all rows at once");
}

#[test]
fn values_that_are_not_finite_are_found_in_a_file() {
    let mut array = example::ensemble();
    let mut writer = RowWriter::new(Scratch::default().with_limit_bytes(0), 4096);
    for (event, row) in array.real("signal").unwrap().chunks(4096).enumerate() {
        let mut row = row.to_vec();
        if event == 5 {
            row[77] = f64::NAN;
        }
        writer.push(&row).unwrap();
    }
    array.variables[0].values = writer.finish();
    let mut ports = Ports::new();
    ports.insert("ensemble", Artifact::Array(std::sync::Arc::new(array)));
    let error = Average::default().run(&ports, &Context::alone(7)).unwrap_err();
    assert_eq!(error.to_string(), "event 5, sample 77 is not a finite number");
}

/// Rows that lie nowhere in memory: counts how often each is read.
struct Counted {
    values: Vec<f64>,
    samples: usize,
    reads: Mutex<Vec<usize>>,
    broken: Option<usize>,
}

impl RowSource for Counted {
    fn rows(&self) -> usize {
        self.values.len() / self.samples
    }
    fn row_length(&self) -> usize {
        self.samples
    }
    fn borrowed(&self, _row: usize) -> Option<&[f64]> {
        None
    }
    fn read(&self, row: usize, into: &mut [f64]) -> Result<(), StageError> {
        self.reads.lock().unwrap()[row] += 1;
        if self.broken == Some(row) {
            return Err(StageError::new("row 3 of 20 is not there"));
        }
        into.copy_from_slice(&self.values[row * self.samples..(row + 1) * self.samples]);
        Ok(())
    }
}

impl Counted {
    fn new(count: usize, samples: usize) -> Self {
        let values = white_noise(count * samples, 1.0, 3);
        Self { values, samples, reads: Mutex::new(vec![0; count]), broken: None }
    }

    fn take_reads(&self) -> Vec<usize> {
        std::mem::replace(&mut self.reads.lock().unwrap(), vec![0; self.rows()])
    }
}

#[test]
fn kernels_read_rows_as_often_as_they_say_and_get_the_same_bits() {
    // rows of 1 MB: a block has four of them, eight are held for the products
    let (count, samples) = (20, 1 << 17);
    let mut source = Counted::new(count, samples);
    let rows = Rows::new(&source.values, samples).unwrap();
    let all = rows.all();
    let mean = moments(rows, &all).unwrap();
    assert_eq!(moments(&source, &all).unwrap(), mean);
    assert_eq!(source.take_reads(), vec![2; count]);
    assert_eq!(scatter(&source, &all, &mean.mean, 999).unwrap(), scatter(rows, &all, &mean.mean, 999).unwrap());
    assert_eq!(source.take_reads(), vec![1; count]);
    let remainders = scatter::Remainders::new(&mean.mean, 999, samples).unwrap();
    assert_eq!(gram::gram(&source, &remainders).unwrap(), gram::gram(&rows, &remainders).unwrap());
    // once when held, and once for each held block before
    let wanted: Vec<usize> = (0..count).map(|row| 1 + row / 8).collect();
    assert_eq!(source.take_reads(), wanted);
    source.broken = Some(3);
    let error = moments(&source, &all).unwrap_err();
    assert_eq!(error.to_string(), "row 3 of 20 is not there");
}
