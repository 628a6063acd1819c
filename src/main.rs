//! afmid, the command line.
mod report;

fn main() {}
