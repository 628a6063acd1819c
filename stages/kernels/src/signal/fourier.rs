//! The Fourier transform of real signals of one length.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use num_complex::Complex64;
use realfft::{ComplexToReal, RealFftPlanner, RealToComplex};

/// A plan for signals of N samples: bins 0 to N/2 of `X_k = sum_n x_n exp(-i 2 pi k n / N)`, and back.
///
/// Cost: planning some transforms, each transform `N log N`.
#[derive(Clone)]
pub struct RealTransform {
    forward: Forward,
    /// Planned when it is first needed.
    inverse: OnceLock<Arc<dyn ComplexToReal<f64>>>,
}

impl RealTransform {
    /// For signals of `samples`.
    pub fn new(samples: usize) -> Self {
        Self { forward: planned(samples), inverse: OnceLock::new() }
    }

    /// Samples of a signal.
    pub fn samples(&self) -> usize {
        self.forward.len()
    }

    /// Bins of a transform, `N / 2 + 1`.
    pub fn bins(&self) -> usize {
        self.samples() / 2 + 1
    }

    /// Transform of a signal, zeros added or the end cut off to N samples.
    pub fn forward(&self, signal: impl IntoIterator<Item = f64>) -> Vec<Complex64> {
        let mut space = SPACE.take();
        self.transform(signal, &mut space);
        let bins = space.bins[..self.bins()].to_vec();
        space.keep();
        bins
    }

    /// The same into the bins of `space`, which may be more.
    fn transform(&self, signal: impl IntoIterator<Item = f64>, space: &mut Space) {
        let Space { time, bins, scratch } = space;
        time.clear();
        time.extend(signal);
        time.resize(self.samples(), 0.0);
        let needed = self.forward.get_scratch_len();
        bins.resize(bins.len().max(self.bins()), Complex64::ZERO);
        scratch.resize(scratch.len().max(needed), Complex64::ZERO);
        // lengths are the plan's own: it cannot fail
        let _ = self.forward.process_with_scratch(time, &mut bins[..self.bins()], &mut scratch[..needed]);
    }

    /// Squared absolute values of the transform.
    pub fn power(&self, signal: impl IntoIterator<Item = f64>) -> Vec<f64> {
        let mut space = SPACE.take();
        self.transform(signal, &mut space);
        let power = space.bins[..self.bins()].iter().map(Complex64::norm_sqr).collect();
        space.keep();
        power
    }

    /// N times the signal of these bins. What rounding left of imaginary parts at zero and half the sample rate is
    /// dropped.
    pub fn inverse(&self, mut bins: Vec<Complex64>) -> Vec<f64> {
        bins.resize(self.bins(), Complex64::ZERO);
        if let Some(first) = bins.first_mut() {
            first.im = 0.0;
        }
        if self.samples().is_multiple_of(2)
            && let Some(last) = bins.last_mut()
        {
            last.im = 0.0;
        }
        let inverse = self.inverse.get_or_init(|| RealFftPlanner::new().plan_fft_inverse(self.samples()));
        let mut time = inverse.make_output_vec();
        let _ = inverse.process(&mut bins, &mut time);
        time
    }
}

/// Room for a transform.
#[derive(Default)]
struct Space {
    time: Vec<f64>,
    bins: Vec<Complex64>,
    scratch: Vec<Complex64>,
}

thread_local! {
    /// Of the last transform: the next one needs no new room.
    static SPACE: Cell<Space> = Cell::default();
}

impl Space {
    /// For the next transform of this thread, unless it is large.
    fn keep(self) {
        if self.time.capacity() <= LONGEST_KEPT {
            SPACE.set(self);
        }
    }
}

type Forward = Arc<dyn RealToComplex<f64>>;

/// Plans that are kept: a loop over records of one length makes none twice.
static KEPT: Mutex<Vec<Forward>> = Mutex::new(Vec::new());
/// Their number at most, the one longest unused goes first.
const MOST_KEPT: usize = 16;
/// Samples of one at most: 16 bytes each, so that all take 16 MB at most.
const LONGEST_KEPT: usize = 65_536;

/// A plan for a length, of those that are kept or a new one.
fn planned(samples: usize) -> Forward {
    let plan = || RealFftPlanner::new().plan_fft_forward(samples);
    if samples > LONGEST_KEPT {
        return plan();
    }
    let mut kept = KEPT.lock().unwrap_or_else(PoisonError::into_inner);
    let found = kept.iter().position(|own| own.len() == samples).map(|place| kept.remove(place));
    let found = found.unwrap_or_else(plan);
    kept.truncate(MOST_KEPT - 1);
    kept.insert(0, found.clone());
    found
}

/// Plans of several lengths, each made when it is first asked for.
#[derive(Default)]
pub struct TransformPlans(Mutex<BTreeMap<usize, RealTransform>>);

impl TransformPlans {
    /// For signals of `samples`.
    pub fn of(&self, samples: usize) -> RealTransform {
        let mut plans = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        plans.entry(samples).or_insert_with(|| RealTransform::new(samples)).clone()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixture::white_noise;

    #[test]
    fn the_transform_is_the_sum_and_its_inverse_the_signal() {
        for n in [1, 2, 15, 64, 101] {
            let x = white_noise(n, 1.0, n as u64);
            let plan = RealTransform::new(n);
            let bins = plan.forward(x.iter().copied());
            assert_eq!((bins.len(), plan.samples()), (plan.bins(), n));
            for (k, bin) in bins.iter().enumerate() {
                let turn = |t: usize| -std::f64::consts::TAU * (k * t % n) as f64 / n as f64;
                let slow: Complex64 = x.iter().enumerate().map(|(t, v)| Complex64::from_polar(*v, turn(t))).sum();
                // a hundred roundings of numbers of order one, ten of them added
                assert!((bin - slow).norm() < 1e-12);
            }
            let again = plan.inverse(bins);
            assert!(again.iter().zip(&x).all(|(a, x)| (a / n as f64 - x).abs() < 1e-13)); // rounding
        }
    }

    #[test]
    fn plans_that_are_kept_do_as_new_ones() {
        let x = white_noise(3 * MOST_KEPT, 1.0, 7);
        let of = |n: usize| RealTransform::new(n).forward(x.iter().copied());
        let first: Vec<Vec<Complex64>> = (1..3 * MOST_KEPT).map(of).collect();
        // by now the first ones have gone
        assert!((1..3 * MOST_KEPT).all(|n| of(n) == first[n - 1]));
        assert!(KEPT.lock().unwrap_or_else(PoisonError::into_inner).len() <= MOST_KEPT);
    }

    #[test]
    fn short_signals_are_filled_with_zeros_and_long_ones_cut() {
        let plan = RealTransform::new(8);
        assert_eq!(plan.forward([1.0, 2.0]), plan.forward([1.0, 2.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0]));
        assert_eq!(plan.forward((0..9).map(f64::from)), plan.forward((0..8).map(f64::from)));
    }
}
