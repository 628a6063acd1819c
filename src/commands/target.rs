//! Where a command may write: never over its own inputs, and over nothing that afmid did not write, or that was changed
//! since.

use std::fs::{self, Metadata};
use std::io::{ErrorKind, Read};
use std::os::unix::fs::{FileTypeExt, MetadataExt};
use std::path::{Path, PathBuf};

use afmid_pipeline::files::{has_mark, open_regular, probe, read_regular, states_mark, sweep_beside};
use afmid_pipeline::store::{FileKind, Written, file_kind, written};

use crate::export::is_exported;
use crate::failure::Failure;
use crate::interrupt;
use crate::relative::folder_of;
use crate::report::is_page;

/// What is to be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Target {
    /// A result file.
    Result,
    /// A report's page.
    Page,
    /// A model, or modes with their shapes, for other programs.
    Export,
}

impl Target {
    /// Why what lies at the path must stay, in words that follow its name; none: it may be replaced. An empty file
    /// holds nothing that could be lost: a script may have made it to reserve the name.
    ///
    /// Results, pages and exports state the hash of what was written. Errors: it cannot be read.
    fn in_the_way(self, path: &Path) -> std::io::Result<Option<String>> {
        let kind = file_kind(path)?;
        if kind == FileKind::Empty {
            return Ok(None);
        }
        let (own, changed) = match self {
            Self::Result => match written(path)? {
                Written::AsWritten | Written::CutShort => (true, false),
                Written::Changed => (true, true),
                Written::Other(_) => (false, false),
            },
            Self::Page | Self::Export => {
                let head = head(path)?;
                let looks =
                    if self == Self::Page { kind == FileKind::Html && is_page(&head) } else { is_exported(&head) };
                (looks, looks && !has_mark(path)?)
            }
        };
        Ok(match (own, changed) {
            (true, false) => None,
            (true, true) if self == Self::Result || states_mark(path)? => {
                Some("was changed since afmid wrote it: it is not replaced".to_owned())
            }
            (true, true) => {
                Some("states no hash of what was written, as those of earlier versions: it is not replaced".to_owned())
            }
            (false, _) => Some(format!("is {kind}: only {} is replaced", self.wanted())),
        })
    }

    const fn wanted(self) -> &'static str {
        match self {
            Self::Result => "a result of afmid's",
            Self::Page => "a page that `afmid report` wrote",
            Self::Export => "a file that `afmid export` wrote",
        }
    }
}

