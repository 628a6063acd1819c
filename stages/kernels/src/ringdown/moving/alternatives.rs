//! What else a line may be: several linear modes, a mode beside a linear one, a multiple of another mode's phase.

use crate::ringdown::moving::exponentials::{Pole, exponentials, solved};
use crate::ringdown::moving::follow::{BUDGET, Exponential, LEAST_DECAY, Line, Options};
use crate::ringdown::moving::lack::{Lack, lack};
use crate::ringdown::moving::layout::range;
use crate::ringdown::moving::model::{MOST_DAMPING, MULTIPLES, Mode};
use crate::ringdown::moving::result::Follows;
use crate::ringdown::moving::search::{Fit, Problem, TRIALS, Weighted, fit, fit_within};
use crate::ringdown::moving::select::{Rules, projected, selected};
use crate::ringdown::moving::terms::{Law, TERMS, Term, values};
use faer::c64;

/// Probability of as much round a line under noise alone below which neither model holds.
const UNEXPLAINED: f64 = 1e-6;
/// Relative distance of a line to a multiple of another up to which it may be one.
const NEAR_MULTIPLE: f64 = 0.01;
/// Amplitude of a multiple over that of its mode, at most.
const WEAK: f64 = 0.15;
/// Share of a line's energy that a multiple of a phase explains from which on it is one: the power of the amplitude is
/// that of weak nonlinearity.
const EXPLAINED: f64 = 0.95;
/// Terms that one cause adds to the damping, one of them, and to the frequency: drag, cubic damping, dry friction; a cubic
/// spring, the sine of an angle, a spring of a power law.
const OF_DAMPING: [Term; 3] = [Term::Linear, Term::Square, Term::Inverse];
const OF_FREQUENCY: [&[Term]; 3] = [&[Term::Square], &[Term::Square, Term::Fourth], &[Term::Log]];
/// Difference of BIC up to which laws of one cause are as good as others: odds of 20 to 1.
const AS_GOOD: f64 = 6.0;
/// Difference of BIC from which on exponentials replace a mode that leaves no more than noise.
const DECISIVE: f64 = 10.0;
/// Gain of BIC from which on a linear mode stands beside one that moves.
const BESIDE_GAIN: f64 = 60.0;
/// Where steady lines beside a mode are begun, on either side, in its half widths.
const LINES_ABOUT: [f64; 6] = [0.6, 1.5, 2.5, 4.0, 6.0, 8.0];
/// Trials of each: enough to tell which arrives; the best is fitted to its end.
const LINE_TRIALS: usize = 20;
/// Mean square of what is left in a line's band, in units of noise, from which on it may beat.
const BEATS: f64 = 3.0;
/// Share of a pass's work that steady lines about a mode have at least: what was tried before them may have taken all.
const FOR_LINES: f64 = 0.3;
/// Trials of a sum of exponentials, and how far above a mode that leaves no more than noise it may be for more of them.
const EXPONENTIALS: (usize, f64) = (12, 300.0);

/// A fit of all lines under test.
pub(crate) struct Search<'a> {
    pub(crate) problem: Weighted<'a>,
    pub(crate) lines: &'a [Line],
    pub(crate) carriers: &'a [f64],
    pub(crate) options: &'a Options,
    pub(crate) rules: Rules,
}

/// How a line is followed, and the numbers of its modes in the fit.
pub(crate) struct OfLine {
    pub(crate) modes: Vec<usize>,
    pub(crate) bic_difference: Option<f64>,
    /// Whether the first is one mode that the others are beside.
    pub(crate) beside: bool,
    /// Line and multiple that it is.
    pub(crate) multiple: Option<(usize, usize)>,
}

impl OfLine {
    /// Of its modes: more than one are a mode and what is beside.
    pub(crate) fn of(modes: Vec<usize>) -> Self {
        let beside = modes.len() > 1;
        Self { modes, bic_difference: None, beside, multiple: None }
    }
}

