//! The runner as the monitor of a kernel.

use std::sync::Arc;

use afmid_kernels::{Monitor, Watch};
use afmid_pipeline::Context;
use afmid_pipeline::stage::Cancel;

/// Hands a kernel's progress on to the runner, and the wish to end to the kernel.
pub(crate) struct Watched<'a>(pub &'a Context<'a>);

impl Monitor for Watched<'_> {
    fn expect(&self, fits: usize) {
        self.0.expect(fits);
    }

    fn tick(&self) {
        self.0.tick();
    }

    fn is_cancelled(&self) -> bool {
        self.0.cancel().is_cancelled()
    }
}

/// The wish to end alone.
struct Cancelled(Cancel);

impl Monitor for Cancelled {
    fn is_cancelled(&self) -> bool {
        self.0.is_cancelled()
    }
}

/// Who watches the single fits of a stage.
pub(crate) fn watch(cx: &Context) -> Watch {
    Watch::by(Arc::new(Cancelled(cx.cancel().clone())))
}
