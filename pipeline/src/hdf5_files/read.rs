//! Checked HDF5 reading: whatever the bytes, an error instead of a panic, a huge allocation or an endless walk.
//!
//! [`open_file`] is the one door: it wants the finding of a pass through the file. What it gives carries an allowance,
//! the bytes that may still be read out of the file: it is a few times the file's own, since every number and every
//! text lies in it once, compressed samples aside, which are streamed.

use std::collections::HashSet;
use std::ops::Deref;
use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

use afmid_formats::most_inflated;
use hdf5::file::FileCloseDegree;
use hdf5::types::{FixedAscii, FixedUnicode, TypeDescriptor, VarLenAscii, VarLenUnicode};
use hdf5::{Container, Dataset, File, Group, H5Type, Location};

use super::heap_guard::Vetted;
use super::library::{self, follow_no_external_links};
use super::links::require_own_values;
use super::write::path_of;
use crate::error::{Result, StoreError};
use crate::files::open_regular;

/// An allowance is this many times the file, and a little for small ones: a text is read for a list and again for what
/// is listed, and a comparison reads standard errors once more.
const MOST_READS: u64 = 4;
const SPARE_BYTES: u64 = 1 << 20;

/// Bytes of texts of fixed length, which are padded while they are read.
const MOST_PADDED_BYTES: u64 = 64 << 20;

/// Names that are listed of one object, in messages and of attributes.
const MOST_NAMES: usize = 1000;

/// What may still be read out of a file. Clones share it.
#[derive(Debug, Clone)]
pub(crate) struct Allowance {
    vetted: Vetted,
    left: Arc<AtomicU64>,
}

impl Allowance {
    fn new(vetted: Vetted) -> Self {
        let all = vetted.file_bytes.saturating_mul(MOST_READS).saturating_add(SPARE_BYTES);
        Self { vetted, left: Arc::new(AtomicU64::new(all)) }
    }

    /// Errors: more bytes than are left.
    fn take(&self, bytes: Option<u64>) -> Result<()> {
        let take = |left: u64| bytes.and_then(|bytes| left.checked_sub(bytes));
        match self.left.fetch_update(Ordering::Relaxed, Ordering::Relaxed, take) {
            Ok(_) => Ok(()),
            Err(left) => {
                let (file, wanted) = (self.vetted.file_bytes, bytes.map_or("countless".to_owned(), |n| n.to_string()));
                Err(StoreError::new(format!(
                    "asks for {wanted} bytes and more of a file of {file}: damaged (left: {left})"
                )))
            }
        }
    }

    fn left(&self) -> u64 {
        self.left.load(Ordering::Relaxed)
    }
}

/// An object of a file with the file's allowance.
#[derive(Debug, Clone)]
pub(crate) struct Opened<T> {
    object: T,
    allowance: Allowance,
}

/// A group of a file that is read.
pub(crate) type Node = Opened<Group>;

impl<T> Deref for Opened<T> {
    type Target = T;

    fn deref(&self) -> &T {
        &self.object
    }
}

impl<T> Opened<T> {
    fn with<U>(&self, object: U) -> Opened<U> {
        Opened { object, allowance: self.allowance.clone() }
    }

    /// What may still be read out of the file.
    pub(crate) fn allowance(&self) -> &Allowance {
        &self.allowance
    }
}

impl Opened<File> {
    /// The root group with an allowance of its own: for one pass through the file, or one artifact.
    pub(crate) fn root(&self) -> Node {
        let root: &Group = &self.object;
        Opened { object: root.clone(), allowance: Allowance::new(self.allowance.vetted) }
    }
}

