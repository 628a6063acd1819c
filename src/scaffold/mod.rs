//! Beginnings: configs for recordings that were looked at, stages and causes of one's own.

mod cause;
mod channels;
mod choice;
mod density;
mod diagnosis;
mod diagnosis_config;
mod first_file;
mod groups;
mod hit_names;
mod left_out;
mod lever;
mod measurement;
mod pipeline;
mod points;
mod recordings;
mod sensors;
mod spring;
mod stage;
mod stated;
mod steps;

pub use cause::{python as python_cause, rust as rust_cause};
pub use choice::choose;
pub use left_out::left_out;
pub use measurement::joined_files;
pub use pipeline::{Wanted, pipeline};
pub use recordings::look;
pub use stage::{File, python, rust};
