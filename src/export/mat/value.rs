//! MATLAB's arrays: a miMATRIX element each.

use super::element::{Kind, MatError, element, size};

/// A value as MATLAB has it.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A real matrix: rows, columns, values row by row.
    Real(usize, usize, Vec<f64>),
    /// A column of complex numbers: real parts, imaginary parts.
    ComplexColumn(Vec<f64>, Vec<f64>),
    /// True or false.
    Logical(bool),
    /// A row of characters.
    Text(String),
    /// A column of cells.
    Cells(Vec<Value>),
    /// One struct: fields in order.
    Struct(Vec<(String, Value)>),
}

/// Classes of arrays (table 1-3).
const CELL: u32 = 1;
const STRUCT: u32 = 2;
const CHAR: u32 = 4;
const DOUBLE: u32 = 6;
const UINT8: u32 = 9;
/// Flags beside the class.
const COMPLEX: u32 = 0x0800;
const LOGICAL: u32 = 0x0200;
/// Bytes of a field's name with the NUL behind it: as MATLAB writes it, and as it does where one is longer.
const FIELD: [usize; 2] = [32, 64];

impl Value {
    /// A real scalar.
    pub fn scalar(value: f64) -> Self {
        Self::Real(1, 1, vec![value])
    }

    /// A column.
    pub fn column(values: &[f64]) -> Self {
        Self::Real(values.len(), 1, values.to_vec())
    }

    /// Appends it as the variable `name` (empty within cells and structs). Errors: too large.
    pub fn write(&self, out: &mut Vec<u8>, name: &str) -> Result<(), MatError> {
        let mut matrix = Vec::new();
        match self {
            Self::Real(rows, columns, values) => {
                head(&mut matrix, DOUBLE, [*rows, *columns], name)?;
                element(&mut matrix, Kind::Double, &doubles(&by_column(*rows, *columns, values)))?;
            }
            Self::ComplexColumn(re, im) => {
                head(&mut matrix, DOUBLE | COMPLEX, [re.len(), 1], name)?;
                element(&mut matrix, Kind::Double, &doubles(re))?;
                element(&mut matrix, Kind::Double, &doubles(im))?;
            }
            Self::Logical(flag) => {
                head(&mut matrix, UINT8 | LOGICAL, [1, 1], name)?;
                element(&mut matrix, Kind::Uint8, &[u8::from(*flag)])?;
            }
            Self::Text(text) => {
                let units: Vec<u16> = text.encode_utf16().collect();
                head(&mut matrix, CHAR, [usize::from(!units.is_empty()), units.len()], name)?;
                let bytes: Vec<u8> = units.iter().flat_map(|unit| unit.to_le_bytes()).collect();
                element(&mut matrix, Kind::Uint16, &bytes)?;
            }
            Self::Cells(cells) => {
                head(&mut matrix, CELL, [cells.len(), 1], name)?;
                cells.iter().try_for_each(|cell| cell.write(&mut matrix, ""))?;
            }
            Self::Struct(fields) => {
                head(&mut matrix, STRUCT, [1, 1], name)?;
                write_fields(&mut matrix, fields)?;
            }
        }
        element(out, Kind::Matrix, &matrix)
    }
}

/// Flags, dimensions and name.
fn head(out: &mut Vec<u8>, class: u32, shape: [usize; 2], name: &str) -> Result<(), MatError> {
    let flags = [class.to_le_bytes(), [0; 4]].concat();
    element(out, Kind::Uint32, &flags)?;
    let dimensions: Vec<u8> = [size("a matrix", shape[0])?, size("a matrix", shape[1])?].map(u32::to_le_bytes).concat();
    element(out, Kind::Int32, &dimensions)?;
    element(out, Kind::Int8, name.as_bytes())
}

fn write_fields(out: &mut Vec<u8>, fields: &[(String, Value)]) -> Result<(), MatError> {
    let names = field_names(fields);
    let long = names.iter().any(|name| name.len() >= FIELD[0]);
    let length = FIELD[usize::from(long)];
    element(out, Kind::Int32, &size("a name", length)?.to_le_bytes())?;
    let mut text = Vec::with_capacity(length * names.len());
    for name in &names {
        text.extend(name.as_bytes());
        text.resize(text.len().next_multiple_of(length), 0);
    }
    element(out, Kind::Int8, &text)?;
    fields.iter().try_for_each(|(_, value)| value.write(out, ""))
}

/// Names that MATLAB takes: letters, digits and `_`, a letter first, at most 63; a number behind it where two are
/// equal.
fn field_names(fields: &[(String, Value)]) -> Vec<String> {
    let mut names: Vec<String> = Vec::with_capacity(fields.len());
    for (name, _) in fields {
        let mut valid: String = name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        if !valid.starts_with(|c: char| c.is_ascii_alphabetic()) {
            valid.insert_str(0, "x_");
        }
        valid.truncate(FIELD[1] - 1);
        let mut number = 1;
        let mut unique = valid.clone();
        while names.contains(&unique) {
            number += 1;
            let end = format!("_{number}");
            unique = format!("{}{end}", &valid[..valid.len().min(FIELD[1] - 1 - end.len())]);
        }
        names.push(unique);
    }
    names
}

/// Values row by row as values column by column.
fn by_column(rows: usize, columns: usize, values: &[f64]) -> Vec<f64> {
    (0..columns).flat_map(|j| (0..rows).filter_map(move |i| values.get(i * columns + j).copied())).collect()
}

fn doubles(values: &[f64]) -> Vec<u8> {
    values.iter().flat_map(|value| value.to_le_bytes()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn matrices_are_stored_by_columns() {
        assert_eq!(by_column(2, 3, &[1.0, 2.0, 3.0, 4.0, 5.0, 6.0]), [1.0, 4.0, 2.0, 5.0, 3.0, 6.0]);
    }

    #[test]
    fn a_scalar_is_the_bytes_that_the_format_describes() {
        let mut out = Vec::new();
        Value::scalar(1.0).write(&mut out, "x").unwrap();
        let expected = [
            &[14, 0, 0, 0, 56, 0, 0, 0][..],                      // miMATRIX, 56 bytes
            &[6, 0, 0, 0, 8, 0, 0, 0, 6, 0, 0, 0, 0, 0, 0, 0],    // flags: mxDOUBLE_CLASS
            &[5, 0, 0, 0, 8, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0],    // 1 x 1
            &[1, 0, 1, 0, b'x', 0, 0, 0],                         // name, small format
            &[9, 0, 0, 0, 8, 0, 0, 0, 0, 0, 0, 0, 0, 0, 240, 63], // 1.0
        ]
        .concat();
        assert_eq!(out, expected);
    }

    #[test]
    fn names_of_fields_are_valid_short_enough_and_different() {
        let field = |name: &str| (name.to_owned(), Value::Logical(true));
        let long = "n".repeat(70);
        let names = field_names(&[field("a-b"), field("a_b"), field("2x"), field(""), field(&long), field(&long)]);
        assert_eq!(names[..4], ["a_b", "a_b_2", "x_2x", "x_"]);
        assert_eq!((names[4].len(), names[5].len()), (63, 63));
        assert!(names[5].ends_with("_2"));
    }
}
