//! The processes that a process has started, and those that these have started.

use std::collections::{BTreeMap, HashSet};
use std::time::Duration;

use rustix::process::{Pid, PidfdFlags, Signal, kill_process, pidfd_open, pidfd_send_signal};

/// How often it is looked whether anything is left: bounds the search where processes start faster than they are
/// killed.
const ROUNDS: usize = 2_000;

/// Kills all that a process has started, and all that these have, until nothing is left. It itself lives on.
///
/// What has left its session and its group is found too, as long as the process adopts it (`PR_SET_CHILD_SUBREAPER`).
pub(in crate::plugin) fn kill_descendants(root: Pid) {
    for _ in 0..ROUNDS {
        let below = descendants(root);
        if below.is_empty() {
            return;
        }
        below.into_iter().for_each(|pid| kill(pid, root));
        std::thread::sleep(Duration::from_millis(1));
    }
}

/// The number of a process that has ended may be another's: the one that is held is looked at once more.
fn kill(pid: Pid, root: Pid) {
    // an error means that it has ended by itself
    match pidfd_open(pid, PidfdFlags::empty()) {
        Ok(held) if descendants(root).contains(&pid) => drop(pidfd_send_signal(held, Signal::KILL)),
        Ok(_) | Err(rustix::io::Errno::SRCH) => {}
        // a kernel or a sandbox without these
        Err(_) => drop(kill_process(pid, Signal::KILL)),
    }
}

/// All that live: those that have ended and were not waited for are none.
fn descendants(root: Pid) -> HashSet<Pid> {
    let mut children: BTreeMap<i32, Vec<i32>> = BTreeMap::new();
    for entry in std::fs::read_dir("/proc").into_iter().flatten().flatten() {
        let Some(pid) = entry.file_name().to_str().and_then(|name| name.parse::<i32>().ok()) else { continue };
        let stat = std::fs::read_to_string(entry.path().join("stat")).unwrap_or_default();
        if let Some((state, parent)) = state_and_parent(&stat)
            && !matches!(state, 'Z' | 'X')
        {
            children.entry(parent).or_default().push(pid);
        }
    }
    let (mut found, mut next) = (HashSet::new(), vec![root.as_raw_nonzero().get()]);
    while let Some(pid) = next.pop() {
        for child in children.remove(&pid).unwrap_or_default() {
            found.extend(Pid::from_raw(child));
            next.push(child);
        }
    }
    found
}

/// From `PID (NAME) STATE PARENT ...`: a name may hold anything, brackets too.
fn state_and_parent(stat: &str) -> Option<(char, i32)> {
    let mut fields = stat.rsplit_once(')')?.1.split_ascii_whitespace();
    Some((fields.next()?.chars().next()?, fields.next()?.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use std::process::{Command, Stdio};

    use super::*;

    #[test]
    fn state_and_parent_are_read_behind_any_name() {
        assert_eq!(state_and_parent("12 (a) b (c)) S 7 12 3 0"), Some(('S', 7)));
        assert_eq!(state_and_parent("12 (a"), None);
    }

    #[test]
    fn what_a_process_started_dies_and_it_itself_does_not() {
        let mut shell = Command::new("sh")
            // the inner one may be left to the system when its shell goes first, since this one adopts nothing: it ends
            // by itself
            .args(["-c", "sleep 60 & sh -c 'sleep 5; true' & read line"])
            .stdin(Stdio::piped())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn()
            .unwrap();
        let root = Pid::from_raw(i32::try_from(shell.id()).unwrap()).unwrap();
        while descendants(root).len() < 3 {
            std::thread::sleep(Duration::from_millis(5));
        }
        kill_descendants(root);
        assert!(descendants(root).is_empty());
        assert!(shell.try_wait().unwrap().is_none(), "it itself lives");
        drop(shell.stdin.take());
        shell.wait().unwrap();
    }
}
