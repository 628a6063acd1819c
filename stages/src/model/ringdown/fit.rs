//! The joint fit, from records to estimates.

use faer::{Mat, c64};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;

use super::compressed::{Compressed, compress, whiten};
use super::estimate::{Ringdown, RingdownVerdict};
use super::modal_form::{EventParameters, Exponential, columns, shared, signal, weights};
use super::noise::{RingdownNoise, ThermalMode, Wander};
use super::normal::{EventBlock, Freedom, Prior, blocks, symmetric_inverse};
use super::search::{Point, assembled, search};
use super::start::{amplitudes, start};
use super::whitener::Whitener;
use super::whittle::{expected_parts, hann, mean_periodogram, summed_periodograms, variances};
use crate::model::error::{ModelError, finite};
use crate::model::orthogonal::cholesky;

/// What is fitted, and how.
#[derive(Debug, Clone, PartialEq)]
pub struct RingdownOptions {
    /// Oscillating modes, at least 1; default 4, the paper's.
    pub modes: usize,
    /// Real poles of the detector, default 3, the paper's.
    pub real_poles: usize,
    /// Rows of the Hankel matrix of the start; default 100: a period of the slowest mode.
    pub block_rows: usize,
    /// Where the noise's variances come from; default: estimated.
    pub noise: NoiseSource,
    /// Estimate a linear drift of each event beside its offset; default true.
    pub slope: bool,
    /// Relative standard deviation of what is known beforehand of a real pole; default 0.5. They hardly show in what follows the first samples.
    pub real_pole_std: f64,
    /// Draws of the bootstrap over events, default 0: none.
    pub bootstrap_draws: usize,
    /// Seed of those draws.
    pub bootstrap_seed: u64,
    /// Start from these exponentials instead of the Hankel matrix; default none. Their number replaces `modes` and `real_poles`.
    pub start: Option<Vec<Exponential>>,
    /// Make the start from this many first samples of the events' mean, each event's level and drift from the second half of its window;
    /// default none: from the whole mean, no drift at the start. For ringing that fills a small part of the window, like a coupled lever's.
    pub start_samples: Option<usize>,
}

impl Default for RingdownOptions {
    fn default() -> Self {
        Self {
            modes: 4,
            real_poles: 3,
            block_rows: 100,
            noise: NoiseSource::Estimated,
            slope: true,
            real_pole_std: 0.5,
            bootstrap_draws: 0,
            bootstrap_seed: 1,
            start: None,
            start_samples: None,
        }
    }
}

/// Where the noise model comes from.
#[derive(Debug, Clone, PartialEq)]
pub enum NoiseSource {
    /// White noise, its variance from the residuals.
    White,
    /// White, 1/f and thermal noise of every mode, variances from residuals and free stretches.
    Estimated,
    /// Given.
    Known(RingdownNoise),
}

/// Outer rounds: each takes the basis to the present poles.
const ROUNDS: usize = 12;
/// Standard errors that count as arrived.
const ARRIVED: f64 = 1e-3;
/// The same for a draw of the bootstrap, whose scatter is of one standard error.
const BOOTSTRAP_ARRIVED: f64 = 1e-2;
/// Rounds of noise estimation: the third changes variances by less than their own errors.
const NOISE_ROUNDS: usize = 3;
/// Events below which their scatter says too little.
const SANDWICH_EVENTS: usize = 8;

