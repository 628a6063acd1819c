//! Folders: can they be written, how fast, how much is free.

use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::Instant;

use afmid_pipeline::cache::{Sort, Stock};

use super::Finding;
use crate::show::size;

/// Free bytes below which a folder is called full: the intermediates of a paper's archive take a tenth.
const LEAST_FREE: u64 = 1_000_000_000;
/// A file of the size of an averaged event with its standard errors.
const TRIAL_BYTES: usize = 200_000;
/// Seconds for it, synced, beyond which the folder is called slow: a run writes some dozen.
const SLOW_S: f64 = 0.2;

/// Where stage results are kept.
pub fn cache(folder: &Path) -> Finding {
    let help = "choose another with --cache or $AFMID_CACHE";
    if let Err(error) = std::fs::create_dir_all(folder) {
        return Finding::bad("cache", format!("{} cannot be made: {error}", folder.display()), help);
    }
    let kept = Stock::list(folder).map(|stock| stock.total(Sort::Result)).unwrap_or_default();
    let holds = format!("{} results, {}", kept.0, size(kept.1));
    written("cache", folder, &format!("; {holds}"), &format!("`afmid gc` frees it, or {help}"))
}

/// Where `rerun`, `exam` and plugins put what they don't keep.
pub fn temporary() -> Finding {
    written("temporary folder", &std::env::temp_dir(), "", "set TMPDIR to a folder with room")
}

/// The root of the shipped configs' recordings.
pub fn data() -> Finding {
    match std::env::var_os("AFMID_DATA").map(PathBuf::from) {
        None => Finding::good("recordings", "AFMID_DATA is not set: shipped configs look beside their folder"),
        Some(root) if root.is_dir() => Finding::good("recordings", format!("AFMID_DATA is {}", root.display())),
        Some(root) => {
            let found = format!("AFMID_DATA is {}, which is no folder", root.display());
            Finding::warning("recordings", found, "shipped configs that read recordings fail: set it to their root")
        }
    }
}

fn written(what: &'static str, folder: &Path, further: &str, help: &str) -> Finding {
    let name = folder.display();
    let clock = Instant::now();
    let tried = tempfile::NamedTempFile::new_in(folder).and_then(|mut file| {
        file.write_all(&vec![0x5a; TRIAL_BYTES])?;
        file.as_file().sync_all()
    });
    let seconds = clock.elapsed().as_secs_f64();
    let free = fs4::available_space(folder);
    match (tried, free) {
        (Err(error), _) => Finding::bad(what, format!("{name} cannot be written: {error}"), help),
        (Ok(()), Ok(free)) if free < LEAST_FREE => {
            Finding::warning(what, format!("{name}, only {} free{further}", size(free)), help)
        }
        (Ok(()), _) if seconds > SLOW_S => {
            let found =
                format!("{name}, {:.0} ms to write and sync {}{further}", 1e3 * seconds, size(TRIAL_BYTES as u64));
            Finding::warning(what, found, "runs wait for it: choose a folder on a local disk")
        }
        (Ok(()), Ok(free)) => Finding::good(what, format!("{name}, {} free{further}", size(free))),
        (Ok(()), Err(_)) => Finding::good(what, format!("{name}{further}")),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::doctor::State;

    #[test]
    fn a_folder_that_cannot_be_made_is_bad_with_what_to_do() {
        let scratch = tempfile::tempdir().expect("a folder");
        let file = scratch.path().join("file");
        std::fs::write(&file, "no folder").expect("a file");
        let finding = cache(&file.join("cache"));
        assert_eq!(finding.state, State::Bad);
        assert!(finding.help.expect("help").contains("--cache"));
        let finding = cache(&scratch.path().join("new"));
        assert_ne!(finding.state, State::Bad, "{}", finding.found);
        assert!(finding.found.contains("0 results"), "{}", finding.found);
        assert_eq!(
            std::fs::read_dir(scratch.path().join("new")).expect("a folder").count(),
            0,
            "nothing is left behind"
        );
    }
}
