//! The front door.

use std::cell::Cell;

use crate::model::ModelError;
use crate::ringdown::moving::alternatives::{OfLine, Search};
use crate::ringdown::moving::blocks::{Compressed, compress};
use crate::ringdown::moving::group::joined;
use crate::ringdown::moving::input::check;
use crate::ringdown::moving::layout::{first_half_block, half_block, noise, recentred};
use crate::ringdown::moving::model::{MULTIPLES, Mode};
use crate::ringdown::moving::result::{Follows, Moving};
use crate::ringdown::moving::search::{Fit, Weighted, fit};
use crate::ringdown::moving::select::{Rules, selected};
use crate::ringdown::moving::signal::multiples;
use crate::ringdown::moving::start::{linear, plateaus, starts};
use faer::c64;

/// A pole `-rate + i turn`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Exponential {
    /// Decay rate, 1/s.
    pub rate_per_s: f64,
    /// Angular frequency, rad/s.
    pub turn_rad_per_s: f64,
}

/// What a linear fit found within one line: a mode, and its companions if there are any.
#[derive(Debug, Clone, PartialEq)]
pub struct Line {
    /// At least one, any order.
    pub poles: Vec<Exponential>,
}

/// What is fitted, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct Options {
    /// Probability that noise alone makes a linear mode move. Why 0.001: as the number of modes.
    pub false_alarm: f64,
    /// Whether multiples of the phase are looked for.
    pub harmonics: bool,
    /// Largest number of exponentials that are tried in place of a mode.
    pub most_exponentials: usize,
    /// Variance per sample of each channel's noise at the lines; empty: estimated from what is outside the lines.
    pub noise_variance: Vec<f64>,
    /// Points of each course.
    pub course_points: usize,
}

impl Default for Options {
    fn default() -> Self {
        Self { false_alarm: 1e-3, harmonics: true, most_exponentials: 3, noise_variance: Vec::new(), course_points: 12 }
    }
}

/// Least decay within the longest hit that a start has: what seems steady in a linear fit may be a mode that moves.
pub(crate) const LEAST_DECAY: f64 = 0.3;
/// Multiplications that trials of models may take in all: about half a second, and a third more for each line that may
/// stand over a plateau. Fits under way are ended soon after.
pub(crate) const BUDGET: f64 = 5e8;
/// Passes with finer blocks, at most, and the share of a block's length at which one is made.
const ROUNDS: usize = 3;
const FINE_ENOUGH: f64 = 0.75;
/// Gain of BIC from which on a plateau at the end is part of the model.
const PLATEAU_GAIN: f64 = 20.0;

/// Fits free decays with modes whose frequency and decay rate are functions of their amplitude.
///
/// # Model
/// That of [`moving`](super): one mode with two laws per line, or several linear modes, whichever has the lower BIC.
/// # Method
/// Records compressed to slow envelopes in blocks; laws started from log amplitude and phase; all parameters by
/// Levenberg-Marquardt; terms by forward selection, exchange and backward elimination; values averaged over models.
/// # Shapes
/// `events`: hits x channels x samples, the first sample of each hit at t = 0 of that hit; samples that are not finite
/// are missing. `lines`: from a linear fit, one entry per mode; those within each other's width are joined.
/// # Units
/// Seconds, rad/s, 1/s; amplitudes in the unit of the reference channel.
/// # Accuracy
/// docs/results/decay.md, "Modes that move": errors cover at noise of 0.3 % of the amplitude; not with a steady line in
/// the band.
/// # Errors
/// No hit, channel or line; unequal channels or samples; fewer than 16 samples; poles that are not finite or beyond the
/// Nyquist frequency; records that do not determine the modes.
/// # Source
/// N. N. Bogoliubov, Y. A. Mitropolsky, Asymptotic Methods in the Theory of Non-Linear Oscillations (1961); K. P.
/// Burnham, D. R. Anderson, Model Selection and Multimodel Inference (2002).
pub fn follow_moving(
    events: &[Vec<&[f64]>],
    interval_s: f64,
    lines: &[Line],
    options: &Options,
) -> Result<Moving, ModelError> {
    check(events, interval_s, lines, options)?;
    let rules = Rules { false_alarm: options.false_alarm };
    let longest = events.iter().flatten().map(|row| row.len()).max().unwrap_or(1) as f64 * interval_s;
    let (joined, given): (Vec<Line>, Vec<Vec<usize>>) = joined(lines, longest).into_iter().unzip();
    let lines = joined.as_slice();
    let decaying = |p: Exponential| Exponential { rate_per_s: p.rate_per_s.max(LEAST_DECAY / longest), ..p };
    let mains: Vec<Exponential> = lines.iter().filter_map(Line::main).map(decaying).collect();
    let turns: Vec<f64> = mains.iter().map(|p| p.turn_rad_per_s).collect();
    let first_half = first_half_block(lines, events, interval_s);
    let first = compress(events, interval_s, &turns, first_half);
    let variances = noise(&first, events, options);
    let rates: Vec<f64> = mains.iter().map(|p| p.rate_per_s).collect();
    let none = ModelError::Degenerate("the records do not determine the modes");
    let mut modes = starts(&first, &rates, &variances, &rules, &Cell::new(0.2 * BUDGET)).ok_or(none.clone())?;
    let carriers = recentred(&mut modes, &turns);
    let job = Job { events, interval_s, lines, rates: &rates, carriers: &carriers, options, rules };
    let mut result = job.fitted(modes, &variances)?;
    // what a plateau is taken for
    let doubtful = |follows: Follows| matches!(follows, Follows::Beside | Follows::Exponentials(_) | Follows::None);
    let wanted = result.lines.iter().any(|line| line.lack.factor > 1.0 || doubtful(line.follows));
    let budget = Cell::new(0.2 * BUDGET);
    let plateaus = wanted.then(|| plateaus(&first, &rates, &variances, &rules, &budget)).flatten();
    if let Some(mut modes) = plateaus {
        let carriers = recentred(&mut modes, &turns);
        // the same noise: the likelihoods are compared
        let known = Options { noise_variance: result.noise_variance.clone(), ..options.clone() };
        let job = Job { carriers: &carriers, options: &known, ..job };
        result = match job.fitted(modes, &known.noise_variance) {
            Ok(other) if other.bic < result.bic - PLATEAU_GAIN => other,
            _ => result,
        };
    }
    result.lines.iter_mut().zip(given).for_each(|(line, given)| line.given = given);
    Ok(result)
}

