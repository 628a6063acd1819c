//! Exponentials of a linear fit as lines that may move, fitted with laws of their amplitude.

use faer::c64;

use super::course::MOVES;
use super::laws::{LARGEST_LACK, LawFit, OneLine, dies};
use super::levels::density;
use super::result::{ChannelRingdown, RecordFit};
use crate::model::ModelError;
use crate::ringdown::moving::{self, Exponential, FollowedLine, Follows, Line, Moving, follow_moving};

/// Half widths of the broadest exponential of each within which two lines may be one that moves further than any of its
/// exponentials is wide.
const ONE_PATH: f64 = 2.5;
/// Energy that is left over its degrees of freedom below which the noise was taken for larger than it is.
const QUIETER: f64 = 0.7;
/// Degrees of freedom from which on that can be said.
const LEAST_FREEDOM: f64 = 30.0;

/// Lines as they are fitted.
pub(super) struct Lines {
    pub fit: Moving,
    /// Of each line the exponentials that it is made of.
    pub own: Vec<Vec<usize>>,
}

impl Lines {
    /// The lines of these exponentials, all others taken off.
    ///
    /// # Method
    /// Each exponential by itself first: `follow_moving` joins those that share a line. Where a line is then left without
    /// a law, or of a damping that is not known to be above zero, lines that may be one path are joined beforehand and
    /// begin with one exponential each, that of their row if they have one (`rows`: its pole and the exponential that it
    /// is) or else their mean weighted with energy; the fit with the lower Bayesian information criterion counts.
    /// # Errors
    /// Those of `follow_moving`.
    pub fn of(records: &LawFit<'_>, given: &[usize], rows: &[(c64, usize)]) -> Result<Self, ModelError> {
        let left = Left::of(records, given);
        let all = records.all;
        let exponential = |&j: &usize| Exponential { rate_per_s: -all.poles[j].re, turn_rad_per_s: all.poles[j].im };
        let single = |j: &usize| (Line { poles: vec![exponential(j)] }, vec![*j]);
        let first = left.fitted(given.iter().map(single).collect(), left.noise_variance.clone());
        let line_holds = |line: &FollowedLine| match line.follows {
            Follows::None => line.lack.factor < LARGEST_LACK,
            Follows::Moving | Follows::Beside => line.modes.iter().any(dies),
            _ => true,
        };
        let holds = |found: &Self| found.fit.lines.iter().all(line_holds);
        if first.as_ref().is_ok_and(holds) {
            return first;
        }
        let energy = within(all, records);
        let mean = |own: Vec<usize>| {
            let of_row: Vec<c64> = rows.iter().filter(|(_, j)| own.contains(j)).map(|(pole, _)| *pole).collect();
            let weight: f64 = own.iter().map(|&j| energy[j]).sum::<f64>().max(f64::MIN_POSITIVE);
            let pole = match of_row[..] {
                [pole] => pole,
                _ => own.iter().map(|&j| all.poles[j] * energy[j]).sum::<c64>() / weight,
            };
            (Line { poles: vec![Exponential { rate_per_s: -pole.re, turn_rad_per_s: pole.im }] }, own)
        };
        let paths = one_path(&all.poles, given, records.resolution()).into_iter().map(mean).collect();
        let noise =
            first.as_ref().map_or_else(|_| left.noise_variance.clone(), |found| found.fit.noise_variance.clone());
        match (first, left.fitted(paths, noise)) {
            (Ok(first), Ok(second)) => Ok(if second.fit.bic < first.fit.bic { second } else { first }),
            (first, second) => second.or(first),
        }
    }
}

/// What other exponentials leave.
struct Left {
    /// Hits x channels x samples, NaN where none is.
    events: Vec<Vec<Vec<f64>>>,
    interval_s: f64,
    noise_variance: Vec<f64>,
}

impl Left {
    fn of(records: &LawFit<'_>, given: &[usize]) -> Self {
        let LawFit { all, events, interval_s, options } = *records;
        let rest = all.only(&(0..all.poles.len()).filter(|j| !given.contains(j)).collect::<Vec<usize>>());
        let of = |(event, rows): (usize, &Vec<&[f64]>)| {
            let row = |(channel, row): (usize, &&[f64])| {
                let own = rest.records.iter().find(|r| r.event == event && r.channel == channel);
                let model = own.map(|record| rest.ringing(record, interval_s, row.len()));
                let mut left: Vec<f64> = match model {
                    Some(model) => row.iter().zip(model).map(|(y, m)| y - m).collect(),
                    None => row.to_vec(),
                };
                let gaps = options.missing.get(event).and_then(|rows| rows.get(channel));
                let inside = |gap: &std::ops::Range<usize>| gap.start.min(row.len())..gap.end.min(row.len());
                gaps.into_iter().flatten().for_each(|gap| left[inside(gap)].fill(f64::NAN));
                left
            };
            rows.iter().enumerate().map(row).collect()
        };
        let coloured = all.noise.iter().any(|noise| !noise.is_white());
        let level = |noise| {
            let at = |&j: &usize| density(noise, interval_s, all.poles[j].im * interval_s);
            given.iter().map(at).fold(0.0, f64::max)
        };
        let noise_variance = if coloured { all.noise.iter().map(level).collect() } else { Vec::new() };
        Self { events: events.iter().enumerate().map(of).collect(), interval_s, noise_variance }
    }

