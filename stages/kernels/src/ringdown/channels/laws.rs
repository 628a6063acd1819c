//! Modes that follow laws of their amplitude: what the lines of a linear fit are by the data.

use std::f64::consts::{FRAC_1_SQRT_2, TAU};

use faer::c64;

use super::companions::{DETERMINED, Dropped, DroppedMode, broad, energies};
use super::course::{FollowedDecay, nearest};
use super::lines::{Lines, near, paths};
use super::options::ChannelOptions;
use super::result::ChannelRingdown;
use super::rows::Rows;
use crate::model::{ModelError, go_on};
use crate::ringdown::moving::{CoursePoint, FollowedLine, FollowedMode, Follows, MOST_DAMPING, Moving};
use crate::statistics::chi_square_tail;

/// A mode that follows laws of its amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct AmplitudeCourse {
    /// Number of the mode in the fit, from 0.
    pub mode: usize,
    /// Its laws, and its values along the amplitude.
    pub laws: FollowedMode,
    /// Share of each decay, from its beginning on, within which the laws hold: of what follows them no further.
    pub share: f64,
}

/// Shares of the decays, from their beginning on, that laws are tried for where none holds to the end.
const FIRST_PARTS: [f64; 3] = [0.6, 0.35, 0.2];

/// Half widths (of both together) within which lines are fitted together: what one lacks, the others explain.
pub(super) const TOGETHER: f64 = 6.0;
/// Turns more or less within the longest record up to which lines are fitted together: a decay that ends within it, as under
/// friction, is a series of lines that do not die away, one and a half turns apart.
const BESIDE: f64 = 2.0;
/// Half widths within which two modes may be one that moves.
const ONE_LINE: f64 = 2.5;
/// Relative distance from a multiple of another line up to which a line is looked at with it.
const NEAR_MULTIPLE: f64 = 0.02;

/// Variance that the fit leaves round a line, over that of noise, up to which laws stand for it: errors are widened by its
/// root, and beyond a factor of three are none of noise.
pub(super) const LARGEST_LACK: f64 = 10.0;

/// Exponentials of one line that are no modes by themselves.
pub(super) struct OneLine {
    /// The strongest of them.
    pub main: usize,
    /// All, by number.
    pub own: Vec<usize>,
}

/// A line that laws hold for up to a share of the decays.
struct FirstPart {
    line: FollowedLine,
    share: f64,
}

/// Linear modes that may share a line.
const MOST_IN_ONE_LINE: usize = 3;

/// What was fitted.
#[derive(Clone, Copy)]
pub(super) struct LawFit<'a> {
    pub all: &'a ChannelRingdown,
    pub events: &'a [Vec<&'a [f64]>],
    pub interval_s: f64,
    pub options: &'a ChannelOptions,
}

/// Modes in whose lines a linear fit does not hold as modes that follow laws of their amplitude, where they do.
///
/// # Model
/// [`moving`](crate::ringdown::moving).
/// # Method
/// Lines of modes that move, have companions, leave more than noise or lie close together are fitted together, all
/// other exponentials taken off. A line with laws is one row; an exponential at a multiple of its frequency that falls
/// with it none; several exponentials that describe a line better than any law are as many rows. A line that moves and
/// follows no law is one row as well, a linear mode of its last part. `linear_of`: the linear fit with one mode in place
/// of such lines.
/// # Errors
/// Ended from outside. Where the fit fails the linear one stays.
pub(super) fn follow_laws(
    records: &LawFit<'_>,
    linear: FollowedDecay,
    linear_of: &dyn Fn(&[OneLine]) -> Result<FollowedDecay, ModelError>,
) -> Result<FollowedDecay, ModelError> {
    go_on(&records.options.watch)?;
    let given = records.suspects(&linear);
    if given.is_empty() {
        return Ok(linear);
    }
    let at = |pole: &c64| nearest(&records.all.poles, *pole).map(|j| (*pole, j));
    let rows: Vec<(c64, usize)> = linear.whole.poles.iter().filter_map(at).collect();
    let Ok(found) = Lines::of(records, &given, &rows) else { return Ok(linear) };
    let refuted = records.moving_without_law(&linear, &found);
    let linear = if refuted.is_empty() { linear } else { linear_of(&refuted).unwrap_or(linear) };
    let mut rows = Rows::of(linear, records.all);
    let parts: Vec<Option<FirstPart>> = refuted.iter().map(|line| records.first_part(line)).collect();
    for (line, _) in refuted.iter().zip(&parts).filter(|(_, part)| part.is_none()) {
        rows.widen_line(&line.own);
    }
    records.rows(&found, &mut rows);
    for (line, part) in refuted.iter().zip(parts) {
        records.row_of_first_part(line, part, &mut rows);
    }
    for course in rows.moving() {
        rows.widen(course.mode, 0.5 * (course.last.pole() - course.first.pole()));
    }
    // of a line that is several modes none lies within another's range by mistake
    let several = found.fit.lines.iter().any(is_several);
    for (mode, range) in rows.ranges() {
        rows.drop_multiples(mode, range);
        if !several {
            rows.drop_within(mode, range);
        }
    }
    Ok(rows.finished(found.fit.residuals))
}

