//! Local rational smoothing.

use std::f64::consts::TAU;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use rayon::prelude::*;
use rustfft::num_complex::Complex64;

use super::fraction::{Fraction, Orders, Points, fit_fractions};
use super::neighbours::Usable;
use crate::spectra::error::SpectrumError;
use crate::spectra::neighbours::{Bins, Smoothed, SuppressedLine};

/// Orders and width of the local model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RationalSettings {
    /// Order of the numerator.
    pub numerator_order: usize,
    /// Order of the denominator; two for one resonance.
    pub denominator_order: usize,
    /// Neighbourhood, in bins on either side.
    pub half_width_bins: usize,
    /// Order of a transient that turns with the delay from the start of the window to the event, given in samples over
    /// the length of the window (turns per bin); `None` for no transient.
    pub transient: Option<(usize, f64)>,
}

/// Smooths by a quotient of polynomials through the neighbours of each bin.
///
/// # Model
/// `G(f_k + d) = (B(d) + exp(i 2 pi c d) T(d)) / A(d)` over the neighbourhood: a resonance and an antiresonance are
/// exact in it. `T` is what the ends of the window add to the response (it starts at the window, not at the event,
/// hence the turning phase `c` turns per bin); it is fitted and left out of the result.
///
/// # Method
/// Levy's linear least squares with offsets scaled to one, reweighted by the last denominator (Sanathanan and Koerner),
/// then Gauss-Newton. A plain polynomial numerator (no denominator) is fitted beside it, and the two are averaged with
/// the weights of the corrected Akaike criterion: no denominator is invented from noise, and none is dropped by it.
/// Bins of a suppressed line are left out and filled in.
///
/// # Shapes
/// `[bins]` throughout.
///
/// # Units
/// Those of the estimate.
///
/// # Accuracy
/// Noise-free, resonances two bins wide are lowered by less than 0.1 %; a parabola of the same width lowers them by
/// tens of per cent. The variance is that of the linearised local models, from the variance given, or from the residual
/// if that is unknown, and what they differ by.
///
/// # Errors
/// A neighbourhood with fewer bins than one more than the coefficients, too few defined bins, unequal lengths.
///
/// # Source
/// McKelvey and Guerin, IFAC SYSID 2012; Buckland, Burnham and Augustin, Biometrics 53 (1997) 603; Pintelon and
/// Schoukens, System Identification, 2012, ch. 7.
pub fn local_rational(
    bins: Bins<'_>,
    settings: RationalSettings,
    lines: &[SuppressedLine],
) -> Result<Smoothed, SpectrumError> {
    let full = Orders {
        numerator: settings.numerator_order,
        denominator: settings.denominator_order,
        transient: settings.transient.map(|t| t.0),
    };
    let count = 2 * settings.half_width_bins + 1;
    if count < full.count() + 2 {
        let (got, wanted) = (count as f64, "at least two bins more than coefficients: widen half_width_bins");
        return Err(SpectrumError::Setting { name: "bins per local model", got, wanted });
    }
    let usable = Usable::new(bins, lines, full.count() + 2)?;
    let turns = settings.transient.map_or(0.0, |t| t.1);
    let pull = overfit(&usable, full, count, turns);
    let all: Vec<usize> = (0..usable.end).collect();
    let rows: Vec<Local> = all
        .par_chunks(SIDE_BY_SIDE)
        .flat_map_iter(|bins| {
            let points: Vec<Points> = bins.iter().map(|&k| gather(&usable, k, count, turns)).collect();
            average(&points, full, usable.known_variance, pull)
        })
        .collect();

    let n = bins.transfer.len();
    let mut result = Smoothed {
        transfer: vec![Complex64::new(f64::NAN, f64::NAN); n],
        variance: vec![f64::NAN; n],
        half_width: vec![f64::NAN; n],
        misfit: vec![f64::NAN; n],
    };
    for (k, local) in rows.iter().enumerate() {
        result.transfer[k] = local.value;
        result.variance[k] = local.variance;
        result.half_width[k] = 0.5 * (count.min(usable.index.len()) - 1) as f64;
        result.misfit[k] = local.misfit;
    }
    Ok(result)
}

/// Bins fitted together: a few times as many as the vector units take.
const SIDE_BY_SIDE: usize = 32;

fn gather(usable: &Usable<'_>, k: usize, count: usize, turns: f64) -> Points {
    let near = usable.nearest(k, count);
    let reach = near.iter().map(|&i| i.abs_diff(k)).max().unwrap_or(1).max(1) as f64;
    let offset = |i: usize| i as f64 - k as f64;
    Points {
        offset: near.iter().map(|&i| offset(i) / reach).collect(),
        value: near.iter().map(|&i| usable.bins.transfer[i]).collect(),
        weight: near.iter().map(|&i| 1.0 / usable.variance(i).sqrt()).collect(),
        turn: near.iter().map(|&i| Complex64::from_polar(1.0, TAU * turns * offset(i))).collect(),
    }
}

/// What the local models say together.
struct Local {
    value: Complex64,
    variance: f64,
    misfit: f64,
}

