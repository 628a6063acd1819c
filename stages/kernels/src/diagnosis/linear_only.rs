//! How far a linear model goes, whatever its order and however many inputs: for what no cause can extend.

use std::collections::BTreeMap;
use std::ops::Range;

use super::data::{LEAST_SAMPLES, Layout, Stretch};
use super::error::DiagnosisError;
use super::fit::{Blocks, Moments};
use super::lack_of_fit::{Misfit, RIDGE};
use super::ruling::{Grounds, Ruling, follows_output, high_band_variance, left_beyond_noise, left_repeating, repeats};
use super::verdict::{BaselineSummary, Diagnosis, Validation, Verdict};
use crate::Monitor;
use crate::pem::{Experiment, Focus, NoiseModel, PemOptions, identify};
use crate::spectra::period_samples;
use crate::validation::{Driven, Feedback, Nuisances, choose_order, feedback, simulate_held_out};

/// A linear model whose order the data chose, judged on samples that it was not fitted to.
#[derive(Debug, Clone, PartialEq)]
pub struct LinearOnly {
    /// Its order.
    pub order: usize,
    /// FIT on what was held out, per cent: `100 (1 - |y - simulated| / |y - mean|)`.
    pub fit_percent: f64,
    /// Root mean square of its error there.
    pub rms: f64,
    /// The same of the samples that it was fitted to.
    pub training_rms: f64,
    /// Variance of its error there beyond that of the noise, from where the system does not respond, over that of the
    /// output; none where too little was held out.
    pub beyond_noise: Option<f64>,
    /// Power of that error that repeats itself with the inputs over what noise leaves of it; none where they do not.
    pub repeats: Option<f64>,
    /// Whether each input follows the output; none where that cannot be tested.
    pub feedback: Vec<Option<Feedback>>,
    /// What static terms of inputs, output and rate of the output still predict of that error.
    pub misfit: Misfit,
    /// Its simulation of what was held out.
    pub simulated: Vec<f64>,
}

/// Orders that are tried: as many as `model.pem` tries by itself.
const MOST: usize = 16;
/// Samples that it is fitted to at most: as for the poles of the baselines, a second or two.
const SAMPLES: usize = 20_000;
/// Blocks of what was held out: the standard error of their gains is known to a tenth.
const BLOCKS: usize = 48;
/// FIT from which on the output follows from the inputs at all, per cent: below, nine tenths of the signal are left, at
/// which the baselines of causes count as none.
const FOLLOWS: f64 = 10.0;

impl LinearOnly {
    /// Whether it describes what was measured: the output follows from the inputs, no product of them predicts more
    /// than is tolerated, no input follows the output, and what was held out agrees.
    pub fn is_adequate(&self, tolerated: f64, false_alarm_rate: f64) -> bool {
        self.ruling(tolerated, false_alarm_rate).verdict == Verdict::Clean
    }

    /// What says that an input follows the output, in a sentence; none where nothing does.
    pub fn follows_output(&self, false_alarm_rate: f64) -> Option<String> {
        follows_output(&self.feedback, false_alarm_rate)
    }

    /// What says that it does not hold where it was not fitted, in a sentence; none where it does.
    pub(super) fn disagreement(&self) -> Option<String> {
        let (training, held_out) = (Some(self.training_rms.powi(2)), Some([self.rms.powi(2); 2]));
        Grounds { training, held_out, ..Grounds::default() }.disagreement()
    }

    fn ruling(&self, tolerated: f64, false_alarm_rate: f64) -> Ruling {
        let beyond = self.beyond_noise.and_then(left_beyond_noise);
        let against = beyond.into_iter().chain(self.repeats.and_then(left_repeating)).collect();
        let grounds = Grounds {
            adequate: self.fit_percent > FOLLOWS,
            systematic: self.misfit.is_systematic(tolerated),
            training: Some(self.training_rms.powi(2)),
            held_out: Some([self.rms.powi(2); 2]),
            against_clean: against,
            against_all: self.follows_output(false_alarm_rate).into_iter().collect(),
            ..Grounds::default()
        };
        grounds.ruling(&|_| None)
    }

