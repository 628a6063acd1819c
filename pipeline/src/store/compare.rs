//! Comparison of two result files, object by object, bit by bit.

use std::path::Path;

use hdf5::types::{FloatSize, IntSize, TypeDescriptor};
use hdf5::{Container, Group, H5Type, Location};

use super::error::{Result, StoreError};
use super::read;
use super::seal::check_seal;

/// Left out: when and where a run took place.
const LEFT_OUT: &str = "/entry/run";

/// Attributes of dimension scales that hold references between objects: they say nothing of their own.
const REFERENCES: [&str; 2] = ["DIMENSION_LIST", "REFERENCE_LIST"];

/// One difference between two files.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Difference {
    /// The object, or `object@attribute`.
    pub place: String,
    /// What differs.
    pub what: String,
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
    found.push(Difference { place: place.to_owned(), what: what.into() });
}

fn compare_groups(a: &Group, b: &Group, found: &mut Vec<Difference>) -> Result<()> {
    let place = a.name();
    if place == LEFT_OUT {
        return Ok(());
    }
    compare_attributes(a, b, &place, found)?;
    let (left, right) = (names(a)?, names(b)?);
    for name in only_in(&right, &left) {
        push(found, &super::write::path_of(a, name), "only in the second file");
    }
    for name in &left {
        let place = super::write::path_of(a, name);
        if !right.contains(name) {
            push(found, &place, "only in the first file");
        } else if let (Ok(x), Ok(y)) = (a.group(name), b.group(name)) {
            compare_groups(&x, &y, found)?;
        } else if let (Ok(x), Ok(y)) = (a.dataset(name), b.dataset(name)) {
            compare_attributes(&x, &y, &place, found)?;
            compare_values(&x, &y, &place, found)?;
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
        compare_values(&*a.attr(name)?, &*b.attr(name)?, &format!("{place}@{name}"), found)?;
    }
    Ok(())
}

fn compare_values(a: &Container, b: &Container, place: &str, found: &mut Vec<Difference>) -> Result<()> {
    let (kind, other) = (read::descriptor(a)?, read::descriptor(b)?);
    let (shape, other_shape) = (a.get_shape()?, b.get_shape()?);
    if kind != other {
        push(found, place, format!("type {kind} in the first file, {other} in the second"));
    } else if shape != other_shape {
        push(found, place, format!("shape {shape:?} in the first file, {other_shape:?} in the second"));
    } else if let Some(what) = differing(a, b, &kind).map_err(|error| error.at(place))? {
        push(found, place, what);
    }
    Ok(())
}

fn differing(a: &Container, b: &Container, kind: &TypeDescriptor) -> Result<Option<String>> {
    use TypeDescriptor as T;
    match kind {
        T::Float(FloatSize::U8) => bitwise::<f64>(a, b, |value| value.to_bits()),
        T::Float(FloatSize::U4) => bitwise::<f32>(a, b, |value| u64::from(value.to_bits())),
        T::Integer(IntSize::U1) => bitwise::<i8>(a, b, |value| i64::from(value) as u64),
        T::Integer(IntSize::U2) => bitwise::<i16>(a, b, |value| i64::from(value) as u64),
        T::Integer(IntSize::U4) => bitwise::<i32>(a, b, |value| i64::from(value) as u64),
        T::Integer(IntSize::U8) => bitwise::<i64>(a, b, |value| value as u64),
        T::Unsigned(IntSize::U1) => bitwise::<u8>(a, b, u64::from),
        T::Unsigned(IntSize::U2) => bitwise::<u16>(a, b, u64::from),
        T::Unsigned(IntSize::U4) => bitwise::<u32>(a, b, u64::from),
        T::Unsigned(IntSize::U8) => bitwise::<u64>(a, b, |value| value),
        T::VarLenAscii | T::VarLenUnicode | T::FixedAscii(_) | T::FixedUnicode(_) => {
            let (left, right) = (read::read_texts(a)?, read::read_texts(b)?);
            Ok(summary(&left, &right, |x, y| x == y))
        }
        other => Err(StoreError::new(format!("values of type {other} cannot be compared"))),
    }
}

fn bitwise<T>(a: &Container, b: &Container, bits: fn(T) -> u64) -> Result<Option<String>>
where
    T: H5Type + Copy + std::fmt::Debug,
{
    read::check_size(a, size_of::<T>())?;
    read::check_size(b, size_of::<T>())?;
    let (left, right) = (a.read_raw::<T>()?, b.read_raw::<T>()?);
    Ok(summary(&left, &right, |&x, &y| bits(x) == bits(y)))
}

/// How many values differ, and the first of them.
fn summary<T: std::fmt::Debug>(left: &[T], right: &[T], same: impl Fn(&T, &T) -> bool) -> Option<String> {
    let mut differing = left.iter().zip(right).enumerate().filter(|(_, (x, y))| !same(x, y));
    let (index, (x, y)) = differing.next()?;
    let count = 1 + differing.count();
    Some(format!("{count} of {} values differ, first at {index}: {x:?} and {y:?}", left.len()))
}
