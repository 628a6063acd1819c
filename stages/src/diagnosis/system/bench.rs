//! The training part, scaled, and simulations of it.

use super::error::SystemError;
use super::input::FineInput;
use super::model::Model;
use super::oscillator::{Span, free_run, motion};
use afmid_kernels::effects::{Effects, Intersample};

/// A part of a record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// First sample, from 0.
    pub first: usize,
    /// One past the last.
    pub end: usize,
    /// Samples at its beginning that its initial state is fitted to and that are not scored; 0: the simulation of the
    /// training part goes on.
    pub state_samples: usize,
}

/// A record of one input and one output; outputs that are NaN are missing.
#[derive(Debug, Clone, Copy)]
pub struct Recorded<'a> {
    /// Input, all finite; all zero where there is none.
    pub input: &'a [f64],
    /// Output.
    pub output: &'a [f64],
    /// Interval of the samples, s.
    pub interval_s: f64,
}

/// Fewest samples of a training part: a hundred periods' worth of nothing is not enough, a few of a ringdown are.
const LEAST_SAMPLES: usize = 128;
/// Largest angle of a step, rad: the scheme's error is its fourth power over a hundred of what is not linear. Records
/// of more than [`LONG`] samples take the second, whose error is still a thousandth of what a cause has to buy there.
const ANGLES: [f64; 2] = [0.15, 0.45];
/// Samples beyond which time counts.
const LONG: usize = 16_384;
/// Most steps between samples.
const MOST_STEPS: usize = 16;

/// The training part in units of its largest input and output, and what simulates it.
///
/// Scaled by the largest output, a cause's limits and trials mean the same for volts and for strain.
pub struct Bench {
    /// Output of the training part; NaN where missing.
    pub output: Vec<f64>,
    /// Where it lies.
    pub span: Span,
    /// Unit of the scaled output.
    pub output_scale: f64,
    /// Unit of the scaled input.
    pub input_scale: f64,
    /// Whether there is an input.
    pub driven: bool,
    /// First and one past the last sample of the training part.
    pub training: (usize, usize),
    /// Samples with a value.
    pub count: usize,
    inputs: std::sync::Arc<[FineInput; 3]>,
}

impl Bench {
    /// Scales a record by its training part; the input between samples is built for all three assumptions, at a step
    /// that suits `highest_hz`.
    ///
    /// # Errors
    /// See [`SystemError`].
    pub fn new(record: &Recorded<'_>, training: (usize, usize), highest_hz: f64) -> Result<Self, SystemError> {
        check(record, training)?;
        let (first, end) = training;
        let largest =
            |values: &[f64]| values.iter().filter(|v| v.is_finite()).fold(0.0_f64, |most, v| most.max(v.abs()));
        let output_scale = largest(&record.output[first..end]);
        let moves = record.output[first..end].iter().filter(|v| v.is_finite()).any(|v| *v != record.output[first]);
        if output_scale == 0.0 || !moves {
            return Err(SystemError::Silent);
        }
        let input_scale = largest(&record.input[first..end]);
        let driven = input_scale > 0.0;
        let input_scale = if driven { input_scale } else { 1.0 };
        let scaled: Vec<f64> = record.input.iter().map(|u| u / input_scale).collect();
        let angle = 2.0 * std::f64::consts::PI * highest_hz * record.interval_s;
        let largest_angle = ANGLES[usize::from(end - first > LONG)];
        let steps = ((angle / largest_angle).ceil() as usize).clamp(1, MOST_STEPS);
        let kinds = [Intersample::Held, Intersample::Linear, Intersample::BandLimited];
        let output: Vec<f64> = record.output[first..end].iter().map(|y| y / output_scale).collect();
        Ok(Self {
            count: output.iter().filter(|y| y.is_finite()).count(),
            output,
            span: Span {
                interval_s: record.interval_s,
                begin_s: first as f64 * record.interval_s,
                reference_s: (end - first) as f64 * record.interval_s,
            },
            output_scale,
            input_scale,
            driven,
            training,
            inputs: std::sync::Arc::new(kinds.map(|kind| FineInput::new(&scaled, kind, steps))),
        })
    }

    /// A piece of the training part, in the same scale; samples counted from its beginning.
    pub(super) fn cut(&self, first: usize, end: usize) -> Self {
        let output = self.output[first..end].to_vec();
        Self {
            count: output.iter().filter(|y| y.is_finite()).count(),
            output,
            training: (self.training.0 + first, self.training.0 + end),
            inputs: self.inputs.clone(),
            ..*self
        }
    }

    /// The model's output over the training part.
    pub fn simulate(&self, model: &Model) -> Vec<f64> {
        self.simulate_part(model, model.state, self.training)
    }

    /// The model's output with further effects.
    pub(super) fn simulate_with(&self, model: &Model, effects: &Effects) -> Vec<f64> {
        let (first, end) = self.training;
        self.over(effects, first, end, |nodes, steps| {
            free_run(&model.oscillator, model.state, nodes, steps, effects, &self.span)
        })
    }

    /// The model's states over the training part.
    pub(super) fn states(&self, model: &Model) -> Vec<[f64; 2]> {
        let (effects, (first, end)) = (model.effects(), self.training);
        self.over(&effects, first, end, |nodes, steps| {
            motion(&model.oscillator, model.state, nodes, steps, &effects, self.span.interval_s)
        })
    }

    /// The model's output over samples `part` of the record, from a state there.
    pub fn simulate_part(&self, model: &Model, state: [f64; 2], part: (usize, usize)) -> Vec<f64> {
        let effects = model.effects();
        let span = Span { begin_s: part.0 as f64 * self.span.interval_s, ..self.span };
        self.over(&effects, part.0, part.1, |nodes, steps| {
            free_run(&model.oscillator, state, nodes, steps, &effects, &span)
        })
    }

    /// Output less simulation; 0 where the output is missing.
    pub fn residual(&self, simulated: &[f64]) -> Vec<f64> {
        self.output.iter().zip(simulated).map(|(y, s)| if y.is_finite() { y - s } else { 0.0 }).collect()
    }

    fn over<T>(&self, effects: &Effects, first: usize, end: usize, run: impl Fn(&[f64], usize) -> T) -> T {
        let input = match effects.intersample.unwrap_or_default() {
            Intersample::Held => &self.inputs[0],
            Intersample::Linear => &self.inputs[1],
            Intersample::BandLimited => &self.inputs[2],
        };
        let nodes = input.part(first, end);
        if effects.input.is_empty() {
            return run(nodes, input.steps);
        }
        let through = |u: &f64| effects.input.iter().fold(*u, |u, map| map(u));
        run(&nodes.iter().map(through).collect::<Vec<f64>>(), input.steps)
    }
}

fn check(record: &Recorded<'_>, (first, end): (usize, usize)) -> Result<(), SystemError> {
    let (input, samples) = (record.input.len(), record.output.len());
    if input != samples {
        return Err(SystemError::Lengths { input, output: samples });
    }
    if !(record.interval_s > 0.0 && record.interval_s.is_finite()) {
        return Err(SystemError::Interval(record.interval_s));
    }
    if end > samples || first + LEAST_SAMPLES > end {
        return Err(SystemError::Part { name: "training".to_owned(), first, end, samples, least: LEAST_SAMPLES });
    }
    match record.input.iter().position(|u| !u.is_finite()) {
        Some(k) => Err(SystemError::Missing(k)),
        None => Ok(()),
    }
}
