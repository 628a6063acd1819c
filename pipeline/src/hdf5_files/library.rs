//! The HDF5 library itself, for the small objects of which a result has hundreds.
//!
//! Its safe wrapper makes new property lists and spaces for every object and asks back about each: half of the time
//! that files took (docs/results/main-job.md). Here they are made once. All unsafe code of this package
//! is in this file.
#![allow(unsafe_code)]

use std::ffi::{CString, c_char, c_int, c_uint, c_void};
use std::sync::OnceLock;

use hdf5::plist::link_create::CharEncoding;
use hdf5::plist::{DatasetCreate, LinkCreate};
use hdf5::types::{CompoundField, CompoundType, TypeDescriptor, VarLenUnicode};
use hdf5::{Container, Dataset, Dataspace, Datatype, Group, H5Type, Location, ObjectReference1, ReferencedObject};
use hdf5_sys::h5a::{H5Aclose, H5Acreate2, H5Aread, H5Awrite};
use hdf5_sys::h5d::{H5Dcreate2, H5Dread, H5Dwrite};
use hdf5_sys::h5g::H5Gcreate2;
use hdf5_sys::h5i::{H5I_type_t, H5Iget_type, hid_t};
use hdf5_sys::h5l::{H5L_type_t, H5Lunregister};
use hdf5_sys::h5o::H5O_type_t;
use hdf5_sys::h5p::{H5P_CLS_GROUP_CREATE, H5P_DEFAULT, H5Pcreate, H5Pset_obj_track_times};
use hdf5_sys::h5s::H5S_ALL;
use hdf5_sys::h5t::{
    H5T_bkg_t, H5T_cdata_t, H5T_class_t, H5T_cmd_t, H5T_norm_t, H5T_order_t, H5T_pers_t, H5Tclose, H5Tcreate,
    H5Tget_class, H5Tget_ebias, H5Tget_fields, H5Tget_member_type, H5Tget_nmembers, H5Tget_norm, H5Tget_offset,
    H5Tget_order, H5Tget_precision, H5Tget_size, H5Tget_super, H5Tregister,
};

unsafe extern "C" {
    // the high-level part of the library has no wrapper
    fn H5DSset_scale(scale: hid_t, name: *const c_char) -> c_int;
}

/// What every object is made with: links in UTF-8, no times.
struct Kit {
    link: LinkCreate,
    dataset: DatasetCreate,
    /// Open until the process ends.
    group: hid_t,
}

/// Errors: the library has no memory left.
fn kit() -> hdf5::Result<&'static Kit> {
    static KIT: OnceLock<Kit> = OnceLock::new();
    if let Some(kit) = KIT.get() {
        return Ok(kit);
    }
    // SAFETY: a class of lists that the library has from its beginning, with the global lock held; the list was just
    // made.
    let group = hdf5::sync::sync(|| unsafe {
        let list = checked(H5Pcreate(*H5P_CLS_GROUP_CREATE))?;
        checked(H5Pset_obj_track_times(list, 0).into()).map(|_| list)
    })?;
    let link = LinkCreate::build().create_intermediate_group(true).char_encoding(CharEncoding::Utf8).finish()?;
    let dataset = DatasetCreate::build().obj_track_times(false).finish()?;
    Ok(KIT.get_or_init(|| Kit { link, dataset, group }))
}

/// From now on the library follows no external link, in no file: they would lead to any file that this process may
/// read. Errors: it refuses.
pub(crate) fn follow_no_external_links() -> hdf5::Result<()> {
    static DONE: OnceLock<()> = OnceLock::new();
    if DONE.get().is_none() {
        // SAFETY: no handle is passed; the class of links is the library's own; the lock is held, and who comes second
        // finds it done.
        hdf5::sync::sync(|| match DONE.get() {
            Some(()) => Ok(0),
            None => unsafe { checked(H5Lunregister(H5L_type_t::H5L_TYPE_EXTERNAL).into()) }.inspect(|_| {
                let _ = DONE.set(());
            }),
        })?;
    }
    Ok(())
}

