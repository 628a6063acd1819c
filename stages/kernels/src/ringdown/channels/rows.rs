//! The rows of a fit of decays while lines become modes that follow laws.

use std::f64::consts::TAU;

use faer::{Mat, c64};

use super::companions::{Dropped, DroppedMode, energies};
use super::course::{FollowedDecay, ModeCourse, nearest};
use super::laws::AmplitudeCourse;
use super::result::ChannelRingdown;
use super::shape::ShapePoint;
use crate::ringdown::Estimate;
use crate::ringdown::moving::FollowedMode;

/// Rows with tags that stay while others come and go.
pub(super) struct Rows<'a> {
    followed: FollowedDecay,
    /// The fit with all exponentials.
    all: &'a ChannelRingdown,
    /// Of each row its tag, ...
    tags: Vec<usize>,
    /// ... and the exponential that it was.
    from: Vec<usize>,
    /// Of each dropped mode the exponential that it was.
    dropped_from: Vec<usize>,
    next: usize,
}

impl<'a> Rows<'a> {
    /// Tags are the numbers of the modes.
    pub fn of(followed: FollowedDecay, all: &'a ChannelRingdown) -> Self {
        let at = |pole: c64| nearest(&all.poles, pole).unwrap_or(0);
        let from: Vec<usize> = followed.whole.poles.iter().map(|pole| at(*pole)).collect();
        let dropped_from = followed.dropped.iter().map(|d| at(d.mode.pole())).collect();
        let next = from.len();
        Self { followed, all, tags: (0..next).collect(), from, dropped_from, next }
    }

    pub fn is_empty(&self) -> bool {
        self.tags.is_empty()
    }

    fn place(&self, tag: usize) -> Option<usize> {
        self.tags.iter().position(|own| *own == tag)
    }

    /// Tags of the rows that are of these exponentials.
    pub fn of_poles(&self, own: &[usize]) -> Vec<usize> {
        self.tags.iter().zip(&self.from).filter(|(_, from)| own.contains(from)).map(|(tag, _)| *tag).collect()
    }

    /// The row with the most energy.
    pub fn strongest(&self, tags: &[usize]) -> usize {
        let energy = energies(&self.followed.whole);
        let of = |tag: usize| self.place(tag).map_or(0.0, |at| energy[at]);
        tags.iter().copied().max_by(|a, b| of(*a).total_cmp(&of(*b))).unwrap_or(0)
    }

    /// A further row, of an exponential. Its tag.
    pub fn restored(&mut self, exponential: usize) -> usize {
        for fit in [&mut self.followed.fit, &mut self.followed.whole] {
            fit.append(self.all, exponential);
        }
        self.tags.push(self.next);
        self.from.push(exponential);
        self.next += 1;
        self.next - 1
    }

    /// An exponential that was taken for a companion is a mode of its own.
    pub fn undrop_companion(&mut self, exponential: usize) {
        let is_one = |(dropped, from): (&DroppedMode, &usize)| {
            *from == exponential && matches!(dropped.reason, Dropped::Companion { .. })
        };
        if let Some(at) = self.followed.dropped.iter().zip(&self.dropped_from).position(is_one) {
            self.followed.dropped.remove(at);
            self.dropped_from.remove(at);
            self.restored(exponential);
        }
    }

    /// All of these exponentials but one row are companions of that row.
    pub fn drop_but(&mut self, own: &[usize], tag: usize) {
        let mac = |at: usize| match self.place(tag) {
            Some(kept) => self.followed.whole.shapes[at].mac(&self.followed.whole.shapes[kept]),
            None => 1.0,
        };
        let others: Vec<(usize, Dropped)> = (0..self.tags.len())
            .filter(|&at| self.tags[at] != tag && own.contains(&self.from[at]))
            .map(|at| (self.tags[at], Dropped::Companion { of: tag, mac: mac(at) }))
            .collect();
        others.into_iter().for_each(|(other, reason)| self.drop_row(other, reason));
        let kept = self.place(tag).map(|at| self.from[at]);
        self.forget(kept);
        for (dropped, from) in self.followed.dropped.iter_mut().zip(&self.dropped_from) {
            if own.contains(from) && !matches!(dropped.reason, Dropped::Companion { .. }) {
                dropped.reason = Dropped::Companion { of: tag, mac: 1.0 };
            }
        }
    }

