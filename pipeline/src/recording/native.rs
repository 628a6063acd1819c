//! Native records: HDF5, one dataset per channel.

use std::path::Path;
use std::sync::Arc;

use afmid_formats::{Number, WANTED_RATE, brief_number, is_rate};
use hdf5::dataset::Layout;
use hdf5::datatype::ByteOrder;
use hdf5::filters::Filter;
use hdf5::types::{FloatSize, IntSize, TypeDescriptor};
use hdf5::{Dataset, Datatype, File, Group, Location};

use super::chunk::ChunkFilter;
use super::chunk_cache::ChunkCache;
use super::input_files::{HashedHdf5, InputFiles, require_same, require_state};
use super::source::{ChunkPlace, Hdf5Source, Item, Place};
use super::{Channel, Reading, Record};
use crate::error::StageError;
use crate::files::FileState;
use crate::hdf5_files::floats_are_ieee;
use crate::hdf5_files::links::require_own_values;
use crate::hdf5_files::read::{Allowance, Opened, check_samples, open_file, read_texts};

/// A channel to look for in a record.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Wanted<'a> {
    /// What it is to the stages: `deflection`, `piezo`.
    pub role: &'a str,
    /// Where it lies: `/deflection`.
    pub location: &'a str,
    /// Whether a record without it is an error; otherwise the record simply lacks the role.
    pub required: bool,
}

/// Opens a native record.
///
/// Model: file attributes `sample_rate_hz` and, if known, `started_at`; one one-dimensional dataset per channel
/// (integers or floats, contiguous or chunked) with attributes `units`, and, if not 1, 0, empty and none,
/// `scale_factor`, `add_offset`, `long_name`, `_FillValue`. value = stored * scale_factor + add_offset.
///
/// Errors: no file, not HDF5, cut short, damaged; an attribute or a required channel is missing or of another type.
pub fn open_native(files: &InputFiles, path: &Path, wanted: &[Wanted]) -> Result<Record, StageError> {
    let inspected = files.inspect_hdf5(path)?;
    hdf5::sync::sync(|| read_record(files, &open_file(path, &inspected.vetted)?, path, wanted, &inspected))
}

/// As [`open_native`] if the file is a native record: HDF5 that states a sample rate, whatever its channels. None: it
/// is another file, or damaged.
pub(super) fn open_if_native(files: &InputFiles, path: &Path, wanted: &[Wanted]) -> Result<Option<Record>, StageError> {
    let Ok(inspected) = files.inspect_hdf5(path) else { return Ok(None) };
    // one turn for all calls of the library: threads that open a file each would otherwise wait for one another some
    // fifty times
    hdf5::sync::sync(|| match open_file(path, &inspected.vetted) {
        Ok(file) if states_rate(&file) => read_record(files, &file, path, wanted, &inspected).map(Some),
        _ => Ok(None),
    })
}

fn read_record(
    files: &InputFiles,
    file: &Opened<File>,
    path: &Path,
    wanted: &[Wanted],
    inspected: &HashedHdf5,
) -> Result<Record, StageError> {
    let sample_rate_hz = number_attribute(file, "/", "sample_rate_hz").map_err(|error| {
        error
            .at(path)
            .help("native records state it as a file attribute: h5py.File(name, 'a').attrs['sample_rate_hz'] = 5e6")
    })?;
    if !is_rate(sample_rate_hz) {
        let found = brief_number(sample_rate_hz);
        let problem = format!("the attribute sample_rate_hz is {found}, wanted {WANTED_RATE}");
        return Err(StageError::new(problem)
            .at(path)
            .help("write the rate into the file, or read it as any HDF5: format = \"hdf5\" and sample_rate_hz = HZ"));
    }
    let mut channels = Vec::with_capacity(wanted.len());
    for channel in wanted {
        if let Some(dataset) = find(file, path, channel)? {
            channels.push(
                open_channel(files.chunks(), file, &dataset, (path, inspected), channel)
                    .map_err(|error| error.at(path))?,
            );
        }
    }
    // the library opened it by name
    require_state(path, &inspected.state)?;
    Ok(Record {
        name: path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default(),
        path: path.to_owned(),
        size: inspected.state.size(),
        blake3: inspected.blake3.clone(),
        sample_rate_hz,
        rate_relative_std: 0.0,
        started_at: text_attribute(file, "started_at", file.allowance()).unwrap_or_default(),
        first_sample: 0,
        reading: Reading::default(),
        channels,
    })
}

