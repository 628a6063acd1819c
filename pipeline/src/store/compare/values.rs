//! The values of two datasets, of whatever type.

use hdf5::types::{FloatSize, IntSize, TypeDescriptor};
use hdf5::{Container, H5Type};

use super::Pair;
use super::document;
use super::numbers::Numbers;
use crate::error::{Result, StoreError};
use crate::hdf5_files::read::{self, Allowance};

/// What differs between two datasets.
pub(super) struct Found {
    pub(super) what: String,
    pub(super) numbers: Option<Numbers>,
}

/// Numbers with their exact bits.
pub(super) struct Values {
    pub(super) bits: Vec<u64>,
    pub(super) numbers: Vec<f64>,
}

/// What differs between two containers of one type and shape. Errors: they cannot be read, or are of a type that this
/// store never writes.
pub(super) fn differing(
    pair: &Pair,
    kind: &TypeDescriptor,
    errors: &dyn Fn() -> Option<Vec<f64>>,
) -> Result<Option<Found>> {
    let Pair { a, b, allowances: [of_a, of_b] } = pair;
    match (read_numbers(a, of_a)?, read_numbers(b, of_b)?) {
        (Some(left), Some(right)) => Ok(numbers(&left, &right, errors)),
        _ => match kind {
            TypeDescriptor::VarLenAscii
            | TypeDescriptor::VarLenUnicode
            | TypeDescriptor::FixedAscii(_)
            | TypeDescriptor::FixedUnicode(_) => Ok(texts(&read::read_texts(a, of_a)?, &read::read_texts(b, of_b)?)),
            other => Err(StoreError::new(format!("values of type {other} cannot be compared"))),
        },
    }
}

fn numbers(left: &Values, right: &Values, errors: &dyn Fn() -> Option<Vec<f64>>) -> Option<Found> {
    let differs = |index: &usize| left.bits.get(*index) != right.bits.get(*index);
    let first = (0..left.bits.len()).find(differs)?;
    let count = (first..left.bits.len()).filter(differs).count();
    let errors = errors().filter(|errors| errors.len() == left.numbers.len()).unwrap_or_default();
    let mut numbers = Numbers::new(count, left.bits.len());
    for (index, (&x, &y)) in left.numbers.iter().zip(&right.numbers).enumerate() {
        numbers.add(x, y, errors.get(index).copied(), || format!("[{index}]"));
    }
    let (x, y) = (left.numbers.get(first)?, right.numbers.get(first)?);
    let what = format!("{count} of {} values differ, first at {first}: {x:?} and {y:?}", left.bits.len());
    Some(Found { what, numbers: Some(numbers) })
}

fn texts(left: &[String], right: &[String]) -> Option<Found> {
    if let ([x], [y]) = (left, right)
        && let Some(found) = document::differing(x, y)
    {
        return Some(found);
    }
    let differs = |index: &usize| left.get(*index) != right.get(*index);
    let first = (0..left.len()).find(differs)?;
    let count = (first..left.len()).filter(differs).count();
    let (x, y) = (left.get(first)?, right.get(first)?);
    let what = format!("{count} of {} values differ, first at {first}: {x:?} and {y:?}", left.len());
    Some(Found { what, numbers: None })
}

/// The numbers of a container; none if it holds something else. Errors: damaged.
pub(super) fn read_numbers(container: &Container, allowance: &Allowance) -> Result<Option<Values>> {
    use TypeDescriptor as T;
    let container = (container, allowance);
    match read::descriptor(container.0)? {
        T::Float(FloatSize::U8) => values::<f64>(container, f64::to_bits, |value| value),
        T::Float(FloatSize::U4) => values::<f32>(container, |value| u64::from(value.to_bits()), f64::from),
        T::Integer(IntSize::U1) => values::<i8>(container, |value| i64::from(value) as u64, f64::from),
        T::Integer(IntSize::U2) => values::<i16>(container, |value| i64::from(value) as u64, f64::from),
        T::Integer(IntSize::U4) => values::<i32>(container, |value| i64::from(value) as u64, f64::from),
        T::Integer(IntSize::U8) => values::<i64>(container, |value| value as u64, |value| value as f64),
        T::Unsigned(IntSize::U1) => values::<u8>(container, u64::from, f64::from),
        T::Unsigned(IntSize::U2) => values::<u16>(container, u64::from, f64::from),
        T::Unsigned(IntSize::U4) => values::<u32>(container, u64::from, f64::from),
        T::Unsigned(IntSize::U8) => values::<u64>(container, |value| value, |value| value as f64),
        _ => Ok(None),
    }
}

fn values<T: H5Type + Copy>(
    (container, allowance): (&Container, &Allowance),
    bits: fn(T) -> u64,
    number: fn(T) -> f64,
) -> Result<Option<Values>> {
    read::check_size(container, size_of::<T>(), allowance)?;
    let raw = container.read_raw::<T>()?;
    Ok(Some(Values {
        bits: raw.iter().map(|&value| bits(value)).collect(),
        numbers: raw.iter().map(|&value| number(value)).collect(),
    }))
}