/// Fits one set of exponentials to several ringdowns at once.
///
/// # Model
/// `y_e(k) = a_e sum_j Re(rho_j exp(s_j (k T - t_e))) + c_e + d_e k + n(k)`: poles and residues shared, amplitude, sub-sample onset, offset
/// and slope each event's own, `n` of a [`RingdownNoise`].
/// # Method
/// Maximum likelihood. Records are whitened exactly ([`RingdownNoise`]'s Kalman filter), projected on the three dozen directions that
/// the shape can reach, and fitted there by Levenberg-Marquardt with the events' own parameters eliminated; noise variances by a
/// Whittle likelihood of the residuals with what the fit absorbed added back (restricted likelihood), fit and noise in turns.
/// # Shapes
/// `events`: E records of equal length, each from the first sample after its release on; `free`: stretches of noise alone, any length.
/// # Units
/// Volts, seconds, rad/s.
/// # Accuracy
/// The Cramer-Rao bound within a few per cent (docs/accuracy.md). About 3 ms per record of 8192 samples and noise round on one core.
/// # Errors
/// No event, unequal lengths, values that are not finite, too few samples, no oscillation.
/// # Source
/// S. M. Kay, Fundamentals of Statistical Signal Processing I, 1993, chapter 7; G. H. Golub, V. Pereyra, SIAM J. Numer. Anal. 10 (1973) 413;
/// D. A. Harville, J. Am. Stat. Assoc. 72 (1977) 320 (restricted likelihood).
pub fn fit_ringdowns(
    events: &[&[f64]],
    free: &[&[f64]],
    interval_s: f64,
    options: &RingdownOptions,
) -> Result<Ringdown, ModelError> {
    let samples = check(events, free, interval_s, options)?;
    let mut point = first_guess(events, interval_s, options)?;
    let freedom = freedom(&point.exponentials, options);
    let mut noise = RingdownNoise::white(white_variance(events));
    let mut fitted = Fitted::of(events, interval_s, &noise, &mut point, &freedom, samples)?;
    match &options.noise {
        NoiseSource::White => {
            let used = fitted.used(&freedom);
            let excess = fitted.chi_square() / (events.len() * samples).saturating_sub(used).max(1) as f64;
            noise.white *= excess;
            fitted.rescale(excess);
        }
        NoiseSource::Known(known) => {
            noise = known.clone();
            fitted = Fitted::of(events, interval_s, &noise, &mut point, &freedom, samples)?;
        }
        NoiseSource::Estimated => {
            for round in 0..NOISE_ROUNDS {
                let absorbed = if round == 0 { None } else { Some(&fitted) };
                noise = estimated(events, free, interval_s, &point, &noise, absorbed, &freedom);
                fitted = Fitted::of(events, interval_s, &noise, &mut point, &freedom, samples)?;
            }
        }
    }
    let draws = bootstrap(&fitted, &point, &freedom, options);
    fitted.result(events, interval_s, point, noise, &freedom).map(|result| Ringdown { bootstrap: draws, ..result })
}

fn check(events: &[&[f64]], free: &[&[f64]], interval_s: f64, options: &RingdownOptions) -> Result<usize, ModelError> {
    let Some(first) = events.first() else { return Err(ModelError::NoExperiment) };
    let samples = first.len();
    let wanted = 8 * (options.modes + options.real_poles + 2);
    if samples < wanted {
        return Err(ModelError::TooShort { found: samples, wanted });
    }
    for event in events {
        if event.len() != samples {
            return Err(ModelError::Length { what: "event", found: event.len(), wanted: samples });
        }
        finite("event", event)?;
    }
    for stretch in free {
        finite("free stretch", stretch)?;
    }
    if !(interval_s > 0.0 && interval_s.is_finite()) {
        return Err(ModelError::Parameter { name: "interval_s", found: interval_s, wanted: "above 0" });
    }
    if options.start_samples.is_some_and(|count| count < wanted) {
        let found = options.start_samples.unwrap_or(0);
        return Err(ModelError::TooShort { found, wanted });
    }
    if options.modes == 0 && options.start.is_none() {
        return Err(ModelError::Parameter { name: "modes", found: 0.0, wanted: "at least 1" });
    }
    Ok(samples)
}

/// Noise that is white at the highest frequencies: second differences of the quieter half.
fn white_variance(events: &[&[f64]]) -> f64 {
    let (mut sum, mut count) = (0.0, 0usize);
    for event in events {
        for w in event[event.len() / 2..].windows(3) {
            sum += (w[0] - 2.0 * w[1] + w[2]).powi(2);
            count += 1;
        }
    }
    (sum / (6.0 * count.max(1) as f64)).max(f64::MIN_POSITIVE)
}

