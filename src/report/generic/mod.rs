//! What can be shown of any stage: documents as tables, tables as tables, arrays as default plots.

mod array;
mod document;
mod model;
mod recording;
mod stage;
mod table;

pub(crate) use document::document_view;
pub(crate) use stage::stage_view;
use table::ROWS;

use std::collections::BTreeMap;

use afmid_pipeline::Attribute;

use super::number::{integer, number};
use super::view::Fact;

fn attribute_text(attribute: &Attribute) -> String {
    match attribute {
        Attribute::Flag(true) => "yes".to_owned(),
        Attribute::Flag(false) => "no".to_owned(),
        Attribute::Integer(value) => integer(*value),
        Attribute::Real(value) => number(*value),
        Attribute::Text(value) => value.clone(),
    }
}

fn attribute_facts(attributes: &BTreeMap<String, Attribute>) -> impl Iterator<Item = Fact> + '_ {
    attributes.iter().map(|(name, value)| Fact::new(name, attribute_text(value)))
}
