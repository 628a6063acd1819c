//! MATLAB's texts, which may be names and units of channels.

use hdf5::types::{IntSize, TypeDescriptor};
use hdf5::{Dataset, ObjectReference, ObjectReference1, ReferencedObject};

use super::walk::Found;
use crate::hdf5_files::links::require_own_values;
use crate::hdf5_files::read::{Allowance, check_samples};
use crate::recording::native::{check_filters, has_attribute, text_attribute};

/// Longest text and most cells: names and units are no longer.
const MOST: usize = 64;
/// Bytes of a reference.
const REFERENCE_BYTES: usize = 8;

/// A text, or those in a cell array of nothing but texts, with their locations; none of anything else.
pub(super) fn texts(found: &Found, allowance: &Allowance) -> Vec<(String, String)> {
    let class = text_attribute(&found.dataset, "MATLAB_class", allowance);
    match class.as_deref() {
        Some("char") => {
            text(&found.dataset, allowance).map(|text| (found.location.clone(), text)).into_iter().collect()
        }
        Some("cell") => cells(found, allowance).unwrap_or_default(),
        _ => Vec::new(),
    }
}

fn cells(found: &Found, allowance: &Allowance) -> Option<Vec<(String, String)>> {
    let dataset = &found.dataset;
    if !readable(dataset, REFERENCE_BYTES, allowance) {
        return None;
    }
    let references = dataset.read_raw::<ObjectReference1>().ok()?;
    let cell = |(number, reference): (usize, &ObjectReference1)| match reference.dereference(dataset).ok()? {
        ReferencedObject::Dataset(cell) => {
            let class = text_attribute(&cell, "MATLAB_class", allowance)?;
            let text = (class == "char").then(|| text(&cell, allowance)).flatten()?;
            Some((format!("{}{{{}}}", found.location, number + 1), text))
        }
        _ => None,
    };
    references.iter().enumerate().map(cell).collect()
}

/// One line of text: 16-bit characters, as MATLAB has them.
fn text(dataset: &Dataset, allowance: &Allowance) -> Option<String> {
    let kind = dataset.dtype().and_then(|kind| kind.to_descriptor()).ok()?;
    let one_line = dataset.shape().iter().filter(|size| **size != 1).count() <= 1;
    let empty = has_attribute(dataset, "MATLAB_empty");
    if kind != TypeDescriptor::Unsigned(IntSize::U2) || !one_line || empty || !readable(dataset, 2, allowance) {
        return None;
    }
    let characters = dataset.read_raw::<u16>().ok()?;
    Some(String::from_utf16_lossy(&characters))
}

/// Whether it is small and its own values can be read.
fn readable(dataset: &Dataset, bytes: usize, allowance: &Allowance) -> bool {
    let size = dataset.get_shape().map(|shape| shape.iter().fold(1_usize, |all, size| all.saturating_mul(*size)));
    size.is_ok_and(|size| (1..=MOST).contains(&size))
        && require_own_values(dataset).is_ok()
        && check_samples(dataset, bytes, allowance).is_ok()
        && check_filters(dataset).is_ok()
}