/// An input of the command, and what it is to it.
pub type Input = (&'static str, PathBuf);

/// Sees to it, before anything runs, that `path` can be written and that nothing is lost by it. Removes what killed
/// commands left beside it.
///
/// Errors, all usage: it is an input; it exists and is no regular file, or a file of another kind; its folder cannot be
/// made or written.
pub fn prepare(path: &Path, target: Target, inputs: &[Input]) -> Result<(), Failure> {
    let shown = path.display();
    match fs::metadata(path) {
        Ok(metadata) => existing(path, &metadata, target, inputs)?,
        Err(_) if path.is_symlink() => {
            return Err(usage(
                format!("{shown} is a link to nothing, wanted a file"),
                "remove it, or give another name with -o",
            ));
        }
        Err(error) if error.kind() != ErrorKind::NotFound && path.parent().is_some_and(Path::is_dir) => {
            return Err(usage(format!("{shown} cannot be written: {error}"), ANOTHER));
        }
        Err(_) => {}
    }
    if path.file_name().is_none() || path.as_os_str().as_encoded_bytes().ends_with(b"/") {
        return Err(usage(format!("{shown} is a folder, wanted a file"), ANOTHER));
    }
    provide_folder(folder_of(path))?;
    interrupt::writes_in(folder_of(path));
    sweep_beside(path);
    probe(path).map_err(|error| match error.kind() {
        ErrorKind::InvalidFilename => {
            usage(format!("{shown} cannot be written: its name is too long ({error})"), ANOTHER)
        }
        _ => {
            let folder = folder_of(path).display();
            usage(format!("{shown} cannot be written: no file can be made in its folder {folder} ({error})"), ANOTHER)
        }
    })
}

const ANOTHER: &str = "give another place with -o";

fn usage(message: String, help: &str) -> Failure {
    Failure::usage(message, Some(help.to_owned()))
}

fn existing(path: &Path, metadata: &Metadata, target: Target, inputs: &[Input]) -> Result<(), Failure> {
    let shown = path.display();
    if !metadata.is_file() {
        return Err(usage(format!("{shown} is {}, wanted a file", odd(metadata)), ANOTHER));
    }
    let same = |other: &Path| {
        fs::metadata(other).is_ok_and(|other| (other.dev(), other.ino()) == (metadata.dev(), metadata.ino()))
    };
    if let Some((what, input)) = inputs.iter().find(|(_, input)| same(input)) {
        let called = if input == path { String::new() } else { format!(", also called {shown},") };
        return Err(usage(
            format!("the output would replace {what}: {}{called} is an input of this command", input.display()),
            "give another name with -o",
        ));
    }
    let found =
        target.in_the_way(path).map_err(|error| usage(format!("{shown} cannot be looked at: {error}"), ANOTHER))?;
    match found {
        None if path.is_symlink() => Err(usage(
            format!(
                "{shown} is a symbolic link: a new file would take its place, not that of the file that it leads to"
            ),
            "give the name of the file itself with -o, or remove the link first",
        )),
        None => Ok(()),
        Some(found) => Err(usage(
            format!("{shown} exists and {found}"),
            "give another name with -o, or remove the file first if it is no longer needed",
        )),
    }
}

/// The text of a file, as far as it is one; nothing of what is no regular file, or cannot be read.
pub fn text_of(path: &Path) -> String {
    let bytes = read_regular(path, MOST_TEXT_BYTES).unwrap_or_default();
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The largest text of an earlier version that is known by what it says: pages, scripts and figures come to less.
const MOST_TEXT_BYTES: u64 = 1 << 28;

/// As much of a file as tells a page or an exported file.
fn head(path: &Path) -> std::io::Result<Vec<u8>> {
    let mut head = Vec::new();
    open_regular(path)?.take(1 << 13).read_to_end(&mut head)?;
    Ok(head)
}

fn odd(metadata: &Metadata) -> &'static str {
    let kind = metadata.file_type();
    if kind.is_dir() {
        "a folder"
    } else if kind.is_char_device() || kind.is_block_device() {
        "a device"
    } else if kind.is_fifo() {
        "a pipe"
    } else if kind.is_socket() {
        "a socket"
    } else if kind.is_file() {
        "a file"
    } else {
        "no regular file"
    }
}

/// Sees to it that a file can be made in a folder as far as the folder goes: one that is missing is made, with those above
/// it.
///
/// Errors, usage: it cannot be made, or is no folder.
pub fn provide_folder(folder: &Path) -> Result<(), Failure> {
    if folder.is_dir() {
        return Ok(());
    }
    let shown = folder.display();
    Err(match fs::metadata(folder) {
        Ok(metadata) => usage(format!("{shown} is {}, wanted a folder", odd(&metadata)), ANOTHER),
        Err(error) if error.kind() == ErrorKind::NotADirectory => {
            usage(format!("{shown} cannot be a folder: what lies above it is none ({error})"), ANOTHER)
        }
        Err(error) if error.kind() != ErrorKind::NotFound => {
            usage(format!("the folder {shown} cannot be looked at: {error}"), ANOTHER)
        }
        Err(_) => match fs::create_dir_all(folder) {
            Ok(()) => return Ok(()),
            Err(error) => usage(format!("the folder {shown} cannot be made: {error}"), ANOTHER),
        },
    })
}

/// A folder that a command fills (the results of a batch, figures). Errors as of [`provide_folder`].
pub fn make_folder(folder: &Path) -> Result<(), Failure> {
    interrupt::writes_in(folder);
    provide_folder(folder)
}
