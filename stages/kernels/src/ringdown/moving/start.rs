//! Start values: amplitude and unwrapped phase of each line along time, fitted by the slow equations.

use std::cell::Cell;

use crate::ringdown::moving::blocks::Compressed;
use crate::ringdown::moving::dense::Square;
use crate::ringdown::moving::exponentials::solved;
use crate::ringdown::moving::model::{Mode, Normal, paths, rows_of};
use crate::ringdown::moving::path::path;
use crate::ringdown::moving::search::{Fit, PATH_COST, Problem, fit};
use crate::ringdown::moving::select::{Rules, selected};
use crate::ringdown::moving::terms::Law;
use faer::c64;

/// Standard errors of an envelope above which its phase is known.
const KNOWN: f64 = 4.0;
/// Least points of a line's envelope for a start.
const LEAST_POINTS: usize = 4;

/// A line's envelope at one time.
#[derive(Debug, Clone, Copy)]
pub struct Point {
    /// Time, s.
    pub time_s: f64,
    /// Log of the relative amplitude.
    pub log: f64,
    /// Unwrapped phase, relative to the carrier.
    pub phase: f64,
    /// Squared amplitude over its variance.
    pub weight: f64,
}

/// Log amplitudes and phases of all hits.
pub struct Polar<'a> {
    /// Points of each hit, ascending in time.
    pub hits: Vec<Vec<Point>>,
    /// Factor of all weights.
    pub level: f64,
    /// Multiplications that are left for the trial of further models.
    pub budget: &'a Cell<f64>,
}

impl Problem for Polar<'_> {
    fn is_spent(&self) -> bool {
        self.budget.get() <= 0.0
    }

    fn normal(&self, modes: &[Mode]) -> Option<Normal> {
        let mode = modes.first()?;
        let points: usize = self.hits.iter().map(Vec::len).sum();
        self.budget.set(self.budget.get() - points as f64 * PATH_COST);
        let count = mode.count();
        let (damping, frequency) = (mode.damping.terms.len(), mode.frequency.terms.len());
        let mut out = Normal { information: Square::zeros(count), score: vec![0.0; count], chi_square: 0.0 };
        for (number, (points, start)) in self.hits.iter().zip(&mode.starts).enumerate() {
            let times: Vec<f64> = points.iter().map(|p| p.time_s).collect();
            let path = path(&mode.laws(), *start, &times)?;
            for (point, s) in points.iter().zip(path.nodes.chunks(path.width)) {
                let weight = point.weight * self.level;
                let mut rows: [Vec<(usize, f64)>; 2] =
                    [vec![(2 * number, s[2])], vec![(2 * number, s[3]), (2 * number + 1, 1.0)]];
                let at = mode.laws_at();
                for k in 0..damping + frequency {
                    rows[0].push((at + k, s[4 + 2 * k]));
                    rows[1].push((at + k, s[5 + 2 * k]));
                }
                for (row, left) in rows.iter().zip([point.log - s[0], point.phase - s[1]]) {
                    out.chi_square += weight * left * left;
                    for (i, a) in row {
                        out.score[*i] += weight * a * left;
                        row.iter().for_each(|(j, b)| *out.information.at_mut(*i, *j) += weight * a * b);
                    }
                }
            }
            if points.is_empty() {
                // nothing known of this hit: kept where it is
                *out.information.at_mut(2 * number, 2 * number) += 1.0;
                *out.information.at_mut(2 * number + 1, 2 * number + 1) += 1.0;
            }
        }
        out.chi_square.is_finite().then_some(out)
    }
}

/// Beats of two lines in a block from which on its least squares tells them apart.
const RESOLVED_BEATS: f64 = 2.0;
/// Rounds in which lines that are not resolved are taken off in turn.
const ROUNDS: usize = 3;

