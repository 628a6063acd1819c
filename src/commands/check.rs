//! `afmid check`: everything that can be wrong without opening data.

use afmid_pipeline::Registry;
use std::path::PathBuf;

use super::load::load;
use crate::failure::{Failure, Message};
use crate::output::print;

/// Checks every config before it gives up.
pub fn run(configs: &[PathBuf], registry: &Registry) -> Result<(), Failure> {
    let (mut wrong, mut printed) = (0, Ok(()));
    for config in configs {
        match load(config, &[], registry) {
            // the verdict counts, whether anybody reads on or not
            Ok(plan) if printed.is_ok() => {
                let points =
                    plan.points().map(|count| format!(", every point of a sweep of {count}")).unwrap_or_default();
                printed = print(&format!("{}: right, {} stages{points}\n", config.display(), plan.nodes.len()));
            }
            Ok(_) => {}
            Err(failure) => {
                wrong += 1;
                failure.report();
            }
        }
    }
    if wrong == 0 { printed } else { Err(Failure::Usage(Message::Rendered(String::new()))) }
}
