//! Which terms the laws have: forward selection, exchange and backward elimination.

use crate::ringdown::moving::dense::{Factor, Square};
use crate::ringdown::moving::model::Mode;
use crate::ringdown::moving::search::{Fit, Problem, TRIALS, fit_within};
use crate::ringdown::moving::terms::{ALL, Law, TERMS, Term, values};
use crate::statistics::chi_square_level;

/// When a term is kept.
#[derive(Debug, Clone, Copy)]
pub struct Rules {
    /// Probability that noise alone adds any term to a mode.
    pub false_alarm: f64,
}

impl Rules {
    /// Gains of chi square above which a term is kept, ten terms being tried: the first of a mode, and further ones.
    pub fn least_gains(&self) -> Gains {
        let tried = (2 * (TERMS - 1)) as f64;
        let level = |p: f64| chi_square_level(p.min(0.5) / tried, 1);
        Gains { first: level(self.false_alarm), further: level(FURTHER * self.false_alarm) }
    }
}

/// False alarm of a further term of a mode that moves, over that of the first: what is at stake is no longer whether it
/// moves but how far its laws can be trusted.
const FURTHER: f64 = 10.0;

/// Gains of chi square above which terms are kept.
#[derive(Debug, Clone, Copy)]
pub struct Gains {
    /// The first term of a linear mode.
    first: f64,
    /// A further one.
    further: f64,
}

impl Gains {
    fn of(&self, smaller: &Mode) -> f64 {
        if smaller.moves() { self.further } else { self.first }
    }
}

/// Which law of a mode.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Of {
    /// Decay rate.
    Damping,
    /// Frequency.
    Frequency,
}

impl Of {
    /// The law.
    pub fn law(self, mode: &Mode) -> &Law {
        match self {
            Self::Damping => &mode.damping,
            Self::Frequency => &mode.frequency,
        }
    }

    fn replaced(self, mode: &Mode, law: Law) -> Mode {
        let mut mode = mode.clone();
        match self {
            Self::Damping => mode.damping = law,
            Self::Frequency => mode.frequency = law,
        }
        mode
    }

    fn place(self, mode: &Mode, term: Term) -> Option<usize> {
        let before = if self == Self::Frequency { mode.damping.terms.len() } else { 0 };
        self.law(mode).terms.iter().position(|&t| t == term).map(|k| mode.laws_at() + before + k)
    }
}

/// Both laws.
pub const BOTH: [Of; 2] = [Of::Damping, Of::Frequency];
/// Candidates of each round that are fitted: the score test ranks them for small changes only.
const TRIED: usize = 3;
/// Share of the least gain that the score test must promise.
const PROMISED: f64 = 0.3;
/// Most terms of a law beside the constant.
const MOST_TERMS: usize = 3;
/// Gain that an exchange of terms must have: of equally good terms the first stays.
const EXCHANGE_GAIN: f64 = 1.0;

/// Chooses terms, from a fit, in at most so many `rounds` of forward selection.
pub fn selected(problem: &dyn Problem, start: Fit, rules: &Rules, rounds: usize) -> Fit {
    let least = rules.least_gains();
    let mut fit = start;
    for _ in 0..3 {
        let before = fit.normal.chi_square;
        let count = fit.parameters();
        fit = forward(problem, fit, least, rounds);
        fit = exchanged(problem, fit);
        fit = backward(problem, fit, least);
        if fit.parameters() == count && before - fit.normal.chi_square < EXCHANGE_GAIN {
            break;
        }
    }
    fit
}

/// Models with one term more, exchanged or less, of the modes that move.
pub fn neighbours(problem: &dyn Problem, fit: &Fit, most_loss: f64) -> Vec<Fit> {
    let mut out = Vec::new();
    for (number, of, term, gain) in score_gains(problem, &fit.modes) {
        if gain > LEAST_NEIGHBOUR && !problem.is_spent() {
            out.extend(with_term(problem, fit, (number, of, term)));
        }
    }
    for (number, mode) in fit.modes.iter().enumerate().filter(|(_, m)| m.may_move) {
        for of in BOTH {
            for &term in of.law(mode).terms.iter().filter(|t| **t != Term::One) {
                let smaller = of.law(mode).without(term);
                let loss = fit.wald(number, of, term);
                let others = ALL.into_iter().filter(|t| !of.law(mode).terms.contains(t));
                let mut laws: Vec<Law> = others.map(|t| smaller.with(t)).collect();
                if loss < most_loss {
                    laws.push(smaller);
                }
                for law in laws {
                    if problem.is_spent() {
                        return out;
                    }
                    let Some(law) = projected(of.law(mode), law, mode) else { continue };
                    let mut modes = fit.modes.clone();
                    modes[number] = of.replaced(mode, law);
                    out.extend(fit_within(problem, modes, NEIGHBOUR_TRIALS));
                }
            }
        }
    }
    out
}

