//! Lines of constant amplitude in free decays: no mode makes them, and each hit has a phase of its own.

use std::collections::BTreeMap;
use std::f64::consts::TAU;

use super::data::{Layout, Record, Stretch};
use super::options::DiagnosisOptions;
use super::verdict::{Diagnosis, Gain, NamedCause, Rung, Value, Verdict};
use crate::causes::Cause;
use crate::signal::{RealTransform, hann};
use crate::statistics::{f_tail, gamma_tail, median};

/// The cause that is named.
const ID: &str = "spurious-line";
/// Lines that are taken out at most.
const MOST: usize = 3;
/// Fewest samples of a second half.
const LEAST: usize = 64;
/// Probability of so high a peak in noise, all frequencies considered: the level beside it is estimated.
const CHANCE: f64 = 1e-6;
/// Power of a line in a later quarter, or half, of all decays over that of the one before, at least and at most: what dies
/// away within six records' lengths has less.
const STEADY: std::ops::Range<f64> = 0.85..1.18;
/// Standard errors of its logarithm within which that is one.
const SURE: f64 = 5.0;
/// Hits from which on their amplitudes tell a line from a mode, and how far they scatter then, over their mean: hits of one
/// strength within a fifth are seldom.
const HITS: usize = 3;
const EVEN: f64 = 0.2;
/// Least share of what the model leaves.
const SHARE: f64 = 0.01;
/// Main lobe of Hann's window, and reach of the level beside it, in bins of a second half.
const LOBE: f64 = 4.0;
const BESIDE: f64 = 24.0;
/// Blocks of a decay; every other one predicts the rest.
const BLOCKS: usize = 8;

/// One channel of one decay.
struct Piece {
    record: usize,
    channel: usize,
    first: usize,
    /// NaN where missing.
    values: Vec<f64>,
}

/// A line: cosine and sine of each piece, about its first sample.
struct Line {
    frequency_hz: f64,
    parts: Vec<[f64; 2]>,
}

/// Lines that the later halves of all decays show, and the decays without them.
pub(super) struct SteadyLines {
    interval_s: f64,
    pieces: Vec<Piece>,
    lines: Vec<Line>,
    /// Samples by record and channel, the lines taken out.
    rest: Vec<Vec<Vec<f64>>>,
}

impl SteadyLines {
    /// None where an input is measured, lines may not be named, or none is seen.
    ///
    /// # Method
    /// Periodograms of the tapered second halves, summed over decays and channels, against the median beside each bin; a
    /// peak whose power in the last quarter is that of the third.
    pub fn find(records: &[Record<'_>], interval_s: f64, options: &DiagnosisOptions) -> Option<Self> {
        let named = options.candidates.iter().any(|cause| cause.about().id == ID);
        let driven = records.iter().any(|record| !record.input.is_empty());
        let channels = records.first()?.outputs.len();
        if driven || !named || !(options.one_unit || channels == 1) {
            return None;
        }
        let mut pieces: Vec<Piece> = Vec::new();
        let judged = options.parts.iter().map(|part| &part.stretch);
        for stretch in options.training.iter().chain(judged) {
            for (channel, output) in records.get(stretch.record)?.outputs.iter().enumerate() {
                let values = output.get(stretch.first..stretch.end)?.to_vec();
                pieces.push(Piece { record: stretch.record, channel, first: stretch.first, values });
            }
        }
        let rest: Vec<Vec<Vec<f64>>> =
            records.iter().map(|record| record.outputs.iter().map(|output| output.to_vec()).collect()).collect();
        let mut lines = Vec::new();
        let mut left: Vec<Vec<f64>> = pieces.iter().map(|piece| piece.values.clone()).collect();
        for _ in 0..MOST {
            let Some(frequency_hz) = strongest(&left, interval_s) else { break };
            let turn = TAU * frequency_hz * interval_s;
            let of_half = |values: &Vec<f64>| {
                let half = &values[values.len() / 2..];
                turned_back(part(half, turn, &tapered(half)), turn * (values.len() / 2) as f64)
            };
            let line = Line { frequency_hz, parts: left.iter().map(of_half).collect() };
            line.taken_from(&mut left, interval_s);
            lines.push(line);
        }
        (!lines.is_empty()).then(|| Self { interval_s, pieces, lines, rest }.taken_out())
    }

    /// The records without the lines.
    pub fn rest(&self) -> Vec<Record<'_>> {
        let outputs = self.rest.iter().map(|outputs| outputs.iter().map(Vec::as_slice).collect());
        outputs.map(|outputs| Record { input: &[], outputs }).collect()
    }

