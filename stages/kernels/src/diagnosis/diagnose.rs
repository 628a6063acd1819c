//! The whole way from records to a verdict.

use super::answer::Findings;
use super::baseline::{Baseline, baselines, blocks, criterion, starts};
use super::chain::chain;
use super::data::{Bench, Record, Stretch, Thinned};
use super::dynamics::{Modal, Model};
use super::error::DiagnosisError;
use super::fit::Blocks;
use super::grounds::noise_loss;
use super::lack_of_fit::misfit;
use super::linear_only::{LinearOnly, halves, linear_only};
use super::options::DiagnosisOptions;
use super::ruling::{ALARMS_OF_LAW, FOLLOWS};
use super::score_test::{Candidate, trials};
use super::selection::{Choice, Search};
use super::simulation::{ModalSimulation, Simulation};
use super::steady_lines::SteadyLines;
use super::story::{Story, story};
use super::unnamed_law::{Laws, simpler_law, unnamed_law};
use super::validation::check_part;
use super::verdict::{Diagnosis, Verdict};
use crate::Unwatched;
use crate::causes::{Cause, Need};

/// A diagnosis and the model that it ends with.
pub struct Diagnosed {
    /// The answer.
    pub diagnosis: Diagnosis,
    /// Output of the stretches that were learnt from, stretch by stretch and channel by channel, NaN where missing.
    pub output: Vec<f64>,
    /// The linear baseline's simulation of it.
    pub before: Vec<f64>,
    /// The extended model's.
    pub after: Vec<f64>,
    /// What both models miss, for a person to look at.
    pub story: Story,
    /// The model to simulate other inputs with: the extended one where causes are named, else the linear baseline.
    pub simulation: Simulation,
}

/// Samples that causes are chosen on; all samples fit what was chosen. Below half as many again all are taken.
const SAMPLE: usize = 16_384;

/// The largest stretches of motion, where there are many samples; every so many were kept of what was measured.
fn sampled(whole: &Bench, every: usize) -> Bench {
    let layout = &whole.layout;
    if 2 * layout.all_samples() * every < 3 * SAMPLE {
        return whole.clone();
    }
    let share = (SAMPLE / every / layout.stretches().max(1)).max(super::data::LEAST_SAMPLES);
    let windows: Vec<(usize, usize)> = (0..layout.stretches())
        .map(|e| {
            let length = layout.samples(e).min(share);
            let first = whole.loudest(e, length);
            (first, first + length)
        })
        .collect();
    whole.cut(|e| windows[e])
}

