//! From signs to names: refits, held-out events, and when to abstain.

use super::align::aligned;
use super::joint::{EVALUATIONS, JointFit, Search, fit, fit_within};
use super::problem::Problem;
use super::residuals::{Tile, common, peaks, residuals, tiles, whitened};
use super::screen::{Screen, Sign, screen};
use super::state::{Hold, Hypothesis, State};
use super::window::EventWindow;
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
const PENALTY: f64 = 1.0;
/// Difference of penalised gains below which two classes tie, unless held-out events decide.
const TIE: f64 = 6.0;
/// Share of the baseline's excess energy that named causes may leave.
const REMAINDER: f64 = 0.05;
/// Safety of the omnibus test, whose tiles are counted but whose noise model is an estimate.
const OMNIBUS: f64 = 0.1;

/// Probability of a sign beside named causes above which it does not take their names away: their own model is not exact either.
const FAINT: f64 = 1e-6;

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
    Scene {
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
/// named if it wins both and is not at a limit of its parameters. The search ends when no sign is stronger than the false-alarm rate allows.
/// # Errors
/// Those of [`fit`] on the baseline.
pub fn name_causes(
    problem: &Problem<'_>,
    state: State,
    starts: Vec<usize>,
    catalogue: &[&'static dyn Cause],
    options: &NamingOptions,
) -> Result<Naming, ModelError> {
    let mut candidates: Vec<&'static dyn Cause> = Vec::new();
    for cause in catalogue.iter().copied().filter(|cause| is_candidate(*cause, &options.without)) {
        // of members of one class the first stands for all
        if candidates.iter().all(|known| known.about().class != cause.about().class) {
            candidates.push(cause);
        }
    }
    let clean = (state.clone(), starts.clone());
    let mut fits = vec![fit(problem, state, starts, Hold::Nothing)?];
    let mut named: Vec<Named> = Vec::new();
    let mut nearest = Vec::new();
    let mut evidence = Vec::new();
    let mut verdict = Verdict::Clean;
    let first_tiles = tiles_of(problem, &fits[0]);
    let mut redone = 0;
    let mut last_screen;
    let mut first_p_value = None;
    loop {
        let base = &fits[fits.len() - 1];
        let common = common_of(problem, base);
        last_screen = screen(problem, base, &candidates, &scene(problem, base, &common), options.seed)?;
        first_p_value.get_or_insert(last_screen.p_value);
        if last_screen.p_value >= options.false_alarm_rate || named.len() == options.most {
            break;
        }
        let mut trials = refits(problem, base, &clean, &last_screen.signs, options.refits);
        if redone < REDONE
            && let Some(best) = trials.first()
            && best.beyond_promise(base)
            && let Some(better) = refitted(problem, base, best)
        {
            // the base had not arrived: what a candidate gained was in part its own
            redone += 1;
            let own = base.cost - better.cost;
            let most_of_it = own > OWN * (base.cost - best.fitted.cost);
            trials.iter_mut().for_each(|trial| trial.gain -= own);
            let last = fits.len() - 1;
            fits[last] = better;
            if most_of_it {
                continue;
            }
        }
        let base = &fits[fits.len() - 1];
        let Some(best) = trials.first() else {
            verdict = Verdict::Unexplained;
            evidence.push("signs of a cause, but no candidate could be fitted".into());
            break;
        };
        let rival = trials.iter().find(|t| !same_class(t.cause, best.cause));
        let share = |t: &Trial| (best.gain > 0.0).then(|| (t.gain / best.gain).clamp(0.0, 1.0));
        let runner_up = rival.map(|t| RunnerUp { id: t.cause.about().id.into(), share_of_gain: share(t) });
        let halves = Halves::of(problem, base);
        let held_out = halves.gain(base, best);
        let refusal = if best.gain <= 0.0 {
            Some("no candidate pays for its parameters".to_string())
        } else if let Some(line) = combination(base, best) {
            Some(format!(
                "the nearest candidate, {}, would ring at {line}: the sign of a nonlinearity that no candidate accounts for",
                best.cause.about().id
            ))
        } else if !best.fitted.at_limit.is_empty() {
            Some(format!("the nearest candidate, {}, ends at a limit of its parameters", best.cause.about().id))
        } else if held_out.log_likelihood <= 0.0 {
            Some(format!("the nearest candidate, {}, gains nothing on held-out events", best.cause.about().id))
        } else {
            rival.and_then(|rival| {
                let close = best.gain - rival.gain < TIE;
                let held = || halves.gain(base, rival).log_likelihood;
                (close && held() > held_out.log_likelihood - 0.5 * TIE).then(|| {
                    format!("{} and {} explain it equally well", best.cause.about().id, rival.cause.about().id)
                })
            })
        };
        if let Some(reason) = refusal {
            if !named.is_empty() && last_screen.p_value > FAINT {
                evidence.push(format!("a faint sign is left (p = {:.1e}): {reason}", last_screen.p_value));
                break;
            }
            verdict = Verdict::Unexplained;
            nearest = trials
                .iter()
                .take(3)
                .map(|t| RunnerUp { id: t.cause.about().id.into(), share_of_gain: share(t) })
                .collect();
            evidence.push(reason);
            break;
        }
        let cause = best.cause;
        named.push(Named {
            cause,
            p_value: last_screen.p_value,
            score: best.score,
            gain: held_out.report(),
            runner_up,
        });
        candidates.retain(|candidate| !same_class(*candidate, cause));
        verdict = Verdict::Named;
        if let Some(best) = trials.into_iter().next() {
            fits.push(best.fitted);
        }
    }
    let last_tiles = tiles_of(problem, &fits[fits.len() - 1]);
    let left = remainder(&first_tiles, &last_tiles, options.false_alarm_rate);
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

fn same_class(a: &dyn Cause, b: &dyn Cause) -> bool {
    a.about().class.contains(&b.about().id) || b.about().class.contains(&a.about().id)
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

/// A candidate fitted in full.
struct Trial {
    cause: &'static dyn Cause,
    fitted: JointFit,
    /// Score of the sign that it began with, and the fall of the cost that this promised.
    score: f64,
    promised: f64,
    /// Fall of the cost less what the parameters must pay.
    gain: f64,
    /// Fall of the cost in its last steps.
    fall: f64,
}

/// Relative distance within which a frequency is a combination of others.
const NEAR: f64 = 0.01;

/// The combination of the lever's frequencies at which a candidate rings, if there is one.
fn combination(base: &JointFit, trial: &Trial) -> Option<String> {
    let hypothesis = trial.fitted.state.hypotheses.last()?;
    let place = trial.cause.about().parameters.iter().position(|p| p.name == "frequency_hz")?;
    let found = hypothesis.values.get(place)?;
    let own: Vec<f64> = base.state.lever.modes.iter().map(|m| m.omega / std::f64::consts::TAU).collect();
    let first = *own.first()?;
    let mut lines = vec![("2 f1".to_string(), 2.0 * first), ("3 f1".to_string(), 3.0 * first)];
    for (m, f) in own.iter().enumerate().skip(1) {
        lines.push((format!("f{} + f1", m + 1), f + first));
        lines.push((format!("f{} - f1", m + 1), f - first));
    }
    lines.into_iter().find(|(_, f)| (found / f - 1.0).abs() < NEAR).map(|(name, _)| name)
}

/// Times that a base may be fitted anew.
const REDONE: usize = 3;
/// A refit that gains so much more than its score promised has found what the base missed.
const BEYOND: (f64, f64) = (2.0, 15.0);

impl Trial {
    fn beyond_promise(&self, base: &JointFit) -> bool {
        base.cost - self.fitted.cost > BEYOND.0 * self.promised + BEYOND.1
    }
}

/// The base fitted from where a candidate has led the lever; none unless it is better there.
fn refitted(problem: &Problem<'_>, base: &JointFit, trial: &Trial) -> Option<JointFit> {
    let mut state = trial.fitted.state.clone();
    state.hypotheses.pop();
    let better = fit_within(problem, state, trial.fitted.starts.clone(), Hold::Nothing, Search::new(3 * LOOK)).ok()?;
    (better.cost < base.cost - BETTER).then_some(better)
}

/// Share of a candidate's gain that a base fitted anew must bring for all to begin anew.
const OWN: f64 = 0.3;
/// Fall of the cost that makes a base a better one.
const BETTER: f64 = 2.0;

/// Trial steps after which a candidate's fit is looked at: who leads goes on.
const LOOK: usize = 6;
/// Trial steps of a leader at most: along a bent valley (a rupture against the detector's poles) they are short.
const LEADER: usize = 3 * EVALUATIONS;
/// Share of the leader's gain below which a rival is not fitted any further, unless it falls so fast that it may get there: so many times as far as in its
/// last steps.
const HOPELESS: f64 = 0.5;
const COMES_UP: f64 = 3.0;
/// Cost over the base's beyond which the first steps have led nowhere.
const NOT_LOST: f64 = 1.5;

/// The strongest candidates fitted from the present fit, best first.
///
/// Every candidate has some steps; then the leader goes on until it has arrived, and whoever is not far behind or comes up: candidates that do not fit cost
/// little.
fn refits(
    problem: &Problem<'_>,
    base: &JointFit,
    clean: &(State, Vec<usize>),
    signs: &[Sign],
    count: usize,
) -> Vec<Trial> {
    let mut chosen: Vec<&Sign> = Vec::new();
    for sign in signs.iter().filter(|s| s.gain > 0.0) {
        // members of one class are one signal
        if chosen.iter().all(|c| !same_class(c.cause, sign.cause)) {
            chosen.push(sign);
        }
    }
    let mut trials: Vec<Trial> =
        chosen.into_iter().take(count).flat_map(|sign| Trial::begin(problem, base, clean, sign)).collect();
    loop {
        trials.sort_by(|a, b| b.gain.total_cmp(&a.gain));
        let Some(leader) = trials.first() else { return trials };
        let bar = HOPELESS * leader.gain;
        // the leader first, then whoever is not far behind or comes up
        let goes_on = |trial: &Trial| trial.can_go_on(EVALUATIONS) && trial.gain + COMES_UP * trial.fall >= bar;
        let next = match trials.first().is_some_and(|leader| leader.can_go_on(LEADER)) {
            true => trials.first_mut(),
            false => trials.iter_mut().find(|trial| goes_on(trial)),
        };
        if !next.is_some_and(|trial| trial.go_on(problem, base)) {
            break;
        }
    }
    // of two beginnings of one candidate the better end
    let mut best: Vec<Trial> = Vec::new();
    for trial in trials {
        if best.iter().all(|known| known.cause.about().id != trial.cause.about().id) {
            best.push(trial);
        }
    }
    best
}

impl Trial {
    /// The first steps of a candidate, from the present fit and, where that has not arrived, from where free exponentials did.
    fn begin(problem: &Problem<'_>, base: &JointFit, clean: &(State, Vec<usize>), sign: &Sign) -> Vec<Self> {
        let hypothesis = Hypothesis { cause: sign.cause, values: sign.values.clone() };
        let from = |lever: &State, starts: &[usize]| {
            let mut state = lever.clone();
            state.hypotheses = base.state.hypotheses.clone();
            state.hypotheses.push(hypothesis.clone());
            let mut starts = starts.to_vec();
            aligned(problem, &mut state, &mut starts).ok()?;
            let fitted = fit_within(problem, state, starts, Hold::Nothing, Search::new(LOOK)).ok()?;
            let fall = if fitted.cost < NOT_LOST * base.cost { f64::INFINITY } else { 0.0 };
            let mut trial = Self { cause: sign.cause, score: sign.z, promised: sign.gain, gain: 0.0, fall, fitted };
            trial.weigh(problem, base);
            Some(trial)
        };
        let first = from(&base.state, &base.starts);
        // a baseline that did not arrive has bent to the misfit
        let again = !base.converged || first.as_ref().is_none_or(|trial| !trial.fitted.converged);
        let second = if again { from(&clean.0, &clean.1) } else { None };
        first.into_iter().chain(second).collect()
    }

    fn can_go_on(&self, most: usize) -> bool {
        !self.fitted.converged && self.fitted.evaluations < most && self.fall > 0.0
    }

    /// Some steps more; whether they could be made.
    fn go_on(&mut self, problem: &Problem<'_>, base: &JointFit) -> bool {
        let (state, starts) = (self.fitted.state.clone(), self.fitted.starts.clone());
        // a search that has reached the largest damping begins anew
        let damping = if self.fitted.damping < 1.0 { self.fitted.damping } else { 1e-3 };
        let search = Search { most: LOOK, damping };
        let Ok(further) = fit_within(problem, state, starts, Hold::Nothing, search) else { return false };
        let spent = self.fitted.evaluations + further.evaluations.max(1);
        self.fall = self.fitted.cost - further.cost;
        self.fitted = JointFit { evaluations: spent, ..further };
        self.weigh(problem, base);
        true
    }

    fn weigh(&mut self, problem: &Problem<'_>, base: &JointFit) {
        let samples = (base.state.events.len() * problem.cut.samples) as f64;
        let parameters = self.fitted.state.hypotheses.last().map_or(0, |h| h.values.len());
        self.gain = base.cost - self.fitted.cost - PENALTY * samples.ln() * parameters as f64;
    }
}

/// Trial steps of a half, which begins where the whole ended.
const HALF: usize = 8;

/// Two halves of the events, each fitted alone and judged on the other.
struct Halves<'a> {
    whole: &'a Problem<'a>,
    windows: [Vec<EventWindow>; 2],
    events: [Vec<usize>; 2],
}

struct HeldOut {
    log_likelihood: f64,
    rms: [f64; 2],
    events: usize,
}

impl HeldOut {
    fn report(&self) -> Gain {
        Gain {
            rms_before: Some(self.rms[0]),
            rms_after: Some(self.rms[1]),
            unit: "V".into(),
            log_likelihood: Some(self.log_likelihood),
            held_out: format!("{} events, each judged by a fit to the other half", self.events),
        }
    }
}

impl<'a> Halves<'a> {
    fn of(whole: &'a Problem<'a>, base: &JointFit) -> Self {
        let events = [0, 1].map(|half| (0..base.state.events.len()).filter(|i| i % 2 == half).collect::<Vec<usize>>());
        let windows = events.clone().map(|chosen| chosen.iter().map(|&i| whole.windows[i].clone()).collect());
        Self { whole, windows, events }
    }

    fn part(&self, half: usize) -> Problem<'_> {
        self.whole.with_windows(&self.windows[half])
    }

    fn state(&self, fitted: &JointFit, half: usize) -> (State, Vec<usize>) {
        let mut state = fitted.state.clone();
        state.events = self.events[half].iter().map(|&i| fitted.state.events[i]).collect();
        (state, self.events[half].iter().map(|&i| fitted.starts[i]).collect())
    }

    /// Fits `fitted`'s model to one half, then the other half's own parameters under it.
    fn judged(&self, fitted: &JointFit, half: usize) -> Option<(f64, Vec<f64>)> {
        let (state, starts) = self.state(fitted, half);
        let trained = fit_within(&self.part(half), state, starts, Hold::Nothing, Search::new(HALF)).ok()?;
        let other = 1 - half;
        let (mut state, starts) = self.state(fitted, other);
        state.lever = trained.state.lever;
        state.hypotheses = trained.state.hypotheses;
        let problem = self.part(other);
        let judged = fit(&problem, state, starts, Hold::Shared).ok()?;
        let residuals = residuals(&problem, &judged.state, &judged.starts);
        Some((judged.costs.iter().sum(), common(&judged.state, &residuals)))
    }

    /// Gain of the log likelihood on held-out events, and the rms of their common residual where the models differ.
    fn gain(&self, base: &JointFit, trial: &Trial) -> HeldOut {
        let count = base.state.events.len();
        let mut out = HeldOut { log_likelihood: 0.0, rms: [0.0; 2], events: count };
        let mut weight = 0.0;
        if self.events[1].is_empty() {
            return HeldOut { log_likelihood: f64::NEG_INFINITY, ..out };
        }
        for half in 0..2 {
            let (Some(before), Some(after)) = (self.judged(base, half), self.judged(&trial.fitted, half)) else {
                return HeldOut { log_likelihood: f64::NEG_INFINITY, ..out };
            };
            out.log_likelihood += 0.5 * (before.0 - after.0);
            // of a sum weighted to unit variance: back to volts of one event
            let scale = (self.events[1 - half].len() as f64).sqrt();
            let differs: Vec<f64> = before.1.iter().zip(&after.1).map(|(b, a)| (b - a).abs()).collect();
            let limit = 0.1 * differs.iter().copied().fold(0.0, f64::max);
            for ((b, a), d) in before.1.iter().zip(&after.1).zip(&differs) {
                if *d >= limit {
                    out.rms[0] += (b / scale).powi(2);
                    out.rms[1] += (a / scale).powi(2);
                    weight += 1.0;
                }
            }
        }
        out.rms = out.rms.map(|sum| (sum / f64::max(weight, 1.0)).sqrt());
        out
    }
}