    /// Takes the exponential that is a row now from the list of those that are none.
    fn forget(&mut self, exponential: Option<usize>) {
        while let Some(at) = self.dropped_from.iter().position(|from| Some(*from) == exponential) {
            self.followed.dropped.remove(at);
            self.dropped_from.remove(at);
        }
    }

    /// All rows of these exponentials are no modes.
    pub fn drop_all(&mut self, own: &[usize], reason: Dropped) {
        self.of_poles(own).into_iter().for_each(|tag| self.drop_row(tag, reason));
    }

    /// A row is no mode.
    pub fn drop_row(&mut self, tag: usize, reason: Dropped) {
        let Some(at) = self.place(tag) else { return };
        self.followed.dropped.push(DroppedMode { mode: self.followed.whole.modes()[at], reason });
        self.dropped_from.push(self.from[at]);
        self.followed.fit = self.followed.fit.without(&[at]);
        self.followed.whole = self.followed.whole.without(&[at]);
        self.tags.remove(at);
        self.from.remove(at);
        self.followed.course.retain(|course| course.mode != tag);
    }

    /// A row has the values of laws at the smallest amplitude.
    pub fn take_laws(&mut self, tag: usize, mode: &FollowedMode, lack_of_fit: f64) {
        self.take_linear(tag, mode, lack_of_fit);
        self.followed.course.retain(|course| course.mode != tag);
        self.followed.along.push(AmplitudeCourse { mode: tag, laws: mode.clone(), share: 1.0 });
    }

    /// The laws of a row hold in this share of the decays alone.
    pub fn holds_in(&mut self, tag: usize, share: f64) {
        let own = self.followed.along.iter_mut().filter(|along| along.mode == tag);
        own.for_each(|along| along.share = share);
    }

    /// A row has frequency, damping, shape and amplitudes of a mode.
    pub fn take_linear(&mut self, tag: usize, mode: &FollowedMode, lack_of_fit: f64) {
        let Some(at) = self.place(tag) else { return };
        let Some(low) = mode.course.first() else { return };
        for fit in [&mut self.followed.fit, &mut self.followed.whole] {
            fit.take_values(at, low.frequency_hz, low.damping_ratio, lack_of_fit);
            fit.take_ringing(at, mode);
        }
    }

    /// Errors of a mode that moves without a law count half of what it moves, rad/s: the value at the smallest amplitude lies
    /// beyond that of the last part.
    pub fn widen(&mut self, tag: usize, half: c64) {
        let Some(at) = self.place(tag) else { return };
        let half = [half.re, half.im];
        for a in 0..2 {
            for b in 0..2 {
                self.followed.fit.covariance[(2 * at + a, 2 * at + b)] += half[a] * half[b];
            }
        }
    }

    /// The same of a line of several exponentials that no law describes: it is said to move, or where both parts do not
    /// have it, the error counts how far the exponentials lie from the row, weighted with their energy.
    pub fn widen_line(&mut self, own: &[usize]) {
        let Some(tag) = self.of_poles(own).first().copied() else { return };
        if let Some(course) = self.followed.course.iter_mut().find(|course| course.mode == tag) {
            course.moves = true;
            return;
        }
        let Some(row) = self.place(tag).map(|at| self.followed.fit.poles[at]) else { return };
        let energy = energies(self.all);
        let sum: f64 = own.iter().map(|&j| energy[j]).sum::<f64>().max(f64::MIN_POSITIVE);
        let apart = |part: fn(c64) -> f64| {
            (own.iter().map(|&j| energy[j] * part(self.all.poles[j] - row).powi(2)).sum::<f64>() / sum).sqrt()
        };
        self.widen(tag, c64::new(apart(|s| s.re), apart(|s| s.im)));
    }

