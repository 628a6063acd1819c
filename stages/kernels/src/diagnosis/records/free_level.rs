//! The level of the free lever, record by record: what depends on position, on time, on what went before.

use crate::linear_algebra::{dot, product};
use faer::Mat;

use super::basis::{Basis, norm};
use super::replicates::Weighted;
use super::segments::SegmentKind;
use super::slow_lines::SlowLine;
use super::summary::RecordSummary;
use crate::linear_algebra::symmetric_inverse;

/// Fewest records: replicates for a t test.
pub(super) const FEWEST_RECORDS: usize = 4;
/// A slope can be distinguished from a drift in time if these leave at least this share of the position's variance.
const LEAST_CONTRAST: f64 = 0.02;
/// Fewest blocks of a record's free stretches together.
const FEWEST_BLOCKS: usize = 24;

/// The free stretches of one record.
#[derive(Debug, Clone)]
pub(super) struct FreeRecord {
    /// Piezo position, m.
    pub position_m: Vec<f64>,
    /// Deflection summed up since the record's beginning, V s.
    pub integral_vs: Vec<f64>,
    /// Time since the record's beginning, s.
    pub time_s: Vec<f64>,
    /// Deflection, V, less what the nuisances explain.
    pub left_v: Vec<f64>,
    /// An offset for each stretch, slow lines, what was found before; a drift in time where it can be distinguished
    /// from the position.
    pub nuisance: Basis,
    stretches: Vec<Range>,
    /// Share of the position's variance that a drift in time leaves.
    contrast: f64,
}

/// Where a stretch lies in the record's columns, and what it is.
#[derive(Debug, Clone)]
struct Range {
    kind: SegmentKind,
    start: usize,
    end: usize,
}

/// The free level of an archive.
#[derive(Debug, Clone)]
pub(super) struct FreeLevel {
    /// Records with free stretches and a piezo channel.
    pub records: Vec<FreeRecord>,
    /// The lever is free on the way in and out: a drift in time is no slope against position.
    pub two_way: bool,
}

impl FreeLevel {
    /// Of all records, with the slow lines as nuisances.
    pub fn new(records: &[RecordSummary], slow: &[SlowLine]) -> Self {
        let known: Vec<f64> = slow.iter().map(|line| line.frequency_hz.0).collect();
        let parts: Vec<FreeRecord> = records.iter().filter_map(|record| FreeRecord::new(record, &known)).collect();
        let both = |record: &FreeRecord| record.contrast >= LEAST_CONTRAST;
        let two_way = parts.iter().filter(|record| both(record)).count() >= FEWEST_RECORDS;
        let settled = parts.into_iter().filter(|record| !two_way || both(record)).map(|mut record| {
            if two_way {
                record.explain(record.time_s.clone());
            }
            record
        });
        Self { records: settled.collect(), two_way }
    }

    /// Replicates enough for a test.
    pub fn can_judge(&self) -> bool {
        self.records.len() >= FEWEST_RECORDS
    }

    /// The same with further nuisances in each record.
    pub fn without(&self, columns: impl Fn(&FreeRecord) -> Vec<Vec<f64>>) -> Self {
        let mut less = self.clone();
        for record in &mut less.records {
            for column in columns(record) {
                record.explain(column);
            }
        }
        less
    }

    /// The same less shapes, each of one size for all records by least squares; no nuisances are added.
    pub fn less(&self, columns: impl Fn(&FreeRecord) -> Vec<Vec<f64>>) -> Self {
        // of the first record's scale: metres, volts seconds and sines side by side
        let scales: Vec<f64> = self.records.first().map_or_else(Vec::new, |record| {
            columns(record).iter().map(|column| norm(column).max(f64::MIN_POSITIVE)).collect()
        });
        let shapes: Vec<Mat<f64>> = self
            .records
            .iter()
            .map(|record| {
                let columns: Vec<Vec<f64>> = columns(record).iter().map(|c| record.nuisance.residual(c)).collect();
                Mat::from_fn(record.left_v.len(), scales.len(), |k, j| columns[j][k] / scales[j])
            })
            .collect();
        let mut information = Mat::<f64>::zeros(scales.len(), scales.len());
        let mut score = Mat::<f64>::zeros(scales.len(), 1);
        for (record, shapes) in self.records.iter().zip(&shapes) {
            information += product(shapes.transpose(), shapes.as_ref());
            let left = Mat::from_fn(record.left_v.len(), 1, |k, _| record.left_v[k]);
            score += product(shapes.transpose(), left.as_ref());
        }
        let sizes = product(symmetric_inverse(&information).as_ref(), score.as_ref());
        let mut less = self.clone();
        for (record, shapes) in less.records.iter_mut().zip(&shapes) {
            let fitted = product(shapes.as_ref(), sizes.as_ref());
            record.left_v.iter_mut().enumerate().for_each(|(k, value)| *value -= fitted[(k, 0)]);
        }
        less
    }

    /// Records of one parity.
    pub fn half(&self, parity: usize) -> Vec<&FreeRecord> {
        self.records.iter().skip(parity).step_by(2).collect()
    }
}

