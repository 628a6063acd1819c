//! Modes that follow laws of their amplitude: what the lines of a linear fit are by the data.

use std::f64::consts::TAU;

use faer::c64;

use super::companions::{DETERMINED, Dropped, DroppedMode, broad, energies};
use super::course::{FollowedDecay, MOVES, nearest};
use super::levels::density;
use super::options::ChannelOptions;
use super::result::ChannelRingdown;
use super::rows::Rows;
use crate::model::{ModelError, go_on};
use crate::ringdown::moving::{self, Exponential, FollowedLine, FollowedMode, Follows, Line, Moving, follow_moving};
use crate::statistics::chi_square_tail;

/// A mode that follows laws of its amplitude.
#[derive(Debug, Clone, PartialEq)]
pub struct AmplitudeCourse {
    /// Number of the mode in the fit, from 0.
    pub mode: usize,
    /// Its laws, and its values along the amplitude.
    pub laws: FollowedMode,
}

/// Half widths (of both together) within which lines are fitted together: what one lacks, the others explain.
const TOGETHER: f64 = 6.0;
/// The same within which two modes may be one that moves.
const ONE_LINE: f64 = 2.5;
/// Relative distance from a multiple of another line up to which a line is looked at with it.
const NEAR_MULTIPLE: f64 = 0.02;

/// What was fitted.
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
/// with it none; several exponentials that describe a line better than any law are as many rows.
/// # Errors
/// Ended from outside. Where the fit fails the linear one stays.
pub(super) fn follow_laws(records: &LawFit<'_>, linear: FollowedDecay) -> Result<FollowedDecay, ModelError> {
    go_on(&records.options.watch)?;
    let given = records.suspects(&linear);
    if given.is_empty() {
        return Ok(linear);
    }
    let Ok(found) = records.fitted(&given) else { return Ok(linear) };
    let moves = |line: &FollowedLine| !matches!(line.follows, Follows::Linear | Follows::None);
    if !found.lines.iter().any(moves) {
        return Ok(linear);
    }
    Ok(records.with_rows(linear, &given, found))
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
    let found = if given.is_empty() { None } else { records.fitted(&given).ok() }?;
    let followed = records.with_rows(empty, &given, found);
    (!followed.fit.poles.is_empty()).then_some(followed)
}