    /// Modes that move from part to part.
    pub fn moving(&self) -> Vec<ModeCourse> {
        self.followed.course.iter().filter(|course| course.moves).copied().collect()
    }

    /// Modes that move, by tag, with the least and the largest angular frequency that they pass through.
    pub fn ranges(&self) -> Vec<(usize, [f64; 2])> {
        let course = self.followed.course.iter().filter(|course| course.moves);
        let parts = course.map(|course| (course.mode, vec![course.first.pole().im, course.last.pole().im]));
        let along = self.followed.along.iter().map(|along| {
            let turns = along.laws.course.iter().map(|at| TAU * at.frequency_hz.value).collect();
            (along.mode, turns)
        });
        let range = |turns: Vec<f64>| {
            [turns.iter().copied().fold(f64::MAX, f64::min), turns.into_iter().fold(f64::MIN, f64::max)]
        };
        parts.chain(along).map(|(tag, turns)| (tag, range(turns))).collect()
    }

    /// Weaker rows within the range that a mode with laws passes through, of lines without: what its motion left.
    pub fn drop_within(&mut self, of: usize, [low, high]: [f64; 2]) {
        let Some(main) = self.place(of) else { return };
        let energy = energies(&self.followed.whole);
        let width = self.followed.fit.poles[main].re.abs();
        let lawless = |tag: usize| self.followed.along.iter().all(|along| along.mode != tag);
        if lawless(of) {
            return;
        }
        let is_one = |at: &usize| {
            let inside = (low - width..high + width).contains(&self.followed.fit.poles[*at].im);
            *at != main && inside && energy[*at] < energy[main] && lawless(self.tags[*at])
        };
        let found: Vec<usize> = (0..self.tags.len()).filter(is_one).map(|at| self.tags[at]).collect();
        for tag in found {
            self.drop_row(tag, Dropped::Companion { of, mac: 1.0 });
        }
    }

    /// Weak rows at a multiple of a mode that moves, anywhere in the range that it passes through, are none.
    pub fn drop_multiples(&mut self, of: usize, [low, high]: [f64; 2]) {
        let Some(main) = self.place(of) else { return };
        let fit = &self.followed.whole;
        let energy = energies(fit);
        let is_one = |at: usize, multiple: f64| {
            let width = fit.poles[at].re.abs();
            let range = multiple * low - width..multiple * high + width;
            energy[at] < WEAK_MULTIPLE * energy[main] && range.contains(&fit.poles[at].im)
        };
        let found: Vec<(usize, usize)> = (0..self.tags.len())
            .filter(|at| *at != main)
            .filter_map(|at| (2..=3).find(|n| is_one(at, *n as f64)).map(|n| (self.tags[at], n)))
            .collect();
        for (tag, multiple) in found {
            self.drop_row(tag, Dropped::Harmonic { of, multiple });
        }
    }

    /// Rows ascending, numbers instead of tags.
    pub fn finished(mut self, residuals: Vec<Vec<Vec<f64>>>) -> FollowedDecay {
        let mut order: Vec<usize> = (0..self.tags.len()).collect();
        let poles = &self.followed.fit.poles;
        order.sort_by(|&a, &b| poles[a].norm().total_cmp(&poles[b].norm()));
        let number = |tag: usize| order.iter().position(|&at| self.tags[at] == tag);
        for dropped in &mut self.followed.dropped {
            match &mut dropped.reason {
                Dropped::Companion { of, .. } | Dropped::Harmonic { of, .. } | Dropped::Sideband { of, .. } => {
                    *of = number(*of).unwrap_or(0);
                }
                _ => {}
            }
        }
        self.followed.course.iter_mut().for_each(|course| course.mode = number(course.mode).unwrap_or(0));
        self.followed.along.iter_mut().for_each(|along| along.mode = number(along.mode).unwrap_or(0));
        self.followed.course.sort_by_key(|course| course.mode);
        self.followed.along.sort_by_key(|along| along.mode);
        self.followed.fit = self.followed.fit.chosen(&order);
        self.followed.whole = self.followed.whole.chosen(&order);
        // without a law the linear fit is what was fitted
        self.followed.residuals = if self.followed.along.is_empty() { Vec::new() } else { residuals };
        self.followed
    }
}

