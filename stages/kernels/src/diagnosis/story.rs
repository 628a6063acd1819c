//! What a report shows of a diagnosis: the errors of either model in frequency, against the output's size, and over the
//! time of the judged parts.

use super::data::{Bench, Part, Record};
use super::dynamics::Model;
use super::score_test::first_channel;
use super::validation::free_run_part;
use crate::signal::{Detrend, Welch};

/// Errors of the linear and of the extended model.
#[derive(Debug, Clone, PartialEq)]
pub struct Story {
    /// One-sided densities over the training part: output, errors before and after.
    pub spectra: Spectra,
    /// Errors over the training part by the size of the output.
    pub sizes: Vec<Binned>,
    /// Errors over the time of the judged parts, of the training part where there is none.
    pub times: Vec<(String, Vec<Binned>)>,
}

/// Densities in the output's unit squared per Hz.
#[derive(Debug, Clone, PartialEq)]
pub struct Spectra {
    /// Frequencies of the bins, Hz.
    pub frequency_hz: Vec<f64>,
    /// Of the output.
    pub output: Vec<f64>,
    /// Of the linear model's error.
    pub before: Vec<f64>,
    /// Of the extended model's.
    pub after: Vec<f64>,
}

/// Root mean squares of the samples of a bin, in the output's unit.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Binned {
    /// Middle of the bin: time in s, or size of the output in its unit.
    pub at: f64,
    /// Of the output.
    pub output: f64,
    /// Of the linear model's error.
    pub before: f64,
    /// Of the extended model's.
    pub after: f64,
}

/// Longest segment of the spectra, and their fewest number; stretches of a part; bins of the output's size, with the
/// fewest samples of one.
const SEGMENT: usize = 4096;
const SEGMENTS: usize = 8;
const STRETCHES: usize = 400;
const SIZES: usize = 24;
const LEAST: usize = 4;

/// Output and both errors, sample by sample, in the output's unit; NaN where the output is missing.
struct Errors {
    output: Vec<f64>,
    before: Vec<f64>,
    after: Vec<f64>,
}

impl Errors {
    fn new(output: &[f64], [before, after]: [&[f64]; 2], scale: f64) -> Self {
        let error = |simulated: &[f64]| output.iter().zip(simulated).map(|(y, s)| (y - s) * scale).collect();
        Self { output: output.iter().map(|y| y * scale).collect(), before: error(before), after: error(after) }
    }

    fn binned(&self, at: f64, samples: impl Iterator<Item = usize> + Clone) -> Option<Binned> {
        let present = samples.filter(|k| self.output[*k].is_finite());
        let count = present.clone().count();
        let rms = |values: &[f64]| (present.clone().map(|k| values[k].powi(2)).sum::<f64>() / count as f64).sqrt();
        let bin = Binned { at, output: rms(&self.output), before: rms(&self.before), after: rms(&self.after) };
        (count >= LEAST).then_some(bin)
    }

    fn over_time(&self, begin_s: f64, interval_s: f64) -> Vec<Binned> {
        let length = self.output.len().div_ceil(STRETCHES).max(LEAST);
        (0..self.output.len())
            .step_by(length)
            .filter_map(|first| {
                let end = (first + length).min(self.output.len());
                self.binned(begin_s + 0.5 * (first + end - 1) as f64 * interval_s, first..end)
            })
            .collect()
    }

    /// By signed output: what bends one way only shows as such.
    fn by_size(&self) -> Vec<Binned> {
        let present = || self.output.iter().copied().filter(|y| y.is_finite());
        let (low, high) = present().fold((f64::INFINITY, f64::NEG_INFINITY), |(l, h), y| (l.min(y), h.max(y)));
        let width = (high - low) / SIZES as f64;
        let mut members: Vec<Vec<usize>> = vec![Vec::new(); SIZES];
        for (k, y) in self.output.iter().enumerate().filter(|(_, y)| y.is_finite()) {
            members[(((y - low) / width) as usize).min(SIZES - 1)].push(k);
        }
        let bin = |(b, own): (usize, &Vec<usize>)| self.binned(low + (b as f64 + 0.5) * width, own.iter().copied());
        members.iter().enumerate().filter_map(bin).collect()
    }

    fn spectra(&self, interval_s: f64) -> Spectra {
        let segment = (self.output.len() / SEGMENTS).clamp(32, SEGMENT) / 2 * 2;
        // missing samples count as none: a gap is short, or the spectrum says little
        let density = |values: &[f64]| {
            let whole: Vec<f64> = values.iter().map(|v| if v.is_finite() { *v } else { 0.0 }).collect();
            let mut welch = Welch::new(segment, 1.0 / interval_s, Detrend::Mean).ok()?;
            welch.push(&whole);
            welch.average().ok()
        };
        let found = density(&self.output).zip(density(&self.before)).zip(density(&self.after));
        let Some(((output, before), after)) = found else {
            let none = Vec::new;
            return Spectra { frequency_hz: none(), output: none(), before: none(), after: none() };
        };
        Spectra {
            frequency_hz: (0..output.density.len()).map(|k| k as f64 * output.bin_hz).collect(),
            output: output.density,
            before: before.density,
            after: after.density,
        }
    }
}

