//! Output files that lead out of themselves are refused: a link may name any file that this program can read.

use hdf5::plist::dataset_create::Layout;
use hdf5::{Dataset, File, Group, IndexType, IterationOrder, LinkType, LocationType};

use crate::error::StoreError;

/// Objects of one file that are looked at, and how deep groups lie in each other: a file of numbers needs a few.
const MOST_OBJECTS: usize = 100_000;
const MOST_DEPTH: usize = 32;

/// Sees that a file holds nothing but groups and datasets of its own. Errors: a soft or external link, data in other files, too many objects.
pub(super) fn refuse_links(file: &File) -> Result<(), StoreError> {
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
            LocationType::Dataset => dataset(&own.dataset(&name)?, &path)?,
            // a type leads nowhere
            _ => {}
        }
    }
    Ok(())
}

fn dataset(own: &Dataset, path: &str) -> Result<(), StoreError> {
    let how = own.dcpl()?;
    if how.layout() == Layout::Virtual || !how.get_external()?.is_empty() {
        return Err(wrong(format!(
            "holds the dataset {path}, whose values lie in another file: wanted them in this one"
        )));
    }
    Ok(())
}

fn wrong(problem: String) -> StoreError {
    StoreError::new(problem)
}