/// The same where the linear fit has no mode: lines that seem steady may be modes that move. None: they are steady.
pub(super) fn oscillations(records: &LawFit<'_>) -> Option<FollowedDecay> {
    let all = records.all;
    let wide = broad(all);
    let modes = all.modes();
    let reason = |j: usize| if wide.contains(&j) { Dropped::Broad } else { Dropped::Steady };
    let dropped = (0..modes.len()).map(|j| DroppedMode { mode: modes[j], reason: reason(j) }).collect();
    let none = all.only(&[]);
    let empty = FollowedDecay {
        fit: none.clone(),
        whole: none,
        fitted: all.clone(),
        dropped,
        course: Vec::new(),
        along: Vec::new(),
        residuals: Vec::new(),
    };
    let given = records.oscillating();
    let found = if given.is_empty() { None } else { Lines::of(records, &given, &[]).ok() }?;
    let mut rows = Rows::of(empty, all);
    records.rows(&found, &mut rows);
    if rows.is_empty() {
        paths(records, &given)
            .iter()
            .for_each(|line| records.row_of_first_part(line, records.first_part(line), &mut rows));
    }
    let followed = rows.finished(found.fit.residuals);
    (!followed.fit.poles.is_empty()).then_some(followed)
}

impl<'a> LawFit<'a> {
    /// Numbers of the exponentials to be looked at, ascending; none where a linear fit holds everywhere.
    fn suspects(&self, linear: &FollowedDecay) -> Vec<usize> {
        let poles = &self.all.poles;
        let rows: Vec<Option<usize>> = linear.whole.poles.iter().map(|pole| nearest(poles, *pole)).collect();
        let row = |mode: usize| rows.get(mode).copied().flatten();
        let mut suspect: Vec<usize> =
            linear.course.iter().filter(|course| course.moves).filter_map(|course| row(course.mode)).collect();
        suspect.extend((0..rows.len()).filter(|&j| linear.whole.lack_of_fit[j] > 1.0).filter_map(row));
        for harmonic in linear.whole.harmonics() {
            suspect.extend(row(harmonic.mode).into_iter().chain(row(harmonic.of)));
        }
        // of exponentials that share a line each may be anything by itself
        let others = self.oscillating();
        let shares = |j: &usize| {
            others.iter().any(|other| other != j && near(poles[*j], poles[*other], ONE_LINE, self.resolution()))
        };
        suspect.extend(others.iter().copied().filter(shares));
        // with them what is beside
        loop {
            let beside = |j: &usize| {
                !suspect.contains(j)
                    && suspect.iter().any(|&other| near(poles[*j], poles[other], TOGETHER, BESIDE * self.resolution()))
            };
            let more: Vec<usize> = others.iter().copied().filter(beside).collect();
            if more.is_empty() {
                break;
            }
            suspect.extend(more);
        }
        let multiple = |j: &usize| {
            let of = |other: &usize| (2..=3).any(|n| near_multiple(poles[*j], poles[*other], f64::from(n)));
            !suspect.contains(j) && suspect.iter().any(of)
        };
        let more: Vec<usize> = others.iter().copied().filter(multiple).collect();
        suspect.extend(more);
        suspect.sort_unstable();
        suspect.dedup();
        suspect
    }

