//! Measured input and output from the channels of one file.

mod at_hand;
mod example;
mod overdriven;
mod part;
mod selection;
mod series;
mod stage;
mod stretch;
#[cfg(test)]
mod tests;

pub use at_hand::{Recorded, pair_of_series};
pub use selection::Column;
pub use stage::Columns;
pub use stretch::{Removal, Stretch, Trend, halves};
