//! Columns of equal length: the shape of event lists and modal tables.

use std::collections::BTreeMap;

use super::Attribute;
use super::array::missing;
use crate::error::StageError;

/// Columns of equal length.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Table {
    /// The columns, in reading order.
    pub columns: Vec<Column>,
    /// Scalars that describe the whole.
    pub attributes: BTreeMap<String, Attribute>,
}

/// A column.
#[derive(Debug, Clone, PartialEq)]
pub struct Column {
    /// Its name.
    pub name: String,
    /// Unit of the values; `1` for dimensionless, empty for text.
    pub unit: String,
    /// What it is, for people.
    pub long_name: String,
    /// The values.
    pub values: ColumnValues,
}

/// The values of a column.
#[derive(Debug, Clone, PartialEq)]
pub enum ColumnValues {
    /// Real numbers; NaN marks what is unknown.
    Real(Vec<f64>),
    /// Whole numbers.
    Integer(Vec<i64>),
    /// Yes or no.
    Flag(Vec<bool>),
    /// Text.
    Text(Vec<String>),
}

impl ColumnValues {
    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::Real(values) => values.len(),
            Self::Integer(values) => values.len(),
            Self::Flag(values) => values.len(),
            Self::Text(values) => values.len(),
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl From<Vec<f64>> for ColumnValues {
    fn from(values: Vec<f64>) -> Self {
        Self::Real(values)
    }
}

impl From<Vec<i64>> for ColumnValues {
    fn from(values: Vec<i64>) -> Self {
        Self::Integer(values)
    }
}

impl From<Vec<usize>> for ColumnValues {
    fn from(values: Vec<usize>) -> Self {
        Self::Integer(values.into_iter().map(|value| value as i64).collect())
    }
}

impl From<Vec<bool>> for ColumnValues {
    fn from(values: Vec<bool>) -> Self {
        Self::Flag(values)
    }
}

impl From<Vec<String>> for ColumnValues {
    fn from(values: Vec<String>) -> Self {
        Self::Text(values)
    }
}

impl From<Vec<&str>> for ColumnValues {
    fn from(values: Vec<&str>) -> Self {
        Self::Text(values.into_iter().map(str::to_owned).collect())
    }
}

/// A table that has a row for each of some items: add columns with [`TableOf::with`], then take the [`TableOf::table`].
#[derive(Debug)]
pub struct TableOf<'a, T> {
    items: &'a [T],
    table: Table,
}

impl<'a, T> TableOf<'a, T> {
    /// Adds a column.
    #[must_use]
    pub fn with<V>(self, name: &str, unit: &str, long_name: &str, of: impl Fn(&'a T) -> V) -> Self
    where
        Vec<V>: Into<ColumnValues>,
    {
        let values: Vec<V> = self.items.iter().map(of).collect();
        Self { table: self.table.with(name, unit, long_name, values), ..self }
    }

    /// Adds a column of values and one of their standard errors.
    #[must_use]
    pub fn with_std<E>(self, names: [&str; 2], unit: &str, long_name: &str, of: impl Fn(&'a T) -> E) -> Self
    where
        E: Into<(f64, f64)>,
    {
        self.with(names[0], unit, long_name, |item| of(item).into().0).with(
            names[1],
            unit,
            "its standard error",
            |item| of(item).into().1,
        )
    }

    /// The table.
    pub fn table(self) -> Table {
        self.table
    }
}

impl Table {
    /// An empty table: add columns with [`Table::with`].
    pub fn new() -> Self {
        Self::default()
    }

    /// An empty table of a row for each item.
    pub fn of<T>(items: &[T]) -> TableOf<'_, T> {
        TableOf { items, table: Self::new() }
    }

    /// Adds a column.
    #[must_use]
    pub fn with(mut self, name: &str, unit: &str, long_name: &str, values: impl Into<ColumnValues>) -> Self {
        self.columns.push(Column {
            name: name.to_owned(),
            unit: unit.to_owned(),
            long_name: long_name.to_owned(),
            values: values.into(),
        });
        self
    }

    /// Adds a scalar.
    #[must_use]
    pub fn attribute(mut self, name: &str, value: impl Into<Attribute>) -> Self {
        self.attributes.insert(name.to_owned(), value.into());
        self
    }

    /// How many rows.
    pub fn rows(&self) -> usize {
        self.columns.first().map_or(0, |column| column.values.len())
    }

    /// The column `name`. Errors: there is none.
    pub fn column(&self, name: &str) -> Result<&Column, StageError> {
        self.columns
            .iter()
            .find(|column| column.name == name)
            .ok_or_else(|| missing("column", name, self.columns.iter().map(|column| column.name.as_str())))
    }

    /// The real column `name`. Errors: there is none, or it is not real.
    pub fn real(&self, name: &str) -> Result<&[f64], StageError> {
        match &self.column(name)?.values {
            ColumnValues::Real(values) => Ok(values),
            _ => Err(other_kind(name, "real numbers")),
        }
    }

    /// The column `name` of whole numbers. Errors: there is none, or it is of another kind.
    pub fn integer(&self, name: &str) -> Result<&[i64], StageError> {
        match &self.column(name)?.values {
            ColumnValues::Integer(values) => Ok(values),
            _ => Err(other_kind(name, "whole numbers")),
        }
    }

    /// The text column `name`. Errors: there is none, or it is not text.
    pub fn text(&self, name: &str) -> Result<&[String], StageError> {
        match &self.column(name)?.values {
            ColumnValues::Text(values) => Ok(values),
            _ => Err(other_kind(name, "text")),
        }
    }

    /// The yes-or-no column `name`. Errors: there is none, or it is of another kind.
    pub fn flag(&self, name: &str) -> Result<&[bool], StageError> {
        match &self.column(name)?.values {
            ColumnValues::Flag(values) => Ok(values),
            _ => Err(other_kind(name, "yes or no")),
        }
    }

    /// Checks that all columns are of one length and have names of their own.
    pub fn validate(&self) -> Result<(), StageError> {
        let rows = self.rows();
        for (index, column) in self.columns.iter().enumerate() {
            if column.values.len() != rows {
                return Err(StageError::new(format!(
                    "column `{}` has {} rows, `{}` has {rows}",
                    column.name,
                    column.values.len(),
                    self.columns[0].name
                )));
            }
            if self.columns[..index].iter().any(|other| other.name == column.name) {
                return Err(StageError::new(format!("the column name `{}` is used twice", column.name)));
            }
        }
        Ok(())
    }
}

fn other_kind(name: &str, wanted: &str) -> StageError {
    StageError::new(format!("column `{name}`: found another kind of values, wanted {wanted}"))
}