/// Whether a file is a native record, as [`open_if_native`] has it.
pub(crate) fn is_native(files: &InputFiles, path: &Path) -> bool {
    // damage that keeps the library busy for ever is looked for first
    let Ok(HashedHdf5 { vetted, .. }) = files.inspect_hdf5(path) else { return false };
    hdf5::sync::sync(|| open_file(path, &vetted).is_ok_and(|file| states_rate(&file)))
}

pub(super) fn states_rate(file: &File) -> bool {
    has_attribute(file, "sample_rate_hz")
}

pub(super) fn find(file: &File, path: &Path, wanted: &Wanted) -> Result<Option<Dataset>, StageError> {
    match file.dataset(wanted.location) {
        Ok(dataset) => {
            require_own(&dataset, wanted.location).map_err(|error| error.at(path))?;
            Ok(Some(dataset))
        }
        Err(_) if !wanted.required && !file.link_exists(wanted.location) => Ok(None),
        Err(_) => {
            let have = datasets(file);
            let problem = if file.group(wanted.location).is_ok() {
                format!("`{}` is a group, wanted a dataset", wanted.location)
            } else {
                format!("there is no channel `{}`", wanted.location)
            };
            let listed = if have.is_empty() { "no dataset at all".to_owned() } else { have.join(", ") };
            Err(StageError::new(format!("{problem}; the file has: {listed}"))
                .at(path)
                .help("set `channel` to one of them"))
        }
    }
}

/// Errors: the values lie in another file, whose bytes nobody would hash.
fn require_own(dataset: &Dataset, location: &str) -> Result<(), StageError> {
    require_own_values(dataset).map_err(|error| {
        let problem = format!("{location} is a dataset {}", error.problem);
        StageError::new(problem).help(error.help.unwrap_or_default())
    })
}

/// Paths of the datasets of a file, two levels deep: for messages.
fn datasets(file: &File) -> Vec<String> {
    let list = |group: &Group| -> Vec<String> {
        group.datasets().unwrap_or_default().iter().map(|dataset| dataset.name()).collect()
    };
    let mut names = list(file);
    for group in file.groups().unwrap_or_default() {
        names.extend(list(&group));
    }
    names
}

fn open_channel(
    chunks: &ChunkCache,
    file: &Opened<File>,
    dataset: &Dataset,
    hashed: (&Path, &HashedHdf5),
    wanted: &Wanted,
) -> Result<Channel, StageError> {
    let (location, allowance) = (wanted.location, file.allowance());
    let source = describe(chunks, allowance, dataset, hashed, location, None)?;
    let unit = text_attribute(dataset, "units", allowance).ok_or_else(|| {
        StageError::new(format!("{location}: the attribute `units` is missing"))
            .help("state the unit of stored * scale_factor + add_offset, such as `V`")
    })?;
    let optional = |name: &str, otherwise: f64| -> Result<f64, StageError> {
        if has_attribute(dataset, name) { number_attribute(dataset, location, name) } else { Ok(otherwise) }
    };
    let (scale_factor, add_offset) = (optional("scale_factor", 1.0)?, optional("add_offset", 0.0)?);
    if !scale_factor.is_finite() || scale_factor == 0.0 || !add_offset.is_finite() {
        return Err(StageError::new(format!(
            "{location}: scale_factor is {scale_factor} and add_offset {add_offset}, wanted finite numbers, the first not 0"
        )));
    }
    let fill = ["_FillValue", "missing_value"].into_iter().find(|name| has_attribute(dataset, name));
    Ok(Channel {
        role: wanted.role.to_owned(),
        location: location.to_owned(),
        samples: source.samples,
        unit,
        long_name: text_attribute(dataset, "long_name", allowance).unwrap_or_default(),
        scale_factor,
        add_offset,
        fill_code: fill.map(|name| number_attribute(dataset, location, name)).transpose()?,
        source: Arc::new(source),
    })
}

