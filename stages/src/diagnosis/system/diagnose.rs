//! The whole way from a record to a verdict.

use super::answer::Findings;
use super::bench::{Bench, Recorded};
use super::blocks::Blocks;
use super::choice::Search;
use super::error::SystemError;
use super::misfit::misfit;
use super::model::Model;
use super::options::SystemOptions;
use super::start::baseline;
use super::story::{SystemStory, story};
use super::validation::check_part;
use crate::causes::{Cause, Domain, catalogue};
use crate::diagnosis::Diagnosis;

/// A diagnosis and the model that it ends with.
pub struct SystemDiagnosis {
    /// The answer.
    pub diagnosis: Diagnosis,
    /// Output of the training part, NaN where missing.
    pub output: Vec<f64>,
    /// The linear baseline's simulation of it.
    pub before: Vec<f64>,
    /// The extended model's.
    pub after: Vec<f64>,
    /// What both models miss, for a person to look at.
    pub story: SystemStory,
    /// The extended model, in units of the largest output and input.
    pub model: Model,
    /// Those units.
    pub scales: (f64, f64),
}

/// Fewest and most blocks: fewer leave the errors' own error above a fifth, more gain nothing.
const BLOCKS: (usize, usize) = (24, 128);
/// Periods of the oscillator in a block at least. Much longer blocks would hold all that a decay tells of its large
/// swings in one.
const PERIODS: f64 = 2.0;

/// Samples that candidates are compared on; all samples fit what was chosen.
const SAMPLE: usize = 16_384;

/// Says what a linear oscillator gets wrong in a measured input and output.
///
/// # Model
/// `q'' + (w/Q) q' + w^2 q = w^2 g u(t)`, y = q, free-running from a free state; the input held between samples; all
/// else is a cause.
/// # Method
/// Least squares of the free-run error on the training part; causes added by score screen, joint refits of the best
/// five, and likelihood less the Bayesian penalty; dropped or exchanged where later ones do better; each tested by
/// blocks against its best rival. What a library of general terms still predicts of the residual decides whether the
/// causes are the whole story.
/// # Shapes
/// Input and output of equal length; the answer's simulations are those of the training part.
/// # Units
/// Any; scaled inside by the largest input and output.
/// # Accuracy
/// See docs/diagnosis.md, "Input and output".
/// # Errors
/// Parts beyond the record, a missing input, an output that does not move, an unknown candidate: see [`SystemError`].
/// # Source
/// L. Ljung, System Identification, 2nd ed., 1999, chapter 7; J. Schoukens, L. Ljung, IEEE Control Syst. Mag. 39 (2019)
/// 28.
pub fn diagnose_system(record: &Recorded<'_>, options: &SystemOptions) -> Result<SystemDiagnosis, SystemError> {
    let coarse = Bench::new(record, options.training, 0.0)?;
    options.parts.iter().try_for_each(|part| check_part(part, &coarse, record.output.len()))?;
    let start = baseline(&coarse).ok_or(SystemError::NoBaseline)?;
    let bench = Bench::new(record, options.training, start.model.oscillator.frequency_hz)?;
    let fit = super::fit::Fit::new(&bench, &start.model, None).ok_or(SystemError::NoBaseline)?;
    let blocks = blocks(&bench, &fit);
    let sample = bench.cut(0, bench.output.len().min(SAMPLE));
    let candidates = candidates(options, bench.driven)?;
    let search = Search {
        bench: &bench,
        blocks,
        sample_blocks: Blocks { samples: sample.output.len(), ..blocks },
        sample,
        options,
        trials: super::screen::trials(&bench, &fit, &candidates),
        candidates,
    };
    let choice = search.run(fit);
    let Some(last) = choice.ladder.last() else { return Err(SystemError::NoBaseline) };
    let misfit = misfit(&bench, &last.fit, &blocks);
    let first = &choice.ladder[0].fit;
    let simulated = [&first.simulated[..], &last.fit.simulated];
    let story = story(&bench, record, [&first.model, &last.fit.model], simulated, &options.parts);
    let volts = |values: &[f64]| values.iter().map(|value| value * bench.output_scale).collect();
    let (before, after) = (volts(&choice.ladder[0].fit.simulated), volts(&last.fit.simulated));
    let model = last.fit.model.clone();
    let findings = Findings { bench: &bench, record, options, blocks, choice, misfit };
    Ok(SystemDiagnosis {
        diagnosis: findings.answer(),
        output: volts(&bench.output),
        before,
        after,
        story,
        model,
        scales: (bench.output_scale, bench.input_scale),
    })
}

/// Blocks of a few periods, as far as there are enough of them.
fn blocks(bench: &Bench, fit: &super::fit::Fit) -> Blocks {
    let samples = bench.output.len();
    let count = (bench.span.reference_s * fit.model.oscillator.frequency_hz / PERIODS) as usize;
    Blocks { samples, count: count.clamp(BLOCKS.0, BLOCKS.1).min(samples / 4) }
}

/// The causes to try. Errors: an id that is none for input and output.
fn candidates(options: &SystemOptions, driven: bool) -> Result<Vec<&'static dyn Cause>, SystemError> {
    let usable = |cause: &&'static dyn Cause| {
        let about = cause.about();
        about.domain != Domain::Release && (driven || about.part != crate::causes::Part::Input)
    };
    let all = catalogue();
    if let Some(unknown) = options
        .candidates
        .iter()
        .find(|id| !all.iter().any(|cause| cause.about().id == **id && cause.about().domain != Domain::Release))
    {
        return Err(SystemError::Cause(unknown.clone()));
    }
    let wanted = |cause: &&'static dyn Cause| {
        options.candidates.is_empty() || options.candidates.iter().any(|id| cause.about().id == id)
    };
    Ok(all.into_iter().filter(usable).filter(wanted).collect())
}
