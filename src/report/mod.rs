//! The report: one self-contained HTML page about a run, in the words of what was measured.
//!
//! ```text
//! RunResult
//!     -> batch/ (of many data sets) + diagnosis/ (its story) + paper/ (of a lever's events) or measured/ (of anything
//!        else), with the words of origin + generic/ (every stage)
//!     -> page -> template.html
//! ```
//!
//! The page loads nothing, follows the reader's colour scheme and prints. The same run gives the same bytes.

mod batch;
mod diagnosis;
mod drawn;
mod estimates;
mod figure;
mod find;
mod generic;
mod measured;
mod number;
mod origin;
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