/// Modes of all lines, one for each carrier, from their decay rates.
///
/// Lines that the blocks do not tell apart are started as linear modes; each is then followed with the others taken
/// off.
pub fn starts(
    data: &Compressed,
    rates_per_s: &[f64],
    variances: &[f64],
    rules: &Rules,
    budget: &Cell<f64>,
) -> Option<Vec<Mode>> {
    let turns = &data.carriers;
    let half = data.hits.iter().flat_map(|hit| &hit.blocks).map(|b| b.1).fold(f64::INFINITY, f64::min);
    let nearest = (0..turns.len())
        .flat_map(|i| (0..i).map(move |j| (i, j)))
        .map(|(i, j)| (turns[i] - turns[j]).abs())
        .fold(f64::INFINITY, f64::min);
    let rows = data.rows();
    let linear = linear(data, rates_per_s, variances);
    if nearest * 2.0 * half > RESOLVED_BEATS * std::f64::consts::TAU {
        let of = |carrier: usize| {
            let envelopes = data.envelopes(&rows, carrier, false);
            start(data, carrier, envelopes, rates_per_s[carrier], variances, rules, budget)
        };
        let backup = |carrier: usize| linear.as_ref().map(|modes| modes[carrier].clone());
        return (0..turns.len()).map(|carrier| of(carrier).or_else(|| backup(carrier))).collect();
    }
    let mut modes = linear?;
    for _ in 0..ROUNDS {
        for carrier in 0..turns.len() {
            let others: Vec<Mode> = modes.iter().filter(|m| m.carrier != carrier).cloned().collect();
            let Some(paths) = paths(data, &others) else { continue };
            let left: Vec<Vec<f64>> = data.records.iter().map(|r| rows_of(data, r, &others, &paths).left).collect();
            let envelopes = data.envelopes(&left, carrier, true);
            if let Some(mode) = start(data, carrier, envelopes, rates_per_s[carrier], variances, rules, budget) {
                modes[carrier] = mode;
            }
        }
    }
    Some(modes)
}

/// Share of the blocks, the last, in which a plateau is looked for.
const LAST_SHARE: f64 = 0.25;
/// Coherence of the envelope there, and factor by which the record starts larger, of a plateau.
const PLATEAU: (f64, f64) = (0.97, 3.0);

/// Modes of all lines with the steady lines taken off that the decays end in, and those lines behind them; none where
/// no line ends in one.
pub fn plateaus(
    data: &Compressed,
    rates_per_s: &[f64],
    variances: &[f64],
    rules: &Rules,
    budget: &Cell<f64>,
) -> Option<Vec<Mode>> {
    let rows = data.rows();
    let linear = linear(data, rates_per_s, variances)?;
    let of = |mode: &Mode| plateau(data, mode, &data.envelopes(&rows, mode.carrier, false));
    let steady: Vec<Mode> = linear.iter().filter_map(of).collect();
    if steady.is_empty() {
        return None;
    }
    let paths = paths(data, &steady)?;
    let left: Vec<Vec<f64>> = data.records.iter().map(|r| rows_of(data, r, &steady, &paths).left).collect();
    let moving = |mode: Mode| {
        let envelopes = data.envelopes(&left, mode.carrier, false);
        start(data, mode.carrier, envelopes, rates_per_s[mode.carrier], variances, rules, budget).unwrap_or(mode)
    };
    Some(linear.into_iter().map(moving).chain(steady).collect())
}

/// The steady line that a line's envelope ends in.
fn plateau(data: &Compressed, like: &Mode, envelopes: &[Vec<(c64, f64)>]) -> Option<Mode> {
    let turn = data.carriers[like.carrier];
    let last = |hit: usize| {
        let count = data.hits[hit].blocks.len();
        count - ((LAST_SHARE * count as f64) as usize).min(count)..count
    };
    // relative to the carrier
    let slow = |record: usize, block: usize| {
        let middle = data.hits[data.records[record].hit].blocks[block].0;
        (middle, envelopes[record][block].0 * c64::cis(-turn * middle))
    };
    let longest = (0..data.hits.len()).max_by_key(|hit| data.hits[*hit].blocks.len())?;
    let record = longest * data.channels + like.reference;
    let blocks = last(longest);
    if blocks.len() < 4 {
        return None;
    }
    let step = (blocks.start + 1..blocks.end).map(|b| slow(record, b).1 * slow(record, b - 1).1.conj());
    let apart = slow(record, blocks.start + 1).0 - slow(record, blocks.start).0;
    let offset = step.fold(c64::default(), |a, b| a + b).arg() / apart;
    let mean = |record: usize| {
        let blocks = last(data.records[record].hit);
        let (count, unturned) = (blocks.len().max(1) as f64, |b: usize| {
            let (middle, value) = slow(record, b);
            value * c64::cis(-offset * middle)
        });
        blocks.map(unturned).fold(c64::default(), |a, b| a + b).scale(1.0 / count)
    };
    let size = |b: usize| slow(record, b).1.norm();
    let average = blocks.clone().map(size).sum::<f64>() / blocks.len() as f64;
    let level = mean(record);
    let coherent = level.norm() > PLATEAU.0 * average;
    let starts_larger = size(0) > PLATEAU.1 * level.norm();
    // the first half of the stretch is no larger than the second
    let half = blocks.start + blocks.len() / 2;
    let part = |range: std::ops::Range<usize>| range.clone().map(size).sum::<f64>() / range.len().max(1) as f64;
    let flat = part(blocks.start..half) < 1.15 * part(half..blocks.end);
    if !(coherent && starts_larger && flat && level.norm() > 0.0) {
        return None;
    }
    let duration = data.hits[longest].duration_s;
    let mut mode = Mode {
        unit: level.norm(),
        damping: Law::constant(1e-3 / duration),
        frequency: Law::constant(offset),
        may_move: false,
        ..like.clone()
    };
    for hit in 0..data.hits.len() {
        let value = mean(hit * data.channels + like.reference);
        mode.starts[hit] = ((value.norm() / level.norm()).max(1e-6).ln(), value.arg());
    }
    for channel in (0..data.channels).filter(|c| *c != like.reference) {
        let ratio = mean(longest * data.channels + channel) * level.conj();
        mode.shape[channel] = ratio.scale(1.0 / level.norm_sqr());
    }
    Some(mode)
}

