//! Records compressed to what slow envelopes on a few carriers can explain of them, block by block.
//!
//! # Model
//! In a block round `t_b` a record is `sum_c Re(E_c(t) exp(i w_c (t - t_b))) + drift`, with each envelope `E_c` a cubic
//! through its values at the block's four Chebyshev nodes and the drift a straight line. `Q` is an orthonormal basis of
//! all such signals, `X = Q R` for the columns X of the nodes' real and imaginary parts: `z = Q' y` is all that the
//! block tells of them, white noise of the same variance, and the model is `R E`. What is orthogonal to `Q` yields the
//! noise.
//! # Accuracy
//! A cubic through Chebyshev nodes is off by `(s h)^4 / 192` of an envelope `exp(s t)` in a block of half length h.

use std::collections::HashMap;

use faer::c64;

/// Nodes of each block.
pub const NODES: usize = 4;
/// Columns of each carrier.
pub const COLUMNS: usize = 2 * NODES;
/// Share of a column's length, orthogonal to those before it, below which it adds nothing.
const DEPENDENT: f64 = 1e-7;

/// Chebyshev nodes in [-1, 1], ascending.
pub fn nodes() -> [f64; NODES] {
    std::array::from_fn(|j| -((2 * j + 1) as f64 * std::f64::consts::PI / (2 * NODES) as f64).cos())
}

/// Lagrange polynomials of the nodes at `x`.
pub fn lagrange(x: f64) -> [f64; NODES] {
    let at = nodes();
    std::array::from_fn(|j| (0..NODES).filter(|&i| i != j).map(|i| (x - at[i]) / (at[j] - at[i])).product())
}

/// Blocks of one length and pattern of missing samples.
#[derive(Debug, Clone)]
pub struct Pattern {
    /// Rows of R.
    pub rows: usize,
    /// R, row by row: carriers x nodes x (re, im), then offset and slope over the half block.
    pub r: Vec<f64>,
    /// Columns of R.
    pub columns: usize,
}

/// A block of one record.
#[derive(Debug, Clone)]
pub struct Block {
    /// Number of its pattern.
    pub pattern: usize,
    /// `Q' y`.
    pub z: Vec<f64>,
}

/// One channel of one hit.
#[derive(Debug, Clone)]
pub struct Record {
    /// Number of the hit.
    pub hit: usize,
    /// Number of the channel.
    pub channel: usize,
    /// Its blocks, as many as the hit has.
    pub blocks: Vec<Block>,
    /// The record's offset and slope in all rows, orthonormal: 2 x rows.
    pub drift: [Vec<f64>; 2],
    /// Energy that is orthogonal to all Q, and its degrees of freedom.
    pub outside: (f64, f64),
    /// Rows of all blocks.
    pub rows: usize,
}

/// Where the blocks of a hit are.
#[derive(Debug, Clone, Default)]
pub struct Hit {
    /// Middle of each block and half its length, s.
    pub blocks: Vec<(f64, f64)>,
    /// All nodes, ascending, s.
    pub times_s: Vec<f64>,
    /// Length, s.
    pub duration_s: f64,
}

/// All records.
#[derive(Debug, Clone)]
pub struct Compressed {
    /// Carriers, rad/s.
    pub carriers: Vec<f64>,
    /// Patterns of the blocks.
    pub patterns: Vec<Pattern>,
    /// Hits.
    pub hits: Vec<Hit>,
    /// Records, hit by hit.
    pub records: Vec<Record>,
    /// Number of channels.
    pub channels: usize,
}

struct Basis {
    /// Orthonormal columns, one after the other.
    q: Vec<Vec<f64>>,
    pattern: Pattern,
}