/// Of floating point numbers that the readers would take for others.
pub(super) const ODD_FLOATS: &str = "its floating point numbers are not those of IEEE 754 of 2, 4 or 8 bytes";

/// A number in the records of a dataset.
#[derive(Debug, Clone, Copy)]
pub(super) struct Part {
    pub(super) number: Number,
    /// Byte of it in a record.
    pub(super) offset: usize,
}

/// Opens one dataset of a file in this state as a source of samples, or one number of its records. Errors: as
/// [`open_native`]; the file is in another state.
pub(super) fn open_source(
    files: &InputFiles,
    path: &Path,
    state: FileState,
    location: &str,
    part: Option<Part>,
) -> Result<Hdf5Source, StageError> {
    let hashed = files.inspect_hdf5(path)?;
    require_same(path, &hashed.state, &state)?;
    let file = open_file(path, &hashed.vetted)?;
    let dataset =
        file.dataset(location).map_err(|_| StageError::new(format!("there is no channel `{location}`")).at(path))?;
    require_own(&dataset, location).map_err(|error| error.at(path))?;
    let source = describe(files.chunks(), file.allowance(), &dataset, (path, &hashed), location, part)
        .map_err(|error| error.at(path))?;
    // the library opened it by name
    require_state(path, &state)?;
    Ok(source)
}

fn describe(
    chunks: &ChunkCache,
    allowance: &Allowance,
    dataset: &Dataset,
    (path, hashed): (&Path, &HashedHdf5),
    location: &str,
    part: Option<Part>,
) -> Result<Hdf5Source, StageError> {
    let fail = |problem: String| StageError::new(format!("{location}: {problem}"));
    let hdf5 = |error: hdf5::Error| fail(format!("damaged: {error}"));
    let shape = dataset.get_shape().map_err(hdf5)?;
    let [samples] = shape[..] else {
        let found = if shape.is_empty() { "a single value".to_owned() } else { format!("the shape {shape:?}") };
        return Err(fail(format!("found {found}, wanted one dimension, time")));
    };
    let dtype = dataset.dtype().map_err(hdf5)?;
    if !floats_are_ieee(&dtype) {
        return Err(fail(ODD_FLOATS.to_owned()).help("store the numbers as float32 or float64"));
    }
    let (kind, offset) = match part {
        Some(part) => (part.number, part.offset),
        None => (number_of(&dtype).map_err(|error| fail(error.problem).help(error.help.unwrap_or_default()))?, 0),
    };
    let item = Item { bytes: if part.is_some() { dtype.size() } else { kind.bytes() as usize }, offset };
    if offset.checked_add(kind.bytes() as usize).is_none_or(|end| end > item.bytes) {
        return Err(fail(format!("damaged: a number at byte {offset} of records of {} bytes", item.bytes)));
    }
    check_samples(dataset, item.bytes, allowance).map_err(|error| fail(error.problem))?;
    let order = dtype.byte_order();
    check_filters(dataset).map_err(|error| fail(error.problem).help(error.help.unwrap_or_default()))?;
    let place = locate(dataset, item.bytes as u64, samples, hashed.state.size()).map_err(fail)?;
    // the library converts numbers, not parts of records
    if part.is_some() && (place == Place::Library || !matches!(order, ByteOrder::BigEndian | ByteOrder::LittleEndian)) {
        return Err(fail(
            "records that are not stored in one stretch or in gzip chunks, all in one byte order".to_owned(),
        )
        .help("store the column as a dataset of its own"));
    }
    Ok(Hdf5Source {
        path: path.to_owned(),
        state: hashed.state,
        vetted: hashed.vetted,
        location: location.to_owned(),
        samples,
        kind,
        item,
        big_endian: matches!(order, ByteOrder::BigEndian),
        place,
        number: chunks.source_number(),
        chunks: chunks.clone(),
    })
}

