//! Records through a whitening filter.

use crate::model::Coefficients;

/// Numerator and denominator of a whitening filter.
pub(crate) type Filter = (Vec<Coefficients>, Vec<Coefficients>);

/// Signals that pass the whitening filter side by side.
pub(super) const LANES: usize = 5;
pub(super) const INPUT: usize = 0;
pub(super) const IMPULSE: usize = 1;
pub(super) const ONE: usize = 2;
pub(super) const RAMP: usize = 3;
pub(super) const OUTPUT: usize = 4;

/// The signals of all experiments, filtered once for all points of a search.
pub(crate) struct Whitened {
    pub filter: Filter,
    pub(super) experiments: Vec<Signals>,
}

/// The signals of one experiment.
pub(super) struct Signals {
    /// Input, impulse at the first sample, one, ramp, output; a sample after the other.
    pub lanes: Vec<[f64; LANES]>,
    /// Each further input.
    pub further: Vec<Vec<f64>>,
}

impl Whitened {
    /// Of experiments of inputs and output.
    pub fn new(experiments: &[(&[f64], &[f64])], filter: Filter) -> Self {
        let each = |(u, y): &(&[f64], &[f64])| {
            let (first, further) = u.split_at(y.len());
            let alone = |u: &[f64]| {
                whiten(&filter.0, &filter.1, u.iter().map(|&u| [u]).collect()).into_iter().flatten().collect()
            };
            Signals {
                lanes: whiten(&filter.0, &filter.1, lanes(first, y)),
                further: further.chunks_exact(y.len()).map(alone).collect(),
            }
        };
        let experiments = experiments.iter().map(each).collect();
        Self { filter, experiments }
    }
}

/// Input, impulse at the first sample, one, ramp from -1 to 1, output.
fn lanes(u: &[f64], y: &[f64]) -> Vec<[f64; LANES]> {
    let centre = 0.5 * (y.len() as f64 - 1.0).max(1.0);
    u.iter()
        .zip(y)
        .enumerate()
        .map(|(k, (&u, &y))| {
            // a missing output takes no part: see the mask
            let y = if y.is_nan() { 0.0 } else { y };
            [u, if k == 0 { 1.0 } else { 0.0 }, 1.0, (k as f64 - centre) / centre, y]
        })
        .collect()
}

/// `prod a_i / c_i` applied to all lanes; transposed direct form II, zero initial state.
fn whiten<const N: usize>(a: &[Coefficients], c: &[Coefficients], mut signals: Vec<[f64; N]>) -> Vec<[f64; N]> {
    // slow sections first: a fast one alone would decay into denormal numbers
    let mut order: Vec<usize> = (0..a.len()).collect();
    order.sort_by(|&i, &j| radius(c[j]).total_cmp(&radius(c[i])));
    for i in order {
        let ([a1, a2], [c1, c2]) = (a[i], c[i]);
        let (mut s1, mut s2) = ([0.0; N], [0.0; N]);
        for sample in &mut signals {
            for l in 0..N {
                let x = sample[l];
                let y = x + s1[l];
                s1[l] = a1 * x - c1 * y + s2[l];
                s2[l] = a2 * x - c2 * y;
                sample[l] = y;
            }
        }
    }
    signals
}

fn radius(c: Coefficients) -> f64 {
    let d = 0.25 * c[0] * c[0] - c[1];
    if d < 0.0 { c[1].sqrt() } else { 0.5 * c[0].abs() + d.sqrt() }
}
