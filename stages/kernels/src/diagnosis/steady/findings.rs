//! From samples to what the answer is made of.

use super::blocks::{Blocks, HARMONICS, Mean};
use super::checks::{p_values, ripple, scaled, steady, training};
use super::choice::{Judged, Measured, tied};
use super::curves::Curve;
use super::judged_lines::JudgedFamily;
use super::lines::{Lines, lines};
use super::phase::{Track, track};
use super::{NotSteady, SteadyOptions};

/// Share of the harmonics, in amplitude, that a named curve may leave, and that may be in quadrature: 11 degrees,
/// what a lag of the detector or a gain that the light modulates makes.
const TOLERATED: f64 = 0.2;
/// Standard errors below which nothing is a strength.
const STRENGTH: f64 = 3.0;
/// Harmonics below this share of the fundamental are the filter's and rounding.
const RESOLVED: f64 = 1e-8;

/// What is concluded about the harmonics.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Harmonics {
    /// None beyond noise.
    Clean,
    /// The judged curve of this place makes them.
    Named(usize),
    /// Not those of a static curve.
    OwnMotion,
    /// No allowed curve.
    Unknown,
}

/// All that the answer needs; amplitudes in units of `scale`.
pub(super) struct Findings<'a> {
    pub options: &'a SteadyOptions,
    pub rate: f64,
    pub scale: f64,
    pub offset: f64,
    pub values: Vec<f64>,
    pub track: Track,
    pub blocks: Blocks,
    /// Real and imaginary parts by number; 0 is unused.
    pub real: Vec<Mean>,
    pub imaginary: Vec<Mean>,
    /// Chance of each harmonic in noise, all considered.
    pub p_values: Vec<f64>,
    /// What rounding to codes may make of a harmonic.
    pub ripple: f64,
    pub measured: Measured,
    pub judged: Vec<Judged>,
    pub harmonics: Harmonics,
    pub lines: Lines,
    pub families: Vec<JudgedFamily>,
}

impl<'a> Findings<'a> {
    pub fn of(y: &[f64], rate: f64, options: &'a SteadyOptions) -> Result<Self, NotSteady> {
        let (values, offset, scale) = scaled(y, rate)?;
        let track = track(&values)?;
        let blocks = Blocks::of(&values, &track);
        steady(&values, &track, &blocks)?;
        let training = training(&blocks, &track, options);
        let mean = |of: &dyn Fn(&super::blocks::Block) -> f64| blocks.mean(of);
        let part = |k: usize, im: bool| {
            mean(&move |block| block.harmonics.get(k).map_or(0.0, |h| if im { h.im } else { h.re }))
        };
        let real: Vec<Mean> = (0..=HARMONICS).map(|k| part(k, false)).collect();
        let imaginary: Vec<Mean> = (0..=HARMONICS).map(|k| part(k, true)).collect();
        let amplitude = real.get(1).map_or(0.0, |first| first.value);
        let ripple = ripple(y, scale, amplitude, blocks.noise());
        let p_values = p_values(&blocks, &real, &imaginary, ripple.max(RESOLVED * amplitude));
        // noise of one block, by its residual, where neighbours happen to agree
        let floor = 2.0 * blocks.noise().powi(2) / blocks.length as f64;
        let floored: Vec<Mean> = real
            .iter()
            .map(|mean| Mean { scatter: mean.scatter.max(floor).max((RESOLVED * amplitude).powi(2)), ..*mean })
            .collect();
        let measured = Measured::of(&blocks, &floored, training);
        // curves are tried where there is something to explain
        let harmonics = p_values.iter().any(|p| *p < options.false_alarm_rate);
        let judged = if harmonics { measured.judge() } else { Vec::new() };
        let wander = blocks.mean(|block| block.frequency).scatter.sqrt();
        let wander = if track.bandwidth > 0.0 { wander } else { 0.0 };
        let lines = lines(&blocks, &track, wander, ripple, options.false_alarm_rate);
        let harmonics = Harmonics::Clean;
        let families = Vec::new();
        let mut found = Self {
            options,
            rate,
            scale,
            offset,
            values,
            track,
            blocks,
            real,
            imaginary,
            p_values,
            ripple,
            measured,
            judged,
            harmonics,
            lines,
            families,
        };
        found.harmonics = found.conclude();
        let ratio = found.distortion().powi(2) / (0.5 * amplitude * amplitude);
        if ratio > 1.0
            && matches!(found.harmonics, Harmonics::OwnMotion | Harmonics::Unknown)
            && !found.best_is_detector()
        {
            return Err(NotSteady::Several { ratio });
        }
        found.judge_families();
        Ok(found)
    }

