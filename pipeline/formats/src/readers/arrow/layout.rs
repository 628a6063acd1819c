//! Where in a record batch the values of each column are.

use super::batch::Part;
use crate::columnar::arrow_schema::{Field, Holds, Unit};
use crate::columnar::{Described, MOST_PATH_BYTES};

/// One of a batch's buffers: its number among those that the schema gives, and how many columns lie before it of
/// which each batch says how many more there are.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Place {
    pub(super) buffer: usize,
    pub(super) views: usize,
}

/// A field or a struct around it: number of its values, and which of them are there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Level {
    /// Its number among all fields.
    pub(super) node: usize,
    pub(super) there: Place,
}

/// A column that is no struct.
#[derive(Debug)]
pub(super) struct Leaf<'a> {
    /// Names of the structs that it is in, and its own, with points between them.
    name: String,
    holds: &'a Holds,
    unit: Option<&'a Unit>,
    /// The structs that it is in, and it itself; empty for what is no column of numbers.
    pub(super) levels: Vec<Level>,
    /// Its numbers.
    pub(super) data: Place,
}

impl Leaf<'_> {
    /// Bytes that count of each number.
    pub(super) fn number_bytes(&self) -> usize {
        match self.holds {
            Holds::Numbers { number, .. } => number.bytes() as usize,
            _ => 1,
        }
    }

    /// Bits of each number.
    pub(super) fn bits(&self) -> usize {
        match self.holds {
            Holds::Numbers { bits, .. } => *bits,
            _ => 8,
        }
    }

    /// What the file says of it.
    pub(super) fn described(&self, parts: &[Part]) -> Described {
        Described {
            name: self.name.clone(),
            kind: match self.holds {
                Holds::Numbers { number, what, .. } => Ok((*number, *what)),
                Holds::Else { called, .. } => Err((*called).to_owned()),
                Holds::Views => Err("texts or bytes".to_owned()),
                Holds::Struct => Err("nothing".to_owned()),
            },
            left_out: None,
            may_miss: parts.iter().any(|part| !part.there.is_empty()),
            unit: self.unit.cloned(),
            rows: parts.iter().map(|part| part.rows).collect(),
        }
    }
}

/// The columns of a table, in its order. Error: a name is too long.
pub(super) fn leaves(fields: &[Field]) -> Result<Vec<Leaf<'_>>, String> {
    let mut walk = Walk { node: 0, next: Place { buffer: 0, views: 0 }, leaves: Vec::new() };
    for field in fields {
        walk.field(field, &Branch::default())?;
    }
    Ok(walk.leaves)
}

/// The structs that a field is in.
#[derive(Debug, Clone, Default)]
struct Branch {
    name: String,
    levels: Vec<Level>,
}

/// What comes next in a batch.
#[derive(Debug)]
struct Walk<'a> {
    node: usize,
    next: Place,
    leaves: Vec<Leaf<'a>>,
}

impl<'a> Walk<'a> {
    /// Takes a field and those in it.
    fn field(&mut self, field: &'a Field, around: &Branch) -> Result<(), String> {
        let mut here = around.clone();
        if !here.name.is_empty() {
            here.name.push('.');
        }
        here.name.push_str(&field.name);
        if here.name.len() > MOST_PATH_BYTES {
            return Err(format!("the name of a column has more than {MOST_PATH_BYTES} bytes"));
        }
        here.levels.push(Level { node: self.node, there: self.next });
        self.node += 1;
        self.next.buffer += match field.holds {
            Holds::Numbers { .. } | Holds::Views => 2,
            Holds::Struct => 1,
            Holds::Else { buffers, .. } => buffers,
        };
        self.next.views += usize::from(field.holds == Holds::Views);
        if field.holds == Holds::Struct && !field.fields.is_empty() {
            return field.fields.iter().try_for_each(|inner| self.field(inner, &here));
        }
        let has_numbers = matches!(field.holds, Holds::Numbers { .. });
        let there = here.levels.last().map_or(self.next, |level| level.there);
        self.leaves.push(Leaf {
            name: here.name,
            holds: &field.holds,
            unit: field.unit.as_ref(),
            levels: if has_numbers { here.levels } else { Vec::new() },
            data: Place { buffer: there.buffer + 1, ..there },
        });
        // what is in lists and the like has its place in a batch, and is no column
        let leaves = self.leaves.len();
        field.fields.iter().try_for_each(|inner| self.field(inner, &Branch::default()))?;
        self.leaves.truncate(leaves);
        Ok(())
    }
}