    /// The verdict on it alone: no cause, whatever it says.
    ///
    /// `part`: name of what was held out.
    pub fn answer(&self, part: &str, unit: &str, tolerated: f64, false_alarm_rate: f64) -> Diagnosis {
        let Ruling { verdict, because, .. } = self.ruling(tolerated, false_alarm_rate);
        let adequate = verdict == Verdict::Clean;
        let noise = self.rms * (1.0 - self.misfit.share()).sqrt();
        Diagnosis {
            verdict,
            p_value: None,
            baseline: BaselineSummary {
                adequate,
                order: Some(self.order),
                parameters: BTreeMap::new(),
                noise_rms: Some(noise),
                distortion_rms: Some((self.rms.powi(2) - noise.powi(2)).max(0.0).sqrt()),
            },
            causes: Vec::new(),
            evidence: self.sentences(tolerated).into_iter().chain(because).collect(),
            nearest: Vec::new(),
            modes_before: Vec::new(),
            modes_after: Vec::new(),
            validation: vec![Validation {
                name: part.to_owned(),
                rms_before: Some(self.rms),
                rms_after: Some(self.rms),
                unit: unit.to_owned(),
            }],
            ladder: Vec::new(),
            false_alarm_rate,
        }
    }

    /// What to say about it.
    pub fn sentences(&self, tolerated: f64) -> Vec<String> {
        let predicted = format!(
            "products of inputs and output predict {:.1} % of the squared error there ({:.1} standard errors)",
            100.0 * self.misfit.share(),
            self.misfit.significance
        );
        let end = match (self.fit_percent > FOLLOWS, self.misfit.is_systematic(tolerated)) {
            (false, _) => "the output does not follow from the inputs by a linear model".to_owned(),
            (true, true) => format!("{predicted}: a linear model is not enough"),
            (true, false) if self.misfit.is_significant() => format!("{predicted}, which is tolerated"),
            (true, false) => format!("{predicted}, which may be chance"),
        };
        let fit = format!(
            "a linear model of order {}, chosen by the data that it was fitted to, has a FIT of {:.1} % on what was held out",
            self.order, self.fit_percent
        );
        vec![fit, end]
    }
}

/// What to learn from and what to judge on: a part that was named, else what follows, else the last third.
pub fn halves(learnt: Range<usize>, part: Option<Range<usize>>, samples: usize) -> (Range<usize>, Range<usize>) {
    let behind = learnt.end..samples;
    match part {
        Some(part) => (learnt, part),
        None if behind.len() >= learnt.len() / 3 && !learnt.is_empty() => (learnt, behind),
        None => {
            let cut = learnt.end - learnt.len() / 3;
            (learnt.start..cut, cut..learnt.end)
        }
    }
}