    /// The fit of these lines, each with its exponentials; once more where it leaves less than that noise.
    fn fitted(&self, lines: Vec<(Line, Vec<usize>)>, noise_variance: Vec<f64>) -> Result<Lines, ModelError> {
        let (lines, numbers): (Vec<Line>, Vec<Vec<usize>>) = lines.into_iter().unzip();
        let rows: Vec<Vec<&[f64]>> = self.events.iter().map(|rows| rows.iter().map(Vec::as_slice).collect()).collect();
        let fitted = |noise_variance| {
            let options = moving::Options { false_alarm: MOVES, noise_variance, ..moving::Options::default() };
            follow_moving(&rows, self.interval_s, &lines, &options)
        };
        let mut fit = fitted(noise_variance)?;
        let (energy, freedom) = fit.chi_square;
        if freedom > LEAST_FREEDOM && energy < QUIETER * freedom {
            let quieter = fit.noise_variance.iter().map(|v| v * energy / freedom).collect();
            fit = fitted(quieter).unwrap_or(fit);
        }
        let own = |given: &Vec<usize>| given.iter().flat_map(|&line| numbers[line].iter().copied()).collect();
        let own = fit.lines.iter().map(|line| own(&line.given)).collect();
        Ok(Lines { fit, own })
    }
}

/// The paths that these exponentials may be, each with the one that has the most energy in the records.
pub(super) fn paths(records: &LawFit<'_>, given: &[usize]) -> Vec<OneLine> {
    let energy = within(records.all, records);
    let of = |own: Vec<usize>| {
        let main = own.iter().copied().max_by(|a, b| energy[*a].total_cmp(&energy[*b]))?;
        Some(OneLine { main, own })
    };
    one_path(&records.all.poles, given, records.resolution()).into_iter().filter_map(of).collect()
}

/// Energy of each exponential within the records, in variances of the noise: that of one that hardly dies away is finite.
fn within(all: &ChannelRingdown, records: &LawFit<'_>) -> Vec<f64> {
    let duration_s = |event: usize| {
        let samples = records.events.get(event).and_then(|rows| rows.first()).map_or(0, |row| row.len());
        samples as f64 * records.interval_s
    };
    let of = |(j, pole): (usize, &c64)| -> f64 {
        let gone = |record: &RecordFit| 1.0 - (2.0 * pole.re * duration_s(record.event)).exp();
        let energy =
            |record: &RecordFit| record.residues[j].norm_sqr() / all.noise[record.channel].white * gone(record);
        all.records.iter().map(energy).sum::<f64>() / -pole.re
    };
    all.poles.iter().enumerate().map(of).collect()
}

/// Exponentials that may be one path each, by number: neighbours within the width of the broadest of either, which is half
/// of what the records resolve at least. A decay that ends within them, as under friction, is made of many that do not.
fn one_path(poles: &[c64], given: &[usize], resolution: f64) -> Vec<Vec<usize>> {
    let mut paths: Vec<Vec<usize>> = Vec::new();
    let mut order = given.to_vec();
    order.sort_by(|&a, &b| poles[a].im.total_cmp(&poles[b].im));
    for j in order {
        paths.push(vec![j]);
        // the newest path takes its neighbour below for as long as they touch
        while let [.., below, last] = paths.as_slice() {
            let width = |own: &[usize]| own.iter().map(|&j| poles[j].re.abs()).fold(0.5 * resolution, f64::max);
            let (end, begin) = (below[below.len() - 1], last[0]);
            if poles[begin].im - poles[end].im > ONE_PATH * (width(below) + width(last)) {
                break;
            }
            let last = paths.pop().unwrap_or_default();
            if let Some(below) = paths.last_mut() {
                below.extend(last);
            }
        }
    }
    paths
}

/// Whether two lines are within so many half widths of both.
///
/// `resolution`: rad/s that the records tell apart; what is nearer is one line.
pub(super) fn near(a: c64, b: c64, widths: f64, resolution: f64) -> bool {
    (a.im - b.im).abs() < (widths * (a.re.abs() + b.re.abs())).max(resolution)
}