/// Linear modes at the carriers.
pub fn linear(data: &Compressed, rates_per_s: &[f64], variances: &[f64]) -> Option<Vec<Mode>> {
    let energy = |channel: usize| -> f64 {
        let records = data.records.iter().filter(|r| r.channel == channel).flat_map(|r| &r.blocks);
        records.flat_map(|block| &block.z).map(|z| z * z).sum::<f64>() / variances[channel]
    };
    let reference = (0..data.channels).max_by(|a, b| energy(*a).total_cmp(&energy(*b)))?;
    let unit = |carrier: usize| Mode {
        carrier,
        turn: data.carriers[carrier],
        multiples: [None, None],
        unit: 1.0,
        floor: 1e-4,
        damping: Law::constant(rates_per_s[carrier]),
        frequency: Law::constant(0.0),
        starts: Vec::new(),
        shape: Vec::new(),
        reference,
        harmonics: [None, None],
        may_move: true,
        probe: None,
    };
    let mut modes = solved(data, &[], (0..data.carriers.len()).map(unit).collect())?;
    for mode in &mut modes {
        // relative amplitudes: the largest start is 1
        let high = mode.starts.iter().map(|s| s.0).fold(f64::MIN, f64::max);
        mode.starts.iter_mut().for_each(|s| s.0 -= high);
        mode.unit = high.exp();
        mode.floor = floor(variances[reference], mode.unit);
    }
    Some(modes)
}

fn floor(variance: f64, unit: f64) -> f64 {
    (0.2 * variance.sqrt() / unit).clamp(1e-4, 0.1)
}