impl Basis {
    /// Method: modified Gram-Schmidt, twice; dependent columns add none.
    fn of(length: usize, present: &[bool], interval_s: f64, carriers: &[f64]) -> Self {
        let half = 0.5 * length as f64;
        let mut columns: Vec<Vec<f64>> = Vec::new();
        let offset = |k: usize| k as f64 - 0.5 * (length as f64 - 1.0);
        let polynomials: Vec<[f64; NODES]> = (0..length).map(|k| lagrange(offset(k) / half)).collect();
        for &turn in carriers {
            let wave: Vec<c64> = (0..length).map(|k| c64::cis(turn * interval_s * offset(k))).collect();
            for j in 0..NODES {
                let own = || polynomials.iter().map(|all| all[j]).zip(&wave);
                columns.push(own().map(|(p, w)| p * w.re).collect());
                columns.push(own().map(|(p, w)| -p * w.im).collect());
            }
        }
        columns.push(vec![1.0; length]);
        columns.push((0..length).map(|k| offset(k) / half).collect());
        for column in &mut columns {
            column.iter_mut().zip(present).for_each(|(v, p)| *v = if *p { *v } else { 0.0 });
        }
        let mut q: Vec<Vec<f64>> = Vec::new();
        for column in &columns {
            let full = dot(column, column).sqrt();
            let mut rest = column.clone();
            for _ in 0..2 {
                for unit in &q {
                    let share = dot(unit, &rest);
                    rest.iter_mut().zip(unit).for_each(|(r, u)| *r -= share * u);
                }
            }
            let size = dot(&rest, &rest).sqrt();
            if size > DEPENDENT * full.max(1e-300) && q.len() < length {
                rest.iter_mut().for_each(|r| *r /= size);
                q.push(rest);
            }
        }
        let rows = q.len();
        let r: Vec<f64> = q.iter().flat_map(|unit| columns.iter().map(move |column| dot(unit, column))).collect();
        Self { q, pattern: Pattern { rows, r, columns: columns.len() } }
    }
}

/// Ridge of the local least squares of starts, relative to the mean diagonal.
const RIDGE: f64 = 1e-4;

/// Columns of a straight envelope: value and slope at the middle, real and imaginary part.
const STRAIGHT: usize = 4;

