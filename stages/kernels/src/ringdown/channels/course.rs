//! Whether modes keep their frequency and damping while they die away.

use std::ops::Range;

use faer::c64;

use super::companions::{Dropped, DroppedMode, brief, broad, companions, energies, steady, undetermined};
use super::laws::{AmplitudeCourse, LawFit, OneLine, follow_laws, oscillations};
use super::levels::density;
use super::options::{ChannelOptions, ModesWanted};
use super::order::fit_channels;
use super::records::LEAST_SAMPLES;
use super::result::{ChannelRingdown, RecordFit};
use crate::model::ModelError;
use crate::ringdown::{Estimate, ModeEstimate};
use crate::statistics::chi_square_tail;

/// A mode in the first and in the last part of the decays.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ModeCourse {
    /// Number of the mode in the fit, from 0.
    pub mode: usize,
    /// Sample at which the first part ends and the last begins.
    pub cut: usize,
    /// Its estimate in the first part.
    pub first: ModeEstimate,
    /// Its estimate in the last part.
    pub last: ModeEstimate,
    /// Difference of the frequencies (last less first) over its standard error.
    pub frequency_z: f64,
    /// The same of the damping ratios.
    pub damping_z: f64,
    /// Probability of poles as far apart in a linear decay.
    pub p_value: f64,
    /// Whether that is below [`MOVES`] over the number of modes.
    pub moves: bool,
    /// Whether it has moved so far that one linear mode cannot stand for both parts: the fit then has its last part.
    pub far: bool,
}

/// What stands for a mode that moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Motion {
    /// One linear mode for all of each decay.
    Whole,
    /// The linear mode of its last part, where it has moved far.
    LastPart,
    /// Its laws at the smallest amplitude, where it follows laws of its amplitude; its last part where it does not.
    Laws,
}

/// A fit of decays, its companions left out, and how its modes change.
#[derive(Debug, Clone)]
pub struct FollowedDecay {
    /// Modes of all of the decays; those that follow laws of their amplitude at the smallest one, others that have moved
    /// far with the poles and shapes of their last part.
    pub fit: ChannelRingdown,
    /// The same modes by the fit of all of the decays alone.
    pub whole: ChannelRingdown,
    /// The fit with all its exponentials.
    pub fitted: ChannelRingdown,
    /// Fitted exponentials that are no modes.
    pub dropped: Vec<DroppedMode>,
    /// Modes that both of their parts have, ascending; without those that follow laws.
    pub course: Vec<ModeCourse>,
    /// Modes that follow laws of their amplitude, ascending.
    pub along: Vec<AmplitudeCourse>,
    /// What is left of hits x channels x samples under these laws; empty where no mode follows any.
    pub residuals: Vec<Vec<Vec<f64>>>,
}

impl FollowedDecay {
    /// As [`ChannelRingdown::add_error_of_rate`], along the amplitude of modes that follow laws too.
    pub fn add_error_of_rate(&mut self, relative_std: f64) {
        self.fit.add_error_of_rate(relative_std);
        let add = |frequency: &mut Estimate| frequency.std = frequency.std.hypot(relative_std * frequency.value);
        for along in &mut self.along {
            add(&mut along.laws.frequency_hz);
            along.laws.course.iter_mut().for_each(|at| add(&mut at.frequency_hz));
        }
    }
}

/// Probability that any mode of a linear decay is said to move.
pub const MOVES: f64 = 1e-3;
/// Decay times of a mode after which its last part begins.
///
/// The error of the difference between the parts' frequencies is least there: with `u = 2 a t`, the information before
/// is `(1 - e^-u) (1 - u^2 e^-u / (1 - e^-u)^2)` of all and after `e^-u`; the sum of inverses is least at u = 1.8.
/// What a frequency quadratic in the amplitude moves between the parts does not depend on the cut.
const CUT: f64 = 0.9;
/// Samples that long first parts are a multiple of: their transforms are quicker, and like decays have like parts.
const BLOCK: usize = 64;
/// First parts of fewer such blocks end at any sample: a tenth of the best length at most does not count.
const LEAST_BLOCKS: usize = 10;
/// Energy of a mode in a part, in variances of the noise, that a comparison needs: in the last part its damping is then
/// known to `2/sqrt(50)`, 28 %.
const KNOWN: f64 = 50.0;
/// The same of what is no mode and fitted along with a part: less is noise's, chi-square of four degrees at 0.1 %.
const SEEN: f64 = 18.5;
/// Decay rates that share a cut, the largest over the smallest. At a factor sqrt 2 from its best place the error of the
/// difference is 16 % more than the least, at a factor 2 60 to 83 %: what that costs the weaker modes of a group saves
/// two fits each.
const ONE_CUT: f64 = 2.0;
/// Phase in radian by which a linear mode may be wrong while the mode that it stands for dies away: a tenth, a shift of
/// the frequency by a tenth of the half width; likewise of the damping.
pub(super) const FAR: f64 = 0.1;

