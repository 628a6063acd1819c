//! The stretches that are learnt from, scaled, and simulations of them.

use std::borrow::Cow;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use rayon::prelude::*;

use super::{FineInput, Layout, Record, Stretch};
use crate::diagnosis::dynamics::{Modal, Model, Run, Span, State, motions, outputs};
use crate::diagnosis::error::DiagnosisError;
use crate::effects::{Effects, Instant, Intersample, Passage, pass};

/// Fewest samples of a stretch: a hundred periods' worth of nothing is not enough, a few of a ringdown are.
pub(crate) const LEAST_SAMPLES: usize = 24;
/// Largest angle of a step, rad: the scheme's error is its fourth power over a hundred of what is not linear. Records
/// of more than [`LONG`] samples take the second, whose error is still a thousandth of what a cause has to gain there.
const ANGLES: [f64; 2] = [0.15, 0.45];
/// Samples beyond which time counts.
const LONG: usize = 8192;
/// Most steps between samples.
const MOST_STEPS: usize = 16;

/// Stretches in units of the largest input and outputs, and what simulates them.
///
/// Scaled by the largest output, a cause's limits and trials mean the same for volts and for strain.
#[derive(Clone)]
pub struct Bench {
    /// Outputs stretch by stretch, channel by channel, sample by sample; NaN where missing.
    pub output: Vec<f64>,
    /// Where each stretch and channel lies in that.
    pub(crate) layout: Layout,
    /// The stretches.
    pub stretches: Vec<Stretch>,
    /// Interval of the samples, s.
    pub interval_s: f64,
    /// Unit of each channel's scaled output.
    pub output_scale: Vec<f64>,
    /// Unit of the scaled input.
    pub input_scale: f64,
    /// Whether there is an input.
    pub driven: bool,
    /// Records that there are.
    records: usize,
    /// Values that are there.
    pub count: usize,
    /// Record of each stretch that is learnt from, and the time of its first sample, s: there the causes' place is 0.
    origins: Arc<Vec<(usize, f64)>>,
    /// Length that the causes' place within a record is counted in, s.
    reference_s: f64,
    /// Input of each record by its course between samples; none where there is no input.
    inputs: Arc<Vec<[FineInput; 3]>>,
    /// Steps of the integrator between samples.
    steps: usize,
    /// Steps of sections that were simulated, by all that come from one bench.
    work: Arc<AtomicU64>,
}

impl Bench {
    /// Scales records by the stretches that are learnt from; the input between samples is built for all three
    /// assumptions, at a step that suits `highest_hz`. Channels of `one_unit` keep their sizes against one another, so
    /// that the noise of small ones does not count for more.
    ///
    /// # Errors
    /// See [`DiagnosisError`].
    pub fn new(
        records: &[Record<'_>],
        stretches: &[Stretch],
        interval_s: f64,
        highest_hz: f64,
        one_unit: bool,
    ) -> Result<Self, DiagnosisError> {
        check(records, stretches, interval_s)?;
        let channels = records[0].outputs.len();
        let layout = Layout::new(stretches, channels);
        let mut output_scale = Vec::new();
        for channel in 0..channels {
            let of = |s: &Stretch| &records[s.record].outputs[channel][s.first..s.end];
            let scale = stretches.iter().map(|s| largest(of(s))).fold(0.0, f64::max);
            let moves = stretches.iter().any(|s| {
                let first = of(s).first().copied().unwrap_or(f64::NAN);
                of(s).iter().filter(|v| v.is_finite()).any(|v| *v != first)
            });
            if scale == 0.0 || !moves {
                return Err(DiagnosisError::Silent { channel: channel + 1 });
            }
            output_scale.push(scale);
        }
        if one_unit {
            let common = output_scale.iter().copied().fold(0.0, f64::max);
            output_scale.fill(common);
        }
        let mut output = vec![f64::NAN; layout.values()];
        for (channel, scale) in output_scale.iter().enumerate() {
            for (e, stretch) in stretches.iter().enumerate() {
                let place = layout.part(e, channel, 0, stretch.samples());
                let measured = &records[stretch.record].outputs[channel][stretch.first..stretch.end];
                output[place].iter_mut().zip(measured).for_each(|(to, y)| *to = y / scale);
            }
        }
        let input = |s: &Stretch| records[s.record].input.get(s.first..s.end).map_or(0.0, largest);
        let input_scale = stretches.iter().map(input).fold(0.0, f64::max);
        let driven = input_scale > 0.0;
        let input_moves = stretches.iter().any(|s| {
            let own = records[s.record].input.get(s.first..s.end).unwrap_or(&[]);
            own.first().is_some_and(|first| own.iter().any(|u| u != first))
        });
        if driven && !input_moves {
            return Err(DiagnosisError::Still);
        }
        let input_scale = if driven { input_scale } else { 1.0 };
        let steps = steps(highest_hz, interval_s, layout.all_samples());
        let kinds = [Intersample::Held, Intersample::Linear, Intersample::BandLimited];
        let fine = |record: &Record<'_>| {
            let scaled: Vec<f64> = record.input.iter().map(|u| u / input_scale).collect();
            kinds.map(|kind| FineInput::new(&scaled, kind, steps))
        };
        let longest = stretches.iter().map(Stretch::samples).max().unwrap_or(0);
        Ok(Self {
            count: output.iter().filter(|y| y.is_finite()).count(),
            output,
            layout,
            stretches: stretches.to_vec(),
            interval_s,
            output_scale,
            input_scale,
            driven,
            records: records.len(),
            origins: Arc::new(stretches.iter().map(|s| (s.record, s.first as f64 * interval_s)).collect()),
            reference_s: longest as f64 * interval_s,
            inputs: Arc::new(if driven { records.iter().map(fine).collect() } else { Vec::new() }),
            steps,
            work: Arc::default(),
        })
    }

