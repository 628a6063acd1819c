//! Poles that a search begins from, of every order wanted, by methods that need no start.
//!
//! Strong modes come from the subspace estimate of every order from six below the wanted one on; what is missing is
//! filled with real poles spread over the fast part of the unit interval, where detectors lie. A weak mode needs the
//! high orders, detector poles the low ones.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::sync::OnceLock;

use faer::{Mat, c64};

use super::data::complete;
use super::options::{Experiment, PemOptions};
use super::products::Products;
use crate::linear_algebra::{eigenvalues, least_squares};
use crate::model::ModelError;
use crate::subspace::{Instruments, Subspace, Weight};

/// Real poles that fill up a start, fast and slow in turn.
const FILL: [f64; 6] = [0.15, 0.5, 0.3, 0.7, 0.05, 0.85];
/// Least of the fewest block rows with instruments.
const FEWEST: usize = 12;

/// Subspace estimates of a record, each made when it is first wanted: it serves all orders.
///
/// Each is made by one thread alone. Were it shared out, a thread that waits for it could hold up the one that makes it.
pub(crate) struct Estimates<'a> {
    input: Cow<'a, [f64]>,
    output: &'a [f64],
    /// Without instruments, by block rows.
    plain: BTreeMap<usize, OnceLock<Result<Subspace, ModelError>>>,
    /// With instruments, by block rows: one of each weight; none where an input does not excite throughout.
    instrumental: BTreeMap<usize, OnceLock<Vec<Subspace>>>,
}

impl<'a> Estimates<'a> {
    /// Of the longest complete stretch, for fits by these options. Errors: it is too short.
    pub fn new(experiments: &[Experiment<'a>], fits: &[PemOptions]) -> Result<Self, ModelError> {
        let longest =
            experiments.iter().max_by_key(|experiment| experiment.output.len()).ok_or(ModelError::NoExperiment)?;
        let most = fits.iter().max_by_key(|options| options.block_rows).ok_or(ModelError::NoExperiment)?;
        let (input, output) = complete(longest, most)?;
        let plain = fits.iter().map(|options| (options.block_rows, OnceLock::new())).collect();
        let instrumental = fits.iter().flat_map(block_rows).map(|rows| (rows, OnceLock::new())).collect();
        Ok(Self { input, output, plain, instrumental })
    }

    /// Without instruments. Errors: too short for these block rows; no convergence.
    pub fn plain(&self, block_rows: usize) -> Result<&Subspace, ModelError> {
        let estimate = || Subspace::new(&self.input, self.output, block_rows);
        let known = self.plain.get(&block_rows).ok_or(ModelError::NoExperiment)?;
        known.get_or_init(estimate).as_ref().map_err(Clone::clone)
    }

    /// The poles of all starts.
    pub fn poles(&self, options: &PemOptions) -> Result<Vec<Vec<c64>>, ModelError> {
        let order = options.order;
        let mut starts = self.without_instruments(options)?;
        if options.many_starts() {
            starts.extend(arx(&self.input, self.output, order));
            starts.extend(block_rows(options).into_iter().flat_map(|rows| self.with_instruments(order, rows)));
        }
        Ok(starts)
    }

    /// The poles of the most precise method: canonical correlations where there are instruments. Errors: no estimate.
    pub fn precise(&self, options: &PemOptions) -> Result<Vec<c64>, ModelError> {
        let PemOptions { order, block_rows, .. } = *options;
        let best = if options.many_starts() { self.with_instruments(order, block_rows).pop() } else { None };
        best.map_or_else(|| self.plain(block_rows)?.poles(order), Ok)
    }

    /// By subspace estimates of this order and of less, filled up.
    fn without_instruments(&self, options: &PemOptions) -> Result<Vec<Vec<c64>>, ModelError> {
        let (order, mut starts) = (options.order, Vec::new());
        let subspace = self.plain(options.block_rows)?;
        let least = order.saturating_sub(FILL.len()).max(1);
        for k in (least..=order.min(subspace.max_order())).rev() {
            let mut poles = subspace.poles(k)?;
            poles.extend(FILL.iter().take(order - k).map(|&z| c64::new(z, 0.0)));
            if poles.len() == order {
                starts.push(poles);
            }
        }
        if starts.is_empty() {
            starts.push((0..order).map(|i| c64::new((i as f64 + 0.5) / order as f64, 0.0)).collect());
        }
        Ok(starts)
    }

    /// One of each weight, where they can be had. They need an input that excites throughout, and see noise that is not
    /// white.
    fn with_instruments(&self, order: usize, rows: usize) -> Vec<Vec<c64>> {
        let estimates = || instrumental(&self.input, self.output, rows);
        let estimates = self.instrumental.get(&rows).map(|known| known.get_or_init(estimates));
        let poles = estimates.into_iter().flatten().filter_map(|estimate| estimate.poles(order).ok());
        poles.filter(|poles| poles.len() == order).collect()
    }
}

/// Few and many block rows of the estimates with instruments.
fn block_rows(options: &PemOptions) -> Vec<usize> {
    let most = options.block_rows;
    let few = (options.order + 2).max(FEWEST).min(most);
    if few < most { vec![few, (few + most) / 2, most] } else { vec![most] }
}

/// Estimates of every weight.
fn instrumental(u: &[f64], y: &[f64], rows: usize) -> Vec<Subspace> {
    let Ok(instruments) = Instruments::new(u, y, rows) else { return Vec::new() };
    [Weight::Moesp, Weight::N4sid, Weight::Cva].into_iter().filter_map(|w| instruments.subspace(w).ok()).collect()
}

/// The poles of an ARX model of this order, by least squares; several inputs one after the other.
fn arx(u: &[f64], y: &[f64], order: usize) -> Result<Vec<c64>, ModelError> {
    let (samples, inputs) = (y.len(), u.len() / y.len().max(1));
    let rows = samples.saturating_sub(order);
    let columns = order + inputs * (order + 1);
    if rows <= columns {
        return Err(ModelError::TooShort { found: samples, wanted: columns + order + 1 });
    }
    let mut past: Vec<&[f64]> = (0..order).map(|j| &y[order - 1 - j..][..rows]).collect();
    past.extend(u.chunks_exact(samples).flat_map(|u| (0..=order).map(move |j| &u[order - j..][..rows])));
    let target = &y[order..];
    let all: Vec<&[f64]> = past.iter().copied().chain([target]).collect();
    let theta = match Products::new(&all) {
        Some((_, solution)) => solution.theta,
        None => {
            let matrix = Mat::from_fn(rows, columns, |t, j| past[j][t]);
            let target = Mat::from_fn(rows, 1, |t, _| target[t]);
            let theta = least_squares(&matrix, &target, f64::EPSILON * rows as f64)?;
            theta.col(0).iter().copied().collect()
        }
    };
    let companion = Mat::from_fn(order, order, |i, j| if i == 0 { theta[j] } else { f64::from(u8::from(i == j + 1)) });
    Ok(eigenvalues(&companion)?)
}