/// Says what a linear model gets wrong in measured runs of a system.
///
/// # Model
/// A sum of modes, free masses and real poles under the measured input, if there is one, free-running from a state of
/// each stretch's own; all else is a cause.
/// # Method
/// Lines that go on through free decays are taken out first, each hit's with a phase of its own. Least squares of the
/// free-run error on what is learnt from; causes added by score test, joint refits of the best
/// five, and likelihood less the Bayesian penalty; dropped or exchanged where later ones do better; each tested by
/// blocks against its best rival. What a library of general terms still predicts of the residual decides whether the
/// causes are the whole story.
/// # Shapes
/// Records of one or several channels; the answer's simulations are those of the stretches that were learnt from.
/// # Units
/// Any; scaled inside by the largest input and outputs.
/// # Accuracy
/// See docs/diagnosis.md.
/// # Errors
/// Parts beyond the records, a missing input, an output that does not move: see [`DiagnosisError`].
/// # Source
/// L. Ljung, System Identification, 2nd ed., 1999, chapter 7; J. Schoukens, L. Ljung, IEEE Control Syst. Mag. 39 (2019)
/// 28.
pub fn diagnose(
    records: &[Record<'_>],
    interval_s: f64,
    options: &DiagnosisOptions,
) -> Result<Diagnosed, DiagnosisError> {
    let mut seen = SteadyLines::find(records, interval_s, options);
    while let Some(lines) = seen {
        let mut found = modelled(&lines.rest(), interval_s, options)?;
        let left: Vec<f64> = found.output.iter().zip(&found.after).map(|(y, made)| y - made).collect();
        match lines.confirmed(&left, options, &mut found.diagnosis) {
            Ok(lines) => {
                for (k, line) in lines.simulated(&options.training).into_iter().enumerate() {
                    found.output[k] += line;
                    found.after[k] += line;
                }
                return Ok(found);
            }
            Err(fewer) => seen = fewer,
        }
    }
    modelled(records, interval_s, options)
}

/// The same of records without steady lines.
fn modelled(records: &[Record<'_>], interval_s: f64, options: &DiagnosisOptions) -> Result<Diagnosed, DiagnosisError> {
    let whole = Bench::new(records, &options.training, interval_s, 0.0, options.one_unit)?;
    options.parts.iter().try_for_each(|part| check_part(part, &whole, records))?;
    let sample = sampled(&whole, 1);
    let starts = starts(records, &sample, options);
    let highest_hz = starts.linear.iter().map(Modal::highest_hz).fold(0.0, f64::max);
    let long = sample.layout.all_samples() < whole.layout.all_samples();
    let thinned = long.then(|| Thinned::new(records, &options.training, interval_s, highest_hz)).flatten();
    let found = match &thinned {
        Some(thinned) => {
            let kept = thinned.records();
            let bench = Bench::new(&kept, &thinned.stretches, thinned.interval_s, highest_hz, options.one_unit)?;
            let every = (thinned.interval_s / interval_s).round() as usize;
            baselines(&kept, &sampled(&bench, every), &starts, options)?
        }
        None => baselines(records, &sample, &starts, options)?,
    };
    let mut extended = Vec::new();
    let mut work = options.work;
    for baseline in found {
        let (found, used) = extend(baseline, options, work.max(options.work / LEAST_SHARE));
        work = work.saturating_sub(used);
        let enough = found.adequate && (found.far_better || !found.is_lacking(options));
        extended.push(found);
        if enough {
            break;
        }
    }
    let Some((last, simpler)) = best_of(extended) else { return Err(DiagnosisError::NoBaseline) };
    let mut of_simpler = Laws::default();
    for simpler in &simpler {
        let laws = last.laws_of(simpler, options);
        of_simpler = Laws { untried: of_simpler.untried || laws.untried, ..laws };
        if of_simpler.lacking.is_some() {
            break;
        }
    }
    let on_sample = last.choice.ladder.last().map_or(f64::NAN, |last| last.fit.loss);
    // of a long record laws without a name are sought where causes were, on fewer samples
    let before = (!last.is_whole(interval_s, options)).then(|| last.unnamed_laws(options));
    let whole = last
        .on_all(records, interval_s, options)
        .or_else(|| last.linear_on_all(records, interval_s, options))
        .ok_or(DiagnosisError::NoBaseline)?;
    let (laws, on_laws) = match before {
        Some(laws) => (laws, on_sample),
        None => (whole.unnamed_laws(options), whole.choice.ladder.last().map_or(f64::NAN, |last| last.fit.loss)),
    };
    let Extended { bench, blocks, mut choice, adequate, .. } = whole;
    let Some(last) = choice.ladder.last() else { return Err(DiagnosisError::NoBaseline) };
    let misfit = misfit(&bench, &last.fit, &blocks);
    let untried = laws.untried || of_simpler.untried;
    let of_simpler = of_simpler.lacking.map(|law| law.scaled(last.fit.loss / on_sample));
    let unnamed = of_simpler.or_else(|| laws.lacking.map(|law| law.scaled(last.fit.loss / on_laws)));
    let first = &choice.ladder[0].fit;
    let linear = first.model.clone();
    let simulated = [&first.simulated[..], &last.fit.simulated];
    let mut story = story(&bench, records, [&first.model, &last.fit.model], simulated, &options.parts);
    let layout = &bench.layout;
    let in_units = |values: &[f64]| -> Vec<f64> {
        let mut values = values.to_vec();
        for e in 0..layout.stretches() {
            for (channel, scale) in bench.output_scale.iter().enumerate() {
                values[layout.part(e, channel, 0, layout.samples(e))].iter_mut().for_each(|value| *value *= scale);
            }
        }
        values
    };
    let (before, mut after) = (in_units(&choice.ladder[0].fit.simulated), in_units(&last.fit.simulated));
    let (output, extended) = (in_units(&bench.output), last.fit.model.clone());
    choice.untried.laws = untried && unnamed.is_none();
    let findings = Findings { bench: &bench, records, options, blocks, choice, misfit, unnamed, adequate };
    let mut diagnosis = findings.answer();
    let named = if diagnosis.verdict == Verdict::Named { &extended } else { &linear };
    let scales = (&bench.output_scale[..], bench.input_scale);
    let mut simulation = Simulation::Modal(ModalSimulation::new(named, scales, bench.reference_s(), bench.steps()));
    if let Some(chain) = chain(&bench, records, options, [&before, &after], &mut diagnosis) {
        after = chain.after;
        simulation = Simulation::Chain { model: chain.model, interval_s };
        story = Story::of_series(&output, [&before, &after], interval_s, &[]).over_parts(
            &bench,
            records,
            &linear,
            &chain.whole,
            &options.parts,
        );
    }
    let unexplained = diagnosis.verdict == Verdict::Unexplained;
    if (unexplained || options.linear_fit)
        && let Some(linear) = alone(&bench, records, options)
    {
        // where no model that causes could extend was found, this one decides
        if unexplained
            && !diagnosis.baseline.adequate
            && linear.is_adequate(options.tolerated_misfit, options.false_alarm_rate)
        {
            let part = options.parts.first().map_or("held out", |part| &part.name[..]);
            diagnosis = linear.answer(part, &options.output_unit, options.tolerated_misfit, options.false_alarm_rate);
            after.clone_from(&before);
        } else {
            // a linear model that is the whole story holds in the rest of the record, too
            let is_linear = !unexplained && diagnosis.causes.iter().all(|cause| cause.id == INTERSAMPLE);
            if let Some(said) = linear.disagreement().filter(|_| is_linear) {
                diagnosis.verdict = Verdict::Unexplained;
                diagnosis.causes.clear();
                diagnosis.evidence.push(said);
            }
            diagnosis.evidence.extend(linear.sentences(options.tolerated_misfit));
            let is_said = diagnosis.evidence.iter().any(|line| line.starts_with(FOLLOWS));
            let follows = linear.follows_output(options.false_alarm_rate);
            diagnosis.evidence.extend(follows.filter(|_| unexplained && !is_said));
        }
    }
    Ok(Diagnosed { diagnosis, output, before, after, story, simulation })
}

/// A choice that a linear model has as well.
const INTERSAMPLE: &str = "intersample";

/// How far a linear model of one input goes, where no model accounts for the data.
fn alone(bench: &Bench, records: &[Record<'_>], options: &DiagnosisOptions) -> Option<LinearOnly> {
    let (stretch, record) = (bench.stretches.first()?, records.first()?);
    if !bench.driven || bench.layout.channels != 1 || bench.layout.stretches() != 1 || records.len() != 1 {
        return None;
    }
    let part = options.parts.first().map(|part| part.stretch.first..part.stretch.end);
    let (learnt, held_out) = halves(stretch.first..stretch.end, part, record.samples());
    linear_only(&[record.input], record.outputs[0], learnt, held_out, bench.interval_s, &Unwatched).ok()
}

/// A baseline with the causes that extend it.
pub(super) struct Extended {
    pub bench: Bench,
    pub blocks: Blocks,
    pub choice: Choice,
    /// Whether the extended model describes as much as any linear model does.
    pub adequate: bool,
    /// Whether it leaves so much less than any linear model that no other structure is looked for.
    pub far_better: bool,
}

impl Extended {
    /// Whether more than noise is left: a further mode is nothing that the library of general terms predicts.
    fn is_lacking(&self, options: &DiagnosisOptions) -> bool {
        let Some(last) = self.choice.ladder.last() else { return true };
        let noise = noise_loss(&self.bench, &last.fit);
        noise.is_some_and(|noise| last.fit.loss > LOUDER * noise)
            || self.choice.lacks(&misfit(&self.bench, &last.fit, &self.blocks), options.tolerated_misfit)
    }

    /// Laws without a name that extend a simpler linear model to leave less than all causes of this one; none where this
    /// one has fewer than two.
    fn laws_of(&self, simpler: &Self, options: &DiagnosisOptions) -> Laws {
        let (Some(first), Some(last)) = (simpler.choice.ladder.first(), self.choice.ladder.last()) else {
            return Laws::default();
        };
        let (first, last) = (&first.fit, &last.fit);
        let same = self.bench.stretches == simpler.bench.stretches && self.bench.interval_s == simpler.bench.interval_s;
        if last.model.causes.len() < 2 || !same {
            return Laws::default();
        }
        let candidates = candidates(options, &simpler.bench, &first.model);
        let level = ALARMS_OF_LAW * options.false_alarm_rate;
        simpler_law(&simpler.bench, first, last, &simpler.blocks, &candidates, level, options.work / 2)
    }

    /// Laws without a name that it lacks.
    fn unnamed_laws(&self, options: &DiagnosisOptions) -> Laws {
        let ladder = &self.choice.ladder;
        let (Some(first), Some(last)) = (ladder.first(), ladder.last()) else { return Laws::default() };
        let candidates = candidates(options, &self.bench, &last.fit.model);
        let level = ALARMS_OF_LAW * options.false_alarm_rate;
        unnamed_law(&self.bench, [&first.fit, &last.fit], &self.blocks, &candidates, level, options.work / 2)
    }

    fn criterion(&self) -> f64 {
        self.choice.ladder.last().map_or(f64::INFINITY, |last| criterion(&self.bench, &last.fit))
    }
}

/// Mean square of what a model leaves over that of the noise in its high band, from which on another baseline is tried.
const LOUDER: f64 = 4.0;

/// Mean square of the best linear model over that of an extended one which no other structure beats: a mode that is missing
/// leaves of it what the linear models with that mode have taken.
const FAR_BETTER: f64 = 100.0;

/// Mean square of a simpler model over that of one that takes its place, at least.
///
/// Why: of models that all leave more than noise one with more poles follows a little more of it.
const BETTER: f64 = 2.0;

/// The first that is as good as any linear model and not far worse than those that come behind it; the last, which a linear
/// model alone is, where none is. Those before it, which are simpler, come with it.
fn best_of(mut extended: Vec<Extended>) -> Option<(Extended, Vec<Extended>)> {
    let last = extended.len().checked_sub(1)?;
    let adequate = |of: &Extended| of.adequate;
    let far = |of: &Extended| of.blocks.count() as f64 * BETTER.ln();
    let is_beaten = |place: usize| {
        let own = extended[place].criterion();
        extended[place + 1..].iter().any(|of| of.criterion() + far(of) < own)
    };
    let first = (0..last).find(|place| adequate(&extended[*place]) && !is_beaten(*place)).unwrap_or(last);
    extended.truncate(first + 1);
    extended.pop().map(|chosen| (chosen, extended))
}

/// Extends a baseline with at most so much work; how much it was.
fn extend(baseline: Baseline, options: &DiagnosisOptions, work: u64) -> (Extended, u64) {
    let Baseline { fit, bench, adequacy } = baseline;
    let blocks = blocks(&bench, &fit);
    let candidates = candidates(options, &bench, &fit.model);
    let begin = bench.work();
    let search = Search {
        bench: &bench,
        blocks: blocks.clone(),
        options,
        trials: trials(&bench, &fit, &candidates),
        end: begin + work,
        for_rivals: options.work / LEAST_SHARE,
        candidates,
    };
    let choice = search.run(fit);
    // where the linear model is the best there is, what extends it need not pay for itself in blocks: F tests decide
    let ends = [choice.ladder.first(), choice.ladder.last()];
    let adequate = ends.iter().flatten().any(|model| adequacy.holds(criterion(&bench, &model.fit)));
    let far = blocks.count() as f64 * FAR_BETTER.ln();
    let far_better = ends[1].is_some_and(|last| adequacy.holds(criterion(&bench, &last.fit) + far));
    let used = bench.work() - begin;
    (Extended { bench, blocks, choice, adequate, far_better }, used)
}

/// Of the work that searches may take each baseline has one in so many, whatever those before it took, and as much again for
/// rivals of what it found.
const LEAST_SHARE: u64 = 8;

/// Fewest records that show a change from one to the next: its slope, and whether it is one.
const ARCHIVE: usize = 4;

/// The causes that these data can show, at every place.
fn candidates(options: &DiagnosisOptions, bench: &Bench, model: &Model) -> Vec<Candidate> {
    let mut numbers: Vec<usize> = options.training.iter().map(|stretch| stretch.record).collect();
    numbers.sort_unstable();
    numbers.dedup();
    let archive = numbers.len() >= ARCHIVE;
    let samples: usize = options.training.iter().map(Stretch::samples).sum();
    let modes = model.dynamics.modes();
    let has = |need: Need| match need {
        Need::Release => false,
        Need::Run => true,
        Need::Mode => modes > 0,
        Need::TwoModes => modes > 1,
        Need::Input => bench.driven,
        Need::Records => archive,
        Need::OneChannel => bench.layout.channels == 1,
        Need::OneRun => bench.layout.stretches() == 1,
        Need::ShortRun => 2 * samples < 3 * SAMPLE,
    };
    let usable = |cause: &&&'static dyn Cause| {
        let about = cause.about();
        about.is_met(has) && !(options.free_offsets && about.id == "offset")
    };
    options.candidates.iter().filter(usable).flat_map(|cause| Candidate::places(*cause, modes)).collect()
}
