//! The linear model that the diagnosis begins with: what identification finds by itself.

mod black_box;
mod decay;
mod linear;
mod oscillator;

use super::data::{Bench, Record};
use super::dynamics::{Kind, Modal, Model, Section};
use super::error::DiagnosisError;
use super::fit::{Blocks, Fit, Until};
use super::options::DiagnosisOptions;

/// A linear model that causes may extend, and how it was judged.
pub(super) struct Baseline {
    pub fit: Fit,
    /// The stretches at a step that suits its highest frequency.
    pub bench: Bench,
    pub adequacy: Adequacy,
}

/// How well linear models describe what was measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Adequacy {
    /// Least criterion of any linear model that was tried.
    pub best: f64,
    /// Its rms over that of the outputs.
    pub left: f64,
}

/// A structure is extended where its error is at most so many times that of the best linear model, or where it is the
/// simplest of a free decay.
///
/// Why: exponentials beside one another follow a frequency or a damping that moves with the amplitude, so that the best
/// linear model of one nonlinear mode has several and leaves a tenth of what one leaves; one oscillator with the right
/// causes beats them all. Without a mode that is there a hundred times as much is left.
const CLOSE: f64 = 20.0;
/// A model of more than one oscillator is extended, too, where it leaves less than so much of what the last simpler one does.
///
/// Why: modes that are there lower the error by a half and more; poles that follow a nonlinear mode by a little each, and
/// the best linear model has many of them.
const ELBOW: f64 = 0.7;
/// The first of several modes beyond the best is tried last where it leaves less than so much of what the best does: where a
/// strong law makes most of the error, a further mode does not pay for its numbers before that law is found.
const RICHER: f64 = 0.85;
/// Share of the signal beyond which what the best linear model leaves is as good as all of it.
const NOTHING: f64 = 0.9;

impl Adequacy {
    /// Whether the output follows from a linear model at all.
    pub fn follows(&self) -> bool {
        self.left < NOTHING
    }

    /// Whether a model describes as much as any linear model does.
    pub fn holds(&self, criterion: f64) -> bool {
        self.follows() && criterion <= self.best + 1e-9 * self.best.abs()
    }
}

/// Schwarz's criterion of a fit, the blocks counted as the independent observations.
///
/// Why blocks: what a model leaves of a nonlinear system is no white noise; as many samples as there are would pay for
/// any number of poles that follow it.
/// # Source
/// G. Schwarz, Ann. Stat. 6 (1978) 461.
pub(super) fn criterion(bench: &Bench, fit: &Fit) -> f64 {
    let count = blocks(bench, fit).count() as f64;
    let own = fit.model.own_numbers() * bench.layout.stretches();
    let numbers = fit.model.system_parameters() + own;
    count * (fit.loss / bench.count as f64).ln() + numbers as f64 * count.ln()
}

/// Linear models as identification finds them.
pub(super) struct Starts {
    pub linear: Vec<Modal>,
    /// Fewest modes that a free decay's model needs.
    needed: usize,
}