/// Fits decays as [`fit_channels`] does, looks whether their modes move with their amplitude, and leaves out what is no
/// mode.
///
/// # Model
/// As [`fit_channels`] in each part. A mode whose frequency and damping change while it dies away is several
/// exponentials in a linear fit: these companions lie in its line and have its shape. With [`Motion::Laws`] such a mode
/// is one whose frequency and damping are functions of its amplitude ([`follow_moving`](crate::ringdown::moving)).
/// # Method
/// Exponentials in the line of a slower one, of its shape and at least twice as fast, are dropped ([`Dropped`]): their
/// modes are fitted again without them, errors widened by what is then left round each line; of all other modes they
/// stay nuisances. So do lines, exponentials without a maximum in their response, and those of which nothing is known, in
/// each part that they are seen in. Modes of like decay rate are fitted to the
/// first and to the last part by themselves: for a linear system they are the same there (chi square of the difference of
/// both poles at the level [`MOVES`] for all modes together). With one channel every shape is the same: there the line
/// and the rate decide.
/// # Shapes
/// As [`fit_channels`]; `motion`: what stands for modes that move.
/// # Units
/// As [`fit_channels`].
/// # Accuracy
/// docs/results/decay.md.
/// # Errors
/// Those of [`fit_channels`].
/// # Source
/// A. Wald, Trans. Am. Math. Soc. 54 (1943) 426; R. J. Allemang, D. L. Brown, Proc. 1st IMAC (1982) 110.
pub fn follow_channels(
    events: &[Vec<&[f64]>],
    free: &[Vec<&[f64]>],
    interval_s: f64,
    options: &ChannelOptions,
    motion: Motion,
) -> Result<FollowedDecay, ModelError> {
    follow_fitted(&fit_channels(events, free, interval_s, options)?, events, free, interval_s, options, motion)
}

/// [`follow_channels`] from `all`, what [`fit_channels`] gave for the same decays and options.
///
/// # Shapes
/// As [`fit_channels`].
/// # Units
/// As [`fit_channels`].
/// # Errors
/// Those of [`follow_channels`].
/// # Source
/// As [`follow_channels`].
pub fn follow_fitted(
    all: &ChannelRingdown,
    events: &[Vec<&[f64]>],
    free: &[Vec<&[f64]>],
    interval_s: f64,
    options: &ChannelOptions,
    motion: Motion,
) -> Result<FollowedDecay, ModelError> {
    let fixed = matches!(options.modes, ModesWanted::Fixed(_)) || !options.start.is_empty();
    let records = LawFit { all, events, interval_s, options };
    let linear = |one_line: &[OneLine]| follow_linear(&records, free, (fixed, motion == Motion::Whole), one_line);
    if fixed || motion == Motion::Whole {
        return linear(&[]);
    }
    let found = match (linear(&[]), motion) {
        (Ok(found), Motion::Laws) => follow_laws(&records, found, &linear)?,
        (Ok(found), _) => return Ok(found),
        (Err(error), _) => oscillations(&records).ok_or(error)?,
    };
    Ok(found.without_sidebands(&records))
}

