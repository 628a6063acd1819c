//! Bytes to numbers.

use super::extents::Shape;
use super::kind::Kind;
use crate::Raw;
use crate::number::Order;

/// An empty stretch of the type that samples of `kind` are given in.
pub(super) fn empty(kind: Kind, digital: bool, capacity: usize) -> Raw {
    match kind {
        _ if digital => Raw::Int16(Vec::with_capacity(capacity)),
        Kind::Int8 | Kind::UInt8 | Kind::Boolean | Kind::Int16 => Raw::Int16(Vec::with_capacity(capacity)),
        Kind::UInt16 | Kind::Int32 => Raw::Int32(Vec::with_capacity(capacity)),
        Kind::Float32 => Raw::Float32(Vec::with_capacity(capacity)),
        _ => Raw::Float64(Vec::with_capacity(capacity)),
    }
}

/// Appends the `count` samples from `first` whose bytes, counted from that sample's, are `block`.
pub(super) fn append(raw: &mut Raw, shape: &Shape, block: &[u8], first: u64, count: u64) {
    let origin = shape.byte_of(first);
    let bytes = (first..first + count).filter_map(|sample| block.get((shape.byte_of(sample) - origin) as usize..));
    let order = shape.order;
    if let Some(bit) = shape.bit {
        let width = shape.kind.width().unwrap_or(1) as usize;
        if let Raw::Int16(out) = raw {
            // The bit counts from the value's least significant byte.
            let byte = if order == Order::Little { 0 } else { width - 1 };
            out.extend(bytes.filter_map(|b| b.get(byte)).map(|b| i16::from(b >> bit & 1)));
        }
        return;
    }
    match (raw, shape.kind) {
        (Raw::Int16(out), Kind::Int8) => {
            out.extend(bytes.filter_map(|b| number(b, order)).map(|v| i16::from(i8::from_le_bytes(v))))
        }
        (Raw::Int16(out), Kind::UInt8 | Kind::Boolean) => {
            out.extend(bytes.filter_map(|b| b.first()).map(|&b| i16::from(b)))
        }
        (Raw::Int16(out), Kind::Int16) => out.extend(bytes.filter_map(|b| number(b, order)).map(i16::from_le_bytes)),
        (Raw::Int32(out), Kind::UInt16) => {
            out.extend(bytes.filter_map(|b| number(b, order)).map(|v| i32::from(u16::from_le_bytes(v))))
        }
        (Raw::Int32(out), Kind::Int32) => out.extend(bytes.filter_map(|b| number(b, order)).map(i32::from_le_bytes)),
        (Raw::Float32(out), Kind::Float32) => {
            out.extend(bytes.filter_map(|b| number(b, order)).map(f32::from_le_bytes))
        }
        (Raw::Float64(out), Kind::UInt32) => {
            out.extend(bytes.filter_map(|b| number(b, order)).map(|v| f64::from(u32::from_le_bytes(v))))
        }
        (Raw::Float64(out), Kind::Int64) => {
            out.extend(bytes.filter_map(|b| number(b, order)).map(|v| i64::from_le_bytes(v) as f64))
        }
        (Raw::Float64(out), Kind::UInt64) => {
            out.extend(bytes.filter_map(|b| number(b, order)).map(|v| u64::from_le_bytes(v) as f64))
        }
        (Raw::Float64(out), Kind::Float64) => {
            out.extend(bytes.filter_map(|b| number(b, order)).map(f64::from_le_bytes))
        }
        // `empty` chose the row of numbers by the type, so nothing else can come.
        _ => {}
    }
}

/// The first `N` bytes, least significant first.
fn number<const N: usize>(bytes: &[u8], order: Order) -> Option<[u8; N]> {
    bytes.first_chunk().map(|&word| order.little(word))
}