    /// Steps of sections that were simulated so far: what a search has cost, the same on any machine.
    pub(crate) fn work(&self) -> u64 {
        self.work.load(Ordering::Relaxed)
    }

    /// The same with every stretch cut down to its samples `range(e)`, counted from its beginning.
    pub(crate) fn cut(&self, range: impl Fn(usize) -> (usize, usize)) -> Self {
        let pieces: Vec<Stretch> = self
            .stretches
            .iter()
            .enumerate()
            .map(|(e, s)| Stretch { first: s.first + range(e).0, end: s.first + range(e).1, ..*s })
            .collect();
        let layout = Layout::new(&pieces, self.layout.channels);
        let mut output = Vec::with_capacity(layout.values());
        for e in 0..pieces.len() {
            for channel in 0..layout.channels {
                output.extend_from_slice(&self.output[self.layout.part(e, channel, range(e).0, range(e).1)]);
            }
        }
        Self {
            count: output.iter().filter(|y| y.is_finite()).count(),
            output,
            layout,
            stretches: pieces,
            ..self.clone()
        }
    }

    /// Other stretches of the same records, in the same scale. None: they do not lie in the records.
    pub(crate) fn elsewhere(&self, records: &[Record<'_>], stretches: &[Stretch]) -> Option<Self> {
        let layout = Layout::new(stretches, self.layout.channels);
        let mut output = Vec::with_capacity(layout.values());
        for stretch in stretches {
            for (samples, scale) in records.get(stretch.record)?.outputs.iter().zip(&self.output_scale) {
                output.extend(samples.get(stretch.first..stretch.end)?.iter().map(|y| y / scale));
            }
        }
        let count = output.iter().filter(|y| y.is_finite()).count();
        Some(Self { count, output, layout, stretches: stretches.to_vec(), ..self.clone() })
    }

    /// Other samples of the same runs, at another interval, in the same scale. None: the stretches do not lie there.
    pub(crate) fn at_interval(
        &self,
        records: &[Record<'_>],
        stretches: &[Stretch],
        interval_s: f64,
        highest_hz: f64,
    ) -> Option<Self> {
        let steps = steps(highest_hz, interval_s, stretches.iter().map(Stretch::samples).sum());
        Some(Self { interval_s, steps, ..self.elsewhere(records, stretches)? })
    }

    /// First sample of the window of `length` samples of stretch `e` whose first channel has the largest mean square.
    pub(crate) fn loudest(&self, e: usize, length: usize) -> usize {
        let samples = self.layout.samples(e);
        let output = &self.output[self.layout.part(e, 0, 0, samples)];
        let power = |first: usize| -> f64 {
            output[first..first + length].iter().filter(|y| y.is_finite()).map(|y| y * y).sum()
        };
        let starts = (0..=samples.saturating_sub(length)).step_by((length / 4).max(1));
        let larger = |best: (f64, usize), next: (f64, usize)| if next.0 > best.0 { next } else { best };
        starts.map(|first| (power(first), first)).fold((-1.0, 0), larger).1
    }

    /// Steps of the integrator between samples.
    pub(crate) fn steps(&self) -> usize {
        self.steps
    }

    /// Length of the longest stretch that is learnt from, s.
    pub(crate) fn reference_s(&self) -> f64 {
        self.reference_s
    }

    /// The model's output over the stretches.
    pub fn simulate(&self, model: &Model) -> Vec<f64> {
        self.simulate_with(model, &model.effects())
    }

    /// The model's output under other effects than its own.
    pub(crate) fn simulate_with(&self, model: &Model, effects: &Effects) -> Vec<f64> {
        self.simulate_each(&[(model, effects)]).pop().unwrap_or_default()
    }

    /// Output of several models, each over the stretches: side by side, which takes little longer than one alone.
    pub(crate) fn simulate_all(&self, models: &[Model]) -> Vec<Vec<f64>> {
        let effects = effects_of_all(models);
        self.simulate_each(&models.iter().zip(&effects).collect::<Vec<_>>())
    }

    /// Output of several models under effects, each over the stretches.
    pub(crate) fn simulate_each(&self, models: &[(&Model, &Effects)]) -> Vec<Vec<f64>> {
        // what several motions have for an input passes only once
        let mut distinct: Vec<&Effects> = Vec::new();
        let mut which = Vec::with_capacity(models.len());
        for (_, effects) in models {
            let known = distinct.iter().position(|other| other.have_the_input_of(effects));
            which.push(known.unwrap_or(distinct.len()));
            if known.is_none() {
                distinct.push(effects);
            }
        }
        let pass = |effects: &&Effects| -> Vec<Option<Cow<'_, [f64]>>> {
            self.stretches.iter().map(|stretch| self.nodes(stretch, effects)).collect()
        };
        let inputs: Vec<Vec<Option<Cow<'_, [f64]>>>> = distinct.par_iter().map(pass).collect();
        let runs = models.iter().zip(&which).flat_map(|((model, effects), which)| {
            let stretches = self.stretches.iter().zip(&model.states).zip(&inputs[*which]);
            stretches.map(|((stretch, state), input)| self.run(model, state, stretch, effects, input.as_deref()))
        });
        let runs: Vec<Run<'_>> = runs.collect();
        self.work.fetch_add(runs.iter().map(Run::work).sum(), Ordering::Relaxed);
        let mut parts = outputs(&runs).into_iter();
        let lengths = models.iter().map(|(model, _)| model.states.len().min(self.stretches.len()));
        lengths.map(|stretches| parts.by_ref().take(stretches).collect::<Vec<_>>().concat()).collect()
    }

    /// The model's output over any stretch of the records from a state there, channel by channel.
    pub(crate) fn simulate_stretch(&self, model: &Model, state: &State, stretch: &Stretch) -> Vec<f64> {
        let effects = model.effects();
        let nodes = self.nodes(stretch, &effects);
        outputs(&[self.run(model, state, stretch, &effects, nodes.as_deref())]).pop().unwrap_or_default()
    }

    fn run<'a>(
        &'a self,
        model: &'a Model,
        state: &'a State,
        stretch: &Stretch,
        effects: &'a Effects,
        nodes: Option<&'a [f64]>,
    ) -> Run<'a> {
        let begin_s = stretch.first as f64 * self.interval_s;
        let span = Span {
            interval_s: self.interval_s,
            begin_s,
            origin_s: self.origin_s(stretch.record, begin_s),
            reference_s: self.reference_s,
            record: stretch.record,
            steps: self.steps,
            samples: stretch.samples() + effects.lost_samples(),
            stored: stretch.samples(),
        };
        Run { dynamics: self.dynamics(model, stretch, effects), state, nodes, effects, span }
    }

    /// Where the place of a stretch is counted from: the last stretch of its record that was learnt from and does not begin
    /// behind it, else the stretch itself.
    fn origin_s(&self, record: usize, begin_s: f64) -> f64 {
        let within = 0.5 * self.interval_s;
        let before = self.origins.iter().filter(|(own, origin)| *own == record && *origin <= begin_s + within);
        before.map(|(_, origin)| *origin).reduce(f64::max).unwrap_or(begin_s)
    }

    /// A model's dynamics as they are in the record of a stretch.
    fn dynamics<'m>(&self, model: &'m Model, stretch: &Stretch, effects: &Effects) -> Cow<'m, Modal> {
        if effects.frequency.is_empty() {
            return Cow::Borrowed(&model.dynamics);
        }
        let place = stretch.record as f64 / (self.records - 1).max(1) as f64;
        let time_s = stretch.first as f64 * self.interval_s;
        let instant = Instant { record: stretch.record, place, time_s, piezo_m: 0.0 };
        let factor = 1.0 + effects.frequency_change(&instant);
        let mut dynamics = model.dynamics.clone();
        dynamics.sections.iter_mut().for_each(|section| section.frequency_hz *= factor);
        Cow::Owned(dynamics)
    }

    /// Motion of the modes over the stretches: by stretch, mode and sample.
    pub(crate) fn motion(&self, model: &Model) -> Vec<Vec<Vec<[f64; 2]>>> {
        let effects = model.effects();
        let nodes: Vec<_> = self.stretches.iter().map(|stretch| self.nodes(stretch, &effects)).collect();
        let stretches = self.stretches.iter().zip(&model.states).zip(&nodes);
        let runs =
            stretches.map(|((stretch, state), nodes)| self.run(model, state, stretch, &effects, nodes.as_deref()));
        motions(&runs.collect::<Vec<_>>())
    }

    /// Output less simulation; 0 where the output is missing.
    pub fn residual(&self, simulated: &[f64]) -> Vec<f64> {
        self.output.iter().zip(simulated).map(|(y, s)| if y.is_finite() { y - s } else { 0.0 }).collect()
    }

    /// The input at the integrator's nodes, through the effects' passages; none where there is no input.
    fn nodes(&self, stretch: &Stretch, effects: &Effects) -> Option<Cow<'_, [f64]>> {
        let inputs = self.inputs.get(stretch.record)?;
        let input = match effects.intersample.unwrap_or_default() {
            Intersample::Held => &inputs[0],
            Intersample::Linear => &inputs[1],
            Intersample::BandLimited => &inputs[2],
        };
        let end = (stretch.end + effects.lost_samples()).min(input.samples());
        let nodes = input.part(stretch.first, end);
        if effects.input.is_empty() {
            return (!nodes.is_empty()).then_some(Cow::Borrowed(nodes));
        }
        if effects.by_sample || effects.input.iter().any(Passage::is_path) {
            // from the record's beginning, so that all its stretches and parts see the same input
            let mut whole = input.passed(&effects.input, end, self.interval_s, effects.by_sample);
            return Some(Cow::Owned(whole.split_off(whole.len().saturating_sub(nodes.len()))));
        }
        let mut nodes = nodes.to_vec();
        pass(&effects.input, |_| 0.0, &mut nodes);
        Some(Cow::Owned(nodes))
    }
}

