//! Variables over named axes: the shape of signals, ensembles and spectra.

use std::collections::BTreeMap;

use num_complex::Complex64;

use super::Attribute;
use crate::error::StageError;
use crate::rows::{RowSource, RowView, StoredRows};

/// Variables over shared, named axes. The first variable is the signal that viewers plot by default.
///
/// Shapes: a variable's values are row-major over its `dims`; time (or frequency) is the last axis.
/// Units: SI, as text (`V`, `s`, `Hz`, `V^2/Hz`; `1` for dimensionless).
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Array {
    /// The axes, each with its coordinates.
    pub axes: Vec<Axis>,
    /// The variables, the signal first.
    pub variables: Vec<Variable>,
    /// Scalars that describe the whole.
    pub attributes: BTreeMap<String, Attribute>,
}

/// An axis with its coordinates.
#[derive(Debug, Clone, PartialEq)]
pub struct Axis {
    /// Its name: a variable's `dims` refer to it.
    pub name: String,
    /// Unit of the coordinates.
    pub unit: String,
    /// What it is, for people.
    pub long_name: String,
    /// The coordinates.
    pub values: Vec<f64>,
}

/// A variable over some of the axes.
#[derive(Debug, Clone, PartialEq)]
pub struct Variable {
    /// Its name.
    pub name: String,
    /// Unit of the values.
    pub unit: String,
    /// What it is, for people.
    pub long_name: String,
    /// Names of its axes, slowest first.
    pub dims: Vec<String>,
    /// The values, row-major.
    pub values: Values,
}

/// The values of a variable. NaN marks what is unknown.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Real numbers.
    Real(Vec<f64>),
    /// Complex numbers.
    Complex(Vec<Complex64>),
    /// Whole numbers.
    Integer(Vec<i64>),
    /// Real numbers over two axes that are too many for memory: rows in a file.
    Stored(StoredRows),
}

impl Values {
    /// How many.
    pub fn len(&self) -> usize {
        match self {
            Self::Real(values) => values.len(),
            Self::Complex(values) => values.len(),
            Self::Integer(values) => values.len(),
            Self::Stored(rows) => rows.len(),
        }
    }

    /// The real numbers, all of them in memory; none if they are of another kind. Errors: they lie in a file and cannot
    /// be read.
    pub fn real(&self) -> Option<Result<&[f64], StageError>> {
        match self {
            Self::Real(values) => Some(Ok(values)),
            Self::Stored(rows) => Some(rows.whole()),
            Self::Complex(_) | Self::Integer(_) => None,
        }
    }

    /// The real numbers as rows of this length, wherever they lie; none if they are of another kind or no whole number
    /// of such rows.
    pub fn rows(&self, row_length: usize) -> Option<RowView<'_>> {
        match self {
            Self::Real(values) if row_length > 0 && values.len().is_multiple_of(row_length) => {
                Some(RowView::Memory(values, row_length))
            }
            Self::Stored(rows) if rows.row_length() == row_length => Some(RowView::Stored(rows)),
            _ => None,
        }
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}

impl From<Vec<f64>> for Values {
    fn from(values: Vec<f64>) -> Self {
        Self::Real(values)
    }
}

impl From<Vec<Complex64>> for Values {
    fn from(values: Vec<Complex64>) -> Self {
        Self::Complex(values)
    }
}

impl From<Vec<i64>> for Values {
    fn from(values: Vec<i64>) -> Self {
        Self::Integer(values)
    }
}

impl Array {
    /// An array without variables over these axes: add them with [`Array::with`].
    pub fn over(axes: Vec<Axis>) -> Self {
        Self { axes, ..Self::default() }
    }