impl FreeRecord {
    fn new(record: &RecordSummary, known_hz: &[f64]) -> Option<Self> {
        let (mut position_m, mut integral_vs, mut deflection, mut time, mut stretches) =
            (Vec::new(), Vec::new(), Vec::new(), Vec::new(), Vec::new());
        for segment in record.segments.iter().filter(|segment| segment.kind != SegmentKind::Contact) {
            let start = position_m.len();
            position_m.extend_from_slice(segment.piezo.as_ref()?);
            integral_vs.extend(segment.sums.iter().map(|sum| sum * record.block_s));
            deflection.extend_from_slice(&segment.values);
            time.extend((0..segment.values.len()).map(|k| (segment.first + k) as f64 * record.block_s));
            stretches.push(Range { kind: segment.kind, start, end: position_m.len() });
        }
        let mut nuisance = Basis::default();
        for stretch in &stretches {
            let inside = |k: usize| f64::from(u8::from((stretch.start..stretch.end).contains(&k)));
            nuisance.push((0..time.len()).map(inside).collect());
        }
        let mut drift = nuisance.clone();
        drift.push(time.clone());
        let contrast = (norm(&drift.residual(&position_m)) / norm(&nuisance.residual(&position_m))).powi(2);
        for f in known_hz {
            let phase = |t: &f64| (std::f64::consts::TAU * f * t).sin_cos();
            nuisance.push(time.iter().map(|t| phase(t).0).collect());
            nuisance.push(time.iter().map(|t| phase(t).1).collect());
        }
        let left_v = nuisance.residual(&deflection);
        let one = Self { position_m, integral_vs, time_s: time, left_v, nuisance, stretches, contrast };
        (contrast.is_finite() && one.left_v.len() > FEWEST_BLOCKS).then_some(one)
    }

    /// Takes a column for a nuisance.
    fn explain(&mut self, column: Vec<f64>) {
        self.nuisance.push(column);
        self.left_v = self.nuisance.residual(&self.left_v);
    }

    /// Least-squares factor of `shape`, less what the nuisances and `lower` shapes explain. It counts as the shape's
    /// mean square: 1/f noise is as strong in a short stretch as in a long one.
    pub fn factor(&self, shape: &[f64], lower: &[Vec<f64>]) -> Option<Weighted> {
        let mut basis = self.nuisance.clone();
        for column in lower {
            basis.push(column.clone());
        }
        let alone = basis.residual(shape);
        let size = dot(&alone, &alone);
        (size > 1e-8 * dot(shape, shape)).then(|| (dot(&alone, &self.left_v) / size, size / shape.len() as f64))
    }

    /// Slope against position of the stretches of one kind, V/m; the mean where there are several.
    pub fn slope(&self, kind: SegmentKind) -> Option<f64> {
        let (mut xy, mut xx) = (0.0, 0.0);
        for stretch in self.stretches.iter().filter(|stretch| stretch.kind == kind) {
            let z = &self.position_m[stretch.start..stretch.end];
            let mean = z.iter().sum::<f64>() / z.len() as f64;
            let z: Vec<f64> = z.iter().map(|z| z - mean).collect();
            xy += dot(&z, &self.left_v[stretch.start..stretch.end]);
            xx += dot(&z, &z);
        }
        (xx > 0.0).then(|| xy / xx)
    }
}

/// What a shape takes off each record's sum of squares when the records of the other parity set its size.
#[derive(Debug, Clone)]
pub(super) struct HeldOut {
    /// Sums of squares without and with the shape, V^2, a record each.
    sums: Vec<(f64, f64)>,
    blocks: usize,
}

impl HeldOut {
    /// `shape` is given the parity of the record it is asked for; it must come from the other.
    pub fn new(level: &FreeLevel, shape: impl Fn(usize, &FreeRecord) -> Option<Vec<f64>>) -> Self {
        let one = |(k, record): (usize, &FreeRecord)| {
            let shape = record.nuisance.residual(&shape(k % 2, record)?);
            let left: Vec<f64> = record.left_v.iter().zip(&shape).map(|(v, s)| v - s).collect();
            Some((dot(&record.left_v, &record.left_v), dot(&left, &left)))
        };
        let sums = level.records.iter().enumerate().filter_map(one).collect();
        Self { sums, blocks: level.records.iter().map(|record| record.left_v.len()).sum() }
    }

    /// Fall of the sum of squares over all records, V^2.
    pub fn gained(&self) -> f64 {
        self.sums.iter().map(|(before, after)| before - after).sum()
    }

    /// Rms without and with the shape, V.
    pub fn rms(&self) -> (f64, f64) {
        let total =
            |pick: fn(&(f64, f64)) -> f64| (self.sums.iter().map(pick).sum::<f64>() / self.blocks as f64).sqrt();
        (total(|s| s.0), total(|s| s.1))
    }

    /// What this leaves less than another, record by record, V^2.
    pub fn ahead_of(&self, other: &Self) -> Vec<f64> {
        self.sums.iter().zip(&other.sums).map(|(own, other)| other.1 - own.1).collect()
    }
}