/// Quotient and plain polynomial, weighted by how well each explains the values (Akaike weights).
///
/// To take the better of the two and forget the other counts the choice as certain: the variance then comes out a tenth
/// too low wherever noise decides. Weighted, it is `(sum w sqrt(v + |g - mean|^2))^2` (Buckland, Burnham and Augustin
/// 1997, Eq. 9).
fn average(points: &[Points], full: Orders, known_variance: bool, pull: f64) -> Vec<Local> {
    let fractions = fit_fractions(points, full);
    if full.denominator == 0 {
        let alone = |(points, fraction): (&Points, &Fraction)| {
            let misfit = misfit(points, fraction);
            let scale = if known_variance { 1.0 } else { misfit };
            Local { value: fraction.value, variance: fraction.unit_variance * scale, misfit }
        };
        return points.iter().zip(&fractions).map(alone).collect();
    }
    let plain = fit_fractions(points, Orders { denominator: 0, ..full });
    let both = plain.iter().zip(&fractions);
    points
        .iter()
        .zip(both)
        .map(|(points, (plain, fraction))| mixed(points, plain, fraction, known_variance, pull))
        .collect()
}

/// The average of one bin.
fn mixed(points: &Points, plain: &Fraction, fraction: &Fraction, known_variance: bool, pull: f64) -> Local {
    let (a, b) = (akaike(points, plain), akaike(points, fraction));
    let share = 1.0 / (1.0 + (0.5 * (a - b)).clamp(-700.0, 700.0).exp());
    // a share that rounding alone leaves is none: the other model's value may be anything
    let share = if share < 1e-12 {
        0.0
    } else if share > 1.0 - 1e-12 {
        1.0
    } else {
        share
    };
    let mix = |x: f64, y: f64| {
        if share == 0.0 {
            y
        } else if share == 1.0 {
            x
        } else {
            share * x + (1.0 - share) * y
        }
    };
    let value = Complex64::new(mix(plain.value.re, fraction.value.re), mix(plain.value.im, fraction.value.im));
    let misfit = mix(misfit(points, plain), misfit(points, fraction)) / (1.0 - pull * share);
    let scale = if known_variance { 1.0 } else { misfit };
    let spread = |fit: &Fraction| (scale * fit.unit_variance + (fit.value - value).norm_sqr()).sqrt();
    Local { value, variance: mix(spread(plain), spread(fraction)).powi(2), misfit }
}

/// Squared residual per degree of freedom.
fn misfit(points: &Points, fit: &Fraction) -> f64 {
    fit.squares / points.offset.len().saturating_sub(fit.rank).max(1) as f64
}

/// How much too small the average's misfit is where nothing resonates: a denominator that looks for the best place to
/// resonate in noise has more freedom than coefficients. Where the data hold a resonance (`share` near 0) it has not.
///
/// Found by fitting noise, 400 draws from a fixed seed, against the plain polynomial's misfit, whose expectation is
/// exactly one.
/// Source: J. Ye, J. Am. Stat. Assoc. 93 (1998) 120 (generalised degrees of freedom).
fn overfit(usable: &Usable<'_>, full: Orders, count: usize, turns: f64) -> f64 {
    const DRAWS: u64 = 400;
    if full.denominator == 0 {
        return 0.0;
    }
    let middle = usable.index[usable.index.len() / 2];
    let mut shape = gather(usable, middle, count, turns);
    shape.weight.fill(1.0);
    let seeds: Vec<u64> = (0..DRAWS).collect();
    let drawn = |&seed: &u64| {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let value = shape.offset.iter().map(|_| Complex64::new(normal(), normal()) * 0.5f64.sqrt()).collect();
        Points { value, offset: shape.offset.clone(), weight: shape.weight.clone(), turn: shape.turn.clone() }
    };
    let draws: Vec<[f64; 2]> = seeds
        .par_chunks(SIDE_BY_SIDE)
        .flat_map_iter(|seeds| {
            let points: Vec<Points> = seeds.iter().map(drawn).collect();
            let plain = fit_fractions(&points, Orders { denominator: 0, ..full });
            let both: Vec<(Fraction, Fraction)> = plain.into_iter().zip(fit_fractions(&points, full)).collect();
            points.into_iter().zip(both).map(|(points, (plain, fraction))| {
                let (a, b) = (akaike(&points, &plain), akaike(&points, &fraction));
                let share = 1.0 / (1.0 + (0.5 * (a - b)).clamp(-700.0, 700.0).exp());
                let reference = misfit(&points, &plain);
                [(1.0 - share) * (misfit(&points, &fraction) - reference), share]
            })
        })
        .collect();
    // ordered sums: the same bits on any number of threads
    let mean = |i: usize| draws.iter().map(|d| d[i]).sum::<f64>() / DRAWS as f64;
    (-mean(0) / mean(1).max(0.1)).clamp(0.0, 0.5)
}

/// Corrected Akaike criterion for unknown noise; complex values and coefficients count twice.
fn akaike(points: &Points, fit: &Fraction) -> f64 {
    let n = 2.0 * points.offset.len() as f64;
    let p = 2.0 * fit.rank as f64 + 1.0;
    // rounding: residuals below this share of the values mean nothing
    let size: f64 = points.value.iter().zip(&points.weight).map(|(g, w)| g.norm_sqr() * w * w).sum();
    let squares = fit.squares.max(1e-26 * size).max(f64::MIN_POSITIVE);
    n * (squares / n).ln() + 2.0 * p + 2.0 * p * (p + 1.0) / (n - p - 1.0).max(1.0)
}

#[cfg(test)]
mod tests;
