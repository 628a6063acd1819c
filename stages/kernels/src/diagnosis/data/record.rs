//! Runs of a system, and parts of them.

/// One run of a system: its input, if it was measured, and its outputs, equally sampled.
#[derive(Debug, Clone, PartialEq)]
pub struct Record<'a> {
    /// Input, all finite; empty where there is none: a free decay.
    pub input: &'a [f64],
    /// Outputs, channel by channel, as long as the input; NaN where missing.
    pub outputs: Vec<&'a [f64]>,
}

impl Record<'_> {
    /// Samples of each channel.
    pub fn samples(&self) -> usize {
        self.outputs.first().map_or(0, |output| output.len())
    }
}

/// Consecutive samples of a record.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Stretch {
    /// Number of the record, from 0.
    pub record: usize,
    /// First sample, from 0.
    pub first: usize,
    /// One past the last.
    pub end: usize,
}

impl Stretch {
    /// How many samples.
    pub fn samples(&self) -> usize {
        self.end.saturating_sub(self.first)
    }
}

/// Where the state at the beginning of a judged part comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum PartStart {
    /// The simulation of the stretch that was learnt from goes on into the part.
    GoesOn,
    /// So many of its first samples set it and are not scored.
    FirstSamples(usize),
    /// All of its samples set it and are scored: amplitude and phase of a decay of which nothing else is known.
    Whole,
}

/// A part that chooses nothing: what is named is judged on it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Part {
    /// Its name.
    pub name: String,
    /// Where it lies.
    pub stretch: Stretch,
    /// Where its state comes from.
    pub start: PartStart,
}
