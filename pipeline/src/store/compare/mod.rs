//! Comparison of two result files, object by object, bit by bit.

mod document;
mod numbers;
mod values;

use std::path::Path;

use hdf5::{Container, Group, Location};

pub use numbers::Numbers;

use self::values::{Found, Values, differing, read_numbers};
use super::seal::check_seal;
use crate::artifact::std_name;
use crate::error::{Result, StoreError};
use crate::hdf5_files::read;

/// Left out: when and where a run took place.
const LEFT_OUT: &str = "/entry/run";

/// Attributes of dimension scales that hold references between objects: they say nothing of their own.
const REFERENCES: [&str; 2] = ["DIMENSION_LIST", "REFERENCE_LIST"];

/// One difference between two files.
#[derive(Debug, Clone, PartialEq)]
pub struct Difference {
    /// The object, or `object@attribute`.
    pub place: String,
    /// What differs.
    pub what: String,
    /// How far apart, if all that differs is numbers.
    pub numbers: Option<Numbers>,
}

/// All differences between two result files (or two stage files) except under `/entry/run`, by place. Numbers are compared bit by bit.
///
/// Errors: a file cannot be read or is damaged.
pub fn compare(a: &Path, b: &Path) -> std::result::Result<Vec<Difference>, StoreError> {
    check_seal(a)?;
    check_seal(b)?;
    let (left, right) = (read::open_file(a)?, read::open_file(b)?);
    let mut found = Vec::new();
    compare_groups(&left, &right, &mut found).map_err(|error| error.file(a))?;
    Ok(found)
}

fn push(found: &mut Vec<Difference>, place: &str, what: impl Into<String>) {
    found.push(Difference { place: place.to_owned(), what: what.into(), numbers: None });
}

fn compare_groups(a: &Group, b: &Group, found: &mut Vec<Difference>) -> Result<()> {
    let place = a.name();
    if place == LEFT_OUT {
        return Ok(());
    }
    compare_attributes(a, b, &place, found)?;
    let (left, right) = (names(a)?, names(b)?);
    for name in only_in(&right, &left) {
        push(found, &crate::hdf5_files::write::path_of(a, name), "only in the second file");
    }
    for name in &left {
        let place = crate::hdf5_files::write::path_of(a, name);
        if !right.contains(name) {
            push(found, &place, "only in the first file");
        } else if let (Ok(x), Ok(y)) = (a.group(name), b.group(name)) {
            compare_groups(&x, &y, found)?;
        } else if let (Ok(x), Ok(y)) = (a.dataset(name), b.dataset(name)) {
            compare_attributes(&x, &y, &place, found)?;
            // the first file's errors; the second's where the first has none
            let errors = || standard_errors(a, name, &left).or_else(|| standard_errors(b, name, &right));
            compare_values(&x, &y, &place, &errors, found)?;
        } else {
            push(found, &place, "a group in one file, a dataset in the other");
        }
    }
    Ok(())
}

fn names(group: &Group) -> Result<Vec<String>> {
    let mut names = group.member_names()?;
    names.sort_unstable();
    Ok(names)
}

fn only_in<'a>(these: &'a [String], others: &'a [String]) -> impl Iterator<Item = &'a String> {
    these.iter().filter(|name| !others.contains(name))
}

fn compare_attributes(a: &Location, b: &Location, place: &str, found: &mut Vec<Difference>) -> Result<()> {
    let list = |location: &Location| -> Result<Vec<String>> {
        let mut names = location.attr_names()?;
        names.retain(|name| !REFERENCES.contains(&name.as_str()));
        names.sort_unstable();
        Ok(names)
    };
    let (left, right) = (list(a)?, list(b)?);
    for name in only_in(&left, &right) {
        push(found, &format!("{place}@{name}"), "only in the first file");
    }
    for name in only_in(&right, &left) {
        push(found, &format!("{place}@{name}"), "only in the second file");
    }
    for name in left.iter().filter(|name| right.contains(name)) {
        compare_values(&*a.attr(name)?, &*b.attr(name)?, &format!("{place}@{name}"), &|| None, found)?;
    }
    Ok(())
}

/// Compares two datasets or attributes; `errors` gives the standard errors of the values, where there are any.
fn compare_values(
    a: &Container,
    b: &Container,
    place: &str,
    errors: &dyn Fn() -> Option<Vec<f64>>,
    found: &mut Vec<Difference>,
) -> Result<()> {
    let (kind, other) = (read::descriptor(a)?, read::descriptor(b)?);
    let (shape, other_shape) = (a.get_shape()?, b.get_shape()?);
    if kind != other {
        push(found, place, format!("type {kind} in the first file, {other} in the second"));
    } else if shape != other_shape {
        push(found, place, format!("shape {shape:?} in the first file, {other_shape:?} in the second"));
    } else if let Some(Found { what, numbers }) = differing(a, b, &kind, errors).map_err(|error| error.at(place))? {
        found.push(Difference { place: place.to_owned(), what, numbers });
    }
    Ok(())
}

/// The standard errors of dataset `name`, if its group holds them under the name that says so.
fn standard_errors(group: &Group, name: &str, names: &[String]) -> Option<Vec<f64>> {
    let errors = group.dataset(std_name(name, names.iter().map(String::as_str))?).ok()?;
    read_numbers(&errors).ok()?.map(|Values { numbers, .. }| numbers)
}