/// Finds linear models to extend, the simplest first.
///
/// # Method
/// Without an input: the strongest one, two, ... modes of the free decays, by [`crate::ringdown`], and one oscillator by
/// a grid. With an input: one oscillator by a grid, and the poles of models of rising order by the prediction error
/// method.
pub(super) fn starts(records: &[Record<'_>], coarse: &Bench, options: &DiagnosisOptions) -> Starts {
    let (mut starts, mut needed) = (Vec::new(), 1);
    let single = coarse.layout.channels == 1 && coarse.layout.stretches() == 1;
    starts.extend(single.then(|| oscillator::best(coarse, options)).flatten().map(|fit| fit.model.dynamics));
    let has_oscillator = !starts.is_empty();
    if coarse.driven {
        starts.extend(black_box::starts(records, coarse, options.sensed(0)));
    } else {
        let (modes, least) = decay::starts(records, coarse, options);
        starts.extend(modes.into_iter().skip(usize::from(has_oscillator)));
        needed = least;
    }
    Starts { linear: starts, needed }
}

/// Fits linear models to stretches from where they were found, and keeps those to extend, the simplest first.
///
/// # Method
/// Least squares of the free-run error. The last has the least criterion ([`criterion`]); simpler ones come before it
/// where they are not far worse, or have the modes that a free decay needs.
pub(super) fn baselines(
    records: &[Record<'_>],
    coarse: &Bench,
    starts: &Starts,
    options: &DiagnosisOptions,
) -> Result<Vec<Baseline>, DiagnosisError> {
    let mut tried: Vec<(Fit, Bench)> =
        starts.linear.iter().filter_map(|start| fitted(records, coarse, start, options)).collect();
    tried.sort_by_key(|(fit, _)| fit.model.dynamics.order());
    let criteria: Vec<f64> = tried.iter().map(|(fit, bench)| criterion(bench, fit)).collect();
    let best = criteria.iter().copied().fold(f64::INFINITY, f64::min);
    let last = criteria.iter().position(|own| *own <= best).ok_or(DiagnosisError::NoBaseline)?;
    let rms = |fit: &Fit| (fit.loss / coarse.count as f64).sqrt();
    let signal =
        (coarse.output.iter().filter(|y| y.is_finite()).map(|y| y * y).sum::<f64>() / coarse.count as f64).sqrt();
    let least = tried.get(last).map_or(0.0, |(fit, _)| rms(fit));
    let adequacy = Adequacy { best, left: least / signal };
    let mut kept = vec![false; tried.len()];
    // root mean square of the last that is kept
    let mut before = f64::INFINITY;
    for (place, (fit, _)) in tried.iter().enumerate().take(last) {
        let simple = fit.model.dynamics.is_oscillator()
            || !coarse.driven
            || (fit.model.dynamics.modes() > 0 && rms(fit) < ELBOW * before);
        let near = rms(fit) <= CLOSE * least || (fit.model.dynamics.modes() == starts.needed && !coarse.driven);
        if simple && near {
            kept[place] = true;
            before = before.min(rms(fit));
        }
    }
    if let Some(best) = kept.get_mut(last) {
        *best = true;
    }
    let rest = tried.iter().enumerate().skip(last + 1);
    let richer = |(_, (fit, _)): &(usize, &(Fit, Bench))| {
        coarse.driven && fit.model.dynamics.modes() > 1 && rms(fit) < RICHER * least
    };
    if let Some((place, _)) = rest.clone().find(richer) {
        kept[place] = true;
    }
    let of = |(fit, bench): (Fit, Bench)| Baseline { fit, bench, adequacy };
    Ok(tried.into_iter().zip(kept).filter(|(_, keep)| *keep).map(|(found, _)| of(found)).collect())
}

/// A start fitted to all stretches, without the modes that a line in the record asked for ([`undriven`]).
fn fitted(records: &[Record<'_>], coarse: &Bench, start: &Modal, options: &DiagnosisOptions) -> Option<(Fit, Bench)> {
    let (stretches, interval_s) = (&coarse.stretches, coarse.interval_s);
    let mut start = start.clone();
    loop {
        let bench = Bench::new(records, stretches, interval_s, start.highest_hz(), options.one_unit).ok()?;
        let model = linear::solved(&bench, &start)?;
        let mut fit = Fit::new(&bench, &model, Until::steps(LINEAR_STEPS))?;
        let left = |(own, found): (&Section, &Section)| (found.frequency_hz / own.frequency_hz - 1.0).abs() > MOVED;
        if !bench.driven && start.sections.iter().zip(&fit.model.dynamics.sections).any(left) {
            fit = Fit::new(&bench, &model, Until::steps(0))?;
        }
        let Some(line) = undriven(&bench, &fit) else { return Some((fit, bench)) };
        let others: Vec<usize> = (0..start.sections.len()).filter(|section| *section != line).collect();
        start = fit.model.dynamics.of(&others);
    }
}

/// A mode that does not decay within a stretch and owes nothing to the input: a line in the record, which is a cause.
fn undriven(bench: &Bench, fit: &Fit) -> Option<usize> {
    let dynamics = &fit.model.dynamics;
    if !bench.driven || dynamics.sections.len() < 2 {
        return None;
    }
    let longest = (0..bench.layout.stretches()).map(|e| bench.layout.samples(e)).max()?;
    let lasts_s = longest as f64 * bench.interval_s;
    let goes_on = |s: &usize| {
        let section = dynamics.sections[*s];
        section.kind == Kind::Oscillator && 0.5 * section.omega() * section.loss * lasts_s < 1.0
    };
    let more = |model: Option<Model>| Some(linear::left(bench, &model?) - fit.loss);
    let undriven = |s: usize| more(linear::solved_undriven(bench, dynamics, s));
    let removed = |s: usize| {
        let others: Vec<usize> = (0..dynamics.sections.len()).filter(|other| *other != s).collect();
        more(linear::solved(bench, &dynamics.of(&others)))
    };
    let little = DRIVEN * fit.loss / bench.count as f64;
    let owes_nothing =
        |s: &usize| undriven(*s).is_some_and(|own| own < little || removed(*s).is_some_and(|all| own < SHARE * all));
    (0..dynamics.sections.len()).filter(goes_on).find(owes_nothing)
}

/// Variances of the residual that the input's share in a mode takes of the loss at least: far more than chance, far
/// less than a mode that the input drives.
const DRIVEN: f64 = 20.0;
/// The same as share of what the whole mode takes: what other modes lack gives a line some share in the input.
const SHARE: f64 = 0.05;
/// Share of its frequency by which a mode of a decay is fitted away from where the fit of decays found it: further on it
/// follows what another one lacks, whose law is not yet known.
const MOVED: f64 = 0.1;
/// Steps of a linear fit from identified poles.
const LINEAR_STEPS: usize = 20;

/// Fewest and most blocks: fewer leave the errors' own error above a fifth, more gain nothing.
const BLOCKS: (usize, usize) = (24, 128);
/// Periods of the slowest mode in a block at least. Much longer blocks would hold all that a decay tells of its large
/// swings in one.
const PERIODS: f64 = 2.0;

/// Blocks of a few periods, as far as there are enough of them.
pub(super) fn blocks(bench: &Bench, fit: &Fit) -> Blocks {
    let samples = bench.layout.all_samples();
    let lowest_hz = fit.model.dynamics.lowest_hz();
    let count = (samples as f64 * bench.interval_s * lowest_hz / PERIODS) as usize;
    Blocks::new(&bench.layout, count.clamp(BLOCKS.0, BLOCKS.1).min(samples / 4))
}
