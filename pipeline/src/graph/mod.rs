//! The graph: stages looked up, parameters read, wires checked and ordered, before any data is opened.

mod lookup;
mod order;
mod plan;
mod render;
mod sweep;
mod wiring;

pub use lookup::Stages;
pub use plan::{Node, Plan, Wire, load, plan};
pub use render::Format;
