//! The config: TOML, parsed in two steps so that every error keeps its place.
//!
//! First the document becomes a [`Config`] (tables, ids, wires, raw `params` with their places in the text); then, with
//! a registry, [`crate::graph::plan`] turns each `params` table into its stage. Both report all their [`Problem`]s at
//! once.

mod document;
mod name;
mod overrides;
mod parameters;
mod pipeline;
mod place;
mod plugins;
mod problem;
mod read;
mod stage;
mod suggest;
mod sweep;
mod value;

pub(crate) use name::RESERVED_ID;
pub use overrides::Override;
pub(crate) use parameters::{Ranges, instantiate};
pub use place::Place;
pub use plugins::{DEFAULT_TIMEOUT_S, PluginDecl};
pub(crate) use plugins::{is_name as is_plugin_name, names as plugin_names};
pub use problem::{Origin, Problem};
pub use read::Config;
pub use stage::{Input, StageDecl};
pub use suggest::nearest;
pub(crate) use suggest::{did_you_mean, list, most_helped};
pub use sweep::Swept;
pub(crate) use sweep::point;
