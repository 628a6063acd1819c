//! What the engine promises whatever happens: what is stored was computed from the bytes that are stated, nothing of
//! others is lost, strangers' files neither run commands nor take all time and memory.

#[path = "../common/mod.rs"]
mod common;

mod archives;
mod batch_names;
mod begun_configs;
mod cache_files;
mod cache_rows;
mod copies;
mod corpus;
mod crates;
mod earlier_results;
mod entrances;
mod failed_runs;
mod faults;
mod floors;
mod full_for_a_moment;
mod handles;
mod hostile;
mod hostile_hdf5;
mod inputs;
mod interrupts;
mod keys;
mod kills;
mod leftovers;
mod limits;
mod ownership;
mod paths;
mod patterns;
mod random;
mod rates;
mod scaling;
mod seeds;
mod small;
mod strangers;
mod terminal;
mod together;
mod words;
