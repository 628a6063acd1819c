//! From signs to names: refits, held-out events, and when to abstain.

use super::joint::{JointFit, with_errors};
use super::last_tests::{of_another_law, remainder, scattered_frequencies, tiles_of};
use super::problem::Problem;
use super::residuals::{Tile, common, peaks, residuals, whitened};
use super::screen::Screen;
use super::seeking::Seeking;
use super::state::State;
use crate::causes::{Cause, Identifiable, Part, Scene, releases_have};
use crate::diagnosis::verdict::{Gain, RunnerUp, Verdict};
use crate::model::ModelError;

/// How names are given.
#[derive(Debug, Clone, PartialEq)]
pub struct NamingOptions {
    /// Probability of a name, or of `unexplained`, where nothing is wrong.
    pub false_alarm_rate: f64,
    /// Most causes named.
    pub most: usize,
    /// Candidates that are fitted in full at each step.
    pub refits: usize,
    /// Seed of the draws of the scores.
    pub seed: u64,
}

impl Default for NamingOptions {
    fn default() -> Self {
        Self { false_alarm_rate: 0.01, most: 4, refits: 5, seed: 1 }
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
    /// Whether the data cannot distinguish the two, which act in the same place: the runner-up is of its class.
    pub tied: bool,
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

/// Fall of the sum of squares that a parameter must bring, over the logarithm of the number of samples: as the Bayesian
/// information criterion.
pub(super) const PENALTY: f64 = 1.0;
/// What may be named: of members of one class the first stands for all.
fn candidates(offered: &[&'static dyn Cause]) -> Vec<&'static dyn Cause> {
    let mut out: Vec<&'static dyn Cause> = Vec::new();
    for cause in offered.iter().copied().filter(|cause| is_candidate(*cause)) {
        if out.iter().all(|known| known.about().class != cause.about().class) {
            out.push(cause);
        }
    }
    out
}

/// Whether a candidate belongs into a screen of events' shapes.
fn is_candidate(cause: &dyn Cause) -> bool {
    let about = cause.about();
    let here = about.is_met(releases_have) && about.identifiable == Identifiable::Shape;
    here && !matches!(about.part, Part::Record | Part::Input)
}

/// Quality factor of the broadest mode in air: the first, of the softest levers.
pub(super) const BROADEST: f64 = 15.0;

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
        begin_s: 0.0,
        level_v: events.iter().map(|e| e.amplitude.abs()).sum::<f64>() / count,
        input_level: 0.0,
        noise_v: (problem.noise.white / count).sqrt(),
        // what lies within a mode's width is that mode's misfit; a mode that came out broader than any is in air is none
        residual_peaks_hz: peaks(common, interval_s, 12)
            .into_iter()
            .filter(|f| modes.iter().zip(&own).all(|(m, g)| (f - g).abs() > g / m.quality_factor.max(BROADEST)))
            .take(4)
            .collect(),
        frequency_hz: own,
    }
}

/// Names what a baseline leaves unexplained.
///
/// # Method
/// Greedy: a score screen of all candidates; the strongest fitted in full, from the present fit; the one that gains
/// most, its parameters paid for, is held against held-out events (two halves in turn, shared parameters frozen) and
/// against the best of another class. It is named if it wins both and is not at a limit of its parameters; what an
/// earlier name explained beside it may make that superfluous, which is then taken back. The search ends when no sign is
/// stronger than the false-alarm rate allows, or than what the named causes' models leave. At last three tests ask what
/// is left: tiles of the residual common to all events, the events' own frequencies, and whether a named strength
/// follows the amplitude; each makes the verdict `unexplained`.
/// # Errors
/// Those of [`super::fit`] on the baseline.
pub fn name_causes(
    problem: &Problem<'_>,
    state: State,
    starts: Vec<usize>,
    offered: &[&'static dyn Cause],
    options: &NamingOptions,
) -> Result<Naming, ModelError> {
    let mut seeking = Seeking::begin(problem, (state, starts), candidates(offered), options)?;
    let first_tiles = tiles_of(problem, &seeking.fits[0]);
    let mut first = None;
    let (last_screen, ending) = loop {
        let screen = seeking.screened()?;
        first.get_or_insert((screen.p_value, screen.detuning));
        if let Some(ending) = seeking.step(&screen)? {
            // a name whose strength follows the amplitude stands for another
            let bent = of_another_law(&seeking.named, &screen.exponents, options.false_alarm_rate).is_some();
            let goes_on = ending.unexplained.is_none() && bent && seeking.replaced()?;
            if !goes_on && !seeking.merged()? {
                break (screen, ending);
            }
        }
    };
    let Seeking { named, mut fits, .. } = seeking;
    if let Some(last) = fits.pop_if(|_| !named.is_empty()) {
        fits.push(with_errors(problem, last)?);
    }
    let (first_p_value, first_detuning) = first.unwrap_or((1.0, last_screen.detuning));
    let last_tiles = tiles_of(problem, &fits[fits.len() - 1]);
    let mut evidence: Vec<String> = ending.evidence.into_iter().collect();
    let (verdict, nearest) = match ending.unexplained {
        Some(nearest) => (Verdict::Unexplained, nearest),
        None => {
            let rate = options.false_alarm_rate;
            let left = remainder(&first_tiles, &last_tiles, rate)
                .or_else(|| scattered_frequencies([first_detuning, last_screen.detuning], &named, &fits, rate))
                .or_else(|| of_another_law(&named, &last_screen.exponents, rate));
            match left {
                Some(reason) => {
                    evidence.push(reason);
                    let found = named.iter().map(|n| n.cause.about().id);
                    let signs = last_screen.signs.iter().take(3).map(|s| s.cause.about().id);
                    let nearest = found.chain(signs).map(|id| RunnerUp { id: id.into(), share_of_gain: None });
                    (Verdict::Unexplained, nearest.collect())
                }
                None if named.is_empty() => (Verdict::Clean, Vec::new()),
                None => (Verdict::Named, Vec::new()),
            }
        }
    };
    Ok(Naming {
        verdict,
        named,
        fits,
        first_p_value,
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
