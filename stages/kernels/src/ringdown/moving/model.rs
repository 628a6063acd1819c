//! The model of all records, its parameters and its normal equations.

use crate::ringdown::moving::blocks::{COLUMNS, Compressed, NODES, Record};
use crate::ringdown::moving::dense::Square;
use crate::ringdown::moving::path::{Laws, Path, path};
use crate::ringdown::moving::terms::Law;
use faer::c64;

/// Largest damping ratio at which the slow equations hold: a quarter of the amplitude is lost in a period.
pub const MOST_DAMPING: f64 = 0.05;

/// Multiples of the phase that are modelled beside the first.
pub const MULTIPLES: [usize; 2] = [2, 3];

/// A mode in all hits and channels.
///
/// `y_c(t) = unit Re( shape_c a exp(i phi) + sum_n harmonics_n,c a^n exp(i n phi) )`, `phi = psi + carrier t`.
#[derive(Debug, Clone)]
pub struct Mode {
    /// Number of its carrier.
    pub carrier: usize,
    /// Numbers of the carriers of its multiples.
    pub multiples: [Option<usize>; 2],
    /// Frequency of that carrier, rad/s.
    pub turn: f64,
    /// Amplitude in the reference channel where a = 1, in that channel's unit.
    pub unit: f64,
    /// Relative amplitude below which `log a` and `1/a` level off.
    pub floor: f64,
    /// Damping, 1/s: [`Laws`].
    pub damping: Law,
    /// Natural frequency less that of the carrier, rad/s.
    pub frequency: Law,
    /// Log of the relative amplitude and phase at the first sample of each hit.
    pub starts: Vec<(f64, f64)>,
    /// Of each channel; 1 in the reference channel.
    pub shape: Vec<c64>,
    /// Number of the channel in which amplitudes count.
    pub reference: usize,
    /// Weights of the multiples in each channel.
    pub harmonics: [Option<Vec<c64>>; 2],
    /// Whether terms may be added to its laws: false for linear modes that stand in place of one that moves.
    pub may_move: bool,
    /// What else is tested, with no value of its own.
    pub probe: Option<Probe>,
}

/// Deviations of log amplitude and phase as Legendre polynomials of the squared amplitude: what laws of other terms
/// leave.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Probe {
    /// Polynomials, of degree 1, 2, ...
    pub count: usize,
    /// Squares of the least and the largest amplitude.
    pub between: (f64, f64),
}

impl Probe {
    /// Values of the polynomials at a log amplitude.
    fn at(&self, log: f64) -> Vec<f64> {
        let (low, high) = self.between;
        let u = (1.0 - 2.0 * ((2.0 * log).exp() - low) / (high - low).max(1e-12)).clamp(-1.0, 1.0);
        let mut all = vec![1.0, u];
        for n in 1..self.count {
            let m = n as f64;
            all.push(((2.0 * m + 1.0) * u * all[n] - m * all[n - 1]) / (m + 1.0));
        }
        all.split_off(1)
    }
}

impl Mode {
    /// Number of parameters: of each hit log amplitude and phase, then coefficients of damping and frequency, then
    /// shape of all channels but the reference, then weights of the multiples.
    pub fn count(&self) -> usize {
        let harmonics: usize = self.harmonics.iter().flatten().map(|h| 2 * h.len()).sum();
        self.laws_at()
            + self.damping.terms.len()
            + self.frequency.terms.len()
            + 2 * (self.shape.len() - 1)
            + harmonics
            + self.probe_count()
    }

    fn probe_count(&self) -> usize {
        self.probe.map_or(0, |probe| 2 * probe.count)
    }

    /// Places of the probe's parameters: the last.
    pub fn probe_places(&self) -> std::ops::Range<usize> {
        self.count() - self.probe_count()..self.count()
    }

    /// Place of the first coefficient of the damping among its parameters.
    pub fn laws_at(&self) -> usize {
        2 * self.starts.len()
    }