    /// What the lines add to the stretches that were learnt from, in the order of a diagnosis' simulations.
    pub fn simulated(&self, training: &[Stretch]) -> Vec<f64> {
        let channels = self.rest.first().map_or(0, Vec::len);
        let learnt = self.pieces.iter().enumerate().take(training.len() * channels);
        learnt
            .flat_map(|(number, piece)| {
                (0..piece.values.len())
                    .map(move |k| self.lines.iter().map(|line| line.at(number, k, self.interval_s)).sum())
            })
            .collect()
    }

    /// Adds the lines to an answer about what is left without them; `left`: what that answer's model leaves, in the output's
    /// unit. Errors: those that stand, where not all do, and the decays without them; none where none does.
    ///
    /// A line stands that takes a share of what is left with it, significantly, steadily, and predicts every other block of
    /// the decays from the rest.
    pub fn confirmed(
        self,
        left: &[f64],
        options: &DiagnosisOptions,
        diagnosis: &mut Diagnosis,
    ) -> Result<Self, Option<Self>> {
        let channels = self.rest.first().map_or(0, Vec::len);
        let layout = Layout::new(&options.training, channels);
        let places = (0..layout.stretches())
            .flat_map(|e| (0..channels).map(move |channel| (e, channel)))
            .map(|(e, channel)| layout.part(e, channel, 0, layout.samples(e)));
        let pieces: Vec<&[f64]> = places.filter_map(|place| left.get(place)).collect();
        let standing = |line: &Line| {
            Standing::new(line, &pieces, channels, self.interval_s)
                .filter(|standing| standing.is_sure(options.false_alarm_rate))
        };
        let sure: Vec<Option<Standing>> = self.lines.iter().map(standing).collect();
        if sure.iter().all(Option::is_some) {
            sure.iter().flatten().for_each(|standing| standing.tell(options, diagnosis));
            let lines = sure.into_iter().flatten().map(|standing| standing.line).collect();
            return Ok(Self { lines, ..self });
        }
        let lines: Vec<Line> =
            self.lines.into_iter().zip(&sure).filter(|(_, sure)| sure.is_some()).map(|(line, _)| line).collect();
        Err((!lines.is_empty()).then(|| Self { lines, ..self }.taken_out()))
    }

    /// The same with the records' rest as these lines leave it.
    fn taken_out(mut self) -> Self {
        let mut left: Vec<Vec<f64>> = self.pieces.iter().map(|piece| piece.values.clone()).collect();
        self.lines.iter().for_each(|line| line.taken_from(&mut left, self.interval_s));
        for (piece, left) in self.pieces.iter().zip(left) {
            self.rest[piece.record][piece.channel][piece.first..piece.first + left.len()].copy_from_slice(&left);
        }
        self
    }
}

impl Line {
    fn at(&self, piece: usize, k: usize, interval_s: f64) -> f64 {
        let [cosine, sine] = self.parts[piece];
        let (s, c) = (TAU * self.frequency_hz * interval_s * k as f64).sin_cos();
        cosine * c + sine * s
    }

    fn taken_from(&self, pieces: &mut [Vec<f64>], interval_s: f64) {
        for (number, values) in pieces.iter_mut().enumerate() {
            values.iter_mut().enumerate().for_each(|(k, value)| *value -= self.at(number, k, interval_s));
        }
    }
}

/// A line beside what a model without it leaves.
struct Standing {
    line: Line,
    frequency_std_hz: f64,
    /// Root mean square over pieces of the amplitudes, and its standard error.
    amplitude: [f64; 2],
    p_value: f64,
    /// Mean squares of what is left with the line in it and without it, and where other blocks predict it.
    with: f64,
    without: f64,
    predicted: f64,
    /// Power of the second halves over that of the first, and the standard error of its logarithm.
    goes_on: [f64; 2],
    /// Scatter of the hits' amplitudes over their mean; none of too few.
    scatter: Option<f64>,
    samples: f64,
}