/// Whether it is an attribute, not a dataset.
pub(crate) fn is_attribute(container: &Container) -> bool {
    // SAFETY: the handle is live; the call looks at it alone; the lock is held.
    hdf5::sync::sync(|| unsafe { H5Iget_type(container.id()) == H5I_type_t::H5I_ATTR })
}

/// A reference to a text in a heap: the text's length, the heap's place (8 bytes), its number there.
pub(crate) const REFERENCE_BYTES: usize = 16;

/// Records in records beyond this are not looked into.
const DEEPEST_TYPE: usize = 32;

/// Whether all floating point numbers of a type, those of records and arrays included, are coded as IEEE 754 has it for
/// their size of 2, 4 or 8 bytes. Others have the same sizes: bfloat16, those of the VAX.
pub(crate) fn floats_are_ieee(kind: &Datatype) -> bool {
    // SAFETY: the handle is live; the lock is held.
    hdf5::sync::sync(|| unsafe { has_ieee_floats(kind.id(), 0) })
}

/// # Safety
/// The handle is that of a type, and live; the library's lock is held.
unsafe fn has_ieee_floats(kind: hid_t, depth: usize) -> bool {
    // SAFETY: a member's handle is the caller's, and is closed once.
    let inner = |member: hid_t| unsafe {
        let fine = member >= 0 && depth < DEEPEST_TYPE && has_ieee_floats(member, depth + 1);
        if member >= 0 {
            H5Tclose(member);
        }
        fine
    };
    // SAFETY: the handle is live, and members are asked for by numbers below their count.
    unsafe {
        match H5Tget_class(kind) {
            H5T_class_t::H5T_FLOAT => is_ieee_float(kind),
            H5T_class_t::H5T_ARRAY => inner(H5Tget_super(kind)),
            H5T_class_t::H5T_COMPOUND => {
                (0..H5Tget_nmembers(kind)).all(|number| inner(H5Tget_member_type(kind, number as c_uint)))
            }
            _ => true,
        }
    }
}

/// # Safety
/// The handle is that of a floating point type, and live; the library's lock is held.
unsafe fn is_ieee_float(kind: hid_t) -> bool {
    let [mut sign, mut exponent, mut exponent_bits, mut fraction, mut fraction_bits] = [0_usize; 5];
    // SAFETY: the handle is live, and there is room for each answer.
    let (bits, bias, plain) = unsafe {
        let fields =
            H5Tget_fields(kind, &mut sign, &mut exponent, &mut exponent_bits, &mut fraction, &mut fraction_bits);
        let ordered = matches!(H5Tget_order(kind), H5T_order_t::H5T_ORDER_LE | H5T_order_t::H5T_ORDER_BE);
        let normal = H5Tget_norm(kind) == H5T_norm_t::H5T_NORM_IMPLIED && H5Tget_offset(kind) == 0;
        let bits = 8 * H5Tget_size(kind);
        (bits, H5Tget_ebias(kind), fields >= 0 && ordered && normal && H5Tget_precision(kind) == bits)
    };
    let wanted = match bits {
        16 => (5, 15),
        32 => (8, 127),
        64 => (11, 1023),
        _ => return false,
    };
    plain
        && (exponent_bits, bias) == wanted
        && (fraction, fraction_bits, exponent, sign) == (0, bits - 1 - wanted.0, bits - 1 - wanted.0, bits - 1)
}

/// The lengths of `count` texts of variable length, as their references state them. Reading the texts would ask for as
/// much memory before the library looks whether there are any. Errors: the library refuses; references of another size
/// than of files with addresses of 8 bytes.
pub(crate) fn text_lengths(container: &Container, count: usize) -> hdf5::Result<Vec<u32>> {
    let raw = raw_reference()?;
    let size = count.checked_mul(REFERENCE_BYTES).ok_or("too many texts")?;
    let mut bytes = vec![0_u8; size];
    let into = bytes.as_mut_ptr().cast();
    let attribute = is_attribute(container);
    // SAFETY: the handles are live; `count` is the number of elements in the container, each of which becomes one of
    // `raw`'s 16 bytes, for which there is room; the lock is held.
    hdf5::sync::sync(|| unsafe {
        if attribute {
            checked(H5Aread(container.id(), raw, into).into())
        } else {
            checked(H5Dread(container.id(), raw, H5S_ALL, H5S_ALL, H5P_DEFAULT, into).into())
        }
    })?;
    let length = |[a, b, c, d, ..]: &[u8; REFERENCE_BYTES]| u32::from_le_bytes([*a, *b, *c, *d]);
    Ok(bytes.as_chunks().0.iter().map(length).collect())
}