    /// Exponentials whose response has a maximum, by their values: errors of those that share a line say nothing.
    fn oscillating(&self) -> Vec<usize> {
        (0..self.all.poles.len()).filter(|&j| self.all.poles[j].im > -self.all.poles[j].re).collect()
    }

    /// One turn more or less within the longest record, rad/s.
    pub fn resolution(&self) -> f64 {
        resolution(self.events, self.interval_s)
    }

    /// The rows of the table as these lines want them.
    fn rows(&self, found: &Lines, rows: &mut Rows<'_>) {
        let lines = || found.fit.lines.iter().zip(&found.own);
        let of_line: Vec<Option<usize>> =
            lines().map(|(line, own)| self.rows_of(line, own, &found.fit, rows)).collect();
        for (line, own) in lines() {
            if let Follows::Multiple { of, multiple } = line.follows
                && let Some(of) = of_line[of]
            {
                rows.drop_all(own, Dropped::Harmonic { of, multiple });
            }
        }
    }

    /// Lines that follow no law and are no linear modes either, for they move from part to part, need more exponentials
    /// than modes share a line, or are not even described by exponentials of which the second strongest does not beat with
    /// the strongest.
    fn moving_without_law(&self, linear: &FollowedDecay, found: &Lines) -> Vec<OneLine> {
        let energy = energies(self.all);
        let moves = |own: &[usize]| {
            linear.course.iter().filter(|course| course.moves).any(|course| {
                nearest(&self.all.poles, linear.whole.poles[course.mode]).is_some_and(|of| own.contains(&of))
            })
        };
        let mut refuted = Vec::new();
        for (line, own) in found.fit.lines.iter().zip(&found.own) {
            if line.follows != Follows::None || law(line).is_some() {
                continue;
            }
            let mut order = own.clone();
            order.sort_by(|a, b| energy[*b].total_cmp(&energy[*a]));
            let pole = |j: usize| self.all.poles[j];
            let overlap = order.get(1).is_some_and(|&next| apart(pole(order[0]), pole(next)) < 1.0);
            let undescribed = overlap && line.lack.factor >= LARGEST_LACK;
            if let Some(&main) = order.first().filter(|_| moves(own) || own.len() > MOST_IN_ONE_LINE || undescribed) {
                refuted.push(OneLine { main, own: own.clone() });
            }
        }
        refuted
    }

    /// The row of a line whose laws hold in a first part of the decays.
    fn row_of_first_part(&self, line: &OneLine, part: Option<FirstPart>, rows: &mut Rows<'_>) {
        let Some(FirstPart { line: followed, share }) = part else { return };
        let tag = law(&followed).and_then(|mode| self.row_of_law(&followed, mode, &line.own, rows));
        tag.into_iter().for_each(|tag| rows.holds_in(tag, share));
    }

    /// The line in the longest first part of the decays that laws hold in, down to noise; none of damping that laws are no
    /// account of.
    fn first_part(&self, line: &OneLine) -> Option<FirstPart> {
        let pole = self.all.poles[line.main];
        if -pole.re > MOST_DAMPING * pole.im {
            return None;
        }
        FIRST_PARTS.into_iter().find_map(|share| {
            let cut = |row: &&[f64]| (row.len() as f64 * share) as usize;
            let part = |rows: &Vec<&'a [f64]>| rows.iter().map(|row| &row[..cut(row)]).collect();
            let events: Vec<Vec<&[f64]>> = self.events.iter().map(part).collect();
            let mut found = Lines::of(&LawFit { events: &events, ..*self }, &line.own, &[]).ok()?;
            let one = if found.fit.lines.len() == 1 { found.fit.lines.pop() } else { None }?;
            let is_one = one.follows == Follows::Moving || one.follows == Follows::Beside && !is_several(&one);
            let holds = is_one && law(&one).is_some();
            holds.then(|| FirstPart { line: widened(one), share })
        })
    }

