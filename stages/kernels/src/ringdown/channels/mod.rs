//! Free decays in several channels, fitted with shared poles: frequencies, damping and complex mode shapes.
//!
//! [`fit_channels`] is the front door. In reading order: options, records (what is fitted), basis, recursion and
//! projection (amplitudes solved for), fit (the search on poles), noise (of each channel), levels (of what
//! is left round a line), bank (where another mode may be), order
//! (how many there are), start (of a given number), shape (rank-one residues), result,
//! companions (what is no mode), course (whether modes move: [`follow_channels`]), lines and laws (those that follow laws of their
//! amplitude), own (each hit's poles) and systems (whether all hits are of one:
//! [`hit_systems`]).

mod bank;
mod basis;
mod companions;
mod course;
#[cfg(test)]
mod course_tests;
mod fit;
mod laws;
#[cfg(test)]
mod laws_tests;
mod levels;
mod lines;
mod noise;
mod options;
mod order;
mod own;
mod projection;
mod records;
mod recursion;
mod result;
mod rows;
mod shape;
mod sidebands;
mod start;
mod systems;
#[cfg(test)]
mod systems_tests;
#[cfg(test)]
mod tests;

pub use companions::{Dropped, DroppedMode, HarmonicOf};
pub use course::{FollowedDecay, MOVES, ModeCourse, Motion, follow_channels, follow_fitted};
pub use laws::AmplitudeCourse;
pub use options::{ChannelNoise, ChannelOptions, ModesWanted};
pub use order::fit_channels;
pub use result::{ChannelRingdown, OrderTried, RecordFit};
pub use shape::{ModeShape, RankOne, ShapePoint};
pub use systems::{HitSystems, hit_systems};