impl Search<'_> {
    pub(crate) fn bic(&self, fit: &Fit) -> f64 {
        let rows: usize = self.problem.data.records.iter().map(|r| r.rows).sum();
        let terms: usize = fit.modes.iter().map(|m| m.damping.terms_that_move() + m.frequency.terms_that_move()).sum();
        // one of so many terms: each has its share of the prior
        let choice = 2.0 * (2.0 * (TERMS - 1) as f64).ln() * terms as f64;
        fit.normal.chi_square + fit.parameters() as f64 * (rows.max(2) as f64).ln() + choice
    }

    fn lack(&self, fit: &Fit, mode: usize) -> Lack {
        lack(self.problem.data, fit, self.problem.weights, mode)
    }

    /// Budget of the choice of terms: little where a line beats that two exponentials explain, since no term mends a
    /// beat.
    pub(crate) fn for_terms(&self, begin: &Fit) -> f64 {
        self.problem.budget.set(0.2 * BUDGET);
        let beats = |line: usize| {
            let wide = self.lack(begin, line).band > BEATS;
            let pair = if wide { self.sum_of(begin, line, line, false) } else { None };
            let fine = |fit: Fit| (begin.modes.len() - 1..fit.modes.len()).all(|n| self.lack(&fit, n).factor <= 1.0);
            pair.is_some_and(fine)
        };
        if (0..self.lines.len()).any(beats) { 0.04 * BUDGET } else { 0.4 * BUDGET }
    }

    /// Lines that are multiples of the phase of another line's mode.
    pub(crate) fn without_multiples(&self, start: Fit, of_lines: &mut [OfLine]) -> Fit {
        let mut best = start;
        for line in (0..of_lines.len()).filter(|_| self.options.harmonics) {
            for of in 0..of_lines.len() {
                let (Some(&number), Some(&base)) = (of_lines[line].modes.first(), of_lines[of].modes.first()) else {
                    continue;
                };
                for (which, multiple) in MULTIPLES.iter().enumerate() {
                    let (own, main) = (&best.modes[number], &best.modes[base]);
                    let apart = (own.turn - *multiple as f64 * main.turn).abs();
                    let near = apart < NEAR_MULTIPLE * own.turn + 3.0 * own.damping.coefficients[0].abs();
                    if line == of || !near || main.harmonics[which].is_some() {
                        continue;
                    }
                    let size = |m: &Mode| m.unit * m.starts.iter().map(|s| s.0.exp()).fold(0.0, f64::max);
                    let weak = size(own) < WEAK * size(main);
                    let mut modes = best.modes.clone();
                    modes[base].multiples[which] = Some(own.carrier);
                    modes[base].harmonics[which] = Some(vec![c64::default(); self.problem.data.channels]);
                    modes.remove(number);
                    let mut without = modes.clone();
                    without[base - usize::from(base > number)].harmonics[which] = None;
                    let Some(next) = fit(&self.problem, modes) else { continue };
                    let Some(without) = fit(&self.problem, without) else { continue };
                    let gain = |fit: &Fit| without.normal.chi_square - fit.normal.chi_square;
                    if self.bic(&next) < self.bic(&best) || weak && gain(&next) > EXPLAINED * gain(&best) {
                        let last = next.modes.len();
                        take(of_lines, line, number, last, last);
                        of_lines[line].multiple = Some((of, *multiple));
                        best = next;
                        break;
                    }
                }
            }
        }
        best
    }

    /// The same with laws of one cause in a mode that leaves noise alone, where they are as good: over a small part of a
    /// decay terms are much alike.
    fn of_one_cause(&self, best: &Fit, number: usize) -> Option<Fit> {
        let mode = &best.modes[number];
        let law = |terms: &[Term]| terms.iter().fold(Law::constant(0.0), |law, term| law.with(*term));
        let choices = |old: &Law, of_cause: &[&[Term]]| -> Vec<Law> {
            let as_many = |terms: &&&[Term]| terms.len() < old.terms.len();
            let others = of_cause.iter().filter(as_many).filter_map(|terms| projected(old, law(terms), mode));
            std::iter::once(old.clone()).chain(others).collect()
        };
        let damping = choices(&mode.damping, &OF_DAMPING.each_ref().map(std::slice::from_ref));
        let frequency = choices(&mode.frequency, &OF_FREQUENCY);
        let both = damping.iter().flat_map(|d| frequency.iter().map(move |f| (d.clone(), f.clone())));
        let modes = both.map(|(damping, frequency)| Mode { damping, frequency, ..mode.clone() });
        let fits = modes.filter(|mode| is_of_one_cause(mode) && !self.problem.is_spent()).filter_map(|mode| {
            let mut modes = best.modes.clone();
            modes[number] = mode;
            fit(&self.problem, modes)
        });
        let found = fits.min_by(|a, b| self.bic(a).total_cmp(&self.bic(b)))?;
        (self.bic(&found) < self.bic(best) + AS_GOOD && self.lack(&found, number).factor <= 1.0).then_some(found)
    }

    /// Each line that moves, has companions or leaves more than noise, as sums of exponentials instead, or with a
    /// linear mode beside.
    pub(crate) fn alternatives(&self, start: Fit, of_lines: &mut [OfLine]) -> Fit {
        let mut best = start;
        for line in 0..of_lines.len() {
            let &[number] = of_lines[line].modes.as_slice() else { continue };
            let left = self.lack(&best, number);
            let lacks = left.factor > 1.0;
            if self.problem.is_spent() || !best.modes[number].moves() && self.lines[line].poles.len() < 2 && !lacks {
                continue;
            }
            if !lacks && !is_of_one_cause(&best.modes[number]) {
                best = self.of_one_cause(&best, number).unwrap_or(best);
            }
            let own = self.bic(&best);
            let mode = &best.modes[number];
            let plain = !lacks && is_of_one_cause(mode);
            let other = self.sum_of(&best, line, number, plain);
            // laws of no one cause may stand for a line beside
            let odd = mode.moves() && !is_of_one_cause(mode) && rate_at_half(mode) < MOST_DAMPING * mode.turn;
            let unexplained = left.p_value < UNEXPLAINED;
            let beside = if unexplained || odd { self.beside(&best, line, number) } else { None };
            let plateau = if odd { self.plateau(&best, number) } else { None };
            of_lines[line].bic_difference = other.as_ref().map(|other| own - self.bic(other));
            // as good is not enough where one mode is the plainer account, and enough where it is not
            let as_good = DECISIVE * f64::from(u8::from(!lacks));
            let wanted = own + if plain { -DECISIVE } else { as_good };
            let good = |fit: &Fit| self.bic(fit) < wanted;
            let gain = if unexplained { BESIDE_GAIN } else { DECISIVE };
            let beside = beside.filter(|fit| self.bic(fit) < own - gain);
            // more than noise left: no better account than any other line beside
            let explains = |fit: &Fit| self.lack(fit, number).factor <= 1.0;
            // a pull by one over the amplitude is what play makes of one mode
            let as_good = if is_of_play(&best.modes[number]) { -DECISIVE } else { as_good };
            let plateau =
                plateau.filter(|fit| self.bic(fit) < own + as_good && (explains(fit) || self.bic(fit) < own - gain));
            let other = other.filter(good);
            let above = |one: &Option<Fit>, by: f64| one.as_ref().map_or(f64::INFINITY, |fit| self.bic(fit) + by);
            let lowest = above(&beside, DECISIVE).min(above(&plateau, 0.0));
            let sum_is_better = other.as_ref().is_some_and(|fit| self.bic(fit) <= lowest);
            let beside = if above(&plateau, 0.0) < above(&beside, DECISIVE) { plateau } else { beside };
            if let (Some(other), true) = (&other, sum_is_better) {
                take(of_lines, line, number, best.modes.len() - 1, other.modes.len());
                best = other.clone();
            } else if let Some(beside) = beside {
                of_lines[line].modes.push(best.modes.len());
                of_lines[line].beside = true;
                best = beside;
            }
        }
        best
    }

    /// The mode with a linear one in its line: steady (a plateau, whose amplitude does not change), or with a pole of the
    /// linear fit, which decays.
    fn beside(&self, best: &Fit, line: usize, number: usize) -> Option<Fit> {
        let mode = &best.modes[number];
        let longest = self.problem.data.hits.iter().map(|hit| hit.duration_s).fold(0.0, f64::max);
        let low = mode.frequency.at(&values(0.05 * range(mode).1, mode.floor).value);
        let decaying =
            |p: &Exponential| (Law::constant(p.rate_per_s.max(LEAST_DECAY / longest)), p.turn_rad_per_s - mode.turn);
        let given = self.lines[line].poles.iter().map(decaying);
        let with = |(damping, offset): (Law, f64)| {
            let begin = self.with_line(best, number, damping, offset, TRIALS)?;
            let found = selected(&self.problem, begin, &self.rules, 3);
            // what grows is no mode
            let grows = found.modes.last().is_some_and(|m| m.damping.coefficients.iter().any(|rate| *rate < 0.0));
            (!grows).then_some(found)
        };
        let starts = std::iter::once((Law::zero(), low)).chain(given);
        starts.take(3).filter_map(with).min_by(|a, b| self.bic(a).total_cmp(&self.bic(b)))
    }

    /// A mode of one cause with a steady line beside, in the place of laws of none: those stood for both and are no start.
    /// Plain laws are, with lines all about the mode.
    fn plateau(&self, best: &Fit, number: usize) -> Option<Fit> {
        // what was tried before may have taken all
        self.problem.budget.set(self.problem.budget.get().max(FOR_LINES * BUDGET));
        let mode = &best.modes[number];
        let longest = self.problem.data.hits.iter().map(|hit| hit.duration_s).fold(0.0, f64::max);
        let rate = rate_at_half(mode).max(LEAST_DECAY / longest);
        let plain = self.plainly(best, number)?;
        let centre = plain.modes[number].frequency.at(&values(0.5 * range(mode).1, mode.floor).value);
        let about = LINES_ABOUT.iter().flat_map(|widths| [-widths, *widths]);
        let begun = about
            .filter_map(|widths| self.with_line(&plain, number, Law::zero(), centre + widths * rate, LINE_TRIALS))
            .min_by(|a, b| self.bic(a).total_cmp(&self.bic(b)))?;
        let found = fit(&self.problem, begun.modes)?;
        // terms that do not show stay: without them errors would leave out what a short record cannot tell
        let other = selected(&self.problem, found.clone(), &self.rules, 1);
        let is_better = other.parameters() > found.parameters() && self.bic(&other) + AS_GOOD < self.bic(&found);
        Some(if is_better { other } else { found })
    }

    /// The fit with a linear mode more, of a damping and at so much from the carrier of a mode whose line it shares.
    fn with_line(&self, best: &Fit, number: usize, damping: Law, offset: f64, trials: usize) -> Option<Fit> {
        if self.problem.is_spent() {
            return None;
        }
        let unit = Mode {
            damping,
            frequency: Law::constant(offset),
            harmonics: [None, None],
            may_move: false,
            ..best.modes[number].clone()
        };
        let more = solved(self.problem.data, &best.modes, vec![unit])?;
        fit_within(&self.problem, best.modes.iter().cloned().chain(more).collect(), trials)
    }

    /// The fit with the plainest laws that move in one mode: drag and a cubic spring.
    fn plainly(&self, best: &Fit, number: usize) -> Option<Fit> {
        let mode = &best.modes[number];
        let law = |old: &Law, term: Term| projected(old, Law::constant(0.0).with(term), mode);
        let (damping, frequency) = (law(&mode.damping, Term::Linear)?, law(&mode.frequency, Term::Square)?);
        let mut modes = best.modes.clone();
        modes[number] = Mode { damping, frequency, ..mode.clone() };
        fit(&self.problem, modes)
    }

    /// The best sum of exponentials in place of a mode. Where the mode leaves noise alone with terms of a common cause
    /// (`plain`), few trials.
    fn sum_of(&self, best: &Fit, line: usize, number: usize, plain: bool) -> Option<Fit> {
        let mode = &best.modes[number];
        let others: Vec<Mode> =
            best.modes.iter().enumerate().filter(|(n, _)| *n != number).map(|(_, m)| m.clone()).collect();
        let trials = if plain { EXPONENTIALS.0 } else { TRIALS };
        let mut other: Option<Fit> = None;
        for count in 2..=self.options.most_exponentials {
            let starts = self.starts(line, mode, count, other.as_ref(), others.len());
            let Some(next) = exponentials(&self.problem, &others, mode, &starts, trials) else { continue };
            let far = plain && next.normal.chi_square > best.normal.chi_square + EXPONENTIALS.1;
            let better = other.as_ref().is_none_or(|o| self.bic(&next) < self.bic(o));
            if better {
                other = Some(self.with_fewer(next, &others, mode, count));
            }
            if far || !better || self.problem.is_spent() {
                break;
            }
        }
        other
    }

    /// The same with one exponential less where that is as good: fewer may not have arrived from their own starts.
    fn with_fewer(&self, fit: Fit, others: &[Mode], mode: &Mode, count: usize) -> Fit {
        if count < 3 || self.problem.is_spent() {
            return fit;
        }
        let poles: Vec<Pole> = fit.modes[others.len()..]
            .iter()
            .map(|m| (m.damping.coefficients[0], m.frequency.coefficients[0]))
            .collect();
        let without = |j: usize| poles.iter().enumerate().filter(|(i, _)| *i != j).map(|(_, p)| *p).collect();
        let starts: Vec<Vec<Pole>> = (0..count).map(without).collect();
        match exponentials(&self.problem, others, mode, &starts, TRIALS) {
            Some(fewer) if self.bic(&fewer) < self.bic(&fit) => fewer,
            _ => fit,
        }
    }

    pub(crate) fn follows(&self, found: &Fit, of: &OfLine) -> (Follows, Lack) {
        let lacks = of.modes.iter().map(|n| self.lack(found, *n));
        let none = Lack { factor: 1.0, p_value: 1.0, along: 1.0, band: 1.0 };
        let worst = lacks.max_by(|a, b| a.factor.total_cmp(&b.factor)).unwrap_or(none);
        if let Some((of, multiple)) = of.multiple {
            return (Follows::Multiple { of, multiple }, none);
        }
        let follows = match of.modes.len() {
            _ if worst.p_value < UNEXPLAINED && worst.factor > 2.0 => Follows::None,
            _ if of.beside => Follows::Beside,
            1 if found.modes[of.modes[0]].moves() => Follows::Moving,
            1 => Follows::Linear,
            count => Follows::Exponentials(count),
        };
        (follows, worst)
    }

    /// Starts of so many exponentials: those of the linear fit; the mode's poles at its largest and smallest amplitude;
    /// pairs about it.
    fn starts(&self, line: usize, mode: &Mode, count: usize, fewer: Option<&Fit>, others: usize) -> Vec<Vec<Pole>> {
        let carrier = self.carriers[line];
        let mut given: Vec<Pole> =
            self.lines[line].poles.iter().map(|p| (p.rate_per_s, p.turn_rad_per_s - carrier)).collect();
        given.sort_by(|a, b| a.0.total_cmp(&b.0));
        let mut starts = Vec::new();
        if given.len() == count {
            starts.push(given);
        }
        let high = range(mode).1;
        let pole = |a: f64| {
            let v = values(a, mode.floor).value;
            (mode.damping.at(&v).max(1e-6 * carrier), mode.frequency.at(&v))
        };
        let (early, late) = (pole(high), pole(0.2 * high));
        let mean = (0.5 * (early.0 + late.0)).max(1e-6 * carrier);
        if count == 2 {
            starts.push(vec![late, (2.0 * early.0.max(late.0), early.1)]);
            if let Some(main) = self.lines[line].main() {
                let (rate, centre) = (main.rate_per_s.max(1e-6 * carrier), main.turn_rad_per_s - carrier);
                starts.push(vec![(rate, centre - 1.2 * rate), (rate, centre + 1.2 * rate)]);
            }
            for apart in [0.7, 2.5] {
                starts.push(vec![(mean, late.1 - apart * mean), (mean, late.1 + apart * mean)]);
            }
        } else if let Some(fewer) = fewer {
            let known: Vec<Pole> = fewer.modes[others..]
                .iter()
                .map(|m| (m.damping.coefficients[0], m.frequency.coefficients[0]))
                .collect();
            let fastest = known.iter().map(|p| p.0).fold(0.0, f64::max);
            let centre = known.iter().map(|p| p.1).sum::<f64>() / known.len().max(1) as f64;
            starts.push(known.iter().copied().chain([(2.0 * fastest, centre)]).collect());
            starts.push(known.iter().copied().chain([(mean, centre)]).collect());
        }
        starts
    }
}

