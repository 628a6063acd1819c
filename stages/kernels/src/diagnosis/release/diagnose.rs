//! From events and summaries of records to the answer.

use std::f64::consts::TAU;

use super::answer::answer;
use super::foreign_line::without_lines;
use super::joint::JointFit;
use super::lever::{Lever, LeverMode};
use super::prepared::Prepared;
use super::problem::Problem;
use super::search::{Naming, NamingOptions, name_causes};
use super::start::start;
use super::story::{Story, story};
use super::window::{Cut, EventWindow};
use crate::causes::Cause;
use crate::diagnosis::records::{
    Begun, CHANNELS, JudgeOptions, PositionCourse, RecordSign, RecordSummary, Resonance, abstentions, without_droop,
};
use crate::diagnosis::verdict::{Diagnosis, Verdict};
use crate::model::ModelError;
use crate::ringdown::RingdownNoise;

/// Shares of the false-alarm rate: shapes of the events, each channel of the records.
const SHAPES_SHARE: f64 = 0.5;
const CHANNEL_SHARE: f64 = 0.5 / CHANNELS as f64;

/// Events of an archive and what its records show as a whole.
#[derive(Debug, Clone)]
pub struct Releases {
    /// At least two events.
    pub windows: Vec<EventWindow>,
    /// How they are cut.
    pub cut: Cut,
    /// One per record.
    pub summaries: Vec<RecordSummary>,
    /// Per record whole windows of its free stretches, one after the other, V: the noise is estimated from them.
    pub free: Vec<Vec<f64>>,
}

/// What is asked for.
#[derive(Clone)]
pub struct ReleaseOptions {
    /// Modes of the lever, 1 to 12; none: as many resonances as ring with falling shares.
    pub modes: Option<usize>,
    /// Nominal poles of the detector, Hz.
    pub detector_poles_hz: Vec<f64>,
    /// Relative standard deviation of what is known of them.
    pub detector_pole_std: f64,
    /// Probability of any other verdict than `clean` where nothing is wrong.
    pub false_alarm_rate: f64,
    /// Most causes named from the events' shapes.
    pub most_causes: usize,
    /// Causes that may be named.
    pub candidates: Vec<&'static dyn Cause>,
    /// Seed of the draws of the scores.
    pub seed: u64,
}

/// What a diagnosis of releases ends with.
pub struct DiagnosedReleases {
    /// The answer.
    pub diagnosis: Diagnosis,
    /// What a person looks at.
    pub story: Story,
    /// The linear lever and detector.
    pub baseline: JointFit,
    /// With the causes that the answer names from the events' shapes; none where it names none.
    pub extended: Option<JointFit>,
    /// Noise that the events were weighted with.
    pub noise: RingdownNoise,
    /// The free level over the piezo's position.
    pub course: Vec<PositionCourse>,
}

