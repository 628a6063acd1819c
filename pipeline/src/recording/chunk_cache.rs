//! The chunks that were inflated last: consecutive short reads do not inflate a chunk again and again.

use std::collections::VecDeque;
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Arc, Mutex, PoisonError};

/// Chunks that are kept per thread: two channels of two records in turn.
const PER_THREAD: usize = 4;

/// Bytes of all that are kept, and of the largest that is.
const MOST_BYTES: usize = 128 << 20;
const LARGEST: usize = 32 << 20;

/// Source and chunk.
type Key = (u64, usize);

/// The chunks that were inflated last. Cloning is cheap, and clones share them.
#[derive(Debug, Clone, Default)]
pub(super) struct ChunkCache(Arc<Inner>);

#[derive(Debug, Default)]
struct Inner {
    chunks: Mutex<VecDeque<(Key, Arc<Vec<u8>>)>>,
    sources: AtomicU64,
}

impl ChunkCache {
    /// A number that no other source of this cache has.
    pub(super) fn source_number(&self) -> u64 {
        self.0.sources.fetch_add(1, Ordering::Relaxed)
    }

    /// The chunk's bytes, from the last few or else from `load`. Errors: those of `load`.
    pub(super) fn chunk<E>(&self, key: Key, load: impl FnOnce() -> Result<Vec<u8>, E>) -> Result<Arc<Vec<u8>>, E> {
        let lock = || self.0.chunks.lock().unwrap_or_else(PoisonError::into_inner);
        if let Some(bytes) = lock().iter().find(|(have, _)| *have == key).map(|(_, bytes)| Arc::clone(bytes)) {
            return Ok(bytes);
        }
        // inflated outside the lock
        let bytes = Arc::new(load()?);
        if bytes.len() > LARGEST {
            return Ok(bytes);
        }
        let mut chunks = lock();
        let mut left = MOST_BYTES - bytes.len();
        chunks.retain(|(_, kept)| {
            let fits = kept.len() <= left;
            left = left.saturating_sub(kept.len());
            fits
        });
        chunks.truncate(PER_THREAD * rayon::current_num_threads() - 1);
        chunks.push_front((key, Arc::clone(&bytes)));
        Ok(bytes)
    }
}