impl Story {
    /// The same with the errors over the time of the parts to judge on, `after` simulated from the record's first sample
    /// on, before by a linear model.
    pub(super) fn over_parts(
        mut self,
        bench: &Bench,
        records: &[Record<'_>],
        linear: &Model,
        after: &[f64],
        parts: &[Part],
    ) -> Self {
        let scale = bench.output_scale.first().copied().unwrap_or(1.0);
        let of = |part: &Part| {
            let run = free_run_part(bench, records, linear, part)?;
            let after: Vec<f64> = after.get(run.first..run.first + run.samples)?.iter().map(|y| y / scale).collect();
            let output = run.output.get(..run.samples)?;
            let errors = Errors::new(output, [run.simulated.get(..run.samples)?, &after], scale);
            Some((part.name.clone(), errors.over_time(run.first as f64 * bench.interval_s, bench.interval_s)))
        };
        if !parts.is_empty() {
            self.times = parts.iter().filter_map(of).collect();
        }
        self
    }

    /// Of one output, simulated before and after, in its unit; by name the samples of the parts to judge on, of all of it
    /// where there is none.
    pub fn of_series(
        output: &[f64],
        simulated: [&[f64]; 2],
        interval_s: f64,
        parts: &[(String, std::ops::Range<usize>)],
    ) -> Self {
        let all = Errors::new(output, simulated, 1.0);
        let of = |(name, range): &(String, std::ops::Range<usize>)| {
            let cut = |values: &[f64]| values.get(range.clone()).unwrap_or(&[]).to_vec();
            let part = Errors { output: cut(&all.output), before: cut(&all.before), after: cut(&all.after) };
            (name.clone(), part.over_time(range.start as f64 * interval_s, interval_s))
        };
        let times = match parts {
            [] => vec![("training".to_owned(), all.over_time(0.0, interval_s))],
            parts => parts.iter().map(of).collect(),
        };
        Self { spectra: all.spectra(interval_s), sizes: all.by_size(), times }
    }
}

/// The errors of both models over what was learnt from (`simulated`) and over the parts to judge on, in the first
/// channel; spectra and sizes of the longest stretch.
pub(super) fn story(
    bench: &Bench,
    records: &[Record<'_>],
    models: [&Model; 2],
    simulated: [&[f64]; 2],
    parts: &[Part],
) -> Story {
    let (interval_s, scale) = (bench.interval_s, bench.output_scale.first().copied().unwrap_or(1.0));
    let of = |column| first_channel(bench, column);
    let training = Errors::new(of(&bench.output), simulated.map(of), scale);
    let judged = |part: &Part| {
        let [before, after] = models.map(|model| free_run_part(bench, records, model, part));
        let (before, after) = before.zip(after)?;
        let first = |values: &[f64]| values.iter().take(before.samples).copied().collect::<Vec<f64>>();
        let simulated = [first(&before.simulated), first(&after.simulated)];
        let errors = Errors::new(&first(&before.output), [&simulated[0], &simulated[1]], scale);
        Some((part.name.clone(), errors.over_time(before.first as f64 * interval_s, interval_s)))
    };
    let mut times: Vec<(String, Vec<Binned>)> = parts.iter().filter_map(judged).collect();
    if times.is_empty() {
        let begin = bench.stretches.first().map_or(0, |stretch| stretch.first);
        times.push(("training".to_owned(), training.over_time(begin as f64 * interval_s, interval_s)));
    }
    Story { spectra: training.spectra(interval_s), sizes: training.by_size(), times }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bins_hold_the_root_mean_squares() {
        let output: Vec<f64> = (0..4000).map(|k| (0.05 * f64::from(k)).sin()).collect();
        let before: Vec<f64> = output.iter().map(|y| y - 0.1 * y * y).collect();
        let mut with_gap = output.clone();
        with_gap[17] = f64::NAN;
        let errors = Errors::new(&with_gap, [&before, &output], 2.0);
        for bin in errors.by_size() {
            // the error is 0.1 y^2 in scaled units: within a bin of width 1/6 of the output (-2 to 2) it varies by y /
            // 6
            let truth = 2.0 * 0.1 * (bin.at / 2.0).powi(2);
            assert!((bin.before - truth).abs() < 0.1 * bin.at.abs() / 6.0 + 1e-3, "{bin:?} {truth}");
            assert_eq!(bin.after, 0.0);
        }
        let over_time = errors.over_time(1.0, 0.5);
        assert_eq!(over_time.len(), 400);
        assert_eq!(over_time[0].at, 1.0 + 0.5 * 4.5);
        let all: f64 = over_time.iter().map(|bin| bin.before.powi(2)).sum::<f64>() / 400.0;
        // the mean square of 0.2 sin^2 is 0.04 * 3/8, over 32 periods and less one sample
        assert!((all / 0.015 - 1.0).abs() < 1e-2, "{all}");
        let spectra = errors.spectra(0.5);
        let peak = (0..spectra.output.len()).max_by(|a, b| spectra.output[*a].total_cmp(&spectra.output[*b]));
        let f = 0.05 / std::f64::consts::TAU / 0.5;
        assert!((spectra.frequency_hz[peak.expect("a bin")] - f).abs() < 2.0 * spectra.frequency_hz[1]);
    }
}
