//! What is said when something cannot be done: by a stage, and about a file.

mod stage;
mod store;

pub use stage::StageError;
pub(crate) use store::Result;
pub use store::StoreError;
