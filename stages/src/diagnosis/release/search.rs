//! From signs to names: refits, held-out events, and when to abstain.

use super::contest::{REDONE, refits};
use super::detuning::Detuning;
use super::exponent::Exponent;
use super::joint::{JointFit, fit, settled, with_errors};
use super::needless::take_back;
use super::problem::Problem;
use super::replaced::replace_one;
use super::residuals::{Tile, common, peaks, residuals, tiles, whitened};
use super::round::{Judged, Round};
use super::screen::{Screen, screen};
use super::state::{Hold, State};
use crate::causes::{Cause, Domain, Identifiable, Part, Scene};
use crate::diagnosis::verdict::{Gain, RunnerUp, Verdict};
use crate::model::ModelError;

/// How names are given.
#[derive(Debug, Clone, PartialEq)]
pub struct NamingOptions {
    /// Probability of a name, or of `unexplained`, where nothing is wrong.
    pub false_alarm_rate: f64,
    /// Causes that are not considered.
    pub without: Vec<String>,
    /// Most causes named.
    pub most: usize,
    /// Candidates that are fitted in full at each step.
    pub refits: usize,
    /// Seed of the draws of the scores.
    pub seed: u64,
}

impl Default for NamingOptions {
    fn default() -> Self {
        Self { false_alarm_rate: 0.01, without: Vec::new(), most: 4, refits: 5, seed: 1 }
    }
}

/// A cause that has been named.
pub struct Named {
    /// The cause; its values are those of the last fit's hypothesis of the same place.
    pub cause: &'static dyn Cause,
    /// Probability of so strong a sign without any cause.
    pub p_value: f64,
    /// Its score when it was found, in standard deviations.
    pub score: f64,
    /// What it buys on held-out events.
    pub gain: Gain,
    /// The next best candidate of another class.
    pub runner_up: Option<RunnerUp>,
}

/// What the search ends with.
pub struct Naming {
    /// Clean, named or unexplained.
    pub verdict: Verdict,
    /// Named causes in the order of their finding.
    pub named: Vec<Named>,
    /// The baseline, then one fit per cause.
    pub fits: Vec<JointFit>,
    /// The last screen.
    pub screen: Screen,
    /// Probability of the strongest sign of the first screen.
    pub first_p_value: f64,
    /// Tiles of the common residual, strongest first: of the baseline and of the last fit.
    pub tiles: [Vec<Tile>; 2],
    /// Nearest candidates where there is no name.
    pub nearest: Vec<RunnerUp>,
    /// What was seen, in sentences.
    pub evidence: Vec<String>,
}

/// Fall of the sum of squares that a parameter must bring, over the logarithm of the number of samples: as the Bayesian information criterion.
pub(super) const PENALTY: f64 = 1.0;
/// Share of the baseline's excess energy that named causes may leave.
const REMAINDER: f64 = 0.05;
/// Safety of the omnibus test, whose tiles are counted but whose noise model is an estimate.
const OMNIBUS: f64 = 0.1;

/// Times that names may give way to others.
const REPLACEMENTS: usize = 3;

/// Power of the amplitude by which a strength must change to be another law's: laws differ by whole powers, inexact models by little.
const ANOTHER_LAW: f64 = 0.25;

