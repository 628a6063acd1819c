//! `afmid check`: everything that can be wrong without opening data.

use afmid_pipeline::Registry;
use std::path::PathBuf;

use super::load::load;
use crate::failure::{Failure, Message};

/// Checks every config before it gives up.
pub fn run(configs: &[PathBuf], registry: &Registry) -> Result<(), Failure> {
    let mut wrong = 0;
    for config in configs {
        match load(config, &[], registry) {
            Ok(plan) => println!("{}: right, {} stages", config.display(), plan.nodes.len()),
            Err(failure) => {
                wrong += 1;
                failure.report();
            }
        }
    }
    if wrong == 0 { Ok(()) } else { Err(Failure::Usage(Message::Rendered(String::new()))) }
}