/// Opens an HDF5 file for reading. Errors: there is none, it is not HDF5, it is cut short, it is not the one that was
/// looked through.
pub(crate) fn open_file(path: &Path, vetted: &Vetted) -> Result<Opened<File>> {
    let io = |error: std::io::Error| StoreError::io("cannot be opened", path, &error);
    let size = open_regular(path).and_then(|file| file.metadata()).map_err(io)?.len();
    if size == 0 {
        return Err(StoreError::new("the file is empty, wanted HDF5").file(path));
    }
    if size != vetted.file_bytes {
        let problem = format!("the file has {size} bytes, it had {} when it was looked through", vetted.file_bytes);
        return Err(StoreError::new(problem).file(path).help("wait until nothing writes to it"));
    }
    follow_no_external_links()?;
    let file = File::with_options()
        // closed with the last of its objects (`Semi` would leave it open for ever where the file goes out of scope
        // before a dataset)
        .with_fapl(|access| access.fclose_degree(FileCloseDegree::Weak).file_locking(false))
        .open(path)
        .map_err(|error| {
            let text = error.to_string();
            if text.contains("truncated file") {
                StoreError::new(format!("the file is cut short ({size} bytes are left): {text}"))
            } else {
                StoreError::new(format!("not a readable HDF5 file: {text}"))
            }
            .file(path)
        })?;
    Ok(Opened { object: file, allowance: Allowance::new(*vetted) })
}

/// Sees that no two of several groups are one: links that lead to one place make a small file large.
#[derive(Debug, Default)]
pub(crate) struct Apart(HashSet<String>);

impl Apart {
    /// Errors: the group was there before.
    pub(crate) fn add(&mut self, group: &Node) -> Result<()> {
        let info = group.loc_info()?;
        if self.0.insert(format!("{:?}", info.token)) {
            return Ok(());
        }
        Err(StoreError::new("two links lead to the group: damaged").at(group.name()))
    }
}

/// The names of a group's members, ascending. Errors: damaged; more than the file has room for.
pub(crate) fn member_names(group: &Node) -> Result<Vec<String>> {
    // a link has a name, an address and what says that it is one
    const LEAST_LINK_BYTES: u64 = 16;
    let most = group.allowance.vetted.file_bytes / LEAST_LINK_BYTES;
    let (mut names, listed) = names_up_to(group, usize::try_from(most).unwrap_or(usize::MAX));
    listed.map_err(|error| StoreError::from(error).at(group.name()))?;
    names.sort_unstable();
    Ok(names)
}

/// The first names, and whether there was an error or more.
fn names_up_to(group: &Group, most: usize) -> (Vec<String>, hdf5::Result<()>) {
    let mut names = Vec::new();
    let listed = group.iter_visit_default(|name, _| {
        if names.len() >= most {
            return Err("more members than the file has room for: damaged".into());
        }
        names.push(name.to_owned());
        Ok(())
    });
    (names, listed)
}

/// The names of an object's attributes, the first thousand.
pub(crate) fn attribute_names(owner: &Location) -> Vec<String> {
    let mut names = Vec::new();
    // what stops the walk is no error
    let _ = owner.iter_attrs(hdf5::IndexType::default(), hdf5::IterationOrder::default(), |name, _| {
        names.push(name.to_owned());
        if names.len() < MOST_NAMES { Ok(()) } else { Err("enough".into()) }
    });
    names
}

pub(crate) fn group(parent: &Node, name: &str) -> Result<Node> {
    let found = parent.group(name).map_err(|_| missing("group", parent, name))?;
    Ok(parent.with(found))
}

pub(crate) fn dataset(parent: &Node, name: &str) -> Result<Opened<Dataset>> {
    let found = parent.dataset(name).map_err(|_| missing("dataset", parent, name))?;
    require_own_values(&found).map_err(|error| error.at(path_of(parent, name)))?;
    Ok(parent.with(found))
}

fn missing(what: &str, parent: &Group, name: &str) -> StoreError {
    let have = names_up_to(parent, MOST_NAMES).0.join(", ");
    StoreError::new(format!("the {what} is missing or damaged; there is: {have}")).at(path_of(parent, name))
}