/// Says what a linear lever and detector get wrong in releases.
///
/// # Method
/// Whole records first; a coupling capacitor that they show is undone, since no event can tell its slow droop from its
/// own slope. Then the events' shapes. Foreign lines that the records show are taken off the events where these don't
/// end clean, and the shapes are asked again. Where no names account for them and a mode has run off in the baseline,
/// they are asked once more with the modes near what free exponentials show.
/// # Errors
/// Fewer oscillations than modes, events that leave their samples, fits without a finite covariance.
pub fn diagnose(releases: &Releases, options: &ReleaseOptions) -> Result<DiagnosedReleases, ModelError> {
    let Releases { windows, cut, summaries, free } = releases;
    let mut judging =
        JudgeOptions { false_alarm_rate: CHANNEL_SHARE * options.false_alarm_rate, ..JudgeOptions::default() };
    let begun = Begun::judge(summaries, &judging);
    let (mut windows, mut free) = (windows.clone(), free.clone());
    if let Some(corner_hz) = begun.coupling_hz().filter(|_| options.may_name("ac-coupling")) {
        windows.iter_mut().for_each(|w| w.values = without_droop(&w.values, corner_hz, cut.interval_s));
        for record in &mut free {
            let parts = record.chunks_exact(cut.samples);
            *record = parts.flat_map(|part| without_droop(part, corner_hz, cut.interval_s)).collect();
        }
    }
    let stretches: Vec<&[f64]> = free.iter().flat_map(|record| record.chunks_exact(cut.samples)).collect();
    let poles: Vec<f64> = options.detector_poles_hz.iter().map(|f| TAU * f).collect();
    let naming_options = NamingOptions {
        false_alarm_rate: SHAPES_SHARE * options.false_alarm_rate,
        most: options.most_causes,
        seed: options.seed,
        ..NamingOptions::default()
    };
    let mut lines_are_off = false;
    loop {
        let begin = start(&windows, &stretches, cut, options.modes, &poles)?;
        let mut problem = Problem {
            windows: &windows,
            cut: *cut,
            noise: begin.noise,
            nominal_poles: poles.clone(),
            pole_std: options.detector_pole_std,
            seen: begin.seen,
            confined: false,
            prepared: Prepared::default(),
        };
        let named = |problem: &Problem<'_>| {
            let (state, starts) = (begin.state.clone(), begin.starts.clone());
            name_causes(problem, state, starts, &options.candidates, &naming_options)
        };
        let mut naming = named(&problem)?;
        if naming.verdict == Verdict::Unexplained
            && let Some(other) = problem.where_a_mode_ran_off(&naming.fits[0].state)
        {
            let again = named(&other)?;
            if again.verdict == Verdict::Named {
                (problem, naming) = (other, again);
            }
        }
        // only the lever's own: a foreign line may ring with them through every event
        judging.resonances = naming.fits.first().map_or_else(Vec::new, |fit| resonances(&fit.state.lever));
        let signs = begun.clone().finish(summaries, &judging);
        if naming.verdict != Verdict::Clean && !std::mem::replace(&mut lines_are_off, true) {
            let lines: Vec<f64> = signs.iter().filter_map(RecordSign::line_hz).collect();
            if let Some(less) = without_lines(&problem, &naming.fits[0], &lines) {
                windows = less;
                continue;
            }
        }
        return options.answered(&problem, naming, signs, begun.course(), summaries);
    }
}

impl ReleaseOptions {
    fn may_name(&self, cause: &str) -> bool {
        self.candidates.iter().any(|candidate| candidate.about().id == cause)
    }

    fn answered(
        &self,
        problem: &Problem<'_>,
        naming: Naming,
        signs: Vec<RecordSign>,
        course: &[PositionCourse],
        summaries: &[RecordSummary],
    ) -> Result<DiagnosedReleases, ModelError> {
        let (signs, left_out): (Vec<RecordSign>, Vec<RecordSign>) =
            signs.into_iter().partition(|sign| self.may_name(sign.id));
        let mut diagnosis = answer(problem, &naming, &signs, &left_out, self.false_alarm_rate);
        let not_asked = abstentions(summaries).into_iter().filter(|one| self.may_name(one.id));
        diagnosis.evidence.extend(not_asked.map(|one| format!("not looked for: {}, since {}", one.id, one.reason)));
        let story = story(problem, &naming).ok_or(ModelError::Degenerate("the search ended without a fit"))?;
        let mut fits = naming.fits;
        let is_extended = diagnosis.verdict == Verdict::Named && fits.len() > 1;
        let extended = if is_extended { fits.pop() } else { None };
        let baseline = fits.into_iter().next().ok_or(ModelError::Degenerate("the search ended without a fit"))?;
        Ok(DiagnosedReleases {
            diagnosis,
            story,
            baseline,
            extended,
            noise: problem.noise.clone(),
            course: course.to_vec(),
        })
    }
}

fn resonances(lever: &Lever) -> Vec<Resonance> {
    let one = |mode: &LeverMode| Resonance { frequency_hz: mode.omega / TAU, quality_factor: mode.quality_factor };
    lever.modes.iter().map(one).collect()
}
