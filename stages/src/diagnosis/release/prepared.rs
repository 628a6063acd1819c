//! What many fits to the same data need again.

use std::sync::{Arc, Mutex, OnceLock, PoisonError};

use faer::Mat;

use super::signals::Signals;
use super::window::Cut;
use crate::model::orthogonal::Qr;
use crate::model::ringdown::Exponential;
use crate::model::ringdown::internals::{Whitener, columns};

/// Whitening filter and the latest bases of a problem: the same numbers whether they are found here or made anew.
#[derive(Default)]
pub struct Prepared {
    whitener: OnceLock<Arc<Whitener>>,
    latest: Mutex<Vec<(Key, Arc<Directions>)>>,
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