/// All values of a dataset of numbers. Errors: missing, of another type, damaged.
pub(crate) fn numbers<T: H5Type>(parent: &Node, name: &str) -> Result<Vec<T>> {
    let dataset = dataset(parent, name)?;
    let place = path_of(parent, name);
    let (wanted, found) = (T::type_descriptor(), descriptor(&dataset).map_err(|error| error.at(&place))?);
    if found != wanted {
        return Err(StoreError::new(format!("found values of type {found}, wanted {wanted}")).at(place));
    }
    check_size(&dataset, size_of::<T>(), dataset.allowance()).map_err(|error| error.at(&place))?;
    dataset.read_raw().map_err(|error| StoreError::from(error).at(place))
}

pub(crate) fn number<T: H5Type + Copy>(parent: &Node, name: &str) -> Result<T> {
    one(numbers(parent, name)?).map_err(|error| error.at(path_of(parent, name)))
}

/// All texts of a dataset. Errors: missing, of another type, damaged, not UTF-8.
pub(crate) fn texts(parent: &Node, name: &str) -> Result<Vec<String>> {
    let dataset = dataset(parent, name)?;
    read_texts(&dataset, dataset.allowance()).map_err(|error| error.at(path_of(parent, name)))
}

pub(crate) fn text(parent: &Node, name: &str) -> Result<String> {
    one(texts(parent, name)?).map_err(|error| error.at(path_of(parent, name)))
}

/// What has attributes.
pub(crate) trait HasLocation {
    /// As the library sees it.
    fn location(&self) -> &Location;
}

impl HasLocation for Group {
    fn location(&self) -> &Location {
        self
    }
}

impl HasLocation for Dataset {
    fn location(&self) -> &Location {
        self
    }
}

/// A text attribute. Errors: missing, another type.
pub(crate) fn text_attribute<T: HasLocation>(owner: &Opened<T>, name: &str) -> Result<String> {
    let location = owner.location();
    let place = || format!("{}@{name}", location.name());
    let attribute =
        location.attr(name).map_err(|_| StoreError::new("the attribute is missing or damaged").at(place()))?;
    one(read_texts(&attribute, owner.allowance()).map_err(|error| error.at(place()))?)
        .map_err(|error| error.at(place()))
}

/// A numeric attribute of type `T`. Errors: missing, another type.
pub(crate) fn attribute<T: H5Type + Copy>(owner: &Location, name: &str) -> Result<T> {
    let place = || format!("{}@{name}", owner.name());
    let attribute = owner.attr(name).map_err(|_| StoreError::new("the attribute is missing or damaged").at(place()))?;
    let found = descriptor(&attribute).map_err(|error| error.at(place()))?;
    if found != T::type_descriptor() || attribute.size() != 1 {
        return Err(StoreError::new(format!("found {found}, wanted one {}", T::type_descriptor())).at(place()));
    }
    one(attribute.read_raw().map_err(|error| StoreError::from(error).at(place()))?)
}

pub(crate) fn descriptor(container: &Container) -> Result<TypeDescriptor> {
    Ok(container.dtype()?.to_descriptor()?)
}

/// Texts of a dataset or attribute, whatever the kind of HDF5 text. Errors: other types; more than the file can hold,
/// or is left of the allowance.
pub(crate) fn read_texts(container: &Container, allowance: &Allowance) -> Result<Vec<String>> {
    let descriptor = descriptor(container)?;
    let count = count_of(container)?;
    let texts = match descriptor {
        TypeDescriptor::VarLenUnicode | TypeDescriptor::VarLenAscii => {
            check_references(container, count, allowance)?;
            match descriptor {
                TypeDescriptor::VarLenUnicode => read_bytes::<VarLenUnicode>(container, VarLenUnicode::as_bytes),
                _ => read_bytes::<VarLenAscii>(container, VarLenAscii::as_bytes),
            }
        }
        TypeDescriptor::FixedAscii(size) if size <= 256 => {
            read_fixed::<FixedAscii<256>>(container, count, FixedAscii::as_bytes)
        }
        TypeDescriptor::FixedAscii(size) if size <= 8192 => {
            read_fixed::<FixedAscii<8192>>(container, count, FixedAscii::as_bytes)
        }
        TypeDescriptor::FixedUnicode(size) if size <= 256 => {
            read_fixed::<FixedUnicode<256>>(container, count, FixedUnicode::as_bytes)
        }
        TypeDescriptor::FixedUnicode(size) if size <= 8192 => {
            read_fixed::<FixedUnicode<8192>>(container, count, FixedUnicode::as_bytes)
        }
        other => Err(StoreError::new(format!("found values of type {other}, wanted text"))),
    }?;
    allowance.take(Some(texts.iter().map(|text| text.len() as u64).sum()))?;
    Ok(texts)
}

