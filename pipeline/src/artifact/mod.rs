//! What travels between stages: a closed set of shapes. What an artifact means is a tag of its port, not a type.

mod array;
mod attribute;
mod document;
mod row_writer;
mod standard_error;
mod state_space;
mod table;

use std::sync::Arc;

pub use array::{Array, Axis, Values, Variable};
pub use attribute::Attribute;
pub use document::Document;
pub use row_writer::RowWriter;
pub use standard_error::std_name;
pub use state_space::{Matrix, StateSpace};
pub use table::{Column, ColumnValues, Table, TableOf};

use crate::error::StageError;
use crate::recording::Recording;

/// The shape of an artifact, without its data: what graph checks compare.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Shape {
    /// Lazy, re-readable record files.
    Recording,
    /// Variables over named axes with coordinates and units.
    Array,
    /// Columns of equal length.
    Table,
    /// A discrete-time state-space model.
    StateSpace,
    /// A JSON document.
    Document,
}

impl Shape {
    /// Its name in messages and docs.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Recording => "recording",
            Self::Array => "array",
            Self::Table => "table",
            Self::StateSpace => "state-space model",
            Self::Document => "document",
        }
    }
}

/// An artifact, shared between the stages that read it. Cloning is cheap.
#[derive(Debug, Clone)]
pub enum Artifact {
    /// See [`Recording`].
    Recording(Arc<Recording>),
    /// See [`Array`].
    Array(Arc<Array>),
    /// See [`Table`].
    Table(Arc<Table>),
    /// See [`StateSpace`].
    StateSpace(Arc<StateSpace>),
    /// See [`Document`].
    Document(Arc<Document>),
}

impl Artifact {
    /// Its shape.
    pub fn shape(&self) -> Shape {
        match self {
            Self::Recording(_) => Shape::Recording,
            Self::Array(_) => Shape::Array,
            Self::Table(_) => Shape::Table,
            Self::StateSpace(_) => Shape::StateSpace,
            Self::Document(_) => Shape::Document,
        }
    }

    /// Checks that its parts fit together. Errors: which do not.
    pub fn validate(&self) -> Result<(), StageError> {
        match self {
            Self::Array(array) => array.validate(),
            Self::Table(table) => table.validate(),
            Self::StateSpace(model) => model.validate(),
            Self::Recording(_) | Self::Document(_) => Ok(()),
        }
    }
}

/// A type that is an artifact's shape: what a [`Port`](crate::outcome::Port) is typed with.
pub trait Shaped: Sized + Send + Sync + 'static {
    /// The shape.
    const SHAPE: Shape;
    /// Makes it an artifact.
    fn wrap(self) -> Artifact;
    /// The value inside, if the artifact has this shape.
    fn peek(artifact: &Artifact) -> Option<&Self>;
}

macro_rules! shaped {
    ($($name:ident),*) => {$(
        impl Shaped for $name {
            const SHAPE: Shape = Shape::$name;
            fn wrap(self) -> Artifact {
                Artifact::$name(Arc::new(self))
            }
            fn peek(artifact: &Artifact) -> Option<&Self> {
                match artifact {
                    Artifact::$name(value) => Some(value),
                    _ => None,
                }
            }
        }
    )*};
}
shaped!(Recording, Array, Table, StateSpace, Document);
