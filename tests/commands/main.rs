//! Every command as a user runs it: configs written, run, batched, swept, submitted, shown, reported; errors, plugins,
//! provenance, the registry, the tutorials.

#[path = "../common/mod.rs"]
mod common;

mod batch;
mod begin;
mod begin_advice;
mod begin_files;
mod clocks;
mod command_line;
mod diagnose;
mod errors;
mod example;
mod kinds;
mod measurement;
mod modes;
mod plugins;
mod provenance;
mod python_reader;
mod readers;
mod registry;
mod report;
mod results;
mod spring_constant;
mod submit;
mod sweep;
mod threads;
mod tutorials;