/// Decay rate of a mode at half its largest amplitude, 1/s.
fn rate_at_half(mode: &Mode) -> f64 {
    mode.damping.at(&values(0.5 * range(mode).1, mode.floor).value)
}

/// Whether a common cause makes both laws.
fn is_of_one_cause(mode: &Mode) -> bool {
    let more = |law: &Law| law.terms.iter().copied().filter(|term| *term != Term::One).collect::<Vec<Term>>();
    let (damping, frequency) = (more(&mode.damping), more(&mode.frequency));
    damping.len() <= 1
        && damping.iter().all(|term| OF_DAMPING.contains(term))
        && (frequency.is_empty() || OF_FREQUENCY.iter().any(|terms| frequency.iter().all(|term| terms.contains(term))))
}

/// Whether the frequency is pulled by one over the amplitude: by play.
fn is_of_play(mode: &Mode) -> bool {
    mode.frequency.terms == [Term::One, Term::Inverse]
}

/// Replaces a line's mode by exponentials, which are the last modes of the fit.
fn take(of_lines: &mut [OfLine], line: usize, number: usize, from: usize, to: usize) {
    // modes behind the removed one move up
    for of in of_lines.iter_mut() {
        of.modes.iter_mut().filter(|n| **n > number).for_each(|n| *n -= 1);
    }
    of_lines[line].modes = (from..to).collect();
}