    /// Its laws.
    pub fn laws(&self) -> Laws<'_> {
        Laws { damping: &self.damping, frequency: &self.frequency, carrier: self.turn, floor: self.floor }
    }

    /// Whether frequency or damping depend on the amplitude.
    pub fn moves(&self) -> bool {
        self.damping.moves() || self.frequency.moves()
    }

    fn shape_at(&self) -> usize {
        self.laws_at() + self.damping.terms.len() + self.frequency.terms.len()
    }

    fn shape_place(&self, channel: usize) -> Option<usize> {
        let number = channel - usize::from(channel > self.reference);
        (channel != self.reference).then_some(self.shape_at() + 2 * number)
    }

    fn harmonic_place(&self, which: usize, channel: usize) -> usize {
        let before: usize = self.harmonics[..which].iter().flatten().map(|h| 2 * h.len()).sum();
        self.shape_at() + 2 * (self.shape.len() - 1) + before + 2 * channel
    }

    fn moved(&self, step: &[f64]) -> Self {
        let mut mode = self.clone();
        for (start, d) in mode.starts.iter_mut().zip(step.chunks(2)) {
            start.0 += d[0];
            start.1 += d[1];
        }
        let laws = mode.damping.coefficients.iter_mut().chain(&mut mode.frequency.coefficients);
        laws.zip(&step[self.laws_at()..]).for_each(|(coefficient, d)| *coefficient += d);
        for channel in 0..self.shape.len() {
            if let Some(place) = self.shape_place(channel) {
                mode.shape[channel] += c64::new(step[place], step[place + 1]);
            }
            for which in 0..2 {
                let place = self.harmonic_place(which, channel);
                if let Some(h) = &mut mode.harmonics[which] {
                    h[channel] += c64::new(step[place], step[place + 1]);
                }
            }
        }
        mode
    }
}

/// The modes moved by a step of all parameters.
pub fn moved(modes: &[Mode], step: &[f64]) -> Vec<Mode> {
    let mut at = 0;
    let of = |mode: &Mode| {
        let count = mode.count();
        at += count;
        mode.moved(&step[at - count..at])
    };
    modes.iter().map(of).collect()
}

/// Normal equations: half the curvature of chi square, half its downward slope, and chi square.
#[derive(Debug, Clone)]
pub struct Normal {
    /// `J' J`.
    pub information: Square,
    /// `J' r`.
    pub score: Vec<f64>,
    /// Weighted energy that is left in the rows.
    pub chi_square: f64,
}

/// Paths of all modes in all hits; none where one grows out of bounds.
pub fn paths(data: &Compressed, modes: &[Mode]) -> Option<Vec<Vec<Path>>> {
    let of = |mode: &Mode| -> Option<Vec<Path>> {
        let hits = data.hits.iter().zip(&mode.starts);
        hits.map(|(hit, start)| path(&mode.laws(), *start, &hit.times_s)).collect()
    };
    modes.iter().map(of).collect()
}

/// Normal equations at `modes` with the inverse variance of each channel; none where a path grows out of bounds.
pub fn normal(data: &Compressed, modes: &[Mode], weights: &[f64]) -> Option<Normal> {
    let paths = paths(data, modes)?;
    let total = modes.iter().map(Mode::count).sum();
    let mut out = Normal { information: Square::zeros(total), score: vec![0.0; total], chi_square: 0.0 };
    for record in &data.records {
        let rows = rows_of(data, record, modes, &paths);
        let weight = weights[record.channel];
        out.chi_square += weight * rows.left.iter().map(|r| r * r).sum::<f64>();
        for (i, (place, column)) in rows.columns.iter().enumerate() {
            out.score[*place] += weight * dot(column, &rows.left);
            for (other, second) in &rows.columns[..=i] {
                let product = weight * dot(column, second);
                *out.information.at_mut(*place, *other) += product;
                if place != other {
                    *out.information.at_mut(*other, *place) += product;
                }
            }
        }
    }
    let finite = out.chi_square.is_finite() && out.score.iter().all(|v| v.is_finite());
    finite.then_some(out)
}

/// Residual rows of a record and the derivatives of the model, with their places among all parameters.
pub struct Rows {
    /// Data less model.
    pub left: Vec<f64>,
    /// Place and values.
    pub columns: Vec<(usize, Vec<f64>)>,
}

