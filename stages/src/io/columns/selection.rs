//! Which column is meant.

use afmid_pipeline::StageError;
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::table::{ColumnTable, NamedColumn};

/// A column: its number from 1, or its name in the header (of a MATLAB matrix `x`: `x:1`, `x:2`).
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(untagged, expecting = "wanted a column: its number, from 1, or its name")]
pub enum Column {
    /// From 1.
    Number(usize),
    /// In the header.
    Name(String),
}

impl std::fmt::Display for Column {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Number(number) => write!(f, "{number}"),
            Self::Name(name) => write!(f, "`{name}`"),
        }
    }
}

impl Column {
    /// Errors: a number 0, an empty name.
    pub(super) fn check(&self, parameter: &str) -> Result<(), StageError> {
        match self {
            Self::Number(0) => Err(StageError::new(format!("`{parameter}` is 0; columns are numbered from 1"))),
            Self::Name(name) if name.is_empty() => {
                Err(StageError::new(format!("`{parameter}` is empty, wanted a column's number or name")))
            }
            _ => Ok(()),
        }
    }

    /// This column of a table. Errors: there is none, two have the name, or it holds text.
    pub(super) fn of<'a>(&self, table: &'a ColumnTable) -> Result<&'a NamedColumn, StageError> {
        let found = match self {
            Self::Number(number) => number.checked_sub(1).and_then(|index| table.columns.get(index)),
            Self::Name(name) => {
                let mut same = table.columns.iter().filter(|column| column.name == *name);
                let first = same.next();
                if same.next().is_some() {
                    return Err(StageError::new(format!("two columns have the name {self}; wanted one"))
                        .help("name the column by its number"));
                }
                first
            }
        };
        let column =
            found.ok_or_else(|| StageError::new(format!("there is no column {self}; there is: {}", listing(table))))?;
        match &column.text {
            Some(text) => Err(StageError::new(format!(
                "column {self} holds `{}` in line {}, wanted numbers",
                text.found, text.line
            ))
            .help("`NaN`, `NA`, `null` and empty entries count as missing")),
            None => Ok(column),
        }
    }
}

/// The columns by number and name, the first forty.
fn listing(table: &ColumnTable) -> String {
    const MOST: usize = 40;
    let mut names: Vec<String> = table
        .columns
        .iter()
        .enumerate()
        .take(MOST)
        .map(|(i, c)| if c.name.is_empty() { format!("{}", i + 1) } else { format!("{} `{}`", i + 1, c.name) })
        .collect();
    if table.columns.len() > MOST {
        names.push(format!("{} more", table.columns.len() - MOST));
    }
    if !table.others.is_empty() {
        names.push(format!("not readable as columns: {}", table.others.join(", ")));
    }
    names.join(", ")
}
