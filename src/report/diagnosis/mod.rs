//! The story of a diagnosis on one page: what is wrong, the picture that gave it away, what every further cause bought.
//!
//! ```text
//! diagnosed.rs (what a stage says) -> words.rs, overlay.rs, telling.rs + panels, tiles.rs, ladder.rs, modes.rs -> section.rs
//! ```

mod diagnosed;
mod ladder;
mod modes;
mod overlay;
mod panels;
mod section;
mod telling;
mod tiles;
mod words;

#[cfg(test)]
pub(super) mod fixture;
#[cfg(test)]
mod tests;

pub(crate) use section::section;
pub(crate) use words::verdict_tiles;