/// Fits a linear model to samples `learnt` and judges it on samples `held_out`.
///
/// # Model
/// That of [`identify`] without noise model, its order chosen by [`choose_order`] from `learnt` alone.
/// # Method
/// The error of the simulation over `held_out` is regressed, by folds of blocks, on linear terms alone and on these
/// with all products of two and three of the inputs, the simulated output and its rate, and their absolute values, each
/// as it is and through the model. What the products gain is the misfit. A linear system whose noise is independent of
/// the inputs leaves nothing to gain.
/// # Shapes
/// Inputs and output of equal length.
/// # Accuracy
/// See docs/results/input-output.md.
/// # Errors
/// Stretches beyond the data, too few samples for a fit, an output that does not move.
/// # Source
/// L. Ljung, System Identification, 2nd ed., 1999, section 16.5; S. A. Billings, W. S. F. Voon, Int. J. Control 44
/// (1986) 235.
pub fn linear_only(
    inputs: &[&[f64]],
    output: &[f64],
    learnt: Range<usize>,
    held_out: Range<usize>,
    interval_s: f64,
    monitor: &dyn Monitor,
) -> Result<LinearOnly, DiagnosisError> {
    let wrong = |_| DiagnosisError::NoBaseline;
    let cut = |name: &str, range: Range<usize>| -> Result<(Vec<f64>, &[f64]), DiagnosisError> {
        let (Range { start: first, end }, samples) = (range.clone(), output.len());
        let parts: Option<Vec<&[f64]>> = inputs.iter().map(|u| u.get(range.clone())).collect();
        match parts.zip(output.get(range)) {
            Some((u, y)) if y.len() >= LEAST_SAMPLES => Ok((u.concat(), y)),
            _ => Err(DiagnosisError::Part { name: name.to_owned(), first, end, samples, least: LEAST_SAMPLES }),
        }
    };
    let learnt = learnt.start..learnt.end.min(learnt.start + SAMPLES);
    let (u, y) = cut("training", learnt.clone())?;
    let experiment = Experiment { input: &u, output: y };
    let options = PemOptions {
        block_rows: 2 * MOST + 4,
        noise: NoiseModel::White,
        focus: Focus::Simulation,
        starts: 4,
        offset: true,
        drift: false,
        ..PemOptions::default()
    };
    let choice = choose_order(experiment, interval_s, MOST, &options, monitor).map_err(wrong)?;
    let options = PemOptions { order: choice.order, ..options };
    let fit = identify(&[experiment], interval_s, &options).map_err(wrong)?;
    let apart = held_out.end <= learnt.start || learnt.end <= held_out.start;
    let (learnt_u, learnt_y) = (u, y);
    let (u, y) = cut("held out", held_out)?;
    let nuisances = Nuisances { offset: true, slope: false };
    let simulation = simulate_held_out(&fit.model, &fit.further_inputs, &u, y, nuisances).map_err(wrong)?;
    let simulated = simulation.response;
    let error: Vec<f64> = y.iter().zip(&simulated).map(|(y, s)| if y.is_finite() { y - s } else { 0.0 }).collect();
    let through = |term: &[f64]| fit.model.simulate(term, &vec![0.0; fit.model.order()]).unwrap_or_default();
    let misfit = bent(&u, &simulated, &error, &through);
    let rms = (error.iter().map(|e| e * e).sum::<f64>() / error.len().max(1) as f64).sqrt();
    let mean = y.iter().sum::<f64>() / y.len().max(1) as f64;
    let variance = y.iter().map(|y| (y - mean).powi(2)).sum::<f64>() / y.len().max(1) as f64;
    let beyond = |noise: f64| (rms * rms - noise).max(0.0) / variance.max(f64::MIN_POSITIVE);
    let all: Vec<&[f64]> = u.chunks(y.len().max(1)).collect();
    let left = fit.residuals.iter().flatten().filter(|e| e.is_finite());
    let (sum, count) = left.fold((0.0, 0.0), |(sum, count), e| (sum + e * e, count + 1.0));
    let residual = fit.residuals.first().map_or(&[][..], Vec::as_slice);
    let made = learnt_y.iter().enumerate().map(|(k, y)| y - residual.get(k).copied().unwrap_or(f64::NAN)).collect();
    let mut runs = vec![Run::new(learnt_u, learnt_y, made)];
    // samples that were fitted and judged count once
    if apart {
        runs.push(Run::new(u.clone(), y, simulated.clone()));
    }
    Ok(LinearOnly {
        feedback: follows(inputs.len(), &runs),
        order: fit.model.order(),
        fit_percent: simulation.fit_percent,
        rms,
        training_rms: (sum / f64::max(count, 1.0)).sqrt(),
        beyond_noise: high_band_variance(&error).map(beyond),
        repeats: period_samples(&all).and_then(|period| repeats(&error, period)),
        misfit,
        simulated,
    })
}

/// What a model makes of inputs one after the other, and what that leaves of an output.
struct Run {
    inputs: Vec<f64>,
    response: Vec<f64>,
    left: Vec<f64>,
}

impl Run {
    fn new(inputs: Vec<f64>, output: &[f64], response: Vec<f64>) -> Self {
        let left = output.iter().zip(&response).map(|(y, made)| y - made).collect();
        Self { inputs, response, left }
    }
}

