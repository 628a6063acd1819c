//! Signals of equal length, one after the other in memory.

use faer::MatRef;
use rayon::prelude::*;

use crate::ringdown::internals::{LANES, Whitener};

/// Signals of equal length.
#[derive(Debug, Clone)]
pub(super) struct Signals {
    samples: usize,
    values: Vec<f64>,
}

impl Signals {
    pub fn with_capacity(samples: usize, count: usize) -> Self {
        Self { samples, values: Vec::with_capacity(samples * count) }
    }

    pub fn push(&mut self, signal: &[f64]) {
        self.values.extend_from_slice(signal);
    }

    pub fn count(&self) -> usize {
        self.values.len() / self.samples.max(1)
    }

    pub fn get(&self, index: usize) -> &[f64] {
        &self.values[index * self.samples..(index + 1) * self.samples]
    }

    pub fn get_mut(&mut self, index: usize) -> &mut [f64] {
        &mut self.values[index * self.samples..(index + 1) * self.samples]
    }

    /// Parts of so many signals each.
    pub fn split(self, count: usize) -> Vec<Self> {
        let parts = self.values.chunks((count * self.samples).max(1));
        parts.map(|part| Self { samples: self.samples, values: part.to_vec() }).collect()
    }

    pub fn matrix(&self) -> MatRef<'_, f64> {
        MatRef::from_column_major_slice(&self.values, self.samples, self.count())
    }

    pub fn whiten(&mut self, whitener: &Whitener) {
        let samples = self.samples.max(1);
        self.values.par_chunks_mut(LANES * samples).for_each(|chunk| {
            let mut lanes: Vec<&mut [f64]> = chunk.chunks_mut(samples).collect();
            whitener.apply(&mut lanes);
        });
    }

    /// Every one less the first, which is taken out, over its divisor.
    pub fn quotients(&mut self, divisors: &[f64]) {
        let base: Vec<f64> = self.values.drain(..self.samples.min(self.values.len())).collect();
        for (signal, divisor) in self.values.chunks_mut(self.samples.max(1)).zip(divisors) {
            signal.iter_mut().zip(&base).for_each(|(s, b)| *s = (*s - b) / divisor);
        }
    }
}