/// The type that texts of variable length are read as where their references are wanted: 16 bytes that mean nothing.
fn raw_reference() -> hdf5::Result<hid_t> {
    static RAW: OnceLock<hid_t> = OnceLock::new();
    if let Some(&raw) = RAW.get() {
        return Ok(raw);
    }
    let text = Datatype::from_type::<VarLenUnicode>()?;
    // SAFETY: the types are live and the name ends with a NUL; the function lives as long as the program; the lock is
    // held.
    let raw = hdf5::sync::sync(|| unsafe {
        let raw = checked(H5Tcreate(H5T_class_t::H5T_OPAQUE, REFERENCE_BYTES))?;
        checked(
            H5Tregister(H5T_pers_t::H5T_PERS_SOFT, c"afmid-reference".as_ptr(), text.id(), raw, Some(as_it_is)).into(),
        )?;
        Ok::<hid_t, hdf5::Error>(raw)
    })?;
    Ok(*RAW.get_or_init(|| raw))
}

/// The conversion of a reference to its bytes, which stay where they are.
extern "C" fn as_it_is(
    from: hid_t,
    to: hid_t,
    about: *mut H5T_cdata_t,
    _count: usize,
    _stride: usize,
    _background_stride: usize,
    _buffer: *mut c_void,
    _background: *mut c_void,
    _transfer: hid_t,
) -> c_int {
    // SAFETY: the library gives live types and a pointer to its own description of the conversion, or none; it holds
    // its lock.
    unsafe {
        let Some(about) = about.as_mut() else { return -1 };
        if about.command == H5T_cmd_t::H5T_CONV_INIT {
            about.need_bkg = H5T_bkg_t::H5T_BKG_NO;
            if H5Tget_size(from) != REFERENCE_BYTES || H5Tget_size(to) != REFERENCE_BYTES {
                return -1;
            }
        }
        0
    }
}

/// A new group. Errors: the library refuses.
pub(crate) fn group(parent: &Group, name: &str) -> hdf5::Result<Group> {
    let (kit, text) = (kit()?, c_text(name)?);
    // SAFETY: every handle is live for the length of the call, since its owner is borrowed; the name ends with a NUL;
    // the lock is held.
    let id = hdf5::sync::sync(|| unsafe {
        checked(H5Gcreate2(parent.id(), text.as_ptr(), kit.link.id(), kit.group, H5P_DEFAULT))
    })?;
    match ReferencedObject::from_type_and_id(H5O_type_t::H5O_TYPE_GROUP, id)? {
        ReferencedObject::Group(group) => Ok(group),
        other => Err(format!("{other:?} instead of a group").into()),
    }
}

/// A new contiguous dataset, nothing written to it. Errors: the library refuses.
pub(crate) fn empty_dataset<T: H5Type>(parent: &Group, name: &str, shape: &[usize]) -> hdf5::Result<Dataset> {
    create(parent, name, shape, &Datatype::from_type::<T>()?)
}

/// A new contiguous dataset of these values, row-major. Errors: the library refuses; they do not fill the shape.
pub(crate) fn filled_dataset<T: H5Type>(
    parent: &Group,
    name: &str,
    shape: &[usize],
    values: &[T],
) -> hdf5::Result<Dataset> {
    check_count(shape, values)?;
    let kind = Datatype::from_type::<T>()?;
    let dataset = create(parent, name, shape, &kind)?;
    if !values.is_empty() {
        // SAFETY: both handles are live; the dataset was made with this shape and type, and `values` are as many of it,
        // laid out as the type says (`H5Type`); the lock is held.
        hdf5::sync::sync(|| unsafe {
            let from = values.as_ptr().cast();
            checked(H5Dwrite(dataset.id(), kind.id(), H5S_ALL, H5S_ALL, H5P_DEFAULT, from).into())
        })?;
    }
    Ok(dataset)
}