    /// What a line is in the table; the tag of its (first) row.
    fn rows_of(&self, line: &FollowedLine, own: &[usize], found: &Moving, rows: &mut Rows<'_>) -> Option<usize> {
        let has_row = rows.of_poles(own);
        if let Some(mode) = law(line) {
            return self.row_of_law(line, mode, own, rows);
        }
        match line.follows {
            Follows::Exponentials(count) if line.lack.factor <= 1.0 && count == own.len() => {
                let energy = energies(self.all);
                let main = own.iter().copied().max_by(|a, b| energy[*a].total_cmp(&energy[*b]))?;
                let beats = |j: &&usize| apart(self.all.poles[main], self.all.poles[**j]) >= 1.0;
                own.iter().filter(beats).for_each(|&j| rows.undrop_companion(j));
                rows.of_poles(own).first().copied()
            }
            Follows::Linear if has_row.len() == 1 && (self.by_chance(line, found) || !line.modes.iter().all(rings)) => {
                rows.drop_all(own, Dropped::Undetermined);
                None
            }
            _ => has_row.first().copied(),
        }
    }

    /// The row of a line with laws; its tag.
    fn row_of_law(
        &self,
        line: &FollowedLine,
        mode: &FollowedMode,
        own: &[usize],
        rows: &mut Rows<'_>,
    ) -> Option<usize> {
        let energy = energies(self.all);
        let strongest = own.iter().copied().max_by(|a, b| energy[*a].total_cmp(&energy[*b]))?;
        let has_row = rows.of_poles(own);
        let tag = if has_row.is_empty() { rows.restored(strongest) } else { rows.strongest(&has_row) };
        rows.drop_but(own, tag);
        rows.take_laws(tag, mode, line.lack.factor);
        let beside = beside(line);
        if let Some(other) = beside {
            let second = rows.restored(strongest);
            rows.take_linear(second, other, line.lack.factor);
            if let Some(mac) = left_by(other, mode) {
                rows.drop_row(second, Dropped::Companion { of: tag, mac });
            }
        }
        Some(tag)
    }

    /// Whether noise alone makes a mode of that energy somewhere.
    fn by_chance(&self, line: &FollowedLine, found: &Moving) -> bool {
        let Some(mode) = line.modes.first() else { return false };
        let rate = mode.course.first().map_or(0.0, |at| at.damping_ratio.value * at.frequency_hz.value * TAU);
        let longest = self.events.iter().flatten().map(|row| row.len()).max().unwrap_or(1);
        let samples = 1.0 / (2.0 * rate.max(0.0) * self.interval_s).max(1.0 / longest as f64);
        let shape: f64 = mode.shape.iter().zip(&found.noise_variance).map(|(s, v)| s.norm_sqr() / v).sum();
        let gain: f64 = mode.starts.iter().map(|(amplitude, _)| 0.5 * amplitude * amplitude * samples * shape).sum();
        let degrees = 2 + 2 * self.all.records.len();
        gain.is_finite() && chi_square_tail(gain, degrees) * longest as f64 > self.options.false_alarm
    }
}

/// A line whose laws hold in a first part alone: they are not those of the motion, and each value of a course is known to
/// half of its distance to the next.
fn widened(mut line: FollowedLine) -> FollowedLine {
    for mode in &mut line.modes {
        let values: Vec<[f64; 2]> =
            mode.course.iter().map(|at| [at.frequency_hz.value, at.damping_ratio.value]).collect();
        for (k, at) in mode.course.iter_mut().enumerate() {
            let next = if k + 1 < values.len() { k + 1 } else { k.saturating_sub(1) };
            let half = |own: usize| 0.5 * (values[next][own] - values[k][own]);
            at.frequency_hz.std = at.frequency_hz.std.hypot(half(0));
            at.damping_ratio.std = at.damping_ratio.std.hypot(half(1));
        }
        if let Some(low) = mode.course.first() {
            mode.frequency_hz = low.frequency_hz;
            mode.quality_factor.std = mode.quality_factor.value * low.damping_ratio.std / low.damping_ratio.value.abs();
        }
    }
    line
}

