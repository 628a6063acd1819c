//! Loading: records from files.

mod memory;

pub use memory::{MemorySource, memory_channel, memory_record};