fn create(parent: &Group, name: &str, shape: &[usize], kind: &Datatype) -> hdf5::Result<Dataset> {
    let (kit, text, space) = (kit()?, c_text(name)?, Dataspace::try_new(shape)?);
    let (link, creation) = (kit.link.id(), kit.dataset.id());
    // SAFETY: as for groups
    let id = hdf5::sync::sync(|| unsafe {
        checked(H5Dcreate2(parent.id(), text.as_ptr(), kind.id(), space.id(), link, creation, H5P_DEFAULT))
    })?;
    match ReferencedObject::from_type_and_id(H5O_type_t::H5O_TYPE_DATASET, id)? {
        ReferencedObject::Dataset(dataset) => Ok(dataset),
        other => Err(format!("{other:?} instead of a dataset").into()),
    }
}

/// A new attribute of these values. Errors: the library refuses; they do not fill the shape.
pub(crate) fn attribute<T: H5Type>(owner: &Location, name: &str, shape: &[usize], values: &[T]) -> hdf5::Result<()> {
    check_count(shape, values)?;
    let (text, kind, space) = (c_text(name)?, Datatype::from_type::<T>()?, Dataspace::try_new(shape)?);
    // SAFETY: every handle is live; the attribute is made with this shape and type, and `values` are as many of it,
    // laid out as the type says (`H5Type`); the name ends with a NUL; the lock is held. The new handle is closed and
    // nobody else has it.
    hdf5::sync::sync(|| unsafe {
        let id = checked(H5Acreate2(owner.id(), text.as_ptr(), kind.id(), space.id(), H5P_DEFAULT, H5P_DEFAULT))?;
        let written = checked(H5Awrite(id, kind.id(), values.as_ptr().cast()).into());
        let closed = checked(H5Aclose(id).into());
        written.and(closed).map(drop)
    })
}

/// Makes a one-dimensional dataset the dimension scale `name`. Errors: the library refuses.
pub(crate) fn make_scale(scale: &Dataset, name: &str) -> hdf5::Result<()> {
    let text = c_text(name)?;
    // SAFETY: the handle is live; the library copies the text, which ends with a NUL; the lock is held.
    hdf5::sync::sync(|| unsafe { checked(H5DSset_scale(scale.id(), text.as_ptr()).into()) }).map(drop)
}

/// One dimension of a dataset that has a scale: an element of the scale's `REFERENCE_LIST`.
#[derive(Debug, Clone, Copy)]
#[repr(C)]
pub(crate) struct ScaledDimension {
    dataset: ObjectReference1,
    dimension: u32,
    /// What lies between two elements, so that it is the same in every file.
    gap: u32,
}

impl ScaledDimension {
    pub(crate) fn new(dataset: ObjectReference1, dimension: u32) -> Self {
        Self { dataset, dimension, gap: 0 }
    }
}

// SAFETY: the fields lie where the descriptor says, the size is that of the structure, and none of its bytes is
// uninitialised.
unsafe impl H5Type for ScaledDimension {
    fn type_descriptor() -> TypeDescriptor {
        let field = |name: &str, kind, offset, index| CompoundField::new(name, kind, offset, index);
        let fields = vec![
            field("dataset", ObjectReference1::type_descriptor(), std::mem::offset_of!(Self, dataset), 0),
            field("dimension", u32::type_descriptor(), std::mem::offset_of!(Self, dimension), 1),
        ];
        TypeDescriptor::Compound(CompoundType { fields, size: size_of::<Self>() })
    }
}

fn check_count<T>(shape: &[usize], values: &[T]) -> hdf5::Result<()> {
    match shape.iter().try_fold(1_usize, |count, &length| count.checked_mul(length)) {
        Some(count) if count == values.len() => Ok(()),
        _ => Err(format!("{} values do not fill {shape:?}", values.len()).into()),
    }
}

fn c_text(text: &str) -> hdf5::Result<CString> {
    CString::new(text).map_err(|_| format!("the name {text:?} holds a NUL").into())
}

/// A handle or a status, unless it says that a call failed.
fn checked(answer: hid_t) -> hdf5::Result<hid_t> {
    if answer < 0 { Err(hdf5::Error::query()?) } else { Ok(answer) }
}
