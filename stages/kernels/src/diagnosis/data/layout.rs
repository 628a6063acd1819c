//! How the channels of all stretches lie in one vector: stretch by stretch, channel by channel, sample by sample.

use std::ops::Range;

use super::Stretch;

/// Places of stretches and channels in the vector of all samples.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Layout {
    /// Channels.
    pub channels: usize,
    /// Samples of each stretch.
    lengths: Vec<usize>,
    /// Where each begins.
    begins: Vec<usize>,
}

impl Layout {
    pub fn new(stretches: &[Stretch], channels: usize) -> Self {
        let lengths: Vec<usize> = stretches.iter().map(Stretch::samples).collect();
        let mut begins = Vec::with_capacity(lengths.len());
        let mut at = 0;
        for length in &lengths {
            begins.push(at);
            at += length * channels;
        }
        Self { channels, lengths, begins }
    }

    /// Stretches.
    pub fn stretches(&self) -> usize {
        self.lengths.len()
    }

    /// Samples of a channel of stretch `e`.
    pub fn samples(&self, e: usize) -> usize {
        self.lengths.get(e).copied().unwrap_or(0)
    }

    /// Samples of a channel of all stretches.
    pub fn all_samples(&self) -> usize {
        self.lengths.iter().sum()
    }

    /// Values of all stretches and channels.
    pub fn values(&self) -> usize {
        self.all_samples() * self.channels
    }

    /// All channels of stretch `e`.
    pub fn stretch(&self, e: usize) -> Range<usize> {
        let begin = self.begins.get(e).copied().unwrap_or(0);
        begin..begin + self.samples(e) * self.channels
    }

    /// Samples `from..to` of one channel of stretch `e`.
    pub fn part(&self, e: usize, channel: usize, from: usize, to: usize) -> Range<usize> {
        let begin = self.stretch(e).start + channel * self.samples(e);
        begin + from..begin + to
    }
}