/// The same of modes that are linear in each part; of the exponentials of `one_line` the strongest alone is a mode.
fn follow_linear(
    records: &LawFit<'_>,
    free: &[Vec<&[f64]>],
    (fixed, whole): (bool, bool),
    one_line: &[OneLine],
) -> Result<FollowedDecay, ModelError> {
    let LawFit { all, events, interval_s, options } = *records;
    let longest = events.iter().flatten().map(|row| row.len()).max().unwrap_or(0);
    let no_modes = if fixed { Vec::new() } else { no_modes(all, interval_s, longest)? };
    let mut dropped: Vec<DroppedMode> = no_modes.iter().map(|(_, mode)| *mode).collect();
    let gone: Vec<usize> = no_modes.iter().map(|(j, _)| *j).collect();
    let mut fit = all.without(&gone);
    let mut decays = Decays { events, free, interval_s, options, others: all.only(&gone) };
    let mut found = if fixed { Vec::new() } else { companions(&fit) };
    for (more, of) in one_line.iter().flat_map(|line| line.own.iter().map(|more| (*more, line.main))) {
        let at = |j: usize| fit.poles.iter().position(|pole| *pole == all.poles[j]);
        if let (Some(more), Some(of), true) = (at(more), at(of), more != of) {
            found.retain(|pair| pair.0 != more && pair.0 != of);
            found.push((more, of, fit.shapes[more].mac(&fit.shapes[of])));
        }
    }
    let mut alone = fit.clone();
    if !found.is_empty() {
        let gone: Vec<usize> = found.iter().map(|pair| pair.0).collect();
        let modes = fit.modes();
        let mut left = fit.without(&gone);
        let number = |j: usize| nearest(&left.poles, fit.poles[j]).unwrap_or(0);
        let reason = |of: usize, mac: f64| Dropped::Companion { of: number(of), mac };
        dropped.extend(found.iter().map(|&(i, of, mac)| DroppedMode { mode: modes[i], reason: reason(of, mac) }));
        alone = decays.of_part(0..usize::MAX, &left.poles)?;
        // companions stay as nuisances of all other modes
        for of in found.iter().map(|pair| number(pair.1)).collect::<std::collections::BTreeSet<usize>>() {
            if let Some(from) = nearest(&alone.poles, left.poles[of]) {
                left.take_over(of, &alone, from);
            }
        }
        fit = left;
    }
    let duration_s: Vec<f64> =
        events.iter().map(|rows| rows.first().map_or(0, |row| row.len()) as f64 * interval_s).collect();
    let unknown = if fixed { Vec::new() } else { undetermined(&fit, &duration_s) };
    if !unknown.is_empty() && unknown.len() < fit.poles.len() {
        let modes = fit.modes();
        dropped.extend(unknown.iter().map(|&j| DroppedMode { mode: modes[j], reason: Dropped::Undetermined }));
        let places = unknown.iter().map(|&j| fit.poles[j]);
        let in_all = places.clone().filter_map(|pole| nearest(&all.poles, pole));
        decays.others = all.only(&gone.iter().copied().chain(in_all).collect::<Vec<usize>>());
        alone = alone.without(&places.filter_map(|pole| nearest(&alone.poles, pole)).collect::<Vec<usize>>());
        fit = fit.without(&unknown);
    }
    let (course, late) = decays.courses(&alone);
    let whole_fit = fit.clone();
    for (mode, (last, number)) in course.iter().zip(&late).filter(|(mode, _)| mode.far && !whole) {
        fit.take_pole(mode.mode, last, *number);
    }
    let (along, residuals) = (Vec::new(), Vec::new());
    Ok(FollowedDecay { fit, whole: whole_fit, fitted: all.clone(), dropped, course, along, residuals })
}

/// Fitted exponentials that are no modes, by number: lines that do not die away, what has no maximum in its response or
/// dies away at once. Errors: all are.
pub(super) fn no_modes(
    all: &ChannelRingdown,
    interval_s: f64,
    samples: usize,
) -> Result<Vec<(usize, DroppedMode)>, ModelError> {
    let (still, wide, short) = (steady(all, samples as f64 * interval_s), broad(all), brief(all, interval_s));
    let modes = all.modes();
    let reason = |j: usize| match [&still, &wide, &short].map(|numbers| numbers.contains(&j)) {
        [true, ..] => Some(Dropped::Steady),
        [_, true, _] => Some(Dropped::Broad),
        [.., true] => Some(Dropped::Brief),
        _ => None,
    };
    let dropped = |j: usize| Some((j, DroppedMode { mode: modes[j], reason: reason(j)? }));
    let found: Vec<(usize, DroppedMode)> = (0..modes.len()).filter_map(dropped).collect();
    let why = match (still.is_empty(), short.is_empty()) {
        (false, _) => "no oscillation that dies away",
        (_, false) => "what oscillates dies away within three samples: record it at a higher rate",
        _ => "overdamped: no quality factor above 0.71",
    };
    if found.len() == modes.len() { Err(ModelError::Degenerate(why)) } else { Ok(found) }
}

struct Decays<'a> {
    events: &'a [Vec<&'a [f64]>],
    free: &'a [Vec<&'a [f64]>],
    interval_s: f64,
    options: &'a ChannelOptions,
    /// What is fitted along with the modes in each part that it is seen in.
    others: ChannelRingdown,
}

