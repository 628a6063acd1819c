//! Level 4: variables one behind the other, each with 20 bytes of header.

use super::stream::Stream;
use super::text;
use crate::fail;
use crate::grid::Store;
use crate::listing::{Array, Listing};
use crate::number::Number;
use crate::pinned::Pinned;
use crate::{Contents, FormatError};
use std::fs::File;

/// MATLAB 4 allowed 19 characters; others who write the format allow more, nobody more than this.
const MOST_NAME_BYTES: u32 = 256;

/// Code of the machine, in the thousands of the type.
const BIG_ENDIAN_IEEE: u32 = 1;
const CRAY: u32 = 4;

/// One variable's header.
#[derive(Debug, Clone, Copy)]
struct Header {
    big_endian: bool,
    machine: u32,
    reserved: u32,
    precision: u32,
    kind: u32,
    rows: u32,
    columns: u32,
    imaginary: u32,
    name_bytes: u32,
}

impl Header {
    /// Reads the five numbers in the byte order in which the type is below 5000. A zero is little-endian by definition.
    fn of(bytes: &[u8; 20]) -> Self {
        let words = bytes.as_chunks::<4>().0;
        let first = words.first().copied().unwrap_or_default();
        let big_endian = u32::from_le_bytes(first) >= 5000;
        let mut numbers =
            words.iter().map(|&word| if big_endian { u32::from_be_bytes(word) } else { u32::from_le_bytes(word) });
        let mut next = || numbers.next().unwrap_or_default();
        let (code, rows, columns, imaginary, name_bytes) = (next(), next(), next(), next(), next());
        Self {
            big_endian,
            machine: code / 1000,
            reserved: code / 100 % 10,
            precision: code / 10 % 10,
            kind: code % 10,
            rows,
            columns,
            imaginary,
            name_bytes,
        }
    }

    fn is_plausible(self) -> bool {
        let machine_fits = if self.big_endian {
            matches!(self.machine, BIG_ENDIAN_IEEE | CRAY)
        } else {
            self.machine != BIG_ENDIAN_IEEE
        };
        machine_fits
            && self.machine <= 4
            && self.reserved == 0
            && self.precision <= 5
            && self.kind <= 2
            && self.imaginary <= 1
            && self.rows <= i32::MAX as u32
            && self.columns <= i32::MAX as u32
            && (1..=MOST_NAME_BYTES).contains(&self.name_bytes)
    }

    fn number(self) -> Option<Number> {
        const NUMBERS: [Number; 6] = [Number::F64, Number::F32, Number::I32, Number::I16, Number::U16, Number::U8];
        NUMBERS.get(self.precision as usize).copied()
    }
}

/// There is no mark: the numbers of the header must make sense and the name be one.
pub(super) fn recognises(head: &[u8]) -> bool {
    let Some((first, rest)) = head.split_first_chunk::<20>() else { return false };
    let header = Header::of(first);
    let name = rest.get(..header.name_bytes as usize).unwrap_or(rest);
    header.is_plausible() && is_name(name)
}

/// A letter, then letters, digits and underscores, then a zero. Bytes behind the zero are ignored.
fn is_name(bytes: &[u8]) -> bool {
    let Some(end) = bytes.iter().position(|&byte| byte == 0) else { return false };
    let name = bytes.get(..end).unwrap_or_default();
    name.first().is_some_and(u8::is_ascii_alphabetic)
        && name.iter().all(|&byte| byte.is_ascii_alphanumeric() || byte == b'_')
}

