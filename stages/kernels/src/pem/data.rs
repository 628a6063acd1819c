//! Records made ready: checked, with priors, without gaps.

use super::columns::BufferPool;
use super::options::{Experiment, NoiseModel, PemOptions};
use super::predictor::Problem;
use crate::model::{ModelError, finite};

/// Inputs, one after the other, and output.
pub(super) type Record = (Vec<f64>, Vec<f64>);

/// Input and output of each input's prior: an impulse of the share's energy, and silence. Errors: a share that is
/// negative or not finite.
pub(super) fn prior_records(experiments: &[Experiment<'_>], options: &PemOptions) -> Result<Vec<Record>, ModelError> {
    if !(options.prior >= 0.0 && options.prior.is_finite()) {
        return Err(ModelError::Parameter { name: "prior", found: options.prior, wanted: "0 or more" });
    }
    if options.prior == 0.0 {
        return Ok(Vec::new());
    }
    let samples = experiments.iter().map(|experiment| experiment.output.len()).max().unwrap_or(0);
    let inputs = inputs(experiments);
    let energy = |input: usize| -> f64 {
        let own = |e: &Experiment<'_>| {
            let n = e.output.len();
            e.input[input * n..(input + 1) * n].iter().map(|u| u * u).sum::<f64>()
        };
        experiments.iter().map(own).sum()
    };
    let record = |input: usize| {
        let mut impulse = vec![0.0; inputs * samples];
        impulse[input * samples] = (options.prior * energy(input)).sqrt();
        (impulse, vec![0.0; samples])
    };
    Ok((0..inputs).map(record).collect())
}

/// How many, at least one.
fn inputs(experiments: &[Experiment<'_>]) -> usize {
    experiments.first().map_or(0, |first| first.input.len() / first.output.len().max(1)).max(1)
}

/// The longest stretch of an experiment without a missing output, its inputs one after the other. Errors: it is too
/// short for the start.
pub(crate) fn complete<'a>(
    experiment: &Experiment<'a>,
    options: &PemOptions,
) -> Result<(std::borrow::Cow<'a, [f64]>, &'a [f64]), ModelError> {
    let samples = experiment.output.len();
    let (mut best, mut first) = (0..0, 0);
    for k in 0..=samples {
        if experiment.output.get(k).is_none_or(|y| y.is_nan()) {
            if k - first > best.len() {
                best = first..k;
            }
            first = k + 1;
        }
    }
    if best.len() == samples {
        return Ok((experiment.input.into(), experiment.output));
    }
    let wanted = 3 * options.block_rows;
    if best.len() < wanted {
        return Err(ModelError::TooShort { found: best.len(), wanted });
    }
    let input: Vec<f64> = experiment.input.chunks_exact(samples).flat_map(|u| u[best.clone()].to_vec()).collect();
    Ok((input.into(), &experiment.output[best]))
}

pub(super) fn checked<'a>(
    experiments: &[Experiment<'a>],
    sample_time_s: f64,
    options: &PemOptions,
) -> Result<Problem<'a>, ModelError> {
    let range = |name, found: usize, ok, wanted| {
        if ok { Ok(()) } else { Err(ModelError::Parameter { name, found: found as f64, wanted }) }
    };
    range("order", options.order, options.order >= 1, "at least 1")?;
    range("block_rows", options.block_rows, options.block_rows > options.order, "more than the order")?;
    range("max_iterations", options.max_iterations, options.max_iterations >= 1, "at least 1")?;
    if !(sample_time_s > 0.0 && sample_time_s.is_finite()) {
        return Err(ModelError::Parameter { name: "sample_time_s", found: sample_time_s, wanted: "positive" });
    }
    if experiments.is_empty() {
        return Err(ModelError::NoExperiment);
    }
    let inputs = inputs(experiments);
    let (mut missing, mut top) = (Vec::new(), 0);
    for Experiment { input, output } in experiments {
        if input.len() != inputs * output.len() {
            return Err(ModelError::Length { what: "input", found: input.len(), wanted: inputs * output.len() });
        }
        finite("input", input)?;
        if let Some(index) = output.iter().position(|y| y.is_infinite()) {
            return Err(ModelError::NotFinite { what: "output", index });
        }
        missing.extend(output.iter().enumerate().filter(|(_, y)| y.is_nan()).map(|(k, _)| top + k));
        let wanted = (3 * options.block_rows).max((4 + 2 * inputs) * options.order + 6);
        let found = top + output.len() - missing.len();
        if output.len() < wanted || found < wanted {
            return Err(ModelError::TooShort { found: found.min(output.len()), wanted });
        }
        let mut present = output.iter().filter(|y| !y.is_nan());
        let first = present.next();
        if present.all(|y| Some(y) == first) {
            return Err(ModelError::ConstantOutput);
        }
        top += output.len();
    }
    if let (Some(&index), true) = (missing.first(), options.noise != NoiseModel::White) {
        return Err(ModelError::Missing { count: missing.len(), index });
    }
    Ok(Problem {
        experiments: experiments.iter().map(|experiment| (experiment.input, experiment.output)).collect(),
        inputs,
        order: options.order,
        offset: options.offset,
        slope: options.drift,
        missing,
        priors: 0,
        buffers: BufferPool::default(),
        watch: options.watch.clone(),
    })
}