/// Tests of each of so many inputs for feedback.
fn follows(inputs: usize, runs: &[Run]) -> Vec<Option<Feedback>> {
    let one = |which: usize| {
        let split = |run: &Run| -> (Vec<f64>, Vec<Vec<f64>>) {
            let mut all: Vec<Vec<f64>> = run.inputs.chunks(run.left.len().max(1)).map(<[f64]>::to_vec).collect();
            (all.remove(which), all)
        };
        let split: Vec<(Vec<f64>, Vec<Vec<f64>>)> = runs.iter().map(split).collect();
        let others: Vec<Vec<&[f64]>> = split.iter().map(|(_, u)| u.iter().map(Vec::as_slice).collect()).collect();
        let driven: Vec<Driven<'_>> = runs
            .iter()
            .zip(split.iter().zip(&others))
            .map(|(run, ((input, _), others))| Driven { input, others, response: &run.response, left: &run.left })
            .collect();
        feedback(&driven)
    };
    (0..inputs).map(one).collect()
}

/// What products of inputs, output and rate predict of an error beyond what they themselves do.
fn bent(u: &[f64], simulated: &[f64], error: &[f64], through: &dyn Fn(&[f64]) -> Vec<f64>) -> Misfit {
    let samples = error.len();
    let rate: Vec<f64> =
        (0..samples).map(|k| simulated[k] - if k > 0 { simulated[k - 1] } else { simulated[0] }).collect();
    let mut signals: Vec<Vec<f64>> = u.chunks(samples.max(1)).map(<[f64]>::to_vec).collect();
    signals.extend([simulated.to_vec(), rate]);
    for signal in &mut signals {
        let largest = signal.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        signal.iter_mut().for_each(|v| *v /= largest.max(f64::MIN_POSITIVE));
    }
    let mut columns = vec![vec![1.0; samples]];
    for signal in &signals {
        columns.push(signal.clone());
        columns.push(through(signal));
        // a delay that the model has not
        columns.push((0..samples).map(|k| if k > 0 { signal[k - 1] } else { 0.0 }).collect());
    }
    let layout = Layout::new(&[Stretch { record: 0, first: 0, end: samples }], 1);
    let blocks = Blocks::new(&layout, BLOCKS.min(samples / 4).max(1));
    let linear = Moments::new(&columns, error, &blocks).held_out(RIDGE);
    for term in products(&signals) {
        let mut passed = through(&term);
        let largest = passed.iter().fold(0.0, |most: f64, v| most.max(v.abs()));
        passed.iter_mut().for_each(|v| *v /= largest.max(f64::MIN_POSITIVE));
        columns.extend([term, passed]);
    }
    let after = Moments::new(&columns, error, &blocks).held_out(RIDGE);
    Misfit::between(&linear, &after)
}