impl Decays<'_> {
    /// The fit of a part of all decays that reach into it, from these poles of modes; what is no mode is fitted along and
    /// left out. Decays with too few samples there are passed over.
    fn of_part(&self, part: Range<usize>, start: &[c64]) -> Result<ChannelRingdown, ModelError> {
        let (mut events, mut missing) = (Vec::new(), Vec::new());
        for (number, event) in self.events.iter().enumerate() {
            let length = event.first().map_or(0, |row| row.len());
            let end = part.end.min(length);
            let inside = |gap: &Range<usize>| {
                gap.start.clamp(part.start, end) - part.start..gap.end.clamp(part.start, end) - part.start
            };
            let row = |gaps: &Vec<Range<usize>>| gaps.iter().map(inside).filter(|gap| !gap.is_empty()).collect();
            let gaps: Option<Vec<Vec<Range<usize>>>> =
                self.options.missing.get(number).map(|rows| rows.iter().map(row).collect());
            let most = gaps.iter().flatten().map(|row| row.iter().map(Range::len).sum::<usize>()).max().unwrap_or(0);
            if end < part.start + LEAST_SAMPLES + most {
                continue;
            }
            events.push(event.iter().map(|row| &row[part.start..end]).collect::<Vec<&[f64]>>());
            missing.extend(gaps);
        }
        let mut others = seen(&self.others, self.interval_s, &part, SEEN);
        loop {
            let all: Vec<c64> = start.iter().chain(&others).copied().collect();
            let options = ChannelOptions { start: all.clone(), missing: missing.clone(), ..self.options.clone() };
            let fit = fit_channels(&events, self.free, self.interval_s, &options)?;
            let gone: Vec<Option<usize>> = matched(&all, &fit.poles).split_off(start.len());
            // one that leaves its line stands for what the modes lack; a line is no narrower than the part can resolve
            let longest = events.iter().flatten().map(|row| row.len()).max().unwrap_or(1);
            let resolved = std::f64::consts::TAU / (longest as f64 * self.interval_s);
            let stays = |(other, place): (&c64, &Option<usize>)| {
                place.is_some_and(|place| (fit.poles[place] - other).norm() <= other.re.abs().max(resolved))
            };
            let kept: Vec<c64> = others.iter().zip(&gone).filter(|pair| stays(*pair)).map(|pair| *pair.0).collect();
            if kept.len() == others.len() {
                return Ok(fit.without(&gone.into_iter().flatten().collect::<Vec<usize>>()));
            }
            others = kept;
        }
    }

    /// The modes in both parts, and where the last is from: a fit and the mode's number in it.
    fn courses(&self, fit: &ChannelRingdown) -> (Vec<ModeCourse>, Vec<(ChannelRingdown, usize)>) {
        let mut found: Vec<(ModeCourse, (ChannelRingdown, usize))> = Vec::new();
        for group in groups(fit) {
            let Some((cut, first, last)) = self.parts(fit, &group) else { continue };
            for (i, j) in pairs(&first, &last) {
                let mode = nearest(&fit.poles, last.poles[j]).filter(|mode| group.contains(mode));
                let known = found.iter().any(|(course, _)| Some(course.mode) == mode);
                if let Some(mode) = mode.filter(|_| !known) {
                    found.push((course(mode, cut, (&first, i), (&last, j)), (last.clone(), j)));
                }
            }
        }
        found.sort_by_key(|(course, _)| course.mode);
        let count = found.len() as f64;
        for (course, _) in &mut found {
            course.moves = course.p_value * count < MOVES;
            course.far &= course.moves;
        }
        found.into_iter().unzip()
    }

    /// The cut for a group of modes, and the fits before and behind it, each with those modes of the whole that it can
    /// tell of.
    fn parts(&self, fit: &ChannelRingdown, group: &[usize]) -> Option<(usize, ChannelRingdown, ChannelRingdown)> {
        let energy = energies(fit);
        let strongest = *group.iter().max_by(|&&a, &&b| energy[a].total_cmp(&energy[b]))?;
        let longest = self.events.iter().flatten().map(|row| row.len()).max().unwrap_or(0);
        let cut = (CUT / (-fit.poles[strongest].re * self.interval_s)) as usize;
        let cut = cut.clamp(1, (longest / 2).max(1));
        let cut = if cut < LEAST_BLOCKS * BLOCK { cut } else { cut - cut % BLOCK };
        let part = |range: Range<usize>| {
            let known = seen(fit, self.interval_s, &range, KNOWN);
            if known.is_empty() { None } else { self.of_part(range, &known).ok() }
        };
        Some((cut, part(0..cut)?, part(cut..longest)?))
    }
}