/// What is fitted from one set of starts.
#[derive(Clone, Copy)]
struct Job<'a> {
    events: &'a [Vec<&'a [f64]>],
    interval_s: f64,
    lines: &'a [Line],
    rates: &'a [f64],
    carriers: &'a [f64],
    options: &'a Options,
    rules: Rules,
}

impl Job<'_> {
    /// Passes with ever finer blocks, until they resolve what is found; then multiples, and the result.
    fn fitted(&self, modes: Vec<Mode>, variances: &[f64]) -> Result<Moving, ModelError> {
        let none = ModelError::Degenerate("the records do not determine the modes");
        let budget = Cell::new(0.0);
        let (mut half, mut variances) = (0.0, variances.to_vec());
        let mut last: Option<(Compressed, Fit, Vec<OfLine>)> = None;
        for round in 0..ROUNDS {
            let now = last.as_ref().map_or(&modes, |(_, fit, _)| &fit.modes);
            let wanted = half_block(now, self.lines, self.events, self.interval_s, &variances);
            if round > 0 && wanted > FINE_ENOUGH * half {
                break;
            }
            half = wanted;
            let data = compress(self.events, self.interval_s, self.carriers, half);
            if self.options.noise_variance.is_empty() {
                variances = noise(&data, self.events, self.options);
            }
            let (fit, of_lines) = self.pass(&data, &modes, &variances, &budget).ok_or(none.clone())?;
            last = Some((data, fit, of_lines));
        }
        let (data, found, of_lines) = last.ok_or(none.clone())?;
        let (data, found) = self.with_multiples(data, found, half, &variances, &budget).ok_or(none)?;
        let weights: Vec<f64> = variances.iter().map(|v| 1.0 / v).collect();
        budget.set(0.2 * BUDGET);
        let search = self.search(&data, &weights, &budget);
        Ok(search.result(self.events, self.interval_s, &variances, found, of_lines))
    }

    fn search<'b>(&'b self, data: &'b Compressed, weights: &'b [f64], budget: &'b Cell<f64>) -> Search<'b> {
        let problem = Weighted { data, weights, budget };
        Search { problem, lines: self.lines, carriers: self.carriers, options: self.options, rules: self.rules }
    }

    /// Terms chosen, and alternatives tried, in one compression of the records.
    fn pass(
        &self,
        data: &Compressed,
        modes: &[Mode],
        variances: &[f64],
        budget: &Cell<f64>,
    ) -> Option<(Fit, Vec<OfLine>)> {
        let weights: Vec<f64> = variances.iter().map(|v| 1.0 / v).collect();
        let search = self.search(data, &weights, budget);
        let begin = match fit(&search.problem, modes.to_vec()) {
            Some(begin) => begin,
            None => fit(&search.problem, linear(data, self.rates, variances)?)?,
        };
        let of_line =
            |line: usize| OfLine::of((0..begin.modes.len()).filter(|n| begin.modes[*n].carrier == line).collect());
        let mut of_lines: Vec<OfLine> = (0..self.lines.len()).map(of_line).collect();
        budget.set(search.for_terms(&begin));
        let chosen = selected(&search.problem, begin, &self.rules, 6);
        budget.set(0.5 * BUDGET);
        let chosen = search.without_multiples(chosen, &mut of_lines);
        let found = search.alternatives(chosen, &mut of_lines);
        Some((found, of_lines))
    }

    /// Multiples of the phase that the residuals contain, fitted along on carriers of their own.
    fn with_multiples(
        &self,
        data: Compressed,
        mut found: Fit,
        half: f64,
        variances: &[f64],
        budget: &Cell<f64>,
    ) -> Option<(Compressed, Fit)> {
        let there = match self.options.harmonics {
            true => multiples(&data, &found, self.events, self.interval_s, variances, self.options),
            false => Vec::new(),
        };
        if there.is_empty() {
            return Some((data, found));
        }
        let mut all = self.carriers.to_vec();
        for (mode, which) in there {
            found.modes[mode].multiples[which] = Some(all.len());
            found.modes[mode].harmonics[which] = Some(vec![c64::default(); data.channels]);
            all.push(data.carriers[found.modes[mode].carrier] * MULTIPLES[which] as f64);
        }
        let data = compress(self.events, self.interval_s, &all, half);
        let weights: Vec<f64> = variances.iter().map(|v| 1.0 / v).collect();
        let found = fit(&Weighted { data: &data, weights: &weights, budget }, found.modes)?;
        Some((data, found))
    }
}
