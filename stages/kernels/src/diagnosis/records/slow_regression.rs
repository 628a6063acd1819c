//! Sines in a whole record, with what the piezo's travel makes projected out.

use crate::linear_algebra::dot;
use std::f64::consts::{PI, TAU};

use super::basis::{Basis, norm, polynomials};
use super::segments::SegmentKind;
use super::summary::RecordSummary;

/// Degree of the polynomials in the piezo position that every stretch is freed from.
const DEGREE: usize = 3;

/// One stretch, freed from its polynomials and weighted by the inverse of what these leave.
#[derive(Debug, Clone)]
struct Part {
    time_s: Vec<f64>,
    values: Vec<f64>,
    weight: f64,
    basis: Basis,
    kind: SegmentKind,
    raw: Vec<f64>,
}

/// A record, ready for regressions on sines.
#[derive(Debug, Clone)]
pub(super) struct SlowRecord {
    parts: Vec<Part>,
    block_s: f64,
    /// From the first block to the last, s.
    pub span_s: f64,
}

/// The sine that fits best.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Sine {
    pub frequency_hz: f64,
    pub cosine: f64,
    pub sine: f64,
    /// Fall of the weighted sum of squares.
    pub power: f64,
}

impl Sine {
    pub fn amplitude(&self) -> f64 {
        self.cosine.hypot(self.sine)
    }

    fn at(&self, time_s: f64, block_s: f64) -> f64 {
        let (s, c) = (TAU * self.frequency_hz * time_s).sin_cos();
        (self.cosine * c + self.sine * s) * averaging(self.frequency_hz, block_s)
    }
}

/// What a block mean leaves of a sine.
fn averaging(frequency_hz: f64, block_s: f64) -> f64 {
    let x = PI * frequency_hz * block_s;
    if x < 1e-6 { 1.0 } else { x.sin() / x }
}

impl SlowRecord {
    /// From a summary, less the `known` sines; none if there is no stretch, or no noise to weigh by.
    pub fn new(record: &RecordSummary, known: &[Sine]) -> Option<Self> {
        let parts: Vec<Part> = record
            .segments
            .iter()
            .filter_map(|segment| {
                let middle = |k: usize| ((segment.first + k) as f64 + 0.5) * record.block_s;
                let time_s: Vec<f64> = (0..segment.values.len()).map(middle).collect();
                let removed =
                    |(t, v): (&f64, &f64)| v - known.iter().map(|sine| sine.at(*t, record.block_s)).sum::<f64>();
                let raw: Vec<f64> = time_s.iter().zip(&segment.values).map(removed).collect();
                let basis = polynomials(segment.piezo.as_ref().unwrap_or(&time_s), DEGREE);
                let mut values = basis.residual(&raw);
                let left = norm(&values) / ((values.len().saturating_sub(DEGREE + 1)).max(1) as f64).sqrt();
                values.iter_mut().for_each(|value| *value /= left);
                (left.is_finite() && left > 0.0).then(|| Part {
                    time_s,
                    values,
                    weight: 1.0 / left,
                    basis,
                    kind: segment.kind,
                    raw,
                })
            })
            .collect();
        let (first, last) = (parts.first()?.time_s.first()?, parts.last()?.time_s.last()?);
        Some(Self { block_s: record.block_s, span_s: last - first, parts })
    }

    /// The best sine of that frequency; none where the polynomials leave nothing of it.
    pub fn fit(&self, frequency_hz: f64) -> Option<Sine> {
        self.fit_to(frequency_hz, |_| true)
    }

    fn fit_to(&self, frequency_hz: f64, wanted: impl Fn(usize) -> bool) -> Option<Sine> {
        let shrunk = averaging(frequency_hz, self.block_s);
        let (mut cc, mut cs, mut ss, mut yc, mut ys) = (0.0, 0.0, 0.0, 0.0, 0.0);
        let mut blocks = 0.0;
        for part in self.parts.iter().enumerate().filter(|(k, _)| wanted(*k)).map(|(_, part)| part) {
            let (mut c, mut s) = waves(&part.time_s, frequency_hz, self.block_s, part.weight * shrunk);
            blocks += norm(&c).powi(2) + norm(&s).powi(2);
            part.basis.remove(&mut c);
            part.basis.remove(&mut s);
            cc += dot(&c, &c);
            cs += dot(&c, &s);
            ss += dot(&s, &s);
            yc += dot(&part.values, &c);
            ys += dot(&part.values, &s);
        }
        let determinant = cc * ss - cs * cs;
        // a hundredth of either phase must be left by the polynomials, or noise in their place is amplified
        if determinant.is_nan() || determinant <= 1e-4 * (0.5 * blocks).powi(2) {
            return None;
        }
        let (cosine, sine) = ((ss * yc - cs * ys) / determinant, (cc * ys - cs * yc) / determinant);
        Some(Sine { frequency_hz, cosine, sine, power: cosine * yc + sine * ys })
    }

    /// The record without that sine.
    pub fn without(&self, sine: &Sine) -> Self {
        let mut left = self.clone();
        for part in &mut left.parts {
            for (t, value) in part.time_s.iter().zip(&mut part.raw) {
                *value -= sine.at(*t, self.block_s);
            }
            part.values = part.basis.residual(&part.raw);
            part.values.iter_mut().for_each(|value| *value *= part.weight);
        }
        left
    }

    /// Mean squares of the last free stretch about its mean, without and with the sine that all others show at that
    /// frequency.
    pub fn held_out(&self, frequency_hz: f64) -> Option<(f64, f64)> {
        let last = self.parts.iter().rposition(|part| part.kind != SegmentKind::Contact)?;
        let sine = self.fit_to(frequency_hz, |k| k != last)?;
        let part = &self.parts[last];
        let left = part.time_s.iter().zip(&part.raw).map(|(t, v)| v - sine.at(*t, self.block_s));
        Some((variance(&part.raw), variance(&left.collect::<Vec<_>>())))
    }
}

fn variance(values: &[f64]) -> f64 {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    values.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / values.len() as f64
}

/// Cosine and sine at evenly spaced times, by rotation (renewed every 64 steps: rounding stays at 1e-14).
fn waves(time_s: &[f64], frequency_hz: f64, block_s: f64, height: f64) -> (Vec<f64>, Vec<f64>) {
    let (turn_s, turn_c) = (TAU * frequency_hz * block_s).sin_cos();
    let (mut cosines, mut sines) = (Vec::with_capacity(time_s.len()), Vec::with_capacity(time_s.len()));
    let (mut s, mut c) = (0.0, 0.0);
    for (k, t) in time_s.iter().enumerate() {
        (s, c) = if k % 64 == 0 {
            let (s, c) = (TAU * frequency_hz * t).sin_cos();
            (height * s, height * c)
        } else {
            (s * turn_c + c * turn_s, c * turn_c - s * turn_s)
        };
        cosines.push(c);
        sines.push(s);
    }
    (cosines, sines)
}

impl SlowRecord {
    /// Duration of a block, s.
    pub fn block_s(&self) -> f64 {
        self.block_s
    }
}