/// Exponentials of the mean, and each event's share of it.
fn first_guess(events: &[&[f64]], interval_s: f64, options: &RingdownOptions) -> Result<Point, ModelError> {
    let samples = events[0].len();
    let mean: Vec<f64> = (0..samples).map(|k| events.iter().map(|e| e[k]).sum::<f64>() / events.len() as f64).collect();
    if mean.iter().all(|v| *v == mean[0]) {
        return Err(ModelError::ConstantOutput);
    }
    let early: Vec<f64> = match options.start_samples {
        Some(count) => {
            let line = line_of_second_half(&mean);
            mean.iter().zip(&line.values(samples)).map(|(y, l)| y - l).take(count).collect()
        }
        None => mean,
    };
    let exponentials = match &options.start {
        Some(given) => {
            let mut given = given.clone();
            amplitudes(&mut given, &early, interval_s);
            given
        }
        None => start(&early, interval_s, options.modes, options.real_poles, options.block_rows)?,
    };
    let tail = samples - samples / 4;
    let shape = {
        let unit = EventParameters { amplitude: 1.0, onset_s: 0.0, offset: 0.0, slope: 0.0 };
        signal(&exponentials, &unit, interval_s, samples)
    };
    let own = events
        .iter()
        .map(|event| {
            let line = if options.start_samples.is_some() && options.slope {
                line_of_second_half(event)
            } else {
                Line { offset: event[tail..].iter().sum::<f64>() / (samples - tail) as f64, slope: 0.0 }
            };
            let (mut up, mut down) = (0.0, 0.0);
            for ((y, l), s) in event.iter().zip(line.values(samples)).zip(&shape) {
                up += (y - l) * s;
                down += s * s;
            }
            let amplitude = up / down.max(f64::MIN_POSITIVE);
            EventParameters { amplitude, onset_s: 0.0, offset: line.offset, slope: line.slope }
        })
        .collect();
    Ok(Point { exponentials, events: own })
}

/// Level in the middle of a window and its change over half of it, V.
struct Line {
    offset: f64,
    slope: f64,
}

impl Line {
    fn values(&self, samples: usize) -> Vec<f64> {
        let centre = 0.5 * (samples.max(2) - 1) as f64;
        (0..samples).map(|k| self.offset + self.slope * (k as f64 - centre) / centre).collect()
    }
}

/// The least-squares line through the second half of a window.
fn line_of_second_half(values: &[f64]) -> Line {
    let (samples, first) = (values.len(), values.len() / 2);
    let centre = 0.5 * (samples.max(2) - 1) as f64;
    let count = (samples - first) as f64;
    let x: Vec<f64> = (first..samples).map(|k| (k as f64 - centre) / centre).collect();
    let (mean_x, mean_y) = (x.iter().sum::<f64>() / count, values[first..].iter().sum::<f64>() / count);
    let up: f64 = x.iter().zip(&values[first..]).map(|(x, y)| (x - mean_x) * (y - mean_y)).sum();
    let down: f64 = x.iter().map(|x| (x - mean_x).powi(2)).sum();
    let slope = up / down.max(f64::MIN_POSITIVE);
    Line { offset: mean_y - slope * mean_x, slope }
}

/// Everything but the residue of the strongest mode, which fixes scale and time of the shape.
fn freedom(exponentials: &[Exponential], options: &RingdownOptions) -> Freedom {
    let strongest = exponentials
        .iter()
        .enumerate()
        .filter(|(_, e)| e.oscillates())
        .max_by(|a, b| a.1.residue.norm().total_cmp(&b.1.residue.norm()))
        .map_or(0, |(i, _)| i);
    let (mut shared, mut priors, mut first) = (Vec::new(), Vec::new(), 0);
    for (i, e) in exponentials.iter().enumerate() {
        let count = e.parameters();
        let free = if i == strongest { count / 2 } else { count };
        shared.extend(first..first + free);
        priors.extend((0..count).map(|k| {
            (!e.oscillates() && k == 0 && options.real_pole_std.is_finite())
                .then(|| Prior { mean: e.pole.re, std: options.real_pole_std * e.pole.re.abs() })
        }));
        first += count;
    }
    let own = if options.slope { vec![0, 1, 2, 3] } else { vec![0, 1, 2] };
    Freedom { shared, priors, own }
}

/// A fit under one noise model.
struct Fitted {
    data: Compressed,
    reference: Vec<Exponential>,
    blocks: Vec<EventBlock>,
    covariance: Mat<f64>,
    verdict: RingdownVerdict,
    events: Vec<EventParameters>,
}

