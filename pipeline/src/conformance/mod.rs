//! What every stage must keep, as checks over its row of the registry: built-in or not, one loop tests them all.

mod documented;
mod example;

pub use documented::documented;
pub use example::{examples_hold, examples_hold_and_repeat, unknown_key_refused};

use crate::stage::Entry;

/// All checks on one stage: what it does not keep, in words. A test prints them and wants none.
pub fn violations(entry: &Entry) -> Vec<String> {
    let checks: [fn(&Entry) -> Vec<String>; 3] = [documented, unknown_key_refused, examples_hold_and_repeat];
    let name = entry.spec.name;
    checks.iter().flat_map(|check| check(entry)).map(|violation| format!("{name}: {violation}")).collect()
}
