//! Who watches a long kernel: how far it is, and whether it shall go on.

use std::fmt;
use std::sync::Arc;

/// Kernels that fit many times call it from any thread, between fits.
///
/// ```
/// use std::sync::atomic::{AtomicUsize, Ordering};
/// use afmid_kernels::{Monitor, validation::{BootstrapSettings, bootstrap}};
///
/// struct AfterTen(AtomicUsize);
/// impl Monitor for AfterTen {
///     fn tick(&self) {
///         self.0.fetch_add(1, Ordering::Relaxed);
///     }
///     fn is_cancelled(&self) -> bool {
///         self.0.load(Ordering::Relaxed) >= 10
///     }
/// }
/// let mean = |chosen: &[usize]| Ok(vec![chosen.iter().sum::<usize>() as f64 / chosen.len() as f64]);
/// let found = bootstrap(16, &BootstrapSettings::default(), mean, &AfterTen(AtomicUsize::new(0)));
/// assert!(found.unwrap_err().to_string().contains("cancelled"));
/// ```
pub trait Monitor: Sync {
    /// So many fits lie ahead.
    fn expect(&self, _fits: usize) {}
    /// One is done.
    fn tick(&self) {}
    /// Whether the kernel shall end with an error instead of a result.
    fn is_cancelled(&self) -> bool {
        false
    }
}

/// Nobody watches.
#[derive(Debug, Clone, Copy)]
pub struct Unwatched;

impl Monitor for Unwatched {}

/// Who watches, or nobody: what the options of a long fit carry. Two are equal always: who watches changes no result.
#[derive(Clone, Default)]
pub struct Watch(Option<Arc<dyn Monitor + Send>>);

impl Watch {
    /// Watched by this one.
    pub fn by(monitor: Arc<dyn Monitor + Send>) -> Self {
        Self(Some(monitor))
    }

    /// Whether the fit shall end with an error instead of a result.
    pub fn is_cancelled(&self) -> bool {
        self.0.as_ref().is_some_and(|monitor| monitor.is_cancelled())
    }
}

impl PartialEq for Watch {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}

impl fmt::Debug for Watch {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(if self.0.is_some() { "Watch(somebody)" } else { "Watch(nobody)" })
    }
}