/// The type of a dataset's numbers. Errors: another type than those of native records.
fn number_of(dtype: &Datatype) -> Result<Number, StageError> {
    let descriptor = dtype.to_descriptor();
    descriptor.as_ref().ok().and_then(sample_type).ok_or_else(|| {
        let odd = |_| format!("an unusual number of {} bytes", dtype.size());
        let found = descriptor.map_or_else(odd, |descriptor| descriptor.to_string());
        let wanted = "int8 to int32, uint8 to uint32, float16, float32 or float64";
        StageError::new(format!("the samples are {found}, wanted {wanted}"))
            .help("store the converter's codes as int16 with scale_factor and add_offset")
    })
}

/// Errors: a filter of the dataset is not built in.
pub(super) fn check_filters(dataset: &Dataset) -> Result<(), StageError> {
    match dataset.filters().iter().find(|filter| !filter.decode_enabled()) {
        Some(filter) => {
            Err(StageError::new(format!("stored with the HDF5 filter {}, which is not built in", filter_name(filter)))
                .help("store it with gzip, or not compressed: h5repack -f GZIP=4 OLD.h5 NEW.h5"))
        }
        None => Ok(()),
    }
}

fn filter_name(filter: &Filter) -> String {
    let name = match filter.id() {
        32000 => "LZF",
        32001 => "Blosc",
        32004 => "LZ4",
        32008 => "bitshuffle",
        32013 => "ZFP",
        32015 => "Zstandard",
        32026 => "Blosc2",
        other => return format!("number {other}"),
    };
    name.to_owned()
}

pub(super) fn sample_type(descriptor: &TypeDescriptor) -> Option<Number> {
    use TypeDescriptor as T;
    Some(match descriptor {
        T::Integer(IntSize::U1) => Number::I8,
        T::Unsigned(IntSize::U1) => Number::U8,
        T::Integer(IntSize::U2) => Number::I16,
        T::Unsigned(IntSize::U2) => Number::U16,
        T::Integer(IntSize::U4) => Number::I32,
        T::Unsigned(IntSize::U4) => Number::U32,
        T::Float(FloatSize::U2) => Number::F16,
        T::Float(FloatSize::U4) => Number::F32,
        T::Float(FloatSize::U8) => Number::F64,
        _ => return None,
    })
}

/// Asks HDF5 where the samples lie. Errors: a place outside the file.
fn locate(dataset: &Dataset, item_bytes: u64, samples: usize, file_size: u64) -> Result<Place, String> {
    let creation = dataset.dcpl().map_err(|error| format!("damaged: {error}"))?;
    let inside = |offset: u64, bytes: u64| match offset.checked_add(bytes) {
        Some(end) if end <= file_size => Ok(()),
        _ => Err(format!("samples at byte {offset}, the file ends at {file_size}: it is cut short or damaged")),
    };
    match creation.layout() {
        Layout::Contiguous => match dataset.offset() {
            Some(offset) => {
                inside(offset, (samples as u64).saturating_mul(item_bytes))?;
                Ok(Place::Contiguous { offset })
            }
            None => Ok(Place::Library),
        },
        Layout::Chunked => {
            let Some(filters) = known_filters(&creation.filters()) else { return Ok(Place::Library) };
            let Some(&[length]) = creation.chunk().as_deref().filter(|chunk| chunk.len() == 1) else {
                return Err("damaged: the chunks have another rank than the dataset".to_owned());
            };
            let bytes = (length as u64).saturating_mul(item_bytes);
            if bytes > MOST_CHUNK_BYTES {
                return Err(format!("stored in chunks of {bytes} bytes, wanted at most {MOST_CHUNK_BYTES} each"));
            }
            let Some(chunks) = chunk_places(dataset, length, samples, file_size) else { return Ok(Place::Library) };
            for chunk in &chunks {
                inside(chunk.offset, chunk.bytes as u64)?;
                // deflate shrinks by at most 1032 to 1
                if (length as u64).saturating_mul(item_bytes) > (chunk.bytes as u64 + 1).saturating_mul(1100) {
                    return Err(format!("damaged: a chunk of {length} samples in {} bytes", chunk.bytes));
                }
            }
            Ok(Place::Chunked { length, chunks, filters })
        }
        _ => Ok(Place::Library),
    }
}

