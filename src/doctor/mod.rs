//! What a run needs of this machine, looked at piece by piece.

mod arithmetic;
mod finding;
mod folders;
mod machine;

pub use finding::{Finding, State};

use std::path::Path;

use afmid_pipeline::Registry;

/// Looks at everything, in the order in which a run needs it.
pub fn examine(cache: &Path, registry: &Registry) -> Vec<Finding> {
    let mut findings = vec![machine::program(registry), machine::processor(), machine::library()];
    findings.extend(machine::environment());
    findings.extend([folders::cache(cache), folders::temporary(), folders::data()]);
    findings.extend(arithmetic::examples(registry));
    findings
}
