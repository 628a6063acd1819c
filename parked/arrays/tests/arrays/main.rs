//! Tests on files: built here, written by the reference readers' own writers (tests/data), and real ones.

mod damage;
mod mat_builder;
mod matlab_built;
mod matlab_real;
mod matlab_written;
mod numpy_built;
mod numpy_written;
mod raw_binary;
mod raw_order;
mod support;
