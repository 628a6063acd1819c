//! What is said when something cannot be done: by a stage, and about a file.

mod stage;
mod store;

pub(crate) use stage::with_id;
pub use stage::{StageError, THIS_STAGE};
pub(crate) use store::Result;
pub use store::StoreError;