impl Standing {
    /// The line as what is left with it in it shows it, over whole decays; none of too few samples.
    fn new(line: &Line, left: &[&[f64]], channels: usize, interval_s: f64) -> Option<Self> {
        let with: Vec<Vec<f64>> = left
            .iter()
            .enumerate()
            .map(|(number, left)| left.iter().enumerate().map(|(k, e)| e + line.at(number, k, interval_s)).collect())
            .collect();
        let pieces: Vec<&[f64]> = with.iter().map(Vec::as_slice).collect();
        let longest = pieces.iter().map(|piece| piece.len()).max()? as f64;
        let turn = top(&pieces, TAU * line.frequency_hz * interval_s, 0.5 * TAU / longest, alike);
        let (mut whole, mut rest, mut predicted, mut samples, mut information) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let mut halves = [0.0; 2];
        let mut parts = Vec::new();
        for with in &pieces {
            let n = with.len();
            let count = with.iter().filter(|e| e.is_finite()).count() as f64;
            let own = part(with, turn, &alike(with));
            whole += square(with);
            rest += beyond(with, own, turn, |_| true);
            samples += count;
            information += size(own) * count.powi(3);
            for (half, of) in [&with[..n / 2], &with[n / 2..]].into_iter().enumerate() {
                halves[half] += size(part(of, turn, &alike(of)));
            }
            // every other block from the rest
            for odd in 0..2 {
                let block = |k: usize| k * BLOCKS / n.max(1) % 2 == odd;
                let weights: Vec<f64> = (0..n).map(|k| if block(k) { 0.0 } else { 1.0 }).collect();
                predicted += beyond(with, part(with, turn, &weights), turn, block);
            }
            parts.push(own);
        }
        let freedom = 2.0 * left.len() as f64;
        let variance = rest / (samples - freedom);
        // of an amplitude 2 variance / n; each half has half of the samples
        let of_half = 4.0 * 2.0 * variance * left.len() as f64 / (0.5 * samples);
        let power = parts.iter().map(|own| size(*own)).sum::<f64>();
        let tail = f_tail((whole - rest) / (freedom * variance), freedom, samples - freedom);
        let of_hit = |of: &[[f64; 2]]| of.iter().map(|own| size(*own)).sum::<f64>().sqrt();
        let hits: Vec<f64> = parts.chunks(channels.max(1)).map(of_hit).collect();
        let mean = hits.iter().sum::<f64>() / hits.len() as f64;
        let spread = hits.iter().map(|hit| (hit - mean).powi(2)).sum::<f64>() / (hits.len() as f64 - 1.0);
        let amplitude = (power / parts.len() as f64).sqrt();
        (samples > 2.0 * freedom && variance > 0.0).then_some(Self {
            line: Line { frequency_hz: turn / TAU / interval_s, parts },
            frequency_std_hz: (24.0 * variance / information).sqrt() / (TAU * interval_s),
            amplitude: [amplitude, (2.0 * variance / samples).sqrt()],
            p_value: (longest * tail).min(1.0),
            with: whole / samples,
            without: rest / samples,
            predicted: predicted / samples,
            goes_on: [halves[1] / halves[0], (2.0 * of_half / power).sqrt()],
            scatter: (hits.len() >= HITS).then(|| spread.sqrt() / mean),
            samples,
        })
    }

    fn is_sure(&self, false_alarm_rate: f64) -> bool {
        self.p_value < false_alarm_rate
            && self.with - self.without > SHARE * self.with
            && self.predicted < self.with
            && STEADY.contains(&self.goes_on[0])
            && self.goes_on[0].ln().abs() < SURE * self.goes_on[1]
    }

