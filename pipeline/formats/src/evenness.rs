//! Whether times run evenly, for every reader.
//!
//! Times are even where a straight line over the row number exists from which each is off by no more than
//! [`MOST_OFF_STEPS`] of a step and half a unit of the last place it is given to. Where they jump, each stretch between
//! two jumps is even by itself, with one step for all.

use crate::printed::Printed;
use crate::rate::{fewest_digits, of_step, roundest_step};
use crate::straight::{Slopes, slopes};

/// Largest deviation from the even grid, in steps. A tenth of it moves phases by less than the noise of any record; times
/// of clocks and of programs are seldom better.
const MOST_OFF_STEPS: f64 = 0.01;
/// A millionth of a step keeps phase over a million samples: such times are exact.
const EXACT_STEPS: f64 = 1e-6;
/// Coarsest rounding, in steps: a lost sample moves times by a step against each other, their rounding by up to a unit,
/// and a line from which none is off by more than half a unit takes up another one.
const COARSEST_STEPS: f64 = 0.5;
/// A step that is known better than this, relative, keeps the digits that it has.
const KNOWN: f64 = 1e-13;
/// A difference of neighbours that is off by more than this share of the median one is a jump.
const JUMP_SHARE: f64 = 0.5;
/// More jumps than one in so many rows are no interruptions of an even clock.
const ROWS_PER_JUMP: usize = 16;
/// Standard deviation of a number that is equally likely within one unit on either side.
const STD_OF_UNIFORM: f64 = 0.577_350_269_189_625_8;

/// Times and how finely they are given.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Times<'a> {
    pub(crate) values: &'a [f64],
    /// How finely they are printed; none for times that are exact but for their type.
    pub(crate) printed: Option<&'a Printed>,
    /// Number of the first row, for messages.
    pub(crate) row: usize,
    /// Relative rounding of the type that holds them.
    pub(crate) epsilon: f64,
}

/// An even axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Even {
    /// The time of the first row, on the grid.
    pub(crate) first: f64,
    /// Of the steps that the times allow that with the fewest digits, or whose rate has.
    pub(crate) step: f64,
    /// Whether the times agree with it only within their rounding or jitter.
    pub(crate) rounded: bool,
    /// Largest deviation from the grid, in steps.
    pub(crate) off_steps: f64,
    /// How far the step may be from the true one, relative.
    pub(crate) uncertainty: f64,
}

impl Even {
    /// Standard error of the rate, relative: all steps that the times allow are equally likely.
    pub(crate) fn relative_std(&self) -> f64 {
        self.uncertainty * STD_OF_UNIFORM
    }
}

/// Even stretches, and the rows before which the times jump.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Stretches {
    pub(crate) even: Even,
    /// Rows from 0, ascending.
    pub(crate) gaps: Vec<usize>,
    /// The first jump, in steps more than one.
    pub(crate) first_jump_steps: f64,
}

impl From<Even> for Stretches {
    fn from(even: Even) -> Self {
        Self { even, gaps: Vec::new(), first_jump_steps: 0.0 }
    }
}

/// The step of times of which only the values are known: rounded to as many digits as the shortest number has that is
/// read as the value. Errors: why they do not run evenly.
pub fn even_step(times: &[f64]) -> Result<f64, String> {
    let printed = Printed::of(times);
    Times { printed: Some(&printed), ..Times::exact(times) }.even(None).map(|even| even.step)
}

impl<'a> Times<'a> {
    /// Times that are known but for the rounding of float64.
    pub(crate) fn exact(values: &'a [f64]) -> Self {
        Self { values, printed: None, row: 0, epsilon: f64::EPSILON }
    }

    fn part(&self, from: usize, end: usize) -> Self {
        Self { values: self.values.get(from..end).unwrap_or_default(), row: self.row + from, ..*self }
    }

    /// One unit of the last place that a time is given to.
    fn unit(&self, time: f64) -> f64 {
        self.printed.map_or(0.0, |printed| printed.unit_of(time))
    }

    /// Rounding of the type itself, of this time and of the first one.
    fn own(&self, time: f64) -> f64 {
        4.0 * self.epsilon * time.abs().max(self.values.first().map_or(0.0, |first| first.abs()))
    }

