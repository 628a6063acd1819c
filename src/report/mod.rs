//! The report: one self-contained HTML page about a run, with the paper's figures where the run has what they show.
//!
//! ```text
//! RunResult
//!     -> batch/ (of many data sets) + diagnosis/ (its story) + paper/ (figures found by what artifacts mean)
//!        + generic/ (every stage)
//!     -> page -> template.html
//! ```
//!
//! The page loads nothing, follows the reader's colour scheme and prints. The same run gives the same bytes.

mod batch;
mod decay;
mod diagnosis;
mod figure;
mod find;
mod frf_modes;
mod generic;
mod number;
mod page;
mod palette;
mod paper;
mod png;
mod view;

#[cfg(test)]
mod fixture;
#[cfg(test)]
mod tests;

pub(crate) use page::{figures, is_page, report};
pub(crate) use png::Painter;