fn known_filters(filters: &[Filter]) -> Option<Vec<ChunkFilter>> {
    filters
        .iter()
        .map(|filter| match filter {
            Filter::Deflate(_) => Some(ChunkFilter::Deflate),
            Filter::Shuffle => Some(ChunkFilter::Shuffle),
            _ => None,
        })
        .collect()
}

/// Chunks are inflated whole.
const MOST_CHUNK_BYTES: u64 = 128 << 20;

/// The places of all chunks, in order; none if one was never written (it reads as the fill value).
fn chunk_places(dataset: &Dataset, length: usize, samples: usize, file_size: u64) -> Option<Vec<ChunkPlace>> {
    let count = samples.checked_div(length)? + usize::from(!samples.is_multiple_of(length));
    // every chunk takes an entry of 8 bytes and more in the file: a larger count is a damaged header
    if count as u64 > file_size / 8 {
        return None;
    }
    let mut places = vec![None; count];
    let mut seen = 0;
    let visited = dataset.chunks_visit(|chunk| {
        // a tree of chunks that leads to the same branch again and again has no end
        seen += 1;
        if seen > count {
            return 1;
        }
        let index = chunk.offset.first().map(|&first| first as usize / length);
        if let Some(place) = index.and_then(|index| places.get_mut(index)) {
            *place =
                Some(ChunkPlace { offset: chunk.addr, bytes: chunk.size as usize, skipped_filters: chunk.filter_mask });
        }
        0
    });
    visited.ok().filter(|()| seen == count)?;
    places.into_iter().collect()
}

pub(super) fn has_attribute(owner: &Location, name: &str) -> bool {
    owner.attr(name).is_ok()
}

/// A text attribute of any kind; none if it is missing or not text.
pub(super) fn text_attribute(owner: &Location, name: &str, allowance: &Allowance) -> Option<String> {
    let attribute = owner.attr(name).ok()?;
    read_texts(&attribute, allowance).ok()?.into_iter().next()
}

/// A number of any type in an attribute with one value.
pub(super) fn number_attribute(owner: &Location, place: &str, name: &str) -> Result<f64, StageError> {
    let fail = |problem: &str| StageError::new(format!("{place}: the attribute `{name}` {problem}"));
    match numbers_attribute(owner, place, name, 1)?.as_slice() {
        [value] => Ok(*value),
        _ => Err(fail("is empty")),
    }
}

/// At most so many numbers of any type in an attribute.
pub(super) fn numbers_attribute(
    owner: &Location,
    place: &str,
    name: &str,
    most: usize,
) -> Result<Vec<f64>, StageError> {
    let fail = |problem: String| StageError::new(format!("{place}: the attribute `{name}` {problem}"));
    let attribute = owner.attr(name).map_err(|_| fail("is missing".to_owned()))?;
    let kind = attribute.dtype().and_then(|dtype| dtype.to_descriptor());
    let numeric =
        matches!(kind, Ok(TypeDescriptor::Integer(_) | TypeDescriptor::Unsigned(_) | TypeDescriptor::Float(_)));
    if !numeric || !(1..=most).contains(&attribute.size()) {
        return Err(fail("is not a single number".to_owned()));
    }
    attribute.read_raw::<f64>().map_err(|error| fail(format!("cannot be read: {error}")))
}
