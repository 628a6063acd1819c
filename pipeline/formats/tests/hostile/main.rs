//! Whatever the bytes: no panic, no endless loop, little memory. A process of its own, since it looks at its peak
//! memory.

mod acquisition;
mod arrays;
#[path = "../formats/mat_builder.rs"]
mod mat_builder;
#[path = "../formats/scope_files.rs"]
mod scope_files;
#[path = "../formats/support.rs"]
mod support;
#[path = "../formats/tdms_file.rs"]
mod tdms_file;