    /// Looks at the times against a line of the given step, or of any. Errors: why they are not even.
    pub(crate) fn even(&self, stated_step: Option<f64>) -> Result<Even, String> {
        let times = self.values;
        let (Some(&first), Some(&last)) = (times.first(), times.last()) else { return Err("it is empty".to_owned()) };
        if times.len() < 3 && stated_step.is_none() {
            return Err("it has fewer than 3 rows".to_owned());
        }
        if let Some(missing) = times.iter().position(|time| !time.is_finite()) {
            return Err(format!("row {} has no time", self.row + missing + 1));
        }
        let steps = times.len().saturating_sub(1).max(1) as f64;
        let step = stated_step.unwrap_or((last - first) / steps);
        if !(step.is_finite() && step > 0.0) {
            return Err("it does not rise".to_owned());
        }
        let coarse = |unit: f64| format!("it is given too coarsely, to {unit:.1e} at steps of {step:.1e}, to tell");
        let type_unit = self.own(first).max(self.own(last));
        if type_unit > COARSEST_STEPS * step {
            return Err(coarse(type_unit));
        }
        let off = |row: usize, time: f64| (time - (first + row as f64 * step)).abs();
        let worst = || times.iter().enumerate().map(|(row, &time)| off(row, time)).fold(0.0, f64::max) / step;
        let exact = times.iter().enumerate().all(|(row, &time)| off(row, time) <= EXACT_STEPS * step + self.own(time));
        let unit = |time: f64| self.unit(time) + self.own(time);
        let coarsest = unit(first).max(unit(last));
        // far from zero the type rounds the times, and with them the step
        let of_type = || {
            let uncertainty = type_unit / (steps * step);
            let rounded = stated_step.is_none() && uncertainty >= KNOWN;
            let (step, uncertainty) =
                if rounded { (roundest_step(step, uncertainty), uncertainty) } else { (step, 0.0) };
            Even { first, step, rounded: false, off_steps: worst(), uncertainty }
        };
        if exact && (stated_step.is_some() || coarsest > COARSEST_STEPS * step || coarsest < KNOWN * steps * step) {
            return Ok(of_type());
        }
        if coarsest > COARSEST_STEPS * step {
            return Err(coarse(coarsest));
        }
        let stated = |found: &Slopes| {
            let slack = EXACT_STEPS * step / steps;
            stated_step.is_none_or(|step| (found.least - slack..=found.largest + slack).contains(&step))
        };
        let rounded = self.within(0.0).filter(|found| stated(found));
        let jittered = || self.within(MOST_OFF_STEPS * step).filter(|found| stated(found));
        if let Some(found) = rounded {
            let middle = f64::midpoint(found.least, found.largest);
            let uncertainty = 0.5 * (found.largest - found.least) / middle;
            let step = stated_step.unwrap_or_else(|| roundest_step(middle, uncertainty));
            let first = if exact { first } else { self.fitted().map_or(first, |line| line.origin) };
            return Ok(Even { first, step, rounded: !exact, off_steps: worst(), uncertainty });
        }
        if exact {
            return Ok(of_type());
        }
        if jittered().is_some() {
            let fit = self.fitted().ok_or("it does not rise")?;
            // all times may be off by the largest deviation, to one side at one end and to the other at the other
            let uncertainty = 2.0 * fit.off_steps / steps;
            let step = stated_step.unwrap_or_else(|| fewest_digits(of_step(fit.step), uncertainty).recip());
            return Ok(Even { first: fit.origin, step, rounded: true, off_steps: fit.off_steps, uncertainty });
        }
        Err(self.furthest(stated_step))
    }

    /// The slopes of all lines from which each time is off by at most half a unit of its last place and `slack`; of
    /// numbers that are single precision in the digits of double, also half a unit of that.
    fn within(&self, slack: f64) -> Option<Slopes> {
        let half = |unit: f64, time: f64| 0.5 * unit + self.own(time) + slack;
        let of = |row: usize| self.values.get(row).copied().unwrap_or(0.0);
        let found = slopes(self.values, |row| half(self.unit(of(row)), of(row)));
        let single_unit = |time: f64| f64::from(f32::EPSILON) * time.abs();
        let (first, last) = (of(0), of(self.values.len().saturating_sub(1)));
        let fine = || {
            let step = (last - first) / self.values.len().saturating_sub(1).max(1) as f64;
            single_unit(first).max(single_unit(last)) <= COARSEST_STEPS * step
        };
        let single = || fine() && self.values.iter().all(|&time| f64::from(time as f32) == time);
        found.or_else(|| single().then(|| slopes(self.values, |row| half(single_unit(of(row)), of(row)))).flatten())
    }