/// Poles whose exponential has at least that energy in a part, in variances of the noise.
fn seen(fit: &ChannelRingdown, interval_s: f64, part: &Range<usize>, least: f64) -> Vec<c64> {
    let energy = |j: usize| -> f64 {
        let rate = -2.0 * fit.poles[j].re * interval_s;
        let share = ((-rate * part.start as f64).exp() - (-rate * part.end as f64).exp()) / rate;
        let turn = fit.poles[j].im * interval_s;
        let of = |record: &RecordFit| {
            0.5 * record.residues[j].norm_sqr() * share / density(&fit.noise[record.channel], interval_s, turn)
        };
        fit.records.iter().map(of).sum::<f64>() / fit.lack_of_fit[j]
    };
    (0..fit.poles.len()).filter(|&j| energy(j) > least).map(|j| fit.poles[j]).collect()
}

/// For each of the `start` poles the number of the fitted one that it has become: the nearest pair first.
fn matched(start: &[c64], fitted: &[c64]) -> Vec<Option<usize>> {
    let distance = |(i, j): &(usize, usize)| (start[*i] - fitted[*j]).norm();
    let mut pairs: Vec<(usize, usize)> =
        (0..start.len()).flat_map(|i| (0..fitted.len()).map(move |j| (i, j))).collect();
    pairs.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
    let mut found = vec![None; start.len()];
    for (i, j) in pairs {
        if found[i].is_none() && !found.contains(&Some(j)) {
            found[i] = Some(j);
        }
    }
    found
}

pub(super) fn nearest(poles: &[c64], to: c64) -> Option<usize> {
    (0..poles.len()).min_by(|&a, &b| (poles[a] - to).norm().total_cmp(&(poles[b] - to).norm()))
}

/// Modes of like decay rate, slowest first.
fn groups(fit: &ChannelRingdown) -> Vec<Vec<usize>> {
    let mut order: Vec<usize> = (0..fit.poles.len()).collect();
    order.sort_by(|&a, &b| fit.poles[b].re.total_cmp(&fit.poles[a].re));
    let mut groups: Vec<Vec<usize>> = Vec::new();
    for j in order {
        match groups.last_mut() {
            Some(group) if fit.poles[j].re > ONE_CUT * fit.poles[group[0]].re => group.push(j),
            _ => groups.push(vec![j]),
        }
    }
    groups
}

/// Modes that are each other's nearest in both parts.
fn pairs(first: &ChannelRingdown, last: &ChannelRingdown) -> Vec<(usize, usize)> {
    (0..last.poles.len())
        .filter_map(|j| nearest(&first.poles, last.poles[j]).map(|i| (i, j)))
        .filter(|&(i, j)| nearest(&last.poles, first.poles[i]) == Some(j))
        .collect()
}

fn course(
    mode: usize,
    cut: usize,
    (first, i): (&ChannelRingdown, usize),
    (last, j): (&ChannelRingdown, usize),
) -> ModeCourse {
    let d = last.poles[j] - first.poles[i];
    let sum = |a: usize, b: usize| first.covariance[(2 * i + a, 2 * i + b)] + last.covariance[(2 * j + a, 2 * j + b)];
    let (rr, ri, ii) = (sum(0, 0), sum(0, 1), sum(1, 1));
    let square = (ii * d.re * d.re - 2.0 * ri * d.re * d.im + rr * d.im * d.im) / (rr * ii - ri * ri);
    let p_value = if square.is_finite() { chi_square_tail(square.max(0.0), 2) } else { 1.0 };
    let z = |a: Estimate, b: Estimate| (b.value - a.value) / a.std.hypot(b.std);
    let (a, b) = (first.modes()[i], last.modes()[j]);
    let (early, late) = (a.damping_ratio().value, b.damping_ratio().value);
    let shift = (a.frequency_hz.value / b.frequency_hz.value - 1.0).abs();
    ModeCourse {
        mode,
        cut,
        first: a,
        last: b,
        frequency_z: z(a.frequency_hz, b.frequency_hz),
        damping_z: z(a.damping_ratio(), b.damping_ratio()),
        p_value,
        moves: false,
        far: shift > FAR * late || (early / late - 1.0).abs() > FAR,
    }
}