pub(super) fn open(pinned: &Pinned, file: File) -> Result<Contents, FormatError> {
    let mut listing = Listing::default();
    let mut stream = Stream::plain(file, 0, pinned.bytes());
    let mut big_endian = false;
    while stream.position() < pinned.bytes() {
        let at = stream.position();
        let header = Header::of(&stream.array(pinned.bytes(), "the header of a variable")?);
        if !header.is_plausible() {
            let problem = "no header of a MATLAB 4 variable where the next one should begin";
            return Err(fail::at(at, problem, fail::COPY_AGAIN));
        }
        if let 2..=4 = header.machine {
            let machine = ["VAX D-float", "VAX G-float", "Cray"].get(header.machine as usize - 2).copied();
            let problem =
                format!("the variable is in the number format {}, IEEE was wanted", machine.unwrap_or_default());
            return Err(fail::at(at, problem, "load it in a MATLAB that can and save it again with -v7"));
        }
        big_endian = header.big_endian;
        variable(&mut listing, &mut stream, pinned, header)?;
    }
    let order = if big_endian { "big" } else { "little" };
    Ok(listing.finish(format!("MATLAB 4 MAT-file, {order}-endian")))
}

fn variable(listing: &mut Listing, stream: &mut Stream, pinned: &Pinned, header: Header) -> Result<(), FormatError> {
    let at = stream.position();
    let name = stream.bytes(header.name_bytes.into(), pinned.bytes(), "the name of a variable")?;
    if !is_name(&name) {
        return Err(fail::at(at, "a variable's name that ends with a zero was wanted", fail::COPY_AGAIN));
    }
    let name = crate::text::latin(name.split(|&byte| byte == 0).next().unwrap_or_default());
    let Some(number) = header.number() else {
        return Err(fail::at(at, "a number format from 0 to 5 was wanted", fail::COPY_AGAIN));
    };
    let (rows, columns) = (u64::from(header.rows), u64::from(header.columns));
    // Below 2^31 each, so their product times 16 may pass 2^64.
    let parts = if header.imaginary == 1 { 2 } else { 1 };
    let data = u128::from(rows) * u128::from(columns) * u128::from(number.bytes()) * parts;
    let first = stream.position();
    let Some(data) = u64::try_from(data).ok().filter(|&data| data <= pinned.bytes() - first) else {
        let problem =
            format!("{name} has {rows} by {columns} numbers of {} bytes, the file ends before", number.bytes());
        return Err(fail::at(first, problem, fail::COPY_AGAIN));
    };
    let array = Array {
        location: format!("/{name}"),
        scope: String::new(),
        long_name: name.clone(),
        shape: vec![rows as usize, columns as usize],
        first_axis_fastest: true,
        base: 1,
        unit: String::new(),
        store: Store::File(pinned.clone()),
        first,
        item_bytes: number.bytes(),
        number,
        big_endian: header.big_endian,
    };
    match (header.kind, parts) {
        (1, _) => texts(listing, stream, &array, pinned.bytes(), data)?,
        (2, _) => listing.remark(format!("/{name} is a sparse matrix, no channel")),
        (_, 2) => {
            listing.remark(format!("/{name} is complex, no channel: real and imaginary part would be two"));
            listing.complex(&array, first + data / 2);
        }
        _ if rows * columns == 1 => {
            let bytes = stream.bytes(data, pinned.bytes(), "a number")?;
            let value = number.decode(&bytes, header.big_endian).widened().first().copied().unwrap_or_default();
            listing.scalar("", &name, &array.location, value);
        }
        _ => listing.array(&array),
    }
    stream.skip(first + data - stream.position(), pinned.bytes())
}

/// Characters are stored as numbers, usually doubles.
fn texts(listing: &mut Listing, stream: &mut Stream, array: &Array, end: u64, data: u64) -> Result<(), FormatError> {
    let characters = array.shape.iter().product();
    if array.shape.first() != Some(&1) || characters > text::SHORT {
        listing.remark(text::remark_long(&array.location, characters));
        return Ok(());
    }
    let codes = array.number.decode(&stream.bytes(data, end, "a text")?, array.big_endian).widened();
    let shown: String = codes.into_iter().map(|code| char::from_u32(code as u32).unwrap_or('\u{fffd}')).collect();
    listing.text(&array.location, &shown, text::remark_short(&array.location, &shown));
    Ok(())
}
