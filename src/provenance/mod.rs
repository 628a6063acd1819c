//! Where results come from: differences, traces, repetitions, crates.

pub mod diff;
pub mod differences;
pub mod digest;
pub mod files;
pub mod located;
pub mod path;
pub mod repeat;
pub mod research_object;
pub mod same;
pub mod tree;