/// Rows of one record, offset and slope projected out.
pub fn rows_of(data: &Compressed, record: &Record, modes: &[Mode], paths: &[Vec<Path>]) -> Rows {
    let mut left: Vec<f64> = record.blocks.iter().flat_map(|block| block.z.iter().copied()).collect();
    let mut columns: Vec<(usize, Vec<f64>)> = Vec::new();
    let mut base = 0;
    for (mode, path) in modes.iter().zip(paths) {
        let first = columns.len();
        let places = local_places(mode, record);
        columns.extend(places.iter().map(|p| (base + p, vec![0.0; record.rows])));
        let mut row0 = 0;
        for (b, block) in record.blocks.iter().enumerate() {
            let pattern = &data.patterns[block.pattern];
            let middle = data.hits[record.hit].blocks[b].0;
            let local =
                Local { mode, record, path: &path[record.hit], block: b, turn: data.carriers[mode.carrier] * middle };
            for (carrier, values, derivatives) in local.orders() {
                for i in 0..pattern.rows {
                    let from = i * pattern.columns + carrier * COLUMNS;
                    let r = &pattern.r[from..from + COLUMNS];
                    left[row0 + i] -= along(r, &values);
                    for (k, derivative) in derivatives.iter().enumerate() {
                        if let Some(derivative) = derivative {
                            columns[first + k].1[row0 + i] += along(r, derivative);
                        }
                    }
                }
            }
            row0 += pattern.rows;
        }
        base += mode.count();
    }
    for unit in &record.drift {
        for column in columns.iter_mut().map(|c| &mut c.1).chain(std::iter::once(&mut left)) {
            let share = dot(unit, column);
            column.iter_mut().zip(unit).for_each(|(v, u)| *v -= share * u);
        }
    }
    Rows { left, columns }
}

fn along(r: &[f64], values: &[c64; NODES]) -> f64 {
    (0..NODES).map(|j| r[2 * j] * values[j].re + r[2 * j + 1] * values[j].im).sum()
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

/// Places, among the mode's parameters, of those that a record depends on.
fn local_places(mode: &Mode, record: &Record) -> Vec<usize> {
    let laws = mode.damping.terms.len() + mode.frequency.terms.len();
    let mut places = vec![2 * record.hit, 2 * record.hit + 1];
    places.extend(mode.laws_at()..mode.laws_at() + laws);
    places.extend(mode.shape_place(record.channel).iter().flat_map(|p| [*p, p + 1]));
    for which in 0..2 {
        if mode.harmonics[which].is_some() {
            let place = mode.harmonic_place(which, record.channel);
            places.extend([place, place + 1]);
        }
    }
    places.extend(mode.probe_places());
    places
}

/// A mode in a block of a record.
struct Local<'a> {
    mode: &'a Mode,
    record: &'a Record,
    path: &'a Path,
    block: usize,
    /// Phase of the carrier in the middle of the block.
    turn: f64,
}

type Nodes = [c64; NODES];
type Order = (usize, Nodes, Vec<Option<Nodes>>);

