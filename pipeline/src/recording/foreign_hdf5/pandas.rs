//! What pandas states of a frame: names of columns, and the unit of an index of moments.
//!
//! Fixed: `axis1` is the index, `block0_items` has the names of the columns of `block0_values`. As a table: the attribute
//! `values_block_0_kind` has the names, pickled by protocol 0, in which every text is a line that begins with `V`.

use std::collections::HashSet;

use super::walk::Found;
use crate::hdf5_files::read::{Allowance, read_texts};
use crate::recording::native::text_attribute;

/// More columns are no recording.
const MOST_NAMES: usize = 4096;

/// Names of the columns of a block of a fixed frame; empty if they are not stated, or do not tell the columns apart.
pub(super) fn block_names(found: &Found, allowance: &Allowance) -> Vec<String> {
    let Some(block) = found.name.strip_suffix("_values") else { return Vec::new() };
    let items = found.dataset.file().and_then(|file| file.dataset(&format!("{}/{block}_items", found.group)));
    distinct(items.ok().and_then(|items| read_texts(&items, allowance).ok()).unwrap_or_default())
}

/// Names that differ from each other and from those of the datasets that a frame has itself.
fn distinct(names: Vec<String>) -> Vec<String> {
    let own = |name: &String| name.is_empty() || name.starts_with("axis") || name.starts_with("block");
    let different: HashSet<&String> = names.iter().collect();
    if different.len() < names.len() || names.iter().any(own) { Vec::new() } else { names }
}

/// Names of the columns of a field of a table; empty if they are not stated.
pub(super) fn field_names(found: &Found, field: &str, allowance: &Allowance) -> Vec<String> {
    let kind = text_attribute(&found.dataset, &format!("{field}_kind"), allowance).unwrap_or_default();
    // every text but the first is appended to the list by the line before, which ends in `a`
    let text = |line: &'_ str| line.strip_prefix("aV").or_else(|| line.strip_prefix('V')).map(str::to_owned);
    distinct(kind.lines().filter_map(text).take(MOST_NAMES).collect())
}

/// The unit of an index of moments, which count from 1970 or from its first: `datetime64[ns]`, `timedelta64[ns]`.
pub(super) fn moments_unit(found: &Found, attribute: &str, allowance: &Allowance) -> Option<String> {
    let kind = text_attribute(&found.dataset, attribute, allowance)?;
    let rest = kind.strip_prefix("datetime64").or_else(|| kind.strip_prefix("timedelta64"))?;
    let unit = rest.strip_prefix('[').and_then(|rest| rest.split([']', ',']).next()).unwrap_or_default();
    Some(if unit.is_empty() { "ns".to_owned() } else { unit.to_owned() })
}
