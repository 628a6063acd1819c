//! What a record must be, and what noise and rounding may make of its harmonics.

use std::f64::consts::PI;

use crate::signal::code_step;
use crate::statistics::f_tail;

use super::blocks::{Block, Blocks, Mean, evenness};
use super::phase::Track;
use super::{NotSteady, SteadyOptions};

/// `<a^4> / <a^2>^2` of a steady amplitude: 1, of noise through a resonance 2; a drift by a fifth makes 1.02.
const MOMENT: f64 = 1.1;
/// Least over largest amplitude: a decay to less takes another diagnosis.
const EVEN: f64 = 0.8;

/// Values about zero of order one, with level and scale.
pub(super) fn scaled(y: &[f64], rate: f64) -> Result<(Vec<f64>, f64, f64), NotSteady> {
    if !(rate > 0.0 && rate.is_finite()) {
        return Err(NotSteady::Rate { found: rate });
    }
    // the sum of so many squares must stay a number
    if let Some(index) = y.iter().position(|v| v.is_nan() || v.abs() >= 1e150) {
        return Err(NotSteady::NotFinite { index });
    }
    if y.len() < 64 {
        return Err(NotSteady::NoLine);
    }
    let offset = y.iter().sum::<f64>() / y.len() as f64;
    let scale = y.iter().map(|v| (v - offset).abs()).fold(0.0, f64::max);
    // a constant differs from its mean by rounding
    if !(scale > 1e-13 * offset.abs() && scale > 1e-150) {
        return Err(NotSteady::NoLine);
    }
    Ok((y.iter().map(|v| (v - offset) / scale).collect(), offset, scale))
}

pub(super) fn steady(values: &[f64], track: &Track, blocks: &Blocks) -> Result<(), NotSteady> {
    let (second, fourth) = track.envelope.iter().fold((0.0, 0.0), |(s, f), a| (s + a * a, f + a.powi(4)));
    let moment = if second > 0.0 { fourth * track.envelope.len() as f64 / (second * second) } else { 1.0 };
    let evenness = evenness(&blocks.blocks);
    if !(moment < MOMENT && evenness > EVEN) {
        return Err(NotSteady::Amplitude { evenness, moment });
    }
    let samples = values.len().max(1) as f64;
    let total: f64 = values.iter().map(|v| v * v).sum::<f64>() / samples;
    let noise = blocks.noise().powi(2);
    let periodic = |block: &Block| 0.5 * block.harmonics.iter().map(|h| h.norm_sqr()).sum::<f64>();
    let power = blocks.mean(periodic).value;
    // a drift of the level is in neither
    if power.is_nan() || power <= noise {
        return Err(NotSteady::NotAlone {
            share: power / (power + noise).max(f64::MIN_POSITIVE).max(total.min(noise)),
        });
    }
    Ok(())
}

/// Blocks that no part to judge on touches; all where too few would remain.
pub(super) fn training(blocks: &Blocks, track: &Track, options: &SteadyOptions) -> Vec<usize> {
    let apart = |range: &std::ops::Range<usize>| {
        let (start, end) = (range.start + track.first, range.end + track.first);
        options.parts.iter().all(|(_, part)| part.end <= start || part.start >= end)
    };
    let left: Vec<usize> =
        blocks.blocks.iter().enumerate().filter(|(_, block)| apart(&block.range)).map(|(b, _)| b).collect();
    if left.len() >= 4 { left } else { (0..blocks.blocks.len()).collect() }
}

/// Largest harmonic that rounding makes of a cosine, noise before the converter smoothing it.
///
/// Rounding in steps q adds `sum_p (2 q / pi p) J_k(2 pi p A / q)` to harmonic k, and `|J_k(x)| < sqrt(2 / pi x)` on
/// average; noise of standard deviation s takes `exp(-2 (pi s / q)^2)` of the first term (B. Widrow, I. Kollar,
/// Quantization Noise, 2008, chapter 4).
pub(super) fn ripple(y: &[f64], scale: f64, amplitude: f64, noise: f64) -> f64 {
    let step = code_step(y) / scale;
    if step <= 0.0 {
        return 0.0;
    }
    // rounding itself is part of what was left
    let before = (noise * noise - step * step / 12.0).max(0.0);
    // sum of p^(-3/2) is 2.612
    2.612 * 2.0 * step / PI * (step / amplitude.max(step)).sqrt() / PI * (-2.0 * PI * PI * before / (step * step)).exp()
}

pub(super) fn p_values(blocks: &Blocks, real: &[Mean], imaginary: &[Mean], floor: f64) -> Vec<f64> {
    // differences of neighbours share their blocks: they count as two thirds as many
    let below = (2.0 / 3.0 * blocks.blocks.len().saturating_sub(1) as f64).max(1.0);
    let tests = blocks.kept.len().saturating_sub(1).max(1) as f64;
    let one = |(k, (re, im)): (usize, (&Mean, &Mean))| {
        let size = re.value.hypot(im.value);
        if k < 2 || !blocks.kept.contains(&k) || size <= floor {
            return 1.0;
        }
        let square =
            (re.value / re.std.max(f64::MIN_POSITIVE)).powi(2) + (im.value / im.std.max(f64::MIN_POSITIVE)).powi(2);
        (tests * f_tail(0.5 * square, 2.0, below)).min(1.0)
    };
    real.iter().zip(imaginary).enumerate().map(one).collect()
}