impl Fitted {
    fn of(
        events: &[&[f64]],
        interval_s: f64,
        noise: &RingdownNoise,
        point: &mut Point,
        freedom: &Freedom,
        samples: usize,
    ) -> Result<Self, ModelError> {
        let whitener = Whitener::new(noise, interval_s, samples);
        let mut whitened: Vec<Vec<f64>> = events.iter().map(|event| event.to_vec()).collect();
        whiten(&whitener, &mut whitened);
        let mut verdict = RingdownVerdict { converged: false, distance: f64::INFINITY, steps: 0 };
        for round in 0..ROUNDS {
            let reference = point.exponentials.clone();
            let data = compress(&whitener, &reference, &whitened, interval_s);
            let before = shared(&point.exponentials);
            let found = search(&data, &reference, point, freedom, ARRIVED);
            verdict.steps += found.steps;
            let parts = blocks(&data, &reference, &point.exponentials, &point.events, freedom, 0.0);
            let values = shared(&point.exponentials);
            let (information, _) = assembled(&parts, freedom, &values);
            // how far this round went: the basis is exact to the third order of it
            let moved: Vec<f64> = freedom.shared.iter().map(|&i| values[i] - before[i]).collect();
            let distance = (0..moved.len())
                .map(|i| (0..moved.len()).map(|j| moved[i] * information[(i, j)] * moved[j]).sum::<f64>())
                .sum::<f64>()
                .max(0.0)
                .sqrt();
            verdict.distance = found.distance;
            verdict.converged = distance < 1.0 && found.distance < ARRIVED;
            if verdict.converged || round + 1 == ROUNDS {
                let covariance = symmetric_inverse(&information);
                if (0..moved.len()).any(|i| !covariance[(i, i)].is_finite()) {
                    return Err(ModelError::Degenerate("no finite covariance"));
                }
                let events = point.events.clone();
                return Ok(Self { data, reference, blocks: parts, covariance, verdict, events });
            }
        }
        Err(ModelError::Degenerate("no round was made"))
    }

    /// The same fit under `excess` times the white noise's variance.
    fn rescale(&mut self, excess: f64) {
        let grow = |matrix: &Mat<f64>, factor: f64| {
            Mat::from_fn(matrix.nrows(), matrix.ncols(), |i, j| factor * matrix[(i, j)])
        };
        self.covariance = grow(&self.covariance, excess);
        self.data.rest.iter_mut().for_each(|rest| *rest /= excess);
        for block in &mut self.blocks {
            block.cost /= excess;
            block.own_inverse = grow(&block.own_inverse, excess);
            block.information = grow(&block.information, 1.0 / excess);
            block.score.iter_mut().for_each(|score| *score /= excess);
        }
    }

    fn used(&self, freedom: &Freedom) -> usize {
        freedom.shared.len() + self.blocks.len() * freedom.own.len()
    }

    fn chi_square(&self) -> f64 {
        self.blocks.iter().map(|block| block.cost).sum::<f64>() + self.data.rest.iter().sum::<f64>()
    }

    fn result(
        self,
        events: &[&[f64]],
        interval_s: f64,
        point: Point,
        noise: RingdownNoise,
        freedom: &Freedom,
    ) -> Result<Ringdown, ModelError> {
        let samples = events.first().map_or(0, |event| event.len());
        let degrees = (self.blocks.len() * samples).saturating_sub(self.used(freedom)).max(1);
        let total = shared(&point.exponentials).len();
        let spread = |inner: &Mat<f64>| {
            let mut full = Mat::<f64>::zeros(total, total);
            for (i, &p) in freedom.shared.iter().enumerate() {
                for (j, &q) in freedom.shared.iter().enumerate() {
                    full[(p, q)] = inner[(i, j)];
                }
            }
            full
        };
        let sandwich = (self.blocks.len() >= SANDWICH_EVENTS).then(|| {
            let n = freedom.shared.len();
            let mut scores = Mat::<f64>::zeros(n, n);
            let count = self.blocks.len() as f64;
            for block in &self.blocks {
                for i in 0..n {
                    for j in 0..n {
                        scores[(i, j)] += block.score[i] * block.score[j] * count / (count - 1.0);
                    }
                }
            }
            spread(&(&self.covariance * scores * &self.covariance))
        });
        let taper = hann(samples);
        let mut expected = vec![0.0; samples / 2 + 1];
        for (part, variance) in expected_parts(&noise, interval_s, &taper).iter().zip(noise.variances()) {
            expected.iter_mut().zip(part).for_each(|(e, p)| *e += variance * p);
        }
        let absorbed = self.absorbed(&point.exponentials, freedom, interval_s, &taper);
        expected.iter_mut().zip(absorbed).for_each(|(e, a)| *e = (*e - a).max(0.0));
        let residual_periodogram = mean_periodogram(&residuals(events, &point, interval_s), &taper);
        let density = |values: Vec<f64>| values.into_iter().map(|v| 2.0 * interval_s * v).collect::<Vec<f64>>();
        Ok(Ringdown {
            bootstrap: Vec::new(),
            event_std: self.event_std(freedom),
            frequency_hz: (0..=samples / 2).map(|k| k as f64 / (samples as f64 * interval_s)).collect(),
            residual_periodogram: density(residual_periodogram),
            expected_periodogram: density(expected),
            covariance: spread(&self.covariance),
            sandwich,
            reduced_chi_square: self.chi_square() / degrees as f64,
            freedom: degrees,
            noise,
            verdict: self.verdict,
            exponentials: point.exponentials,
            events: point.events,
        })
    }

