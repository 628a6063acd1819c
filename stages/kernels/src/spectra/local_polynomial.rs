//! Local polynomial smoothing of real and imaginary parts.

use rayon::prelude::*;
use rustfft::num_complex::Complex64;

use super::least_squares::{Columns, Factored};
use super::neighbours::Usable;
use crate::spectra::error::SpectrumError;
use crate::spectra::neighbours::{Bins, Smoothed, SuppressedLine};

/// How wide and how curved the local polynomial is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PolynomialSettings {
    /// Degree.
    pub degree: usize,
    /// Widest neighbourhood, in bins on either side.
    pub half_width_bins: usize,
    /// Narrows the neighbourhood where the data contradict a wide one by more than so many standard errors; `None`
    /// keeps it fixed.
    pub adapt_sigma: Option<f64>,
}

/// Smooths by a polynomial through the neighbours of each bin.
///
/// # Model
/// `G(f_k + d) = sum_j b_j d^j` over the neighbourhood, complex coefficients: the same as real and imaginary parts one
/// by one. Magnitudes must not be smoothed: noise adds `phi / |U|^2` to their square (Eq. 10).
///
/// # Method
/// Weighted least squares, evaluated at the bin. Adaptive: from the narrowest exact neighbourhood (as many bins as
/// coefficients) outwards in steps of about 1.5; the widest whose value agrees with those of all narrower ones within
/// `adapt_sigma (s_1 + s_2)` is taken. Near a resonance two bins wide that is a few bins, elsewhere all of them.
/// Bins of a suppressed line are left out and filled in.
///
/// # Shapes
/// `[bins]` throughout.
///
/// # Units
/// Those of the estimate.
///
/// # Accuracy
/// A fixed parabola over 8 bins on either side lowers resonances two bins wide by tens of per cent; the adaptive one by
/// no more than its noise. Without a variance the adaptive one keeps to the narrowest neighbourhood.
///
/// # Errors
/// Fewer defined bins than coefficients, unequal lengths, a line without width.
///
/// # Source
/// Stark et al. 2005; Fan and Gijbels 1996; adaptation: Goldenshluger and Nemirovski, Math. Meth. Stat. 6 (1997) 135.
pub fn local_polynomial(
    bins: Bins<'_>,
    settings: PolynomialSettings,
    lines: &[SuppressedLine],
) -> Result<Smoothed, SpectrumError> {
    let usable = Usable::new(bins, lines, settings.degree + 1)?;
    let widest = settings.half_width_bins.max(settings.degree.div_ceil(2));
    let widths = match settings.adapt_sigma {
        Some(_) => widths(settings.degree.div_ceil(2), widest),
        None => vec![widest],
    };
    let rows: Vec<Fit> = (0..usable.end)
        .into_par_iter()
        .map(|k| match settings.adapt_sigma {
            Some(sigma) => adapt(&usable, k, settings.degree, &widths, sigma),
            None => fit(&usable, k, settings.degree, widest),
        })
        .collect();
    let pad = bins.transfer.len() - rows.len();
    let column = |of: fn(&Fit) -> f64| rows.iter().map(of).chain(std::iter::repeat_n(f64::NAN, pad)).collect();
    let undefined = Complex64::new(f64::NAN, f64::NAN);
    Ok(Smoothed {
        transfer: rows.iter().map(|r| r.value).chain(std::iter::repeat_n(undefined, pad)).collect(),
        variance: column(|r| r.variance),
        half_width: column(|r| r.half_width as f64),
        misfit: column(|r| r.misfit),
    })
}

#[derive(Debug, Clone, Copy)]
struct Fit {
    value: Complex64,
    variance: f64,
    half_width: usize,
    misfit: f64,
}

/// From narrow to wide in steps of about 1.5.
fn widths(narrowest: usize, widest: usize) -> Vec<usize> {
    let mut widths = vec![narrowest];
    let mut width = narrowest;
    while width < widest {
        width = (width + width.div_ceil(2)).max(width + 1).min(widest);
        widths.push(width);
    }
    widths
}

/// The widest neighbourhood that agrees with all narrower ones.
fn adapt(usable: &Usable<'_>, k: usize, degree: usize, widths: &[usize], sigma: f64) -> Fit {
    let mut accepted: Vec<Fit> = Vec::with_capacity(widths.len());
    for &width in widths {
        let next = fit(usable, k, degree, width);
        let spread = |f: &Fit| if usable.known_variance { f.variance.sqrt() } else { 0.0 };
        let agrees = |f: &Fit| (f.value - next.value).norm() <= sigma * (spread(f) + spread(&next));
        if !accepted.iter().all(agrees) {
            break;
        }
        accepted.push(next);
    }
    accepted.last().copied().unwrap_or_else(|| fit(usable, k, degree, widths[0]))
}

fn fit(usable: &Usable<'_>, k: usize, degree: usize, half_width: usize) -> Fit {
    let near = usable.nearest(k, (2 * half_width + 1).max(degree + 1));
    let reach = near.iter().map(|&i| i.abs_diff(k)).max().unwrap_or(1).max(1) as f64;
    let weight: Vec<f64> = near.iter().map(|&i| 1.0 / usable.variance(i).sqrt()).collect();
    let offset: Vec<f64> = near.iter().map(|&i| (i as f64 - k as f64) / reach).collect();
    let mut columns = Columns::new(near.len(), degree + 1);
    columns.push(weight.iter().map(|&w| Complex64::new(w, 0.0)));
    (0..degree).for_each(|_| columns.push_last_times(&offset));
    let values: Vec<Complex64> = near.iter().zip(&weight).map(|(&i, w)| usable.bins.transfer[i] * w).collect();
    let factored = Factored::new(&columns);
    let b = factored.solve(&values);
    let mut gradient = vec![Complex64::new(0.0, 0.0); degree + 1];
    gradient[0] = Complex64::new(1.0, 0.0);
    let squares: f64 = (0..near.len())
        .map(|row| {
            let model = b.iter().rev().fold(Complex64::new(0.0, 0.0), |sum, b| sum * offset[row] + b);
            (values[row] - model * weight[row]).norm_sqr()
        })
        .sum();
    let freedom = near.len() - factored.rank();
    let misfit = if freedom > 0 { squares / freedom as f64 } else { f64::NAN };
    let scale = if usable.known_variance { 1.0 } else { misfit };
    Fit { value: b[0], variance: scale * factored.variance(&gradient), half_width, misfit }
}