/// The modal assurance criterion of a linear mode and one that follows laws, where it is what their laws leave of that
/// mode's motion: in its line, of its shape, and faster. None where it is a mode.
///
/// Why faster by any factor: laws take the terms that die away twice as fast, and leave what turns on while they do.
fn left_by(other: &FollowedMode, main: &FollowedMode) -> Option<f64> {
    let (own, low) = (other.course.first()?, main.course.first()?);
    let rate_hz = |at: &CoursePoint| at.frequency_hz.value * at.damping_ratio.value;
    let near = |at: &CoursePoint| (at.frequency_hz.value - own.frequency_hz.value).abs() < rate_hz(own);
    let (cross, one, two) = other.shape.iter().zip(&main.shape).fold((c64::new(0.0, 0.0), 0.0, 0.0), |sum, (a, b)| {
        (sum.0 + a.conj() * b, sum.1 + a.norm_sqr(), sum.2 + b.norm_sqr())
    });
    let mac = cross.norm_sqr() / (one * two);
    (rate_hz(own) > rate_hz(low) && main.course.iter().any(near) && mac > ONE_SHAPE).then_some(mac)
}

/// Modal assurance criterion of one shape, at least.
const ONE_SHAPE: f64 = 0.95;

/// Distance of two lines in half widths of the narrower: below one they do not beat before either is gone.
fn apart(a: c64, b: c64) -> f64 {
    (a.im - b.im).abs() / a.re.abs().min(b.re.abs())
}

/// One turn more or less within the longest record, rad/s.
pub(super) fn resolution(events: &[Vec<&[f64]>], interval_s: f64) -> f64 {
    let longest = events.iter().flatten().map(|row| row.len()).max().unwrap_or(1);
    TAU / (longest as f64 * interval_s)
}

/// Whether a line is about a multiple of another, which may move.
fn near_multiple(line: c64, of: c64, multiple: f64) -> bool {
    let widths = ONE_LINE * (line.re.abs() + multiple * of.re.abs());
    (line.im - multiple * of.im).abs() < widths.max(NEAR_MULTIPLE * line.im)
}

/// The mode of a line that follows laws, closely enough to stand for it.
fn law(line: &FollowedLine) -> Option<&FollowedMode> {
    let mode = line.modes.first()?;
    let moves = mode.damping_terms.len() + mode.frequency_terms.len() > 2;
    let stands = match line.follows {
        Follows::Moving | Follows::Beside => true,
        Follows::None => moves && line.lack.factor < LARGEST_LACK,
        _ => false,
    };
    (stands && dies(mode)).then_some(mode)
}

/// What rings beside the mode of a line; a steady line does not.
fn beside(line: &FollowedLine) -> Option<&FollowedMode> {
    line.modes.get(1).filter(|other| line.follows == Follows::Beside && rings(other))
}

/// Whether a line is several modes: a plateau under one is none.
fn is_several(line: &FollowedLine) -> bool {
    matches!(line.follows, Follows::Exponentials(_)) || beside(line).is_some()
}

/// Whether a mode's damping is above zero somewhere along its amplitude.
pub(super) fn dies(mode: &FollowedMode) -> bool {
    mode.course.iter().any(|at| at.damping_ratio.value > DETERMINED * at.damping_ratio.std)
}

/// Whether a mode's damping is above zero and below that of a response without a maximum.
fn rings(mode: &FollowedMode) -> bool {
    let below = |at: &CoursePoint| at.damping_ratio.value + DETERMINED * at.damping_ratio.std < FRAC_1_SQRT_2;
    dies(mode) && mode.course.iter().all(below)
}
