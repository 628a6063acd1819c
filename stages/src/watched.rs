//! The runner as the monitor of a kernel.

use afmid_kernels::Monitor;
use afmid_pipeline::Context;

/// Hands a kernel's progress on to the runner. A run is cancelled by its signals, which end the process.
pub(crate) struct Watched<'a>(pub &'a Context<'a>);

impl Monitor for Watched<'_> {
    fn expect(&self, fits: usize) {
        self.0.expect(fits);
    }

    fn tick(&self) {
        self.0.tick();
    }
}
