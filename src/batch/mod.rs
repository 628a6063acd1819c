//! One run per data set: what the sets are, what became of each, and one table of them all.

pub mod dataset;
pub mod harvest;
pub mod ledger;
pub mod manifest;
pub mod parquet;
pub mod shard;
pub mod shell;
pub mod slurm;
pub mod summary;
pub mod trends;
pub mod work;