    /// Standard errors of the events' own parameters, those of the shared ones included.
    fn event_std(&self, freedom: &Freedom) -> Vec<EventParameters> {
        self.blocks
            .iter()
            .map(|block| {
                let mut std = [0.0; 4];
                let shared = &block.coupling * &self.covariance * block.coupling.transpose();
                for (k, &parameter) in freedom.own.iter().enumerate() {
                    std[parameter] = (block.own_inverse[(k, k)] + shared[(k, k)]).max(0.0).sqrt();
                }
                EventParameters { amplitude: std[0], onset_s: std[1], offset: std[2], slope: std[3] }
            })
            .collect()
    }

    /// Mean tapered periodogram of what the fit has absorbed of the noise, per event.
    fn absorbed(&self, exponentials: &[Exponential], freedom: &Freedom, interval_s: f64, taper: &[f64]) -> Vec<f64> {
        let count = self.events.len();
        // an event of mean amplitude stands for all: the absorbed part depends on it through its square
        let amplitude = (self.events.iter().map(|e| e.amplitude * e.amplitude).sum::<f64>() / count as f64).sqrt();
        let typical = self
            .events
            .iter()
            .enumerate()
            .min_by(|a, b| (a.1.amplitude.abs() - amplitude).abs().total_cmp(&(b.1.amplitude.abs() - amplitude).abs()))
            .map_or(0, |(i, _)| i);
        let block = &self.blocks[typical];
        let w = weights(&self.reference, exponentials, &self.events[typical]);
        let width = w.value.len();
        let mut directions: Vec<Vec<f64>> = Vec::new();
        let shared_root = cholesky(&self.covariance);
        for j in 0..freedom.shared.len() {
            let mut direction = vec![0.0; width];
            for (i, &parameter) in freedom.shared.iter().enumerate().skip(j) {
                let factor = shared_root[(i, j)];
                for (c, (direction, shared)) in direction.iter_mut().zip(&w.shared[parameter]).enumerate() {
                    let own: f64 =
                        freedom.own.iter().enumerate().map(|(k, &o)| w.own[o][c] * block.coupling[(k, i)]).sum();
                    *direction += factor * (shared - own);
                }
            }
            directions.push(direction);
        }
        let own_root = cholesky(&block.own_inverse);
        for j in 0..freedom.own.len() {
            let mut direction = vec![0.0; width];
            for (i, &o) in freedom.own.iter().enumerate().skip(j) {
                (0..width).for_each(|c| direction[c] += own_root[(i, j)] * w.own[o][c]);
            }
            directions.push(direction);
        }
        let basis = columns(&self.reference, interval_s, taper.len());
        let signals: Vec<Vec<f64>> = directions
            .iter()
            .map(|direction| {
                let mut signal = vec![0.0; taper.len()];
                for (column, factor) in basis.iter().zip(direction) {
                    signal.iter_mut().zip(column).for_each(|(s, c)| *s += factor * c);
                }
                signal
            })
            .collect();
        summed_periodograms(&signals, taper)
    }
}