impl ChannelRingdown {
    /// Takes over a mode of another fit of the same records as a further one, its errors independent of the others'.
    fn append(&mut self, other: &Self, from: usize) {
        let old = self.covariance.clone();
        let size = old.nrows();
        self.covariance = Mat::from_fn(size + 2, size + 2, |i, j| {
            if i < size && j < size {
                old[(i, j)]
            } else if i >= size && j >= size {
                other.covariance[(2 * from + i - size, 2 * from + j - size)]
            } else {
                0.0
            }
        });
        self.poles.push(other.poles[from]);
        self.shapes.push(other.shapes[from].clone());
        self.lack_of_fit.push(other.lack_of_fit[from]);
        for (own, record) in self.records.iter_mut().zip(&other.records) {
            own.residues.push(record.residues[from]);
            own.residue_covariance.push(record.residue_covariance[from]);
        }
    }

    /// Natural frequency and damping ratio of a mode, their errors independent.
    fn take_values(&mut self, mode: usize, frequency_hz: Estimate, damping_ratio: Estimate, lack_of_fit: f64) {
        let (omega, ratio) = (TAU * frequency_hz.value, damping_ratio.value.clamp(LEAST_RATIO, 0.99));
        let turn = (1.0 - ratio * ratio).sqrt();
        self.poles[mode] = c64::new(-ratio * omega, turn * omega);
        // change of the pole's parts with frequency and damping ratio
        let (by_omega, by_ratio) = ([-ratio, turn], [-omega, -omega * ratio / turn]);
        let variance = [(TAU * frequency_hz.std).powi(2), damping_ratio.std.powi(2)];
        for a in 0..2 {
            for i in 0..self.covariance.nrows() {
                self.covariance[(2 * mode + a, i)] = 0.0;
                self.covariance[(i, 2 * mode + a)] = 0.0;
            }
        }
        for a in 0..2 {
            for b in 0..2 {
                self.covariance[(2 * mode + a, 2 * mode + b)] =
                    variance[0] * by_omega[a] * by_omega[b] + variance[1] * by_ratio[a] * by_ratio[b];
            }
        }
        self.lack_of_fit[mode] = lack_of_fit;
    }

    /// Shape and amplitudes of a mode; errors of the shape stay.
    fn take_ringing(&mut self, mode: usize, by: &FollowedMode) {
        let amplitudes: Vec<c64> = by.starts.iter().map(|(size, phase)| c64::cis(*phase) * *size).collect();
        for record in &mut self.records {
            record.residues[mode] = amplitudes[record.event] * by.shape[record.channel];
        }
        let shape = &mut self.shapes[mode];
        // errors relative to another reference are of that one's value
        let scale = by.shape[shape.reference].norm_sqr();
        for (point, value) in shape.points.iter_mut().zip(&by.shape) {
            *point = ShapePoint { value: *value, covariance: point.covariance.map(|entry| entry * scale) };
        }
        shape.points[by.reference].covariance = [0.0; 3];
        shape.reference = by.reference;
        shape.amplitudes = amplitudes;
    }
}

/// Energy of a multiple over that of its mode, at most: 15 % of the amplitude, as of weak nonlinearity.
const WEAK_MULTIPLE: f64 = 0.0225;
/// Damping ratio of a row, at least: nothing rings for longer than a hundred million periods.
const LEAST_RATIO: f64 = 1e-9;