/// Probability of a sign beside named causes above which it does not take their names away, and the share of what they have explained below which it does
/// not either: their own model is not exact.
const FAINT: [f64; 2] = [1e-6, 1e-3];
/// What may be named: of members of one class the first stands for all.
fn candidates(catalogue: &[&'static dyn Cause], without: &[String]) -> Vec<&'static dyn Cause> {
    let mut out: Vec<&'static dyn Cause> = Vec::new();
    for cause in catalogue.iter().copied().filter(|cause| is_candidate(*cause, without)) {
        if out.iter().all(|known| known.about().class != cause.about().class) {
            out.push(cause);
        }
    }
    out
}

/// Whether a candidate belongs into a screen of events' shapes.
fn is_candidate(cause: &dyn Cause, without: &[String]) -> bool {
    let about = cause.about();
    let here = matches!(about.domain, Domain::Release | Domain::Both) && about.identifiable == Identifiable::Shape;
    here && !matches!(about.part, Part::Record | Part::Input) && !without.iter().any(|id| id == about.id)
}

/// The scene that trial values are made for.
pub fn scene(problem: &Problem<'_>, fitted: &JointFit, common: &[f64]) -> Scene {
    let modes = &fitted.state.lever.modes;
    let events = &fitted.state.events;
    let count = events.len().max(1) as f64;
    let interval_s = problem.cut.interval_s;
    let own: Vec<f64> = modes.iter().map(|m| m.omega / std::f64::consts::TAU).collect();
    let mut places: Vec<f64> = problem.windows.iter().map(|window| window.first.place).collect();
    places.sort_by(f64::total_cmp);
    places.dedup();
    Scene {
        places,
        quality_factor: modes.iter().map(|m| m.quality_factor).collect(),
        interval_s,
        window_s: problem.cut.samples as f64 * interval_s,
        level_v: events.iter().map(|e| e.amplitude.abs()).sum::<f64>() / count,
        input_level: 0.0,
        noise_v: (problem.noise.white / count).sqrt(),
        // what lies within a mode's width is that mode's misfit
        residual_peaks_hz: peaks(common, interval_s, 12)
            .into_iter()
            .filter(|f| modes.iter().zip(&own).all(|(m, g)| (f - g).abs() > g / m.quality_factor))
            .take(4)
            .collect(),
        frequency_hz: own,
    }
}

/// Names what a baseline leaves unexplained.
///
/// # Method
/// Greedy: a score screen of all candidates; the strongest fitted in full, from the present fit; the one that gains most, its parameters
/// paid for, is held against held-out events (two halves in turn, shared parameters frozen) and against the best of another class. It is
/// named if it wins both and is not at a limit of its parameters; what an earlier name explained beside it may make that needless, which is then taken back. The search ends when no
/// sign is stronger than the false-alarm rate allows, or than what the named causes' models leave. At last three tests ask what is left: tiles of the residual common to all events, the events' own
/// frequencies, and whether a named strength follows the amplitude; each makes the verdict `unexplained`.
/// # Errors
/// Those of [`fit`] on the baseline.
pub fn name_causes(
    problem: &Problem<'_>,
    state: State,
    starts: Vec<usize>,
    catalogue: &[&'static dyn Cause],
    options: &NamingOptions,
) -> Result<Naming, ModelError> {
    let mut candidates = candidates(catalogue, &options.without);
    let clean = (state.clone(), starts.clone());
    let begun = settled(problem, state, starts)?;
    let mut base = fit(problem, begun.state, begun.starts, Hold::Nothing)?;
    let first_tiles = tiles_of(problem, &base);
    let (mut earlier, mut named): (Vec<JointFit>, Vec<Named>) = (Vec::new(), Vec::new());
    let (mut nearest, mut evidence) = (Vec::new(), Vec::new());
    let mut verdict = Verdict::Clean;
    let (mut redone, mut replacements, mut waiting) = (0, 0, Vec::new());
    let mut last_screen;
    let mut first_p_value = None;
    let mut first_detuning = None;
    loop {
        let scene = scene_of(problem, &base);
        last_screen = screen(problem, &base, &candidates, &scene, options.seed)?;
        first_p_value.get_or_insert(last_screen.p_value);
        first_detuning.get_or_insert(last_screen.detuning);
        if last_screen.p_value >= options.false_alarm_rate || named.len() == options.most {
            break;
        }
        let strongest = last_screen.signs.first().map_or(0.0, |sign| sign.gain);
        if strongest < inexact(&named, &earlier, &base) {
            evidence.push(format!(
                "a faint sign is left (p = {:.1e}), within what the named causes' models are known to get wrong",
                last_screen.p_value
            ));
            break;
        }
        let mut trials = refits(problem, &base, &clean, &last_screen.signs, options.refits);
        trials.admit(std::mem::take(&mut waiting));
        if redone < REDONE
            && let Some((better, most_of_it)) = trials.renewed(problem, &base)
        {
            redone += 1;
            base = better;
            if most_of_it {
                // the signs are sought anew, but who led once may do so again
                waiting = trials.finalists;
                continue;
            }
        }
        let round = Round { problem, base: &base, trials: &trials, others: named.len() };
        match round.judged() {
            Judged::Wins { gain, runner_up } => {
                let Some(best) = trials.finalists.into_iter().next() else { break };
                let (cause, score) = (best.cause, best.score);
                named.push(Named { cause, p_value: last_screen.p_value, score, gain, runner_up });
                candidates.retain(|candidate| !same_class(*candidate, cause));
                verdict = Verdict::Named;
                earlier.push(base);
                earlier.push(best.fitted);
                take_back(problem, &mut named, &mut earlier)?;
                base = earlier.pop().ok_or(ModelError::Degenerate("the search has lost its last fit"))?;
            }
            Judged::Refused { reason, candidates: beside } => {
                let explained = earlier.first().map_or(0.0, |first| first.cost - base.cost);
                if replacements < REPLACEMENTS && !named.is_empty() {
                    replacements += 1;
                    earlier.push(base);
                    let put = replace_one(problem, &clean, &candidates, options, &mut named, &mut earlier)?;
                    if put {
                        take_back(problem, &mut named, &mut earlier)?;
                    }
                    base = earlier.pop().ok_or(ModelError::Degenerate("the search has lost its last fit"))?;
                    if put {
                        candidates.retain(|candidate| named.iter().all(|n| !same_class(*candidate, n.cause)));
                        continue;
                    }
                }
                if !named.is_empty() && (last_screen.p_value > FAINT[0] || strongest < FAINT[1] * explained) {
                    evidence.push(format!("a faint sign is left (p = {:.1e}): {reason}", last_screen.p_value));
                } else {
                    (verdict, nearest) = (Verdict::Unexplained, beside);
                    evidence.push(reason);
                }
                break;
            }
        }
    }
    if !named.is_empty() {
        base = with_errors(problem, base)?;
    }
    let fits: Vec<JointFit> = earlier.into_iter().chain([base]).collect();
    let last_tiles = tiles_of(problem, &fits[fits.len() - 1]);
    let left = remainder(&first_tiles, &last_tiles, options.false_alarm_rate)
        .or_else(|| restless([first_detuning?, last_screen.detuning], &named, &fits, options.false_alarm_rate))
        .or_else(|| of_another_law(&named, &last_screen.exponents, options.false_alarm_rate));
    if let Some(reason) = left.filter(|_| verdict != Verdict::Unexplained) {
        let found = named.iter().map(|n| n.cause.about().id);
        let signs = last_screen.signs.iter().take(3).map(|s| s.cause.about().id);
        nearest = found.chain(signs).map(|id| RunnerUp { id: id.into(), share_of_gain: None }).collect();
        verdict = Verdict::Unexplained;
        evidence.push(reason);
    }
    Ok(Naming {
        verdict,
        named,
        fits,
        first_p_value: first_p_value.unwrap_or(1.0),
        screen: last_screen,
        tiles: [first_tiles, last_tiles],
        nearest,
        evidence,
    })
}

pub(super) fn same_class(a: &dyn Cause, b: &dyn Cause) -> bool {
    a.about().class.contains(&b.about().id) || b.about().class.contains(&a.about().id)
}

/// The scene of a fit.
pub(super) fn scene_of(problem: &Problem<'_>, fitted: &JointFit) -> Scene {
    scene(problem, fitted, &common_of(problem, fitted))
}

fn common_of(problem: &Problem<'_>, fitted: &JointFit) -> Vec<f64> {
    let residuals = residuals(problem, &fitted.state, &fitted.starts);
    common(&fitted.state, &whitened(problem, &residuals))
}

/// Tiles of the common residual, judged by what the events have there each for themselves: the noise model is an estimate.
fn tiles_of(problem: &Problem<'_>, fitted: &JointFit) -> Vec<Tile> {
    let (before, interval_s) = (problem.cut.before, problem.cut.interval_s);
    let single = whitened(problem, &residuals(problem, &fitted.state, &fitted.starts));
    let mut all = tiles(&common(&fitted.state, &single), before, interval_s);
    let mut own = vec![0.0; all.len()];
    for event in &single {
        let energies = tiles(event, before, interval_s);
        own.iter_mut().zip(&energies).for_each(|(sum, tile)| *sum += tile.excess / single.len() as f64);
    }
    for (tile, own) in all.iter_mut().zip(own) {
        // what is common is in every event as well: its share, one over their number, is taken off
        let alone = (own - (tile.excess - 1.0).max(0.0) / single.len() as f64).max(1.0);
        *tile = tile.against(alone);
    }
    all.sort_by(|a, b| a.p_value.total_cmp(&b.p_value));
    all
}

/// Whether one of `count` tiles is more than noise.
pub(super) fn stands_out(tile: &Tile, count: usize, false_alarm_rate: f64) -> bool {
    tile.p_value < OMNIBUS * false_alarm_rate / count.max(1) as f64
}

/// What remains in the common residual, if it is more than noise and more than a small share of what there was.
fn remainder(before: &[Tile], after: &[Tile], false_alarm_rate: f64) -> Option<String> {
    let out = |tile: &&Tile| stands_out(tile, after.len(), false_alarm_rate);
    let strongest = after.first().filter(out)?;
    let energy = |tiles: &[Tile]| tiles.iter().filter(out).map(|t| t.excess - 1.0).sum::<f64>();
    let share = energy(after) / energy(before).max(f64::MIN_POSITIVE);
    (share > REMAINDER).then(|| {
        format!(
            "a residual common to all events is left at {:.4} MHz, {:.0} to {:.0} us after the release: {:.1} times the noise's energy",
            1e-6 * strongest.peak_hz,
            1e6 * strongest.from_s.max(0.0),
            1e6 * strongest.to_s,
            strongest.excess
        )
    })
}

/// What the named causes' models leave of what they explain: `earlier` fits and `last`, one more than there are names.
fn inexact(named: &[Named], earlier: &[JointFit], last: &JointFit) -> f64 {
    let costs: Vec<f64> = earlier.iter().chain([last]).map(|fit| fit.cost).collect();
    named.iter().zip(costs.windows(2)).map(|(named, cost)| named.cause.inexact() * (cost[0] - cost[1])).sum()
}

/// A name whose strength follows the amplitude, where its law says that it does not.
fn of_another_law(named: &[Named], exponents: &[Option<Exponent>], false_alarm_rate: f64) -> Option<String> {
    // what changes the lever from record to record has no law in the amplitude, and of friction the fit knows its action on the mean motion only
    let has_a_law = |named: &Named| named.cause.about().part != Part::Archive && named.cause.inexact() == 0.0;
    let of_events = named.iter().zip(exponents).filter(|(named, _)| has_a_law(named));
    let all = of_events.filter_map(|(named, exponent)| Some((named.cause.about().id, (*exponent)?)));
    let rate = false_alarm_rate / named.len().max(1) as f64;
    let (id, exponent) = all
        .filter(|(_, exponent)| exponent.p_value() < rate && exponent.value.abs() > ANOTHER_LAW)
        .min_by(|a, b| a.1.p_value().total_cmp(&b.1.p_value()))?;
    Some(format!(
        "the strength of {id} follows the events' amplitudes, by a power of {:.2} +- {:.2}, where its own law leaves none: something of another law acts",
        exponent.value, exponent.std
    ))
}

/// What remains of the events' own frequencies, if it is more than noise and more than a small share of what there was, and of what the names have explained.
fn restless(
    [before, after]: [Detuning; 2],
    named: &[Named],
    fits: &[JointFit],
    false_alarm_rate: f64,
) -> Option<String> {
    // friction makes each event's own thermal motion a part of its damping and its frequency: no noise model knows by how much
    if named.iter().any(|named| named.cause.inexact() > 0.0) {
        return None;
    }
    let explained = fits.first().zip(fits.last()).map_or(0.0, |(first, last)| first.cost - last.cost);
    let out = after.p_value() < OMNIBUS * false_alarm_rate;
    (out && after.excess() > REMAINDER * before.excess().max(explained)).then(|| {
        format!(
            "the events' frequencies differ by {:.3} ppm from one to another, where noise makes {:.3} ppm",
            1e6 * after.scatter[0],
            1e6 * after.scatter[1]
        )
    })
}
