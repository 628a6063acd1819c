//! The processes that this one has started.

use std::fs;

use super::process::kill_descendants;

/// Kills every process that this one has started in a group of its own, with the group: plugins, wherever they are
/// held. For a program that ends at once.
pub fn kill_children() {
    let own = std::process::id();
    for entry in fs::read_dir("/proc").into_iter().flatten().flatten() {
        let Some(pid) = entry.file_name().to_str().and_then(|name| name.parse::<i32>().ok()) else { continue };
        let Ok(stat) = fs::read_to_string(entry.path().join("stat")) else { continue };
        if parent_and_group(&stat).is_none_or(|(parent, group)| parent != own || group != pid) {
            continue;
        }
        if let Some(group) = rustix::process::Pid::from_raw(pid) {
            // what has left the group is known as long as the host lives
            kill_descendants(group);
            // an error means that nothing is left to kill
            let _ = rustix::process::kill_process_group(group, rustix::process::Signal::KILL);
        }
    }
}

/// From `PID (NAME) STATE PARENT GROUP ...`: a name may hold anything, brackets too.
fn parent_and_group(stat: &str) -> Option<(u32, i32)> {
    let mut fields = stat.rsplit_once(')')?.1.split_ascii_whitespace().skip(1);
    Some((fields.next()?.parse().ok()?, fields.next()?.parse().ok()?))
}

#[cfg(test)]
mod tests {
    use super::parent_and_group;

    #[test]
    fn parent_and_group_are_read_behind_any_name() {
        assert_eq!(parent_and_group("12 (a) b (c)) S 7 12 3 0"), Some((7, 12)));
        assert_eq!(parent_and_group("12 (a"), None);
    }
}