/// A mode for a carrier's line, from its envelopes in all records; none where the line is nowhere above the noise.
fn start(
    data: &Compressed,
    carrier: usize,
    envelopes: Vec<Vec<(c64, f64)>>,
    rate_per_s: f64,
    variances: &[f64],
    rules: &Rules,
    budget: &Cell<f64>,
) -> Option<Mode> {
    let (channels, hits) = (data.channels, data.hits.len());
    let energy = |channel: usize| -> f64 {
        let records = data.records.iter().zip(&envelopes).filter(|(r, _)| r.channel == channel);
        records.flat_map(|(_, e)| e.iter().map(|(v, _)| v.norm_sqr())).sum::<f64>() / variances[channel]
    };
    let reference = (0..channels).max_by(|a, b| energy(*a).total_cmp(&energy(*b)))?;
    let of = |hit: usize, channel: usize| &envelopes[hit * channels + channel];
    let shape: Vec<c64> = (0..channels)
        .map(|channel| {
            let (mut cross, mut own) = (c64::default(), 0.0);
            for hit in 0..hits {
                for (a, b) in of(hit, channel).iter().zip(of(hit, reference)) {
                    cross += a.0 * b.0.conj();
                    own += b.0.norm_sqr();
                }
            }
            if channel == reference { c64::new(1.0, 0.0) } else { cross.scale(1.0 / own.max(1e-300)) }
        })
        .collect();
    let size: f64 = shape.iter().zip(variances).map(|(s, v)| s.norm_sqr() / v).sum();
    let combined = |hit: usize, block: usize| -> (c64, f64) {
        let terms = (0..channels).map(|c| (of(hit, c)[block].0 * shape[c].conj()).scale(1.0 / variances[c] / size));
        let variance = (0..channels).map(|c| of(hit, c)[block].1).fold(0.0, f64::max) / size;
        (terms.fold(c64::default(), |a, b| a + b), variance)
    };
    let mut polar = Polar { hits: Vec::new(), level: 1.0, budget };
    let mut unit = 0.0_f64;
    for hit in 0..hits {
        let mut points: Vec<Point> = Vec::new();
        let mut weak = 0;
        for (block, (middle, _)) in data.hits[hit].blocks.iter().enumerate() {
            let (value, variance) = combined(hit, block);
            let known = value.norm_sqr() > KNOWN * KNOWN * variance;
            if !known {
                weak += 1;
                if weak > 1 && !points.is_empty() {
                    break;
                }
                continue;
            }
            weak = 0;
            let raw = value.arg() - data.carriers[carrier] * middle;
            let before = points.last().map_or(raw.rem_euclid(std::f64::consts::TAU), |p| p.phase);
            let turns = ((raw - before) / std::f64::consts::TAU).round();
            let phase = raw - turns * std::f64::consts::TAU;
            unit = unit.max(value.norm());
            points.push(Point { time_s: *middle, log: value.norm().ln(), phase, weight: value.norm_sqr() / variance });
        }
        polar.hits.push(points);
    }
    let count: usize = polar.hits.iter().map(Vec::len).sum();
    if unit.is_nan() || unit <= 0.0 || count == 0 {
        return None;
    }
    polar.hits.iter_mut().flatten().for_each(|p| p.log -= unit.ln());
    let floor = floor(variances[reference], unit);
    let first = |points: &Vec<Point>| points.first().map_or((-20.0, 0.0), |p| (p.log + rate_per_s * p.time_s, p.phase));
    let mut mode = Mode {
        carrier,
        turn: data.carriers[carrier],
        multiples: [None, None],
        unit,
        floor,
        damping: Law::constant(rate_per_s),
        frequency: Law::constant(0.0),
        starts: polar.hits.iter().map(first).collect(),
        shape: vec![c64::new(1.0, 0.0)],
        reference: 0,
        harmonics: [None, None],
        may_move: true,
        probe: None,
    };
    if count >= LEAST_POINTS + hits {
        let slope = slope(&polar.hits);
        mode.frequency = Law::constant(slope);
        if let Some(found) = fit(&polar, vec![mode.clone()]) {
            mode = chosen(&mut polar, found, rules).modes.into_iter().next()?;
        }
    }
    mode.shape = shape;
    mode.reference = reference;
    Some(mode)
}

/// Terms chosen under the level that the fit leaves.
fn chosen(polar: &mut Polar<'_>, first: Fit, rules: &Rules) -> Fit {
    let rows = 2 * polar.hits.iter().map(Vec::len).sum::<usize>();
    let once = selected(polar, first, rules, 3);
    let degrees = rows.saturating_sub(once.parameters()).max(1) as f64;
    let level = once.normal.chi_square / degrees;
    if level <= 1.5 {
        return once;
    }
    polar.level = 1.0 / level;
    match fit(polar, once.modes.clone()) {
        Some(again) => selected(polar, again, rules, 3),
        None => once,
    }
}

/// Weighted slope of the phase, one offset for each hit.
fn slope(hits: &[Vec<Point>]) -> f64 {
    let (mut products, mut squares) = (0.0, 0.0);
    for points in hits {
        let weight: f64 = points.iter().map(|p| p.weight).sum::<f64>().max(1e-300);
        let mean = |f: &dyn Fn(&Point) -> f64| points.iter().map(|p| p.weight * f(p)).sum::<f64>() / weight;
        let (time, phase) = (mean(&|p| p.time_s), mean(&|p| p.phase));
        products += points.iter().map(|p| p.weight * (p.time_s - time) * (p.phase - phase)).sum::<f64>();
        squares += points.iter().map(|p| p.weight * (p.time_s - time).powi(2)).sum::<f64>();
    }
    if squares > 0.0 { products / squares } else { 0.0 }
}
