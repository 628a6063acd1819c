//! Loading: records from files.

use afmid_pipeline::Entry;

mod census;
mod code_census;
pub mod columns;
mod consistency;
mod file_patterns;
pub mod frf;
mod memory;
mod natural_order;
mod overview;
mod pattern_walk;
mod records;
mod records_example;
mod repeats;
mod shared_data;
mod spectrum;
mod spectrum_example;
mod stretch_extremes;

pub use crate::artifacts::{length_m, quantity_of_unit};
pub use census::Census;
pub use code_census::{CensusSettings, ChannelCensus, Found};
pub use columns::Columns;
pub use consistency::{Consistency, check_consistency};
pub use file_patterns::{Match, matching_files};
pub(crate) use frf::{FRF, ascending};
pub use frf::{Frf, Roving};
pub use memory::{MemorySource, memory_channel, memory_record};
pub use natural_order::natural_order;
pub use overview::Overview;
pub use records::Records;
pub(crate) use repeats::{CopyOf, same_values, varies, warn_of_copies};
pub(crate) use spectrum::DENSITY;
pub use spectrum::{Spectrum, density_of_values};
pub use stretch_extremes::StretchExtremes;

/// The stages of this domain.
pub const STAGES: &[Entry] = &[
    Entry::of::<Records>(),
    Entry::of::<Columns>(),
    Entry::of::<Frf>(),
    Entry::of::<Spectrum>(),
    Entry::of::<Census>(),
    Entry::of::<Overview>(),
];
