//! Comparison of two result files, object by object, bit by bit.

mod document;
mod numbers;
mod values;

use std::path::Path;

use hdf5::{Container, Location};

pub use numbers::Numbers;

use self::values::{Found, Values, differing, read_numbers};
use super::seal::check_seal;
use crate::artifact::std_name;
use crate::error::{Result, StoreError};
use crate::hdf5_files::read::{self, Allowance, Apart, HasLocation, Node, Opened};

/// Left out: when and where a run took place.
const LEFT_OUT: &str = "/entry/run";

/// Attributes of dimension scales that hold references between objects: they say nothing of their own.
const REFERENCES: [&str; 2] = ["DIMENSION_LIST", "REFERENCE_LIST"];

/// What this store writes is four deep.
const DEEPEST: usize = 32;

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

/// All differences between two result files (or two stage files) except under `/entry/run`, by place. Numbers are
/// compared bit by bit.
///
/// Errors: a file cannot be read or is damaged.
pub fn compare(a: &Path, b: &Path) -> std::result::Result<Vec<Difference>, StoreError> {
    let (left, right) = (check_seal(a)?, check_seal(b)?);
    let (left, right) = (read::open_file(a, &left)?, read::open_file(b, &right)?);
    let mut walk = Walk { found: Vec::new(), apart: Apart::default() };
    walk.groups(&left.root(), &right.root(), 0).map_err(|error| error.file(a))?;
    Ok(walk.found)
}

fn push(found: &mut Vec<Difference>, place: &str, what: impl Into<String>) {
    found.push(Difference { place: place.to_owned(), what: what.into(), numbers: None });
}

struct Walk {
    found: Vec<Difference>,
    /// The first file's groups: a circle of links ends here.
    apart: Apart,
}

impl Walk {
    fn groups(&mut self, a: &Node, b: &Node, depth: usize) -> Result<()> {
        let place = a.name();
        if place == LEFT_OUT {
            return Ok(());
        }
        self.apart.add(a)?;
        if depth > DEEPEST {
            return Err(StoreError::new(format!("groups are nested more than {DEEPEST} deep: damaged")).at(place));
        }
        compare_attributes(a, b, &place, &mut self.found)?;
        let (left, right) = (read::member_names(a)?, read::member_names(b)?);
        for name in only_in(&right, &left) {
            push(&mut self.found, &crate::hdf5_files::write::path_of(a, name), "only in the second file");
        }
        for name in &left {
            let place = crate::hdf5_files::write::path_of(a, name);
            if right.binary_search(name).is_err() {
                push(&mut self.found, &place, "only in the first file");
            } else {
                self.members([a, b], name, &place, [&left, &right], depth)?;
            }
        }
        Ok(())
    }

    /// Compares what has one name in both groups, whose members are `names`.
    fn members(
        &mut self,
        [a, b]: [&Node; 2],
        name: &str,
        place: &str,
        names: [&[String]; 2],
        depth: usize,
    ) -> Result<()> {
        match (read::group(a, name), read::group(b, name)) {
            (Ok(x), Ok(y)) => self.groups(&x, &y, depth + 1),
            (Err(_), Err(_)) => {
                let (x, y) = (read::dataset(a, name)?, read::dataset(b, name)?);
                compare_attributes(&x, &y, place, &mut self.found)?;
                // the first file's errors; the second's where the first has none
                let errors = || standard_errors(a, name, names[0]).or_else(|| standard_errors(b, name, names[1]));
                let pair = Pair { a: &x, b: &y, allowances: [x.allowance(), y.allowance()] };
                compare_values(&pair, place, &errors, &mut self.found)
            }
            (x, _) => {
                read::dataset(if x.is_ok() { b } else { a }, name)?;
                push(&mut self.found, place, "a group in one file, a dataset in the other");
                Ok(())
            }
        }
    }
}

/// Names of the first list that the second lacks; both ascend.
fn only_in<'a>(these: &'a [String], others: &'a [String]) -> impl Iterator<Item = &'a String> {
    these.iter().filter(|name| others.binary_search(name).is_err())
}

fn compare_attributes<T: HasLocation>(
    a: &Opened<T>,
    b: &Opened<T>,
    place: &str,
    found: &mut Vec<Difference>,
) -> Result<()> {
    let list = |location: &Location| -> Vec<String> {
        let mut names = read::attribute_names(location);
        names.retain(|name| !REFERENCES.contains(&name.as_str()));
        names.sort_unstable();
        names
    };
    let (left, right) = (list(a.location()), list(b.location()));
    for name in only_in(&left, &right) {
        push(found, &format!("{place}@{name}"), "only in the first file");
    }
    for name in only_in(&right, &left) {
        push(found, &format!("{place}@{name}"), "only in the second file");
    }
    for name in left.iter().filter(|name| right.binary_search(name).is_ok()) {
        let (x, y) = (a.location().attr(name)?, b.location().attr(name)?);
        let pair = Pair { a: &x, b: &y, allowances: [a.allowance(), b.allowance()] };
        compare_values(&pair, &format!("{place}@{name}"), &|| None, found)?;
    }
    Ok(())
}

/// Two datasets or attributes with what may still be read of their files.
struct Pair<'a> {
    a: &'a Container,
    b: &'a Container,
    allowances: [&'a Allowance; 2],
}

/// Compares two datasets or attributes; `errors` gives the standard errors of the values, where there are any.
fn compare_values(
    pair: &Pair,
    place: &str,
    errors: &dyn Fn() -> Option<Vec<f64>>,
    found: &mut Vec<Difference>,
) -> Result<()> {
    let Pair { a, b, .. } = pair;
    let (kind, other) = (read::descriptor(a)?, read::descriptor(b)?);
    let (shape, other_shape) = (a.get_shape()?, b.get_shape()?);
    if kind != other {
        push(found, place, format!("type {kind} in the first file, {other} in the second"));
    } else if shape != other_shape {
        push(found, place, format!("shape {shape:?} in the first file, {other_shape:?} in the second"));
    } else if let Some(Found { what, numbers }) = differing(pair, &kind, errors).map_err(|error| error.at(place))? {
        found.push(Difference { place: place.to_owned(), what, numbers });
    }
    Ok(())
}

/// The standard errors of dataset `name`, if its group holds them under the name that says so.
fn standard_errors(group: &Node, name: &str, names: &[String]) -> Option<Vec<f64>> {
    let errors = read::dataset(group, std_name(name, names.iter().map(String::as_str))?).ok()?;
    read_numbers(&errors, errors.allowance()).ok()?.map(|Values { numbers, .. }| numbers)
}
