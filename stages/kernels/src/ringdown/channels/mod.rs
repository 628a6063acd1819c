//! Free decays in several channels, fitted with shared poles: frequencies, damping and complex mode shapes.
//!
//! [`fit_channels`] is the front door. In reading order: options, records (what is fitted), basis, recursion and
//! projection (amplitudes solved for), fit (the search on poles), noise (of each channel), bank (where another mode may be), order
//! (how many there are), shape (rank-one residues), result.

mod bank;
mod basis;
mod fit;
mod noise;
mod options;
mod order;
mod projection;
mod records;
mod recursion;
mod result;
mod shape;
#[cfg(test)]
mod tests;

pub use options::{ChannelNoise, ChannelOptions, ModesWanted};
pub use order::fit_channels;
pub use result::{ChannelRingdown, OrderTried, RecordFit};
pub use shape::{ModeShape, RankOne, ShapePoint};
