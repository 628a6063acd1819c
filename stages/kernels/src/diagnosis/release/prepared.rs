//! What many fits to the same data need again.

use crate::linear_algebra::Qr;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use faer::Mat;

use super::signals::Signals;
use super::window::Cut;
use crate::ringdown::Exponential;
use crate::ringdown::internals::{Whitener, columns};

/// Whitening filter and the latest bases of a problem, the same numbers whether they are found here or made again; and
/// how much has been simulated.
#[derive(Default)]
pub struct Prepared {
    whitener: OnceLock<Arc<Whitener>>,
    latest: Mutex<Vec<(Key, Arc<Directions>)>>,
    work: Arc<AtomicU64>,
}

/// Orthonormal columns `q` and the triangle `r` of the whitened ones.
pub(super) struct Directions {
    pub q: Mat<f64>,
    pub r: Mat<f64>,
}

/// What a basis follows from beside the problem: bits of its poles, samples of fast poles.
type Key = (Vec<[u64; 2]>, usize);

/// Bases that are kept: some megabytes each; candidates begin from two or three levers.
const KEPT: usize = 4;

impl Prepared {
    /// For other events of the same data: nothing is prepared, what was worked counts together.
    pub(super) fn of_a_part(&self) -> Self {
        Self { work: self.work.clone(), ..Self::default() }
    }

    /// Counts steps of a mode that simulations take.
    pub(super) fn count(&self, steps: usize) {
        self.work.fetch_add(steps as u64, Ordering::Relaxed);
    }

    /// Steps of a mode that all simulations so far have taken: between fits the same on one thread and on many.
    pub(super) fn work(&self) -> u64 {
        self.work.load(Ordering::Relaxed)
    }

    /// The filter, made where it is not yet.
    pub(super) fn whitener(&self, make: impl FnOnce() -> Whitener) -> Arc<Whitener> {
        self.whitener.get_or_init(|| Arc::new(make())).clone()
    }

    /// The basis near some exponentials.
    pub(super) fn directions(
        &self,
        reference: &[Exponential],
        early: usize,
        cut: Cut,
        whitener: impl FnOnce() -> Arc<Whitener>,
    ) -> Arc<Directions> {
        let key: Key = (reference.iter().map(|e| [e.pole.re.to_bits(), e.pole.im.to_bits()]).collect(), early);
        let latest = || self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some((_, known)) = latest().iter().find(|(known, _)| *known == key) {
            return known.clone();
        }
        let made = Arc::new(Directions::new(reference, early, cut, &whitener()));
        let mut latest = latest();
        latest.truncate(KEPT - 1);
        latest.insert(0, (key, made.clone()));
        made
    }
}

impl Directions {
    fn new(reference: &[Exponential], early: usize, cut: Cut, whitener: &Whitener) -> Self {
        let (before, samples) = (cut.before, cut.samples);
        let mut own = columns(reference, cut.interval_s, samples - before);
        let count = own.len();
        for column in &mut own[..count - 2] {
            column.splice(0..0, std::iter::repeat_n(0.0, before));
        }
        let centre = 0.5 * (samples.max(2) - 1) as f64;
        own[count - 2] = vec![1.0; samples];
        own[count - 1] = (0..samples).map(|k| (k as f64 - centre) / centre).collect();
        own.push((0..samples).map(|k| if k < before { 1.0 } else { 0.0 }).collect());
        let unit = |at: usize| (0..samples).map(|k| if k == before + at { 1.0 } else { 0.0 }).collect();
        own.extend((0..early).map(unit));
        let mut all = Signals::with_capacity(samples, own.len());
        own.iter().for_each(|column| all.push(column));
        all.whiten(whitener);
        let qr = Qr::new(all.matrix().to_owned());
        Self { r: qr.r(), q: qr.q() }
    }
}

#[cfg(test)]
mod tests {
    use faer::c64;

    use super::*;
    use crate::ringdown::RingdownNoise;

    #[test]
    fn the_same_basis_is_made_once_and_the_latest_are_kept() {
        let cut = Cut { before: 16, samples: 600, interval_s: 2e-7 };
        let filter = || Arc::new(Whitener::new(&RingdownNoise::white(1e-6), cut.interval_s, cut.samples, &[]));
        let prepared = Prepared::default();
        let at = |frequency: f64| [Exponential { pole: c64::new(-3e3, frequency), residue: c64::new(1.0, 0.0) }];
        let basis = |frequency: f64, early: usize| prepared.directions(&at(frequency), early, cut, filter);
        let first = basis(3e5, 4);
        assert!(Arc::ptr_eq(&first, &basis(3e5, 4)));
        // another pole, other early samples: another basis
        assert!(!Arc::ptr_eq(&first, &basis(3.1e5, 4)) && !Arc::ptr_eq(&first, &basis(3e5, 5)));
        (0..KEPT).for_each(|i| drop(basis(4e5 + i as f64, 4)));
        let again = basis(3e5, 4);
        assert!(!Arc::ptr_eq(&first, &again), "the oldest has made room");
        assert_eq!((&first.q, &first.r), (&again.q, &again.r), "the same numbers, kept or made again");
    }

    #[test]
    fn the_filter_is_made_once() {
        let prepared = Prepared::default();
        let make = || Whitener::new(&RingdownNoise::white(1e-6), 2e-7, 100, &[]);
        let first = prepared.whitener(make);
        assert!(Arc::ptr_eq(&first, &prepared.whitener(|| unreachable!("it is there"))));
    }
}
