//! One run per point of `[sweep]`: what they found, side by side.

pub mod point;
pub mod table;
