//! afmid, the command line.
fn main() {}