impl Local<'_> {
    /// Of each multiple of the phase: its carrier, the envelope at the nodes, and its derivatives by the local
    /// parameters.
    fn orders(&self) -> Vec<Order> {
        let mode = self.mode;
        let mut out = vec![self.order(1, mode.carrier, mode.shape[self.record.channel], None)];
        for (which, multiple) in MULTIPLES.into_iter().enumerate() {
            if let (Some(carrier), Some(weights)) = (mode.multiples[which], &mode.harmonics[which]) {
                out.push(self.order(multiple, carrier, weights[self.record.channel], Some(which)));
            }
        }
        out
    }

    fn order(&self, n: usize, carrier: usize, weight: c64, which: Option<usize>) -> Order {
        let (mode, width) = (self.mode, self.path.width);
        let node = |j: usize| {
            let from = (NODES * self.block + j) * width;
            &self.path.nodes[from..from + width]
        };
        let power = n as f64;
        let wave: Nodes = std::array::from_fn(|j| {
            let s = node(j);
            c64::cis(power * (s[1] + self.turn)).scale(mode.unit * (power * s[0]).exp())
        });
        let values: Nodes = std::array::from_fn(|j| wave[j] * weight);
        let mut derivatives: Vec<Option<Nodes>> = Vec::with_capacity(16);
        let mut times = |f: &dyn Fn(&[f64]) -> c64| {
            derivatives.push(Some(std::array::from_fn(|j| values[j] * f(node(j)).scale(power))));
        };
        times(&|s| c64::new(s[2], s[3]));
        times(&|_| c64::new(0.0, 1.0));
        for k in 0..mode.damping.terms.len() + mode.frequency.terms.len() {
            times(&|s| c64::new(s[4 + 2 * k], s[5 + 2 * k]));
        }
        let weights = |mine: bool, out: &mut Vec<Option<Nodes>>| {
            let i = c64::new(0.0, 1.0);
            out.push(mine.then_some(wave));
            out.push(mine.then(|| std::array::from_fn(|j| wave[j] * i)));
        };
        if self.record.channel != mode.reference {
            weights(which.is_none(), &mut derivatives);
        }
        for other in 0..2 {
            if mode.harmonics[other].is_some() {
                weights(which == Some(other), &mut derivatives);
            }
        }
        if let Some(probe) = mode.probe {
            let at: [Vec<f64>; NODES] = std::array::from_fn(|j| probe.at(node(j)[0]));
            let along = |k: usize| -> [f64; NODES] { std::array::from_fn(|j| power * at[j][k]) };
            for along in (0..probe.count).map(along) {
                let turned = |j: usize| values[j] * c64::new(0.0, 1.0);
                derivatives.push(Some(std::array::from_fn(|j| values[j].scale(along[j]))));
                derivatives.push(Some(std::array::from_fn(|j| turned(j).scale(along[j]))));
            }
        }
        (carrier, values, derivatives)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ringdown::moving::blocks::compress;
    use crate::ringdown::moving::terms::Term;

    fn mode() -> Mode {
        Mode {
            carrier: 0,
            turn: 30.0,
            multiples: [None, Some(1)],
            unit: 2.0,
            floor: 1e-3,
            damping: Law { terms: vec![Term::One, Term::Linear], coefficients: vec![0.2, 0.1] },
            frequency: Law { terms: vec![Term::One, Term::Square], coefficients: vec![0.1, -0.4] },
            starts: vec![(-0.1, 0.3), (-0.7, 1.0)],
            shape: vec![c64::new(1.0, 0.0), c64::new(-0.4, 0.1)],
            reference: 0,
            harmonics: [None, Some(vec![c64::new(0.02, 0.01), c64::new(0.0, 0.03)])],
            may_move: true,
            probe: None,
        }
    }

    #[test]
    fn the_score_is_the_slope_of_chi_square() {
        let rows: Vec<Vec<f64>> = (0..4)
            .map(|r| (0..900).map(|k| (0.31 * k as f64).sin() * (-0.002 * k as f64).exp() + 0.1 * r as f64).collect())
            .collect();
        let events = vec![vec![&rows[0][..], &rows[1][..]], vec![&rows[2][..], &rows[3][..]]];
        let data = compress(&events, 0.01, &[30.0, 90.0], 0.3);
        let modes = vec![mode()];
        let weights = [1.0, 2.0];
        let base = normal(&data, &modes, &weights).expect("normal equations");
        for k in 0..base.score.len() {
            let chi_square = |size: f64| {
                let mut step = vec![0.0; base.score.len()];
                step[k] = size;
                normal(&data, &moved(&modes, &step), &weights).expect("normal equations").chi_square
            };
            let expected = -0.5 * (chi_square(1e-5) - chi_square(-1e-5)) / 2e-5;
            let scale = base.information.at(k, k).sqrt() * base.chi_square.sqrt();
            assert!((base.score[k] - expected).abs() < 1e-4 * scale, "{k}: {} {expected}", base.score[k]);
        }
    }

    #[test]
    fn rows_of_a_signal_of_the_model_are_zero() {
        // an exact linear decay: what is left is the error of cubic envelopes, (s h)^4 / 192 of the amplitude
        let (rate, turn, interval) = (0.2, 31.0, 0.01);
        let y: Vec<f64> = (0..1500)
            .map(|k| k as f64 * interval)
            .map(|t| 2.0 * (-rate * t).exp() * (turn * t + 0.3).cos() + 5.0 - 0.1 * t)
            .collect();
        let data = compress(&[vec![&y[..]]], interval, &[30.0], 0.4);
        let mut mode = mode();
        mode.damping = Law::constant(rate);
        mode.frequency = Law::constant(1.0 + 0.5 * rate * rate / turn);
        mode.starts = vec![(0.0, 0.3)];
        mode.shape = vec![c64::new(1.0, 0.0)];
        mode.harmonics = [None, None];
        let normal = normal(&data, &[mode], &[1.0]).expect("normal equations");
        let (left, bound) = ((normal.chi_square / 1500.0).sqrt(), 2.0 * (1.02_f64 * 0.4).powi(4) / 192.0);
        assert!(left < bound, "{left} {bound}");
    }
}
