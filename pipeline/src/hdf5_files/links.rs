//! What leads out of a file is refused: a link, or a dataset whose values lie elsewhere, may name any file that this
//! program can read; its bytes would be no part of a hash, and one that never ends would be read for ever. External
//! links are followed nowhere (see `library`).

use hdf5::plist::dataset_create::Layout;
use hdf5::{Dataset, File, Group, IndexType, IterationOrder, LinkType, LocationType};

use crate::error::StoreError;

/// Objects of one file that are looked at, and how deep groups lie in each other: a file of numbers needs a few.
const MOST_OBJECTS: usize = 100_000;
const MOST_DEPTH: usize = 32;

/// Sees that a file holds nothing but groups and datasets of its own. Errors: a soft or external link, data in other
/// files, too many objects.
pub(crate) fn refuse_links(file: &File) -> Result<(), StoreError> {
    let mut left = MOST_OBJECTS;
    group(file, 0, &mut left)
}

fn group(own: &Group, depth: usize, left: &mut usize) -> Result<(), StoreError> {
    if depth > MOST_DEPTH {
        return Err(wrong(format!("has groups more than {MOST_DEPTH} deep, such as {}", own.name())));
    }
    for (name, link) in own.links(IndexType::Name, IterationOrder::Native)? {
        *left = left.checked_sub(1).ok_or_else(|| wrong(format!("holds more than {MOST_OBJECTS} objects")))?;
        let path = format!("{}/{name}", own.name().trim_end_matches('/'));
        if link.link_type != LinkType::Hard {
            return Err(wrong(format!("holds the link {path}: wanted datasets, and no links")));
        }
        match own.loc_type_by_name(&name)? {
            LocationType::Group => group(&own.group(&name)?, depth + 1, left)?,
            LocationType::Dataset => require_own_values(&own.dataset(&name)?)
                .map_err(|error| wrong(format!("holds the dataset {path}: {}", error.problem)))?,
            // a type leads nowhere
            _ => {}
        }
    }
    Ok(())
}

/// Sees that a dataset has its values in the file itself; nothing else may be asked of it before. Errors: it is
/// virtual, or has external files.
pub(crate) fn require_own_values(dataset: &Dataset) -> Result<(), StoreError> {
    let how = dataset.dcpl()?;
    if how.layout() == Layout::Virtual || !how.get_external()?.is_empty() {
        let help = "copy them into one file: h5repack does, or h5py with f.create_dataset(name, data=dataset[...])";
        return Err(wrong("its values lie in another file: wanted them in this one".to_owned()).help(help));
    }
    Ok(())
}

fn wrong(problem: String) -> StoreError {
    StoreError::new(problem)
}