/// Gain of a further term below which it is no neighbour: it moves nothing.
const LEAST_NEIGHBOUR: f64 = 1.0;
/// Trials of a fit with one term more.
const FORWARD_TRIALS: usize = 25;
/// Trials of a neighbour's fit: those that are near arrive in a few.
const NEIGHBOUR_TRIALS: usize = 12;

impl Fit {
    /// Square of a coefficient over its variance.
    fn wald(&self, number: usize, of: Of, term: Term) -> f64 {
        let mode = &self.modes[number];
        let law = of.law(mode);
        let value = law.terms.iter().position(|t| *t == term).map_or(0.0, |k| law.coefficients[k]);
        let place = of.place(mode, term).map(|p| self.base(number) + p);
        match (self.covariance(), place) {
            (Some(c), Some(place)) => value * value / c.at(place, place).max(1e-300),
            _ => 0.0,
        }
    }
}

fn with_term(problem: &dyn Problem, from: &Fit, (number, of, term): (usize, Of, Term)) -> Option<Fit> {
    let mut modes = from.modes.clone();
    modes[number] = of.replaced(&modes[number], of.law(&modes[number]).with(term));
    fit_within(problem, modes, FORWARD_TRIALS)
}

fn forward(problem: &dyn Problem, start: Fit, least: Gains, rounds: usize) -> Fit {
    let mut best = start;
    for _ in 0..rounds {
        if problem.is_spent() {
            break;
        }
        let mut gains = score_gains(problem, &best.modes);
        gains.retain(|g| g.3 > PROMISED * least.of(&best.modes[g.0]));
        gains.sort_by(|a, b| b.3.total_cmp(&a.3));
        let trial = |&(number, of, term, _): &(usize, Of, Term, f64)| {
            let next = with_term(problem, &best, (number, of, term))?;
            let gain = best.normal.chi_square - next.normal.chi_square;
            (gain > least.of(&best.modes[number])).then_some(next)
        };
        let trials = gains.iter().take(TRIED).filter_map(trial);
        match trials.min_by(|a, b| a.normal.chi_square.total_cmp(&b.normal.chi_square)) {
            Some(next) => best = next,
            None => break,
        }
    }
    best
}

/// Gain of chi square that the score test expects of each further term.
fn score_gains(problem: &dyn Problem, modes: &[Mode]) -> Vec<(usize, Of, Term, f64)> {
    let mut wide: Vec<Mode> = modes.to_vec();
    let mut new = Vec::new();
    for (number, mode) in modes.iter().enumerate() {
        for of in BOTH {
            if !mode.may_move || of.law(mode).terms.len() > MOST_TERMS {
                continue;
            }
            for term in ALL.into_iter().filter(|t| !of.law(mode).terms.contains(t)) {
                wide[number] = of.replaced(&wide[number], of.law(&wide[number]).with(term));
                new.push((number, of, term));
            }
        }
    }
    let Some(normal) = problem.normal(&wide) else { return Vec::new() };
    let base = |number: usize| wide[..number].iter().map(Mode::count).sum::<usize>();
    let places: Vec<Option<usize>> =
        new.iter().map(|(number, of, term)| of.place(&wide[*number], *term).map(|p| base(*number) + p)).collect();
    let old: Vec<usize> = (0..normal.score.len()).filter(|i| !places.contains(&Some(*i))).collect();
    let gains = |k: usize| scored(&normal.information, &normal.score, &old, &[k]).map_or(0.0, |g| g.0);
    new.iter().zip(&places).filter_map(|(n, p)| p.map(|p| (n.0, n.1, n.2, gains(p)))).collect()
}

