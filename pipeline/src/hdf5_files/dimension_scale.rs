//! Dimension scales: what ties a variable's axes to their coordinates for netCDF readers such as xarray.
//!
//! Both ends know of each other, as HDF5's dimension scale specification wants: a variable lists its scales
//! (`DIMENSION_LIST`), a scale the variables that it belongs to (`REFERENCE_LIST`). H5DSattach_scale rewrites the
//! second list with every variable; here it is written once.

use hdf5::types::VarLenArray;
use hdf5::{Dataset, ObjectReference1};

use super::library::{ScaledDimension, attribute, make_scale};
use crate::error::{Result, StoreError};

const SCALES: &str = "DIMENSION_LIST";
const USES: &str = "REFERENCE_LIST";

/// The scales of a group's variables.
#[derive(Debug, Default)]
pub(crate) struct Scales(Vec<Scale>);

#[derive(Debug)]
struct Scale {
    name: String,
    dataset: Dataset,
    reference: ObjectReference1,
    uses: Vec<ScaledDimension>,
}

impl Scales {
    /// Makes a one-dimensional dataset the scale `name`. Errors: the library refuses.
    pub(crate) fn add(&mut self, name: &str, dataset: Dataset) -> Result<()> {
        let failed = |error| wrapped("make a dimension scale of", name, error);
        make_scale(&dataset, name).map_err(failed)?;
        let reference = dataset.reference(".").map_err(failed)?;
        self.0.push(Scale { name: name.to_owned(), dataset, reference, uses: Vec::new() });
        Ok(())
    }

    /// Attaches scales by name, one for every dimension of a dataset that has one. Errors: one is not there; the
    /// library refuses.
    pub(crate) fn attach(&mut self, dataset: &Dataset, names: &[Option<&str>]) -> Result<()> {
        if names.iter().all(Option::is_none) {
            return Ok(());
        }
        let failed = |error| wrapped("attach dimension scales to", &dataset.name(), error);
        let own: ObjectReference1 = dataset.reference(".").map_err(failed)?;
        let mut list = Vec::with_capacity(names.len());
        for (dimension, name) in (0..).zip(names) {
            let Some(name) = name else {
                list.push(VarLenArray::from_slice(&[]));
                continue;
            };
            let found = self.0.iter_mut().find(|scale| scale.name == *name);
            let scale = found.ok_or_else(|| StoreError::new(format!("no axis `{name}`")).at(dataset.name()))?;
            scale.uses.push(ScaledDimension::new(own, dimension));
            list.push(VarLenArray::from_slice(&[scale.reference]));
        }
        attribute(dataset, SCALES, &[list.len()], &list).map_err(failed)
    }

    /// Tells every scale what it belongs to. Errors: the library refuses.
    pub(crate) fn finish(self) -> Result<()> {
        for Scale { name, dataset, uses, .. } in self.0 {
            if !uses.is_empty() {
                attribute(&dataset, USES, &[uses.len()], &uses)
                    .map_err(|error| wrapped("list the uses of the scale", &name, error))?;
            }
        }
        Ok(())
    }
}

fn wrapped(doing: &str, name: &str, error: hdf5::Error) -> StoreError {
    StoreError::new(format!("HDF5 cannot {doing} `{name}`: {error}"))
}
