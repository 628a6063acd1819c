//! The exchange layout: numbers in an HDF5 file, words in the line.
//!
//! Every HDF5 library writes plain datasets of numbers; few write attributes, texts and dimension scales alike (Octave
//! writes no attributes at all). So a file holds nothing else, and the line says what each dataset is.

mod give;
mod numbers;
mod take;

pub(super) use give::give;
pub(super) use take::{Wanted, take};

use super::message::ShapeName;
use crate::artifact::Shape;

impl From<ShapeName> for Shape {
    fn from(name: ShapeName) -> Self {
        match name {
            ShapeName::Recording => Self::Recording,
            ShapeName::Array => Self::Array,
            ShapeName::Table => Self::Table,
            ShapeName::StateSpace => Self::StateSpace,
            ShapeName::Document => Self::Document,
        }
    }
}

/// The name of a shape in lines.
pub(super) fn shape_name(shape: Shape) -> &'static str {
    match shape {
        Shape::Recording => "recording",
        Shape::Array => "array",
        Shape::Table => "table",
        Shape::StateSpace => "state_space",
        Shape::Document => "document",
    }
}