/// Products of two and of three signals, and their absolute values.
fn products(signals: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let times = |a: &[f64], b: &[f64]| -> Vec<f64> { a.iter().zip(b).map(|(a, b)| a * b).collect() };
    let mut terms: Vec<Vec<f64>> = signals.iter().map(|s| s.iter().map(|v| v.abs()).collect()).collect();
    for (i, a) in signals.iter().enumerate() {
        for (j, b) in signals.iter().enumerate().skip(i) {
            let pair = times(a, b);
            terms.extend(signals.iter().skip(j).map(|c| times(&pair, c)));
            terms.push(pair);
        }
    }
    terms
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Unwatched;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    const SAMPLES: usize = 3000;

    /// Two inputs through two resonances, seen by a sensor that bends by `square` times the square of what it sees.
    fn system(seed: u64, square: f64) -> (Vec<f64>, Vec<f64>, Vec<f64>) {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut white = || -> f64 { StandardNormal.sample(&mut rng) };
        let (u, v): (Vec<f64>, Vec<f64>) = (0..SAMPLES).map(|_| (white(), white())).unzip();
        let (mut a, mut b) = ([0.0; 2], [0.0; 2]);
        let mut output = Vec::with_capacity(SAMPLES);
        for k in 0..SAMPLES {
            let seen: f64 = a[0] + b[0];
            output.push(seen + square * seen * seen + 0.3 * white());
            let next = 1.6 * a[0] - 0.9 * a[1] + 0.5 * u[k] + 0.2 * v[k];
            a = [next, a[0]];
            let next = 0.9 * b[0] - 0.8 * b[1] + v[k] - 0.4 * u[k];
            b = [next, b[0]];
        }
        (u, v, output)
    }

    fn judged(seed: u64, square: f64) -> LinearOnly {
        let (u, v, output) = system(seed, square);
        let half = SAMPLES / 2;
        linear_only(&[&u, &v], &output, 0..half, half..SAMPLES, 1.0, &Unwatched).expect("a model")
    }

    /// A disturbance that wanders, of a tenth of the output's variance.
    #[test]
    fn what_is_left_beyond_noise_is_no_clean_record() {
        for seed in 0..4 {
            let (u, v, mut output) = system(seed, 0.0);
            let mean_square = output.iter().map(|y| y * y).sum::<f64>() / SAMPLES as f64;
            let mut rng = ChaCha8Rng::seed_from_u64(90 + seed);
            let mut wander = 0.0;
            for y in &mut output {
                let white: f64 = StandardNormal.sample(&mut rng);
                wander = 0.95 * wander + (0.1 * mean_square * (1.0 - 0.95 * 0.95)).sqrt() * white;
                *y += wander;
            }
            let half = SAMPLES / 2;
            let found = linear_only(&[&u, &v], &output, 0..half, half..SAMPLES, 1.0, &Unwatched).expect("a model");
            assert!(found.fit_percent > 50.0 && !found.is_adequate(0.25, 0.01), "{seed}: {found:?}");
            let answer = found.answer("held out", "V", 0.25, 0.01);
            assert!(answer.evidence.iter().any(|line| line.contains("beyond the noise")), "{:?}", answer.evidence);
        }
    }

    /// One input that a controller makes of a sensor's noise and all, beside one from outside.
    #[test]
    fn an_input_that_follows_the_output_is_no_clean_record() {
        for seed in 0..4 {
            let mut rng = ChaCha8Rng::seed_from_u64(300 + seed);
            let mut white = || -> f64 { StandardNormal.sample(&mut rng) };
            let (mut a, mut reference) = ([0.0; 2], 0.0);
            let (mut u, mut v, mut output) = (Vec::new(), Vec::new(), Vec::new());
            for _ in 0..SAMPLES {
                let seen = a[0] + 0.3 * white();
                reference = 0.9 * reference + 0.4 * white();
                output.push(seen);
                u.push(reference - 0.3 * seen);
                v.push(white());
                let next = 1.6 * a[0] - 0.9 * a[1] + 0.5 * u[u.len() - 1] + 0.2 * v[v.len() - 1];
                a = [next, a[0]];
            }
            let half = SAMPLES / 2;
            let found = linear_only(&[&u, &v], &output, 0..half, half..SAMPLES, 1.0, &Unwatched).expect("a model");
            let level = 0.01;
            assert!(!found.is_adequate(0.25, level) && found.is_adequate(0.25, 0.0), "{seed}: {found:?}");
            let answer = found.answer("held out", "V", 0.25, level);
            assert!(answer.evidence.iter().any(|line| line.starts_with("the input follows")), "{:?}", answer.evidence);
        }
    }

    #[test]
    fn linear_systems_of_two_inputs_are_adequate_and_a_bent_sensor_is_seen() {
        for seed in 0..6 {
            let linear = judged(seed, 0.0);
            assert!(linear.is_adequate(0.25, 0.01), "{seed}: {linear:?}");
            // noise of 0.3 beside a signal of about 3
            assert!(linear.fit_percent > 80.0 && (4..=6).contains(&linear.order), "{seed}: {linear:?}");
            let bent = judged(seed, 0.04);
            assert!(!bent.is_adequate(0.25, 0.01), "{seed}: {:?} {}", bent.misfit, bent.fit_percent);
        }
    }
}
