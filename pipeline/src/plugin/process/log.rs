//! What a plugin writes to stderr: its end is kept.

use std::collections::VecDeque;
use std::fs::File;
use std::io::Read;
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::time::Duration;

use rustix::event::{PollFd, PollFlags, poll};

/// Bytes of stderr that are kept.
const MOST_BYTES: usize = 64 << 10;

/// The most that is read at once: a plugin that never stops writing delays an answer by no more than this.
const MOST_AT_ONCE: usize = 1 << 20;

/// The end of a stream. Two read it, a thread that waits for it and a caller, each with the lock held: what was written
/// before an answer is therefore never missed by a caller that reads after it.
#[derive(Debug, Clone, Default)]
pub(super) struct Log(Arc<(Mutex<Tail>, Condvar)>);

#[derive(Debug, Default)]
struct Tail {
    stream: Option<File>,
    bytes: VecDeque<u8>,
    cut: bool,
}

impl Log {
    /// Of a stream, and the thread's work that empties it whenever there is something. Errors: the system refuses.
    pub(super) fn of(stream: File) -> std::io::Result<(Self, impl FnOnce() + Send + 'static)> {
        let waits = stream.try_clone()?;
        never_wait(&stream)?;
        let log = Self(Arc::new((Mutex::new(Tail { stream: Some(stream), ..Tail::default() }), Condvar::new())));
        let own = log.clone();
        let follow = move || {
            while wait_for(&waits) {
                let mut tail = own.lock();
                tail.read();
                if tail.stream.is_none() {
                    break;
                }
            }
            own.lock().stream = None;
            own.0.1.notify_all();
        };
        Ok((log, follow))
    }

    /// What came since it was asked last.
    pub(super) fn take(&self) -> String {
        let mut tail = self.lock();
        tail.read();
        let cut = if std::mem::take(&mut tail.cut) { "[...]\n" } else { "" };
        let bytes: Vec<u8> = tail.bytes.drain(..).collect();
        format!("{cut}{}", String::from_utf8_lossy(&bytes))
    }

    /// The same when no more is to come, or after a moment: a process is dead before its last words are read.
    pub(super) fn take_last(&self) -> String {
        let wait = Duration::from_millis(500);
        let waited = self.0.1.wait_timeout_while(self.lock(), wait, |tail| tail.stream.is_some());
        drop(waited);
        self.take()
    }

    fn lock(&self) -> MutexGuard<'_, Tail> {
        self.0.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Tail {
    /// Takes what there is, without waiting. At its end the stream is let go.
    fn read(&mut self) {
        let mut buffer = [0; 8192];
        let mut total = 0;
        while total < MOST_AT_ONCE {
            let Some(stream) = &mut self.stream else { return };
            match stream.read(&mut buffer) {
                Ok(count @ 1..) => {
                    total += count;
                    self.bytes.extend(&buffer[..count]);
                    let excess = self.bytes.len().saturating_sub(MOST_BYTES);
                    self.cut |= excess > 0;
                    self.bytes.drain(..excess);
                }
                Err(error) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(error) if error.kind() == std::io::ErrorKind::WouldBlock => return,
                Ok(0) | Err(_) => self.stream = None,
            }
        }
    }
}

/// Reading shall say that there is nothing instead of waiting; the writer's end is a file of its own and is not
/// touched.
fn never_wait(stream: &File) -> std::io::Result<()> {
    let flags = rustix::fs::fcntl_getfl(stream)?;
    Ok(rustix::fs::fcntl_setfl(stream, flags | rustix::fs::OFlags::NONBLOCK)?)
}

/// Waits until there is something to read, or the end: whether it can be waited for.
fn wait_for(stream: &File) -> bool {
    loop {
        match poll(&mut [PollFd::new(stream, PollFlags::IN)], None) {
            Ok(_) => return true,
            Err(rustix::io::Errno::INTR) => {}
            Err(_) => return false,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use super::{Log, MOST_BYTES};

    fn pipe() -> (Log, std::thread::JoinHandle<()>, std::io::PipeWriter) {
        let (reader, writer) = std::io::pipe().unwrap();
        let (log, follow) = Log::of(std::os::fd::OwnedFd::from(reader).into()).unwrap();
        (log, std::thread::spawn(follow), writer)
    }

    #[test]
    fn the_end_of_a_long_log_is_kept() {
        let (log, thread, mut writer) = pipe();
        writer.write_all(&[b"first\n".repeat(20_000), b"last".to_vec()].concat()).unwrap();
        drop(writer);
        thread.join().unwrap();
        let text = log.take_last();
        assert!(text.starts_with("[...]\n") && text.ends_with("first\nlast"), "{}", &text[..20]);
        assert_eq!(text.len(), MOST_BYTES + 6);
        assert_eq!(log.take(), "");
    }

    #[test]
    fn what_was_written_before_it_is_asked_is_there() {
        let (log, thread, mut writer) = pipe();
        // the thread may or may not have woken up: it must make no difference
        for turn in 0..2_000 {
            writeln!(writer, "line {turn}").unwrap();
            assert_eq!(log.take(), format!("line {turn}\n"));
        }
        drop(writer);
        thread.join().unwrap();
    }
}