    /// Adds a variable over `dims` (slowest first).
    #[must_use]
    pub fn with(mut self, name: &str, unit: &str, long_name: &str, dims: &[&str], values: impl Into<Values>) -> Self {
        self.variables.push(Variable {
            name: name.to_owned(),
            unit: unit.to_owned(),
            long_name: long_name.to_owned(),
            dims: dims.iter().map(|&dim| dim.to_owned()).collect(),
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

    /// The axis `name`. Errors: there is none.
    pub fn axis(&self, name: &str) -> Result<&Axis, StageError> {
        self.axes
            .iter()
            .find(|axis| axis.name == name)
            .ok_or_else(|| missing("axis", name, self.axes.iter().map(|axis| axis.name.as_str())))
    }

    /// The variable `name`. Errors: there is none.
    pub fn variable(&self, name: &str) -> Result<&Variable, StageError> {
        self.variables
            .iter()
            .find(|variable| variable.name == name)
            .ok_or_else(|| missing("variable", name, self.variables.iter().map(|variable| variable.name.as_str())))
    }

    /// The values of the real variable `name`, all of them: from a file they are read once, and stay in memory. Errors:
    /// there is none, it is not real, or it cannot be read.
    pub fn real(&self, name: &str) -> Result<&[f64], StageError> {
        self.variable(name)?.values.real().unwrap_or_else(|| Err(not_real(name)))
    }

    /// The rows of the real variable `name` over two axes, for [`in_blocks`](crate::rows::in_blocks): nothing is read
    /// yet. Errors: there is none, it is not real, or not over two axes.
    pub fn rows(&self, name: &str) -> Result<RowView<'_>, StageError> {
        let variable = self.variable(name)?;
        let [_, last] = &variable.dims[..] else {
            return Err(StageError::new(format!("variable `{name}` has {} axes, wanted 2", variable.dims.len())));
        };
        variable.values.rows(self.axis(last)?.values.len()).ok_or_else(|| not_real(name))
    }

    /// The values of the complex variable `name`. Errors: there is none, or it is not complex.
    pub fn complex(&self, name: &str) -> Result<&[Complex64], StageError> {
        match &self.variable(name)?.values {
            Values::Complex(values) => Ok(values),
            _ => Err(StageError::new(format!("variable `{name}`: found real numbers, wanted complex ones"))),
        }
    }

    /// The number in attribute `name`. Errors: there is none, or it is not a number.
    pub fn number(&self, name: &str) -> Result<f64, StageError> {
        self.attributes
            .get(name)
            .and_then(Attribute::as_f64)
            .ok_or_else(|| missing("numeric attribute", name, self.attributes.keys().map(String::as_str)))
    }

    /// Checks that every variable has as many values as its axes ask for, and that names are unique.
    pub fn validate(&self) -> Result<(), StageError> {
        if self.variables.is_empty() {
            return Err(StageError::new("an array without a variable: the first one is the signal"));
        }
        let mut names: Vec<&str> = self.axes.iter().map(|axis| axis.name.as_str()).collect();
        for variable in &self.variables {
            let mut wanted = 1;
            for dim in &variable.dims {
                wanted *= self.axis(dim)?.values.len();
            }
            if variable.values.len() != wanted {
                return Err(StageError::new(format!(
                    "variable `{}` has {} values, its axes ({}) want {wanted}",
                    variable.name,
                    variable.values.len(),
                    variable.dims.join(", "),
                )));
            }
            names.push(&variable.name);
        }
        names.sort_unstable();
        match names.windows(2).find(|pair| pair[0] == pair[1]) {
            Some(pair) => Err(StageError::new(format!("the name `{}` is used twice in one array", pair[0]))),
            None => Ok(()),
        }
    }
}

impl Axis {
    /// An axis from its parts.
    pub fn new(name: &str, unit: &str, long_name: &str, values: Vec<f64>) -> Self {
        Self { name: name.to_owned(), unit: unit.to_owned(), long_name: long_name.to_owned(), values }
    }
}

fn not_real(name: &str) -> StageError {
    StageError::new(format!("variable `{name}`: found complex or whole numbers, wanted real ones"))
}

pub(super) fn missing<'a>(what: &str, name: &str, have: impl Iterator<Item = &'a str>) -> StageError {
    let have: Vec<&str> = have.collect();
    StageError::new(format!("there is no {what} `{name}`; there is: {}", have.join(", ")))
}
