//! Freeing the cache: what has not been used for longest goes first.
//!
//! Nothing here can break a run: results are read whole into memory, files under way have names of their own, and what
//! is missing is computed again.

use std::fs;
use std::io::ErrorKind;
use std::path::Path;
use std::time::{Duration, SystemTime};

use super::stock::{Sort, Stock, Stored, age};
use crate::error::StoreError;

/// What may stay.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Limits {
    /// Results and stamps that have not been used for longer go.
    pub older_than: Option<Duration>,
    /// The least recently used results go until the rest is at most this many bytes.
    pub max_bytes: Option<u64>,
}

/// Why a file goes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Why {
    /// It is of no use to anybody.
    Leftover,
    /// It has not been used for longer than the limit.
    Old,
    /// The cache is larger than the limit.
    Size,
}

impl Why {
    /// Its name in messages and in JSON.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Leftover => "leftover",
            Self::Old => "older than the limit",
            Self::Size => "above the size limit",
        }
    }
}

/// A file that went, or would go.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Gone {
    /// The file.
    pub file: Stored,
    /// Why.
    pub why: Why,
}

/// What was freed, or would be.
#[derive(Debug, Clone, Default)]
pub struct Freed {
    /// What went, in this order.
    pub gone: Vec<Gone>,
    /// What is left.
    pub left: Stock,
    /// What could not be removed, and why not.
    pub failed: Vec<(Gone, String)>,
}

/// Frees a cache's folder: leftovers always, results and stamps as the limits say. `dry` removes nothing and says what
/// would go.
///
/// A result that a run uses in the meantime stays. Errors: the folder cannot be listed.
pub fn free(folder: &Path, limits: &Limits, dry: bool) -> Result<Freed, StoreError> {
    let stock = Stock::list(folder)?;
    let mut freed = Freed::default();
    for (file, why) in choose(stock, limits, SystemTime::now()) {
        let Some(why) = why else {
            freed.left.files.push(file);
            continue;
        };
        let gone = Gone { file, why };
        match if dry { Ok(true) } else { remove(&gone.file) } {
            Ok(true) => freed.gone.push(gone),
            Ok(false) => freed.left.files.push(gone.file),
            Err(error) => {
                freed.left.files.push(gone.file.clone());
                freed.failed.push((gone, error.to_string()));
            }
        }
    }
    Ok(freed)
}

/// Each file, and why it goes, if it does.
fn choose(stock: Stock, limits: &Limits, now: SystemTime) -> Vec<(Stored, Option<Why>)> {
    let old = |file: &Stored| limits.older_than.is_some_and(|limit| age(file.used, now) > limit);
    let mut chosen: Vec<(Stored, Option<Why>)> = stock
        .files
        .into_iter()
        .map(|file| {
            let why = match file.sort {
                Sort::Leftover => Some(Why::Leftover),
                Sort::Result | Sort::Stamp if old(&file) => Some(Why::Old),
                Sort::Result | Sort::Stamp => None,
            };
            (file, why)
        })
        .collect();
    let Some(most) = limits.max_bytes else { return chosen };
    let mut left: u64 = chosen.iter().filter(|(_, why)| why.is_none()).map(|(file, _)| file.bytes).sum();
    for (file, why) in chosen.iter_mut().filter(|(file, why)| why.is_none() && file.sort == Sort::Result) {
        if left <= most {
            break;
        }
        (left, *why) = (left.saturating_sub(file.bytes), Some(Why::Size));
    }
    chosen
}

/// Removes a file, a result with its origin; `false` if it was used since it was listed. A file that is gone already is
/// removed.
fn remove(file: &Stored) -> std::io::Result<bool> {
    let modified = fs::metadata(&file.path).and_then(|metadata| metadata.modified());
    if modified.is_ok_and(|modified| modified != file.used) {
        return Ok(false);
    }
    gone(fs::remove_file(&file.path))?;
    if file.sort == Sort::Result {
        gone(fs::remove_file(file.path.with_extension("json")))?;
    }
    Ok(true)
}

fn gone(removed: std::io::Result<()>) -> std::io::Result<()> {
    removed.or_else(|error| if error.kind() == ErrorKind::NotFound { Ok(()) } else { Err(error) })
}