    fn tell(&self, options: &DiagnosisOptions, diagnosis: &mut Diagnosis) {
        let unit = &options.output_unit;
        let of_line = self.with - self.without;
        let root = |rms: Option<f64>| rms.map(|rms| (rms * rms + of_line).sqrt());
        let value =
            |[value, std]: [f64; 2], unit: &str| Value { value: Some(value), std: Some(std), unit: unit.to_owned() };
        for part in &mut diagnosis.validation {
            part.rms_before = root(part.rms_before);
        }
        diagnosis.baseline.distortion_rms = root(diagnosis.baseline.distortion_rms);
        if let Some(linear) = diagnosis.ladder.first_mut() {
            let with = Rung {
                rms: root(linear.rms),
                held_out_rms: root(linear.held_out_rms),
                log_likelihood_gain: None,
                bic: None,
                ..linear.clone()
            };
            linear.added = ID.to_owned();
            linear.log_likelihood_gain = gain(self.samples, with.rms, linear.rms);
            diagnosis.ladder.insert(0, with);
        }
        let [before, after] = [self.with, self.predicted].map(f64::sqrt);
        let even = self.scatter.is_some_and(|scatter| scatter < EVEN);
        if !even {
            diagnosis.evidence.push(format!(
                "an oscillation of {:.4} Hz and {:.3e} {unit} goes on to the end of all hits, not as large in each: a line \
                 from outside, or a mode that hardly dies away; record without a hit: a line stays",
                self.line.frequency_hz, self.amplitude[0]
            ));
            diagnosis.verdict = Verdict::Unexplained;
            diagnosis.causes.clear();
            return;
        }
        diagnosis.evidence.push(format!(
            "{ID} of {:.4} Hz, alike in all hits, lowers the error of the decays from {before:.4e} to {after:.4e} {unit}; it \
             was taken out before anything else",
            self.line.frequency_hz
        ));
        if diagnosis.verdict == Verdict::Unexplained {
            return;
        }
        let about = crate::causes::built_in(ID).map(Cause::about);
        diagnosis.verdict = Verdict::Named;
        diagnosis.causes.push(NamedCause {
            id: ID.to_owned(),
            class: vec![ID.to_owned()],
            p_value: Some(self.p_value),
            parameters: BTreeMap::from([
                ("amplitude".to_owned(), value(self.amplitude, unit)),
                ("frequency_hz".to_owned(), value([self.line.frequency_hz, self.frequency_std_hz], "Hz")),
            ]),
            gain: Gain {
                rms_before: Some(before),
                rms_after: Some(after),
                unit: unit.clone(),
                log_likelihood: gain(self.samples, Some(before), Some(after)),
                held_out: "every other block of the decays in turn".to_owned(),
            },
            runner_up: None,
            next_measurement: about.map_or(String::new(), |about| about.next_measurement.to_owned()),
        });
    }
}

fn gain(samples: f64, before: Option<f64>, after: Option<f64>) -> Option<f64> {
    before.zip(after).map(|(before, after)| samples * (before / after).ln()).filter(|gain| gain.is_finite())
}

fn size([cosine, sine]: [f64; 2]) -> f64 {
    cosine * cosine + sine * sine
}

/// Sum of the squares of the measured values of some samples beyond a line.
fn beyond(values: &[f64], [cosine, sine]: [f64; 2], turn: f64, of: impl Fn(usize) -> bool) -> f64 {
    let there = values.iter().enumerate().filter(|(k, value)| of(*k) && value.is_finite());
    let error = |(k, value): (usize, &f64)| {
        let (s, c) = (turn * k as f64).sin_cos();
        (value - cosine * c - sine * s).powi(2)
    };
    there.map(error).sum()
}

/// Sum of the squares of what is there.
fn square(values: &[f64]) -> f64 {
    values.iter().filter(|value| value.is_finite()).map(|value| value * value).sum()
}

/// Cosine and sine, about the first sample, of values about their mean, by least squares under these weights; missing
/// samples have none.
fn part(values: &[f64], turn: f64, weights: &[f64]) -> [f64; 2] {
    let there = values.iter().filter(|value| value.is_finite());
    let mean = there.clone().sum::<f64>() / there.count().max(1) as f64;
    let [mut cc, mut cs, mut ss, mut cy, mut sy] = [0.0; 5];
    for (k, (value, weight)) in values.iter().zip(weights).enumerate().filter(|(_, (value, _))| value.is_finite()) {
        let (s, c) = (turn * k as f64).sin_cos();
        let y = value - mean;
        cc += weight * c * c;
        cs += weight * c * s;
        ss += weight * s * s;
        cy += weight * c * y;
        sy += weight * s * y;
    }
    let determinant = cc * ss - cs * cs;
    if determinant > 0.0 { [(cy * ss - sy * cs) / determinant, (sy * cc - cy * cs) / determinant] } else { [0.0; 2] }
}

