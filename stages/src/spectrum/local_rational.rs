//! Local rational smoothing.

use std::f64::consts::TAU;

use rayon::prelude::*;
use rustfft::num_complex::Complex64;

use super::fraction::{Fraction, Orders, Points, fit_fraction};
use super::neighbours::Usable;
use super::{Bins, Smoothed, SpectrumError, SuppressedLine};

/// Orders and width of the local model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RationalSettings {
    /// Order of the numerator.
    pub numerator_order: usize,
    /// Order of the denominator; two for one resonance.
    pub denominator_order: usize,
    /// Neighbourhood, in bins on either side.
    pub half_width_bins: usize,
    /// Order of a transient that turns with the delay from the start of the window to the event, given in samples over the
    /// length of the window (turns per bin); `None` for no transient.
    pub transient: Option<(usize, f64)>,
}

/// Smooths by a quotient of polynomials through the neighbours of each bin.
///
/// # Model
/// `G(f_k + d) = (B(d) + exp(i 2 pi c d) T(d)) / A(d)` over the neighbourhood: a resonance and an antiresonance are exact in it.
/// `T` is what the ends of the window add to the response (it starts at the window, not at the event, hence the turning phase
/// `c` turns per bin); it is fitted and left out of the result.
///
/// # Method
/// Levy's linear least squares with offsets scaled to one, reweighted by the last denominator (Sanathanan and Koerner),
/// then Gauss-Newton. A plain polynomial numerator (no denominator) is fitted beside it, and where it does as well by the corrected
/// Akaike criterion it is taken: no denominator is invented from noise. Bins of a suppressed line are left out and filled in.
///
/// # Shapes
/// `[bins]` throughout.
///
/// # Units
/// Those of the estimate.
///
/// # Accuracy
/// Noise-free, resonances two bins wide are lowered by less than 0.1 %; a parabola of the same width lowers them by tens of per cent.
/// The variance is that of the linearised local model, from the variance given, or from the residual if that is unknown.
///
/// # Errors
/// A neighbourhood with fewer bins than one more than the coefficients, too few defined bins, unequal lengths.
///
/// # Source
/// McKelvey and Guerin, IFAC SYSID 2012; Pintelon and Schoukens, System Identification, 2012, ch. 7.
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
    let rows: Vec<(Fraction, usize)> = (0..usable.end)
        .into_par_iter()
        .map(|k| {
            let points = gather(&usable, k, count, turns);
            (choose(&points, full), points.offset.len())
        })
        .collect();

    let n = bins.transfer.len();
    let mut result = Smoothed {
        transfer: vec![Complex64::new(f64::NAN, f64::NAN); n],
        variance: vec![f64::NAN; n],
        half_width: vec![f64::NAN; n],
        misfit: vec![f64::NAN; n],
    };
    for (k, (fraction, points)) in rows.iter().enumerate() {
        let freedom = points.saturating_sub(fraction.rank).max(1) as f64;
        let misfit = fraction.squares / freedom;
        let scale = if usable.known_variance { 1.0 } else { misfit };
        result.transfer[k] = fraction.value;
        result.variance[k] = scale * fraction.unit_variance;
        result.half_width[k] = 0.5 * (points - 1) as f64;
        result.misfit[k] = misfit;
    }
    Ok(result)
}

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

/// The quotient, or the polynomial alone where it explains the values as well.
fn choose(points: &Points, full: Orders) -> Fraction {
    let fraction = fit_fraction(points, full);
    if full.denominator == 0 {
        return fraction;
    }
    let plain = fit_fraction(points, Orders { denominator: 0, ..full });
    if akaike(points, &plain) <= akaike(points, &fraction) { plain } else { fraction }
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
