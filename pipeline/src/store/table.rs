//! Tables: one dataset per column on a common dimension scale.
//!
//! Whole numbers are int64, yes or no int8 with xarray's `dtype = "bool"`, text variable-length UTF-8.

use hdf5::{Dataset, Group};
use serde::{Deserialize, Serialize};

use super::layout::{StoredAttribute, read_attributes, read_layout, write_attributes, write_layout};
use crate::artifact::{Column, ColumnValues, Table};
use crate::error::{Result, StoreError};
use crate::hdf5_files::Scales;
use crate::hdf5_files::read::Node;
use crate::hdf5_files::{read, write};

#[derive(Debug, Serialize, Deserialize)]
struct Layout {
    columns: Vec<StoredColumn>,
    attributes: Vec<StoredAttribute>,
}

#[derive(Debug, Serialize, Deserialize)]
struct StoredColumn {
    name: String,
    kind: Kind,
}

#[derive(Debug, Clone, Copy, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
enum Kind {
    Real,
    Integer,
    Flag,
    Text,
}

/// Writes a table as the group `name`: NXdata if it has a column to plot, NXcollection otherwise. Errors: it is not
/// valid.
pub(super) fn write_table(parent: &Group, name: &str, table: &Table) -> Result<Group> {
    table.validate().map_err(|error| StoreError::new(error.to_string()).at(write::path_of(parent, name)))?;
    let signal = table.columns.iter().find(|column| matches!(column.values, ColumnValues::Real(_)));
    let signal = signal.filter(|_| table.rows() > 0);
    let group = write::nexus_group(parent, name, if signal.is_some() { "NXdata" } else { "NXcollection" })?;
    let rows = row_name(table);
    if let Some(signal) = signal {
        write::text_attribute(&group, "signal", &signal.name)?;
        write::texts_attribute(&group, "axes", &[&rows])?;
        write::attribute(&group, &format!("{rows}_indices"), &0_i64)?;
    }
    let numbers: Vec<i64> = (0..table.rows() as i64).collect();
    let scale = write::dataset(&group, &rows, &[numbers.len()], &numbers)?;
    write::text_attribute(&scale, "long_name", "row")?;
    let mut scales = Scales::default();
    scales.add(&rows, scale)?;
    let mut columns = Vec::with_capacity(table.columns.len());
    for column in &table.columns {
        let (dataset, kind) = write_column(&group, column)?;
        scales.attach(&dataset, &[Some(&rows)])?;
        write::text_attribute(&dataset, "units", &column.unit)?;
        write::text_attribute(&dataset, "long_name", &column.long_name)?;
        columns.push(StoredColumn { name: column.name.clone(), kind });
    }
    scales.finish()?;
    let attributes = write_attributes(&group, &table.attributes)?;
    write_layout(&group, &Layout { columns, attributes })?;
    Ok(group)
}

/// `row`, or the first of `row_`, `row__`... that no column has.
fn row_name(table: &Table) -> String {
    let mut name = "row".to_owned();
    while table.columns.iter().any(|column| column.name == name) {
        name.push('_');
    }
    name
}

fn write_column(group: &Group, column: &Column) -> Result<(Dataset, Kind)> {
    let shape = [column.values.len()];
    Ok(match &column.values {
        ColumnValues::Real(values) => (write::dataset(group, &column.name, &shape, values)?, Kind::Real),
        ColumnValues::Integer(values) => (write::dataset(group, &column.name, &shape, values)?, Kind::Integer),
        ColumnValues::Text(values) => (write::texts(group, &column.name, values)?, Kind::Text),
        ColumnValues::Flag(values) => {
            let values: Vec<i8> = values.iter().map(|&flag| i8::from(flag)).collect();
            let dataset = write::dataset(group, &column.name, &shape, &values)?;
            write::text_attribute(&dataset, "dtype", "bool")?;
            (dataset, Kind::Flag)
        }
    })
}

/// Reads what [`write_table`] wrote. Errors: damaged, or of another layout.
pub(super) fn read_table(group: &Node) -> Result<Table> {
    let layout: Layout = read_layout(group)?;
    let mut table = Table { attributes: read_attributes(group, &layout.attributes)?, ..Table::default() };
    for StoredColumn { name, kind } in layout.columns {
        let values = match kind {
            Kind::Real => ColumnValues::Real(read::numbers(group, &name)?),
            Kind::Integer => ColumnValues::Integer(read::numbers(group, &name)?),
            Kind::Text => ColumnValues::Text(read::texts(group, &name)?),
            Kind::Flag => {
                ColumnValues::Flag(read::numbers::<i8>(group, &name)?.into_iter().map(|flag| flag != 0).collect())
            }
        };
        let dataset = read::dataset(group, &name)?;
        let unit = read::text_attribute(&dataset, "units")?;
        let long_name = read::text_attribute(&dataset, "long_name")?;
        table.columns.push(Column { name, unit, long_name, values });
    }
    table.validate().map_err(|error| StoreError::new(error.to_string()).at(group.name()))?;
    Ok(table)
}