impl LawFit<'_> {
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
                    && suspect.iter().any(|&other| near(poles[*j], poles[other], TOGETHER, self.resolution()))
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
    fn resolution(&self) -> f64 {
        let longest = self.events.iter().flatten().map(|row| row.len()).max().unwrap_or(1);
        TAU / (longest as f64 * self.interval_s)
    }

    /// The lines of these exponentials, the others taken off.
    fn fitted(&self, given: &[usize]) -> Result<Moving, ModelError> {
        let all = self.all;
        let others: Vec<usize> = (0..all.poles.len()).filter(|j| !given.contains(j)).collect();
        let rest = all.only(&others);
        let left: Vec<Vec<Vec<f64>>> = self
            .events
            .iter()
            .enumerate()
            .map(|(event, rows)| {
                let own = |channel: usize| rest.records.iter().find(|r| r.event == event && r.channel == channel);
                let mut rows: Vec<Vec<f64>> = rows
                    .iter()
                    .enumerate()
                    .map(|(channel, row)| match own(channel) {
                        Some(record) if !others.is_empty() => {
                            let model = rest.ringing(record, self.interval_s, row.len());
                            row.iter().zip(model).map(|(y, m)| y - m).collect()
                        }
                        _ => row.to_vec(),
                    })
                    .collect();
                for (row, gaps) in rows.iter_mut().zip(self.options.missing.get(event).into_iter().flatten()) {
                    gaps.iter().for_each(|gap| row[gap.clone()].fill(f64::NAN));
                }
                rows
            })
            .collect();
        let events: Vec<Vec<&[f64]>> = left.iter().map(|rows| rows.iter().map(|row| &row[..]).collect()).collect();
        let line = |&j: &usize| Line {
            poles: vec![Exponential { rate_per_s: -all.poles[j].re, turn_rad_per_s: all.poles[j].im }],
        };
        let lines: Vec<Line> = given.iter().map(line).collect();
        let coloured = all.noise.iter().any(|noise| !noise.is_white());
        let level = |noise| {
            let at = |&j: &usize| density(noise, self.interval_s, all.poles[j].im * self.interval_s);
            given.iter().map(at).fold(0.0, f64::max)
        };
        let noise_variance = if coloured { all.noise.iter().map(level).collect() } else { Vec::new() };
        let options = moving::Options { false_alarm: MOVES, noise_variance, ..moving::Options::default() };
        follow_moving(&events, self.interval_s, &lines, &options)
    }

    /// The rows of the table as these lines want them.
    fn with_rows(&self, linear: FollowedDecay, given: &[usize], found: Moving) -> FollowedDecay {
        let mut rows = Rows::of(linear, self.all);
        let mut of_line: Vec<Option<usize>> = Vec::new();
        for line in &found.lines {
            let own: Vec<usize> = line.given.iter().map(|&number| given[number]).collect();
            of_line.push(self.rows_of(line, &own, &found, &mut rows));
        }
        for line in &found.lines {
            if let Follows::Multiple { of, multiple } = line.follows {
                let own: Vec<usize> = line.given.iter().map(|&number| given[number]).collect();
                if let Some(of) = of_line[of] {
                    rows.drop_all(&own, Dropped::Harmonic { of, multiple });
                }
            }
        }
        let others: Vec<usize> = (0..self.all.poles.len()).filter(|j| !given.contains(j)).collect();
        rows.finished(if others.len() < self.all.poles.len() { found.residuals } else { Vec::new() })
    }

    /// What a line is in the table; the tag of its (first) row.
    fn rows_of(&self, line: &FollowedLine, own: &[usize], found: &Moving, rows: &mut Rows<'_>) -> Option<usize> {
        let has_row = rows.of_poles(own);
        match line.follows {
            Follows::Moving | Follows::Beside => {
                let mode = line.modes.first().filter(|mode| dies(mode))?;
                let energy = energies(self.all);
                let strongest = |list: &[usize]| list.iter().copied().max_by(|a, b| energy[*a].total_cmp(&energy[*b]));
                let tag = match has_row.first() {
                    Some(_) => rows.strongest(&has_row),
                    None => rows.restored(strongest(own)?),
                };
                rows.drop_but(own, tag);
                rows.take_laws(tag, mode, line.lack.factor);
                let beside = line.modes.get(1).filter(|_| line.follows == Follows::Beside);
                if let (Some(other), Some(from)) = (beside.filter(|mode| dies(mode)), strongest(own)) {
                    let tag = rows.restored(from);
                    rows.take_linear(tag, other, line.lack.factor);
                }
                Some(tag)
            }
            Follows::Exponentials(count) if line.lack.factor <= 1.0 && count == own.len() => {
                own.iter().for_each(|&j| rows.undrop_companion(j));
                rows.of_poles(own).first().copied()
            }
            Follows::Linear if has_row.len() == 1 && self.by_chance(line, found) => {
                rows.drop_all(own, Dropped::Undetermined);
                None
            }
            _ => has_row.first().copied(),
        }
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

/// Whether two lines are within so many half widths of both.
///
/// `resolution`: rad/s that the records tell apart; what is nearer is one line.
fn near(a: c64, b: c64, widths: f64, resolution: f64) -> bool {
    (a.im - b.im).abs() < (widths * (a.re.abs() + b.re.abs())).max(resolution)
}

/// Whether a line is about a multiple of another, which may move.
fn near_multiple(line: c64, of: c64, multiple: f64) -> bool {
    let widths = ONE_LINE * (line.re.abs() + multiple * of.re.abs());
    (line.im - multiple * of.im).abs() < widths.max(NEAR_MULTIPLE * line.im)
}

/// Whether a mode's damping is above zero somewhere along its amplitude.
fn dies(mode: &FollowedMode) -> bool {
    mode.course.iter().any(|at| at.damping_ratio.value > DETERMINED * at.damping_ratio.std)
}
