//! Tests on files: built here, written by the reference readers' own writers (tests/data), and real ones.

mod igor;
mod jpk;
mod mat_builder;
mod matlab_built;
mod matlab_real;
mod matlab_written;
mod nanoscope;
mod netcdf;
mod netcdf_builder;
mod numpy_built;
mod numpy_written;
mod parquet;
mod raw_binary;
mod raw_order;
mod registry;
mod responses;
mod scope_files;
mod scopes_built;
mod scopes_real;
mod support;
mod tdms_built;
mod tdms_file;
mod tdms_real;
mod text_table;
mod uff;
mod wav;