/// Thermal motion of every mode and a ladder of wander from the window's own frequency upwards, a decade apart.
fn parts_of(exponentials: &[Exponential], white: f64, interval_s: f64, samples: usize) -> RingdownNoise {
    let lowest = std::f64::consts::TAU / (samples as f64 * interval_s);
    let highest = 0.5 / interval_s;
    let wander = (0..12)
        .map(|decade| lowest * 10f64.powi(decade))
        .take_while(|rate| *rate < highest)
        .map(|rate_per_s| Wander { rate_per_s, variance: 0.0 })
        .collect();
    let thermal = exponentials
        .iter()
        .filter(|e| e.oscillates())
        .map(|e| ThermalMode { pole: c64::new(e.pole.re, e.pole.im), variance: 0.0 })
        .collect();
    RingdownNoise { white, thermal, wander }
}

/// Shared parameters of fits to events drawn with replacement, noise model and weights held.
///
/// Method: compressed events are drawn, not records, so that a draw costs a few steps of the search. Source: B. Efron, Ann. Stat. 7 (1979) 1.
fn bootstrap(fitted: &Fitted, point: &Point, freedom: &Freedom, options: &RingdownOptions) -> Vec<Vec<f64>> {
    let count = point.events.len();
    let draw = |number: usize| {
        let mut rng = ChaCha8Rng::seed_from_u64(options.bootstrap_seed);
        rng.set_stream(number as u64);
        let chosen: Vec<usize> = (0..count).map(|_| rng.random_range(0..count)).collect();
        let data = Compressed {
            r: fitted.data.r.clone(),
            projections: chosen.iter().map(|&i| fitted.data.projections[i].clone()).collect(),
            rest: chosen.iter().map(|&i| fitted.data.rest[i]).collect(),
        };
        let mut drawn = Point {
            exponentials: point.exponentials.clone(),
            events: chosen.iter().map(|&i| point.events[i]).collect(),
        };
        search(&data, &fitted.reference, &mut drawn, freedom, BOOTSTRAP_ARRIVED);
        shared(&drawn.exponentials)
    };
    (0..options.bootstrap_draws).into_par_iter().map(draw).collect()
}

/// Events less their fits.
fn residuals(events: &[&[f64]], point: &Point, interval_s: f64) -> Vec<Vec<f64>> {
    events
        .iter()
        .zip(&point.events)
        .map(|(y, own)| {
            let fitted = signal(&point.exponentials, own, interval_s, y.len());
            y.iter().zip(fitted).map(|(y, s)| y - s).collect()
        })
        .collect()
}

fn estimated(
    events: &[&[f64]],
    free: &[&[f64]],
    interval_s: f64,
    point: &Point,
    last: &RingdownNoise,
    absorbed: Option<&Fitted>,
    freedom: &Freedom,
) -> RingdownNoise {
    let samples = events[0].len();
    let parts = parts_of(&point.exponentials, last.white, interval_s, samples);
    let taper = hann(samples);
    let residuals = residuals(events, point, interval_s);
    let mut observed = mean_periodogram(&residuals, &taper);
    if let Some(fitted) = absorbed {
        let missing = fitted.absorbed(&point.exponentials, freedom, interval_s, &taper);
        observed.iter_mut().zip(missing).for_each(|(o, m)| *o += m);
    }
    let stretches: Vec<Vec<f64>> = free
        .iter()
        .flat_map(|stretch| stretch.chunks_exact(samples))
        .map(|chunk| {
            let mean = chunk.iter().sum::<f64>() / samples as f64;
            chunk.iter().map(|v| v - mean).collect()
        })
        .collect();
    if !stretches.is_empty() {
        // events and stretches count by their number
        let (own, other) = (residuals.len() as f64, stretches.len() as f64);
        let quiet = mean_periodogram(&stretches, &taper);
        observed.iter_mut().zip(quiet).for_each(|(o, q)| *o = (own * *o + other * q) / (own + other));
    }
    let unit = expected_parts(&parts, interval_s, &taper);
    let mean = observed.iter().skip(1).sum::<f64>() / (observed.len() - 1) as f64;
    let first: Vec<f64> = unit
        .iter()
        .enumerate()
        .map(|(i, part)| {
            let peak = part.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
            if i == 0 { last.white.min(mean) } else { 0.1 * mean / peak }
        })
        .collect();
    let mut values = variances(&observed, &unit, &first);
    // without white noise the filter has no floor: rounding of the records is always there
    values[0] = values[0].max(1e-6 * mean);
    parts.with_variances(&values)
}