/// What the causes of each model add; those whose causes of the input have the same values share what it passes
/// through.
fn effects_of_all(models: &[Model]) -> Vec<Effects> {
    let mut known: Vec<(&Model, Vec<Passage>)> = Vec::new();
    let of = |model| {
        let mut effects = Model::effects(model);
        if !effects.input.is_empty() {
            match known.iter().find(|(other, _)| other.drives_as(model)) {
                Some((_, input)) => effects.input.clone_from(input),
                None => known.push((model, effects.input.clone())),
            }
        }
        effects
    };
    models.iter().map(of).collect()
}

/// Steps of the integrator between samples.
fn steps(highest_hz: f64, interval_s: f64, samples: usize) -> usize {
    let angle = std::f64::consts::TAU * highest_hz * interval_s;
    ((angle / ANGLES[usize::from(samples > LONG)]).ceil() as usize).clamp(1, MOST_STEPS)
}

fn largest(values: &[f64]) -> f64 {
    values.iter().filter(|v| v.is_finite()).fold(0.0, |most, v| most.max(v.abs()))
}

fn check(records: &[Record<'_>], stretches: &[Stretch], interval_s: f64) -> Result<(), DiagnosisError> {
    if !(interval_s > 0.0 && interval_s.is_finite()) {
        return Err(DiagnosisError::Interval(interval_s));
    }
    let channels = records.first().map_or(0, |record| record.outputs.len());
    if channels == 0 || stretches.is_empty() {
        return Err(DiagnosisError::Nothing);
    }
    for (number, record) in records.iter().enumerate() {
        let samples = record.samples();
        let lengths = record.outputs.iter().map(|output| output.len());
        let input = (!record.input.is_empty()).then_some(record.input.len());
        if let Some(found) = lengths.chain(input).find(|length| *length != samples) {
            return Err(DiagnosisError::Lengths { record: number + 1, found, wanted: samples });
        }
        if record.outputs.len() != channels {
            let found = record.outputs.len();
            return Err(DiagnosisError::Channels { record: number + 1, found, wanted: channels });
        }
        if let Some(sample) = record.input.iter().position(|u| !u.is_finite()) {
            return Err(DiagnosisError::Missing { record: number + 1, sample });
        }
    }
    for s in stretches {
        let samples = records.get(s.record).map_or(0, Record::samples);
        if s.end > samples || s.first + LEAST_SAMPLES > s.end {
            return Err(DiagnosisError::Part {
                name: "training".to_owned(),
                first: s.first,
                end: s.end,
                samples,
                least: LEAST_SAMPLES,
            });
        }
    }
    Ok(())
}
