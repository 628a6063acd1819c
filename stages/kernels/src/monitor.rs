//! Who watches a long kernel: how far it is, and whether it shall go on.

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
