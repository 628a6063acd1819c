//! Loading: records from files.