/// Cosine and sine about a sample that lies so large an angle before the one that they are about.
fn turned_back([cosine, sine]: [f64; 2], angle: f64) -> [f64; 2] {
    let (s, c) = angle.sin_cos();
    [cosine * c - sine * s, cosine * s + sine * c]
}

fn alike(values: &[f64]) -> Vec<f64> {
    vec![1.0; values.len()]
}

fn tapered(values: &[f64]) -> Vec<f64> {
    hann(values.len(), 0.5)
}

/// Power of a line at that angle per sample in all pieces.
fn power(pieces: &[&[f64]], turn: f64, weights: fn(&[f64]) -> Vec<f64>) -> f64 {
    let of = |values: &&[f64]| {
        let [c, s] = part(values, turn, &weights(values));
        c * c + s * s
    };
    pieces.iter().map(of).sum()
}

/// Frequency of the clearest steady line in the second halves, Hz; none where there is none.
fn strongest(pieces: &[Vec<f64>], interval_s: f64) -> Option<f64> {
    let halves: Vec<&[f64]> =
        pieces.iter().map(|values| &values[values.len() / 2..]).filter(|half| half.len() >= LEAST).collect();
    let longest = halves.iter().map(|half| half.len()).max()?;
    let shortest = halves.iter().map(|half| half.len()).min()?;
    let plan = RealTransform::new(2 * longest.next_power_of_two());
    let mut sum = vec![0.0; plan.bins()];
    for half in &halves {
        let there = half.iter().filter(|value| value.is_finite());
        let mean = there.clone().sum::<f64>() / there.count().max(1) as f64;
        let weights = hann(half.len(), 0.5);
        let energy: f64 = weights.iter().map(|weight| weight * weight).sum();
        let tapered = half.iter().zip(&weights).map(|(v, w)| if v.is_finite() { (v - mean) * w } else { 0.0 });
        sum.iter_mut().zip(plan.power(tapered)).for_each(|(sum, power)| *sum += power / energy);
    }
    let bin = plan.samples() as f64 / shortest as f64;
    let (lobe, reach) = ((LOBE * bin).ceil() as usize, (BESIDE * bin).ceil() as usize);
    let shape = halves.len() as f64;
    // a gamma variable of shape K has its median at about K - 1 / 3
    let height = |k: usize| {
        let mut beside: Vec<f64> =
            [k.saturating_sub(reach)..k.saturating_sub(lobe), (k + lobe).min(sum.len())..(k + reach).min(sum.len())]
                .into_iter()
                .flat_map(|range| sum[range].iter().copied())
                .collect();
        sum[k] / median(&mut beside) * (shape - 1.0 / 3.0)
    };
    let peak = |k: &usize| sum[*k] > sum[k - 1] && sum[*k] >= sum[k + 1];
    let mut peaks: Vec<(usize, f64)> =
        (2 * lobe..sum.len().saturating_sub(lobe + 1)).filter(peak).map(|k| (k, height(k))).collect();
    let bins = sum.len() as f64;
    peaks.retain(|(_, height)| bins * gamma_tail(shape, *height) < CHANCE);
    peaks.sort_by(|a, b| b.1.total_cmp(&a.1));
    peaks.into_iter().find_map(|(k, _)| {
        let bin = TAU / plan.samples() as f64;
        let turn = top(&halves, bin * k as f64, bin, tapered);
        let [third, last] = [0, 1].map(|half| {
            let quarters: Vec<&[f64]> =
                halves.iter().map(|of| if half == 0 { &of[..of.len() / 2] } else { &of[of.len() / 2..] }).collect();
            power(&quarters, turn, tapered)
        });
        STEADY.contains(&(last / third)).then_some(turn / TAU / interval_s)
    })
}

/// The angle per sample near `turn` at which the pieces have the most power: golden section within `reach`.
fn top(pieces: &[&[f64]], turn: f64, reach: f64, weights: fn(&[f64]) -> Vec<f64>) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    const STEPS: usize = 24;
    let at = |turn: f64| power(pieces, turn, weights);
    let (mut low, mut high) = (turn - reach, turn + reach);
    for _ in 0..STEPS {
        let width = GOLDEN * (high - low);
        let (a, b) = (high - width, low + width);
        if at(a) > at(b) { high = b } else { low = a }
    }
    0.5 * (low + high)
}