    /// Root mean square of the harmonics beyond the fundamental.
    pub fn distortion(&self) -> f64 {
        let power =
            |(re, im): (&Mean, &Mean)| (re.value.powi(2) + im.value.powi(2) - re.std.powi(2) - im.std.powi(2)).max(0.0);
        (0.5 * self.real.iter().zip(&self.imaginary).skip(2).map(power).sum::<f64>()).sqrt()
    }

    /// Share of the harmonics in quadrature, noise taken off.
    pub fn quadrature(&self) -> f64 {
        let power: f64 = self.imaginary.iter().skip(2).map(|im| im.value.powi(2) - im.std.powi(2)).sum();
        (0.5 * power.max(0.0)).sqrt() / self.distortion().max(f64::MIN_POSITIVE)
    }

    /// Share of the harmonics that a curve leaves, noise taken off.
    pub fn left(&self, judged: &Judged) -> f64 {
        let predicted = judged.fitted.curve.harmonics(judged.fitted.shared, judged.fitted.amplitude, HARMONICS);
        let of = |(k, h): (usize, &f64)| {
            let had = self.measured.had.get(k) == Some(&true) && k > 0;
            let mean = self.real.get(k + 1).copied().unwrap_or_default();
            if had { (mean.value - h).powi(2) - mean.std.powi(2) } else { 0.0 }
        };
        let power: f64 = predicted.iter().enumerate().map(of).sum();
        (0.5 * power.max(0.0)).sqrt() / self.distortion().max(f64::MIN_POSITIVE)
    }

    /// Chance of the strongest harmonic in noise.
    pub fn p_harmonics(&self) -> f64 {
        self.p_values.iter().copied().fold(1.0, f64::min)
    }

    fn best_is_detector(&self) -> bool {
        self.judged.first().is_some_and(|best| best.fitted.curve.is_detector() && self.left(best) < TOLERATED)
    }

    /// Whether all ids of a curve may be named.
    pub fn allowed(&self, judged: &Judged) -> bool {
        let curve = judged.fitted.curve;
        curve.is_detector() && curve.ids().iter().all(|id| self.options.candidates.iter().any(|other| other == id))
    }

    fn conclude(&self) -> Harmonics {
        if self.p_harmonics() > self.options.false_alarm_rate {
            return Harmonics::Clean;
        }
        if self.quadrature() > TOLERATED {
            return Harmonics::OwnMotion;
        }
        let Some(best) = self.judged.first().filter(|best| best.score > 0.0) else { return Harmonics::Unknown };
        // of curves that can't be distinguished from the best, the simplest that is allowed
        let equal = self.judged.iter().enumerate().filter(|(i, other)| *i == 0 || tied(best, other));
        let allowed = equal.filter(|(_, judged)| self.allowed(judged) && judged.score > 0.0);
        let Some((place, chosen)) = allowed.min_by_key(|(i, judged)| (judged.fitted.curve.parameters(), *i)) else {
            return if best.fitted.curve.is_detector() { Harmonics::Unknown } else { Harmonics::OwnMotion };
        };
        let strong = self.strengths(chosen).iter().all(|strength| *strength >= STRENGTH);
        // lines at half the frequency and a second harmonic: a motion that doubles its period, or a fringe at its
        // extremum, which doubles the frequency
        let bent = !matches!(chosen.fitted.curve, Curve::Fringe | Curve::Clipping);
        let doubled = bent && !self.lines.subharmonic.is_empty();
        if strong && !doubled && self.left(chosen) < TOLERATED { Harmonics::Named(place) } else { Harmonics::Unknown }
    }

    /// Parameters of a curve in their standard errors.
    fn strengths(&self, judged: &Judged) -> Vec<f64> {
        let curve = judged.fitted.curve;
        // a fringe's phase may be zero; of two limits one may be out of reach: what counts is the flat share
        let of = |fitted: &super::choice::Fitted| match curve {
            Curve::Fringe => [fitted.amplitude, fitted.shared[1]],
            Curve::Clipping => {
                let flat = |limit: f64| (fitted.amplitude - limit.abs()).max(0.0);
                [flat(fitted.shared[0]) + flat(fitted.shared[1]), fitted.amplitude]
            }
            _ => fitted.shared,
        };
        let values = of(&judged.fitted);
        let stds: [Option<f64>; 2] = self.measured.jackknife(curve, of);
        let count = curve.parameters();
        values
            .iter()
            .zip(stds)
            .take(count)
            .map(|(v, std)| std.map_or(0.0, |std| v.abs() / std.max(f64::MIN_POSITIVE)))
            .collect()
    }
}