    /// The line of least squares, and the largest deviation from it.
    fn fitted(&self) -> Option<Line> {
        let (count, first) = (self.values.len() as f64, *self.values.first()?);
        let centre = 0.5 * (count - 1.0);
        let mean = self.values.iter().map(|time| time - first).sum::<f64>() / count;
        let product = |(row, time): (usize, &f64)| (row as f64 - centre) * (time - first - mean);
        let step = self.values.iter().enumerate().map(product).sum::<f64>() * 12.0 / (count * (count * count - 1.0));
        let origin = first + mean - centre * step;
        let mut line = Line { step, off_steps: 0.0, row: 0, origin };
        for (row, time) in self.values.iter().enumerate() {
            let off = (time - (origin + row as f64 * step)).abs() / step;
            if off > line.off_steps {
                (line.off_steps, line.row) = (off, row);
            }
        }
        (step > 0.0).then_some(line)
    }

    /// Where the times are furthest from even.
    fn furthest(&self, stated_step: Option<f64>) -> String {
        let Some(line) = self.fitted() else { return "it does not rise".to_owned() };
        if let Some(step) = stated_step.filter(|step| (step / line.step - 1.0).abs() > MOST_OFF_STEPS) {
            return format!("it steps by {:.6e} on average, not by {step:.6e}", line.step);
        }
        let (row, off) = (self.row + line.row + 1, line.off_steps);
        format!(
            "it wanders: row {row} is furthest from the even grid, by {off:.3} steps, wanted {MOST_OFF_STEPS}; `resample` (--resample) puts it on one"
        )
    }

    /// The same where times may jump: each stretch by itself. Errors: why they are not even.
    pub(crate) fn stretches(&self, stated_step: Option<f64>) -> Result<Stretches, String> {
        let why = match self.even(stated_step) {
            Ok(even) => return Ok(even.into()),
            Err(why) => why,
        };
        let gaps = self.jumps();
        if gaps.is_empty() || gaps.len() > self.values.len() / ROWS_PER_JUMP {
            return Err(why);
        }
        let even = self.even_between(&gaps, stated_step).map_err(|_| why)?;
        let at = |row: usize| self.values.get(row).copied().unwrap_or(f64::NAN);
        let first = gaps.first().copied().unwrap_or(0);
        let first_jump_steps = (at(first) - at(first.saturating_sub(1))) / even.step - 1.0;
        Ok(Stretches { even, gaps, first_jump_steps })
    }

    /// Stretches that begin at the given rows (ascending), with one step for all. Errors: why one is not even.
    pub(crate) fn even_between(&self, starts: &[usize], stated_step: Option<f64>) -> Result<Even, String> {
        let begins = [0].into_iter().chain(starts.iter().copied());
        let ends = starts.iter().copied().chain([self.values.len()]);
        let stretches = || begins.clone().zip(ends.clone()).filter(|(from, end)| end.saturating_sub(*from) > 1);
        let longest = stretches().max_by_key(|(from, end)| end - from).ok_or("it has no two rows in sequence")?;
        let mut found = self.part(longest.0, longest.1).even(stated_step)?;
        for (from, end) in stretches() {
            let even = self.part(from, end).even(Some(found.step))?;
            found.rounded |= even.rounded;
            found.off_steps = found.off_steps.max(even.off_steps);
        }
        let first = self.part(0, starts.first().copied().unwrap_or(self.values.len()));
        found.first = first.fitted().map_or(found.first, |line| line.origin);
        Ok(found)
    }

    /// Rows whose time is not about one step after the one before.
    fn jumps(&self) -> Vec<usize> {
        let mut steps: Vec<f64> =
            self.values.windows(2).filter_map(|pair| Some(pair.last()? - pair.first()?)).collect();
        let middle = steps.len() / 2;
        let all = steps.clone();
        if steps.is_empty() {
            return Vec::new();
        }
        let median = *steps.select_nth_unstable_by(middle, f64::total_cmp).1;
        let unit = self.values.iter().map(|&time| self.unit(time) + self.own(time)).fold(0.0, f64::max);
        let is_jump = |step: f64| (step - median).abs() > JUMP_SHARE * median + 2.0 * unit;
        if median.is_nan() || median <= 0.0 {
            return Vec::new();
        }
        (1..).zip(all).filter(|(_, step)| is_jump(*step)).map(|(row, _)| row).collect()
    }
}

/// A line through times.
#[derive(Debug, Clone, Copy)]
struct Line {
    step: f64,
    off_steps: f64,
    row: usize,
    /// The time of the first row.
    origin: f64,
}

/// What is said of times that jump.
pub(crate) fn of_gaps(location: &str, found: &Stretches) -> Option<String> {
    let (first, jump) = (found.gaps.first()?, found.first_jump_steps);
    let count = match found.gaps.len() {
        1 => "once".to_owned(),
        count => format!("{count} times, first"),
    };
    let (seconds, behind) = (jump * found.even.step, first);
    Some(format!(
        "the times in {location} jump {count} behind row {behind}, by {jump:.4} steps ({seconds:.6}) more than one: a gap"
    ))
}