fn read_fixed<T: H5Type>(container: &Container, count: u64, bytes: fn(&T) -> &[u8]) -> Result<Vec<String>> {
    match count.checked_mul(size_of::<T>() as u64) {
        Some(size) if size <= MOST_PADDED_BYTES => read_bytes(container, bytes),
        _ => Err(StoreError::new(format!("claims {count} texts of fixed length, wanted fewer: damaged"))),
    }
}

/// Sees that texts of variable length do not take more than the file allows, before any is read: references may all
/// lead to one large text, and state any length.
fn check_references(container: &Container, count: u64, allowance: &Allowance) -> Result<()> {
    allowance.take(count.checked_mul(library::REFERENCE_BYTES as u64))?;
    let lengths = library::text_lengths(container, count as usize)?;
    let (file, largest) = (allowance.vetted.file_bytes, allowance.vetted.largest_text);
    if let Some(length) = lengths.iter().find(|length| u64::from(**length) > largest) {
        return Err(StoreError::new(format!(
            "states a text of {length} bytes, the longest of the file has {largest}: damaged"
        )));
    }
    let total: u64 = lengths.into_iter().map(u64::from).sum();
    if total <= allowance.left() {
        return Ok(());
    }
    Err(StoreError::new(format!("claims {total} bytes of text in a file of {file}: damaged")))
}

fn read_bytes<T: H5Type>(container: &Container, bytes: fn(&T) -> &[u8]) -> Result<Vec<String>> {
    let values = container.read_raw::<T>()?;
    values
        .iter()
        .map(|value| {
            std::str::from_utf8(bytes(value)).map(str::to_owned).map_err(|_| StoreError::new("the text is not UTF-8"))
        })
        .collect()
}

fn count_of(container: &Container) -> Result<u64> {
    let shape = container.get_shape()?;
    let count = shape.iter().try_fold(1_u64, |product, &length| product.checked_mul(length as u64));
    count.ok_or_else(|| StoreError::new(format!("claims the shape {shape:?}: damaged")))
}

/// Takes the bytes of a container from the allowance. Errors: it claims more values than its file can hold, or than is
/// left.
pub(crate) fn check_size(container: &Container, bytes_per_value: usize, allowance: &Allowance) -> Result<()> {
    allowance.take(count_of(container)?.checked_mul(bytes_per_value as u64))
}

/// Refuses samples, perhaps compressed, that no file of this size can hold. They are streamed, so that nothing is taken
/// from the allowance.
pub(crate) fn check_samples(dataset: &Dataset, bytes_per_value: usize, allowance: &Allowance) -> Result<()> {
    let file_bytes = allowance.vetted.file_bytes;
    match count_of(dataset)?.checked_mul(bytes_per_value as u64) {
        Some(bytes) if bytes <= most_inflated(file_bytes) => Ok(()),
        _ => {
            let shape = dataset.get_shape()?;
            let most = most_inflated(file_bytes);
            Err(StoreError::new(format!(
                "claims the shape {shape:?} in a file of {file_bytes} bytes, wanted at most {most} bytes of samples: \
                 damaged"
            )))
        }
    }
}

fn one<T>(values: Vec<T>) -> Result<T> {
    let found = values.len();
    let mut values = values.into_iter();
    match (values.next(), found) {
        (Some(value), 1) => Ok(value),
        _ => Err(StoreError::new(format!("found {found} values, wanted one"))),
    }
}