/// Gain of chi square that freeing the parameters `new` promises where `old` are free, and the number of directions.
pub fn scored(information: &Square, score: &[f64], old: &[usize], new: &[usize]) -> Option<(f64, usize)> {
    let mut inner = Square::zeros(old.len());
    for (a, i) in old.iter().enumerate() {
        for (b, j) in old.iter().enumerate() {
            *inner.at_mut(a, b) = information.at(*i, *j);
        }
    }
    let factor = Factor::of(&inner, 0.0)?;
    let solved: Vec<Vec<f64>> =
        new.iter().map(|k| factor.solve(&old.iter().map(|i| information.at(*i, *k)).collect::<Vec<f64>>())).collect();
    // Cholesky of what is not within the free directions; dependent ones are skipped
    let mut kept: Vec<(usize, Vec<f64>, f64)> = Vec::new();
    let mut gain = 0.0;
    for (b, j) in new.iter().enumerate() {
        let entry = |i: &usize| {
            let through: f64 = old.iter().zip(&solved[b]).map(|(o, s)| information.at(*o, *i) * s).sum();
            information.at(*i, *j) - through
        };
        let mut row: Vec<f64> = Vec::with_capacity(kept.len() + 1);
        for (a, (i, lower, _)) in kept.iter().enumerate() {
            let inner: f64 = (0..a).map(|c| lower[c] * row[c]).sum();
            row.push((entry(i) - inner) / lower[a]);
        }
        let pivot = entry(j) - row.iter().map(|v| v * v).sum::<f64>();
        let independent = pivot > DEPENDENT * information.at(*j, *j);
        if !independent {
            continue;
        }
        row.push(pivot.sqrt());
        let right = score[*j] - old.iter().zip(&solved[b]).map(|(o, s)| score[*o] * s).sum::<f64>();
        let value = (right - kept.iter().zip(&row).map(|(k, r)| k.2 * r).sum::<f64>()) / pivot.sqrt();
        gain += value * value;
        kept.push((*j, row, value));
    }
    (!kept.is_empty()).then_some((gain, kept.len()))
}

/// Share of a parameter's information, beyond the free ones, below which it adds no direction.
const DEPENDENT: f64 = 1e-6;

/// Each term exchanged for each other of its law where that is better.
fn exchanged(problem: &dyn Problem, start: Fit) -> Fit {
    let mut best = start;
    for number in 0..best.modes.len() {
        for of in BOTH {
            let terms: Vec<Term> =
                of.law(&best.modes[number]).terms.iter().copied().filter(|t| *t != Term::One).collect();
            for term in terms {
                let now = of.law(&best.modes[number]).clone();
                for other in ALL.into_iter().filter(|t| !now.terms.contains(t) && !problem.is_spent()) {
                    let Some(law) = projected(&now, now.without(term).with(other), &best.modes[number]) else {
                        continue;
                    };
                    let mut modes = best.modes.clone();
                    modes[number] = of.replaced(&modes[number], law);
                    let Some(next) = fit_within(problem, modes, NEIGHBOUR_TRIALS) else { continue };
                    if best.normal.chi_square - next.normal.chi_square > EXCHANGE_GAIN {
                        best = next;
                        break;
                    }
                }
            }
        }
    }
    best
}

fn backward(problem: &dyn Problem, start: Fit, least: Gains) -> Fit {
    let mut best = start;
    loop {
        let mut found: Option<Fit> = None;
        for number in 0..best.modes.len() {
            for of in BOTH {
                let mode = &best.modes[number];
                for &term in of.law(mode).terms.iter().filter(|t| **t != Term::One) {
                    if best.wald(number, of, term) > CERTAIN * least.first {
                        continue;
                    }
                    let Some(law) = projected(of.law(mode), of.law(mode).without(term), mode) else { continue };
                    let smaller = of.replaced(mode, law);
                    let needed = least.of(&smaller);
                    let mut modes = best.modes.clone();
                    modes[number] = smaller;
                    let Some(next) = fit_within(problem, modes, TRIALS) else { continue };
                    let cheap = next.normal.chi_square - best.normal.chi_square < needed;
                    if cheap && found.as_ref().is_none_or(|f| next.normal.chi_square < f.normal.chi_square) {
                        found = Some(next);
                    }
                }
            }
        }
        match found {
            Some(next) => best = next,
            None => return best,
        }
    }
}

/// Squared coefficient over its variance, in least gains, from which on no fit without it is tried.
const CERTAIN: f64 = 10.0;

/// A law with other terms that is nearest to `old` where the mode has its energy.
pub fn projected(old: &Law, new: Law, mode: &Mode) -> Option<Law> {
    let count = new.terms.len();
    let mut gram = Square::zeros(count);
    let mut right = vec![0.0; count];
    let high = mode.starts.iter().map(|s| s.0).fold(f64::MIN, f64::max).min(2.0);
    for i in 0..40 {
        let a = (high - 4.0 * i as f64 / 40.0).exp();
        let v = values(a, mode.floor).value;
        for (j, s) in new.terms.iter().enumerate() {
            right[j] += a * a * v[s.index()] * old.at(&v);
            for (k, t) in new.terms.iter().enumerate() {
                *gram.at_mut(j, k) += a * a * v[s.index()] * v[t.index()];
            }
        }
    }
    let coefficients = Factor::of(&gram, 1e-9)?.solve(&right);
    Some(Law { terms: new.terms, coefficients })
}
