//! What a plugin writes to stderr: its end is kept.

use std::collections::VecDeque;
use std::io::Read;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

/// Bytes of stderr that are kept.
const MOST_BYTES: usize = 64 << 10;

/// The end of a stream that a thread reads.
#[derive(Debug, Clone, Default)]
pub(super) struct Log(Arc<(Mutex<Tail>, Condvar)>);

#[derive(Debug, Default)]
struct Tail {
    bytes: VecDeque<u8>,
    cut: bool,
    ended: bool,
}

impl Log {
    /// Reads a stream to its end, on the current thread.
    pub(super) fn follow(&self, mut stream: impl Read) {
        let mut buffer = [0; 8192];
        while let Ok(count @ 1..) = stream.read(&mut buffer) {
            let mut tail = self.lock();
            tail.bytes.extend(&buffer[..count]);
            let excess = tail.bytes.len().saturating_sub(MOST_BYTES);
            tail.cut |= excess > 0;
            tail.bytes.drain(..excess);
        }
        self.lock().ended = true;
        self.0.1.notify_all();
    }

    /// What came since it was asked last.
    pub(super) fn take(&self) -> String {
        let mut tail = self.lock();
        let cut = if std::mem::take(&mut tail.cut) { "[...]\n" } else { "" };
        let bytes: Vec<u8> = tail.bytes.drain(..).collect();
        format!("{cut}{}", String::from_utf8_lossy(&bytes))
    }

    /// The same when no more is to come, or after a moment: a process is dead before its last words are read.
    pub(super) fn take_last(&self) -> String {
        let wait = Duration::from_millis(500);
        let waited = self.0.1.wait_timeout_while(self.lock(), wait, |tail| !tail.ended);
        drop(waited);
        self.take()
    }

    fn lock(&self) -> MutexGuard<'_, Tail> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
#[test]
fn the_end_of_a_long_log_is_kept() {
    let log = Log::default();
    log.follow([b"first\n".repeat(20_000), b"last".to_vec()].concat().as_slice());
    let text = log.take_last();
    assert!(text.starts_with("[...]\n") && text.ends_with("first\nlast"), "{}", &text[..20]);
    assert_eq!(text.len(), MOST_BYTES + 6);
    assert_eq!(log.take(), "");
}
