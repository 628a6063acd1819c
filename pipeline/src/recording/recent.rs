//! The chunks that a thread inflated last: consecutive short reads do not inflate a chunk again and again.

use std::cell::RefCell;
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

/// Two channels of two records in turn.
const SLOTS: usize = 4;

/// Source and chunk.
type Key = (u64, usize);

thread_local! {
    static RECENT: RefCell<Vec<(Key, Arc<Vec<u8>>)>> = const { RefCell::new(Vec::new()) };
}

/// A number that no other source of this process has.
pub(super) fn source_number() -> u64 {
    static NEXT: AtomicU64 = AtomicU64::new(0);
    NEXT.fetch_add(1, Ordering::Relaxed)
}

/// The chunk's bytes, from this thread's last few or else from `load`. Errors: those of `load`.
pub(super) fn chunk<E>(key: Key, load: impl FnOnce() -> Result<Vec<u8>, E>) -> Result<Arc<Vec<u8>>, E> {
    let found = RECENT.with_borrow(|slots| slots.iter().find(|slot| slot.0 == key).map(|slot| Arc::clone(&slot.1)));
    if let Some(bytes) = found {
        return Ok(bytes);
    }
    let bytes = Arc::new(load()?);
    RECENT.with_borrow_mut(|slots| {
        slots.truncate(SLOTS - 1);
        slots.insert(0, (key, Arc::clone(&bytes)));
    });
    Ok(bytes)
}