impl Pattern {
    /// Weights of the rows in the envelope at the middle of the block, real and imaginary part, of the first of these
    /// carriers: least squares of straight envelopes on all of them, and drift.
    fn middle(&self, carriers: &[usize]) -> [Vec<f64>; 2] {
        let at = nodes();
        let mut columns: Vec<Vec<f64>> = Vec::with_capacity(STRAIGHT * carriers.len() + 2);
        for carrier in carriers {
            for (power, part) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let entry = |row: &[f64]| -> f64 {
                    (0..NODES).map(|j| at[j].powi(power) * row[carrier * COLUMNS + 2 * j + part]).sum()
                };
                columns.push(self.r.chunks(self.columns).map(entry).collect());
            }
        }
        (1..=2).for_each(|k| columns.push(self.r.chunks(self.columns).map(|row| row[self.columns - k]).collect()));
        let count = columns.len();
        let mut gram = crate::ringdown::moving::dense::Square::zeros(count);
        for i in 0..count {
            (0..count).for_each(|j| *gram.at_mut(i, j) = dot(&columns[i], &columns[j]));
        }
        let mean = (0..count).map(|i| gram.at(i, i)).sum::<f64>() / count as f64;
        (0..count).for_each(|i| *gram.at_mut(i, i) += RIDGE * mean + 1e-300);
        let factor = crate::ringdown::moving::dense::Factor::of(&gram, 0.0);
        std::array::from_fn(|part| {
            let unit: Vec<f64> = (0..count).map(|k| if k == part { 1.0 } else { 0.0 }).collect();
            let solved = factor.as_ref().map_or(vec![0.0; count], |f| f.solve(&unit));
            (0..self.rows).map(|row| columns.iter().zip(&solved).map(|(c, s)| c[row] * s).sum()).collect()
        })
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Compresses all records: `events` hits x channels x samples, samples that are not finite are missing.
pub fn compress(events: &[Vec<&[f64]>], interval_s: f64, carriers: &[f64], half_s: f64) -> Compressed {
    let mut patterns: Vec<Pattern> = Vec::new();
    let mut whole: HashMap<usize, (usize, Basis)> = HashMap::new();
    let mut hits = Vec::new();
    let mut records = Vec::new();
    let at = nodes();
    for (hit_number, event) in events.iter().enumerate() {
        let samples = event.iter().map(|row| row.len()).min().unwrap_or(0);
        let length = ((2.0 * half_s / interval_s) as usize).clamp(4.min(samples.max(1)), samples.max(1));
        let count = samples.div_ceil(length).max(1);
        let edge = |b: usize| b * samples / count;
        let mut hit = Hit { duration_s: samples as f64 * interval_s, ..Hit::default() };
        for b in 0..count {
            let (from, to) = (edge(b), edge(b + 1));
            let middle = (0.5 * (from + to) as f64 - 0.5) * interval_s;
            let half = 0.5 * (to - from) as f64 * interval_s;
            hit.blocks.push((middle, half));
            hit.times_s.extend(at.map(|x| middle + x * half));
        }
        for (channel, row) in event.iter().enumerate() {
            let mut outside = (0.0, 0.0);
            let mut blocks = Vec::new();
            for b in 0..count {
                let part = &row[edge(b)..edge(b + 1)];
                let present: Vec<bool> = part.iter().map(|y| y.is_finite()).collect();
                let own;
                let (number, basis) = if present.iter().all(|p| *p) {
                    let known = whole.entry(part.len()).or_insert_with(|| {
                        let basis = Basis::of(part.len(), &present, interval_s, carriers);
                        patterns.push(basis.pattern.clone());
                        (patterns.len() - 1, basis)
                    });
                    (known.0, &known.1)
                } else {
                    own = Basis::of(part.len(), &present, interval_s, carriers);
                    patterns.push(own.pattern.clone());
                    (patterns.len() - 1, &own)
                };
                let mut rest: Vec<f64> = part.iter().map(|y| if y.is_finite() { *y } else { 0.0 }).collect();
                let mut z = Vec::with_capacity(basis.q.len());
                for unit in &basis.q {
                    let share = dot(unit, &rest);
                    rest.iter_mut().zip(unit).for_each(|(r, u)| *r -= share * u);
                    z.push(share);
                }
                outside.0 += dot(&rest, &rest);
                outside.1 += present.iter().filter(|p| **p).count().saturating_sub(basis.q.len()) as f64;
                blocks.push(Block { pattern: number, z });
            }
            records.push(finished(hit_number, channel, blocks, &hit, &patterns, outside));
        }
        hits.push(hit);
    }
    let channels = events.first().map_or(0, Vec::len);
    Compressed { carriers: carriers.to_vec(), patterns, hits, records, channels }
}

/// A record with its offset and slope taken off the rows.
fn finished(
    hit_number: usize,
    channel: usize,
    mut blocks: Vec<Block>,
    hit: &Hit,
    patterns: &[Pattern],
    outside: (f64, f64),
) -> Record {
    let mut drift = [Vec::new(), Vec::new()];
    for (block, (middle, half)) in blocks.iter().zip(&hit.blocks) {
        let pattern = &patterns[block.pattern];
        let scale = 2.0 / hit.duration_s.max(1e-300);
        for row in pattern.r.chunks(pattern.columns) {
            let (one, ramp) = (row[pattern.columns - 2], row[pattern.columns - 1]);
            drift[0].push(one);
            drift[1].push((middle * scale - 1.0) * one + half * scale * ramp);
        }
    }
    let [first, second] = &mut drift;
    normalise(first);
    let share = dot(first, second);
    second.iter_mut().zip(first.iter()).for_each(|(s, f)| *s -= share * f);
    normalise(second);
    let rows = drift[0].len();
    let mut all: Vec<f64> = blocks.iter().flat_map(|block| block.z.iter().copied()).collect();
    for unit in &drift {
        let share = dot(unit, &all);
        all.iter_mut().zip(unit).for_each(|(z, u)| *z -= share * u);
    }
    let mut from = 0;
    for block in &mut blocks {
        let count = block.z.len();
        block.z.copy_from_slice(&all[from..from + count]);
        from += count;
    }
    Record { hit: hit_number, channel, blocks, drift, outside, rows }
}

fn normalise(column: &mut [f64]) {
    let size = dot(column, column).sqrt();
    column.iter_mut().for_each(|v| *v = if size > 1e-9 { *v / size } else { 0.0 });
}

impl Compressed {
    /// Least-squares envelope of a carrier in the middle of each block, of each record, and its variance for unit
    /// noise.
    ///
    /// `rows`: of each record. `alone`: the other carriers are not in them.
    pub fn envelopes(&self, rows: &[Vec<f64>], carrier: usize, alone: bool) -> Vec<Vec<(c64, f64)>> {
        let others = (0..self.carriers.len()).filter(|c| *c != carrier && !alone);
        let carriers: Vec<usize> = std::iter::once(carrier).chain(others).collect();
        let weights: Vec<[Vec<f64>; 2]> = self.patterns.iter().map(|p| p.middle(&carriers)).collect();
        let of = |(record, rows): (&Record, &Vec<f64>)| {
            let mut from = 0;
            let mut out = Vec::with_capacity(record.blocks.len());
            for block in &record.blocks {
                let [re, im] = &weights[block.pattern];
                let part = &rows[from..from + re.len()];
                from += re.len();
                out.push((c64::new(dot(re, part), dot(im, part)), 0.5 * (dot(re, re) + dot(im, im))));
            }
            out
        };
        self.records.iter().zip(rows).map(of).collect()
    }

    /// Rows of all records as they are.
    pub fn rows(&self) -> Vec<Vec<f64>> {
        self.records.iter().map(|r| r.blocks.iter().flat_map(|block| block.z.iter().copied()).collect()).collect()
    }
}
