//! What a file is, as far as its first bytes show: for messages, and before a file is replaced.

use std::fmt;
use std::path::Path;

use crate::files::{HDF5_SIGNATURE, head, is_result, open_regular};
use crate::recording::{InputFiles, is_native};

/// What a file is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum FileKind {
    /// A stage or result file of afmid's, whole or damaged.
    Own,
    /// A native record.
    Record,
    /// Any other HDF5 file.
    Hdf5,
    /// A page.
    Html,
    /// TOML: most likely a config.
    Toml,
    /// Any other text.
    Text,
    /// Nothing in it.
    Empty,
    /// None of these.
    Other,
}

impl fmt::Display for FileKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Own => "a file of afmid's",
            Self::Record => "a native record (HDF5 with `sample_rate_hz`)",
            Self::Hdf5 => "an HDF5 file of another program",
            Self::Html => "an HTML page",
            Self::Toml => "a TOML file",
            Self::Text => "a text file",
            Self::Empty => "an empty file",
            Self::Other => "a file of an unknown kind",
        })
    }
}

/// What a file is. It need not be whole: a result that was cut short is still afmid's. Errors: it cannot be read.
pub fn file_kind(path: &Path) -> std::io::Result<FileKind> {
    let mut file = open_regular(path)?;
    let head = head(&mut file)?;
    if is_result(&mut file, &head)? {
        return Ok(FileKind::Own);
    }
    if head.starts_with(HDF5_SIGNATURE) {
        return Ok(if is_native(&InputFiles::new(), path) { FileKind::Record } else { FileKind::Hdf5 });
    }
    Ok(text_kind(path, &head))
}

fn text_kind(path: &Path, head: &[u8]) -> FileKind {
    if head.is_empty() {
        return FileKind::Empty;
    }
    let text = match std::str::from_utf8(head) {
        Ok(text) => text,
        // the head may end within a character
        Err(error) if error.error_len().is_none() => {
            std::str::from_utf8(&head[..error.valid_up_to()]).unwrap_or_default()
        }
        Err(_) => return FileKind::Other,
    };
    let start: String = text.trim_start_matches('\u{feff}').trim_start().chars().take(14).collect();
    let start = start.to_ascii_lowercase();
    if start.starts_with("<!doctype html") || start.starts_with("<html") {
        return FileKind::Html;
    }
    let named = path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("toml"));
    if named || text.lines().any(|line| line.trim() == "[pipeline]") { FileKind::Toml } else { FileKind::Text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_are_distinguished_by_their_bytes() {
        let folder = tempfile::tempdir().unwrap();
        let kind = |name: &str, bytes: &[u8]| {
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).unwrap();
            file_kind(&path).unwrap()
        };
        assert_eq!(kind("a.html", b" \n<!DOCTYPE html>\n<html>"), FileKind::Html);
        assert_eq!(kind("page", b"<HTML lang=en>"), FileKind::Html);
        assert_eq!(kind("a.toml", b"x = 1\n"), FileKind::Toml);
        assert_eq!(kind("config", b"# mine\n[pipeline]\n"), FileKind::Toml);
        assert_eq!(kind("notes.txt", "Länge".as_bytes()), FileKind::Text);
        assert_eq!(kind("nothing", b""), FileKind::Empty);
        assert_eq!(kind("bytes", &[0xff, 0x00, 0xfe]), FileKind::Other);
        // a signature and nothing behind it
        assert_eq!(kind("cut.h5", HDF5_SIGNATURE), FileKind::Hdf5);
        assert!(file_kind(&folder.path().join("nowhere")).is_err());
    }

    #[test]
    fn results_are_afmids_even_when_cut_short_and_records_are_not() {
        use crate::recording::{Codes, NativeChannel, NativeRecord, RecordStorage, write_native};
        let folder = tempfile::tempdir().unwrap();
        let result = folder.path().join("r.h5");
        crate::store::write_result(&result, &crate::store::fixture::run_result()).unwrap();
        assert_eq!(file_kind(&result).unwrap(), FileKind::Own);
        let bytes = std::fs::read(&result).unwrap();
        std::fs::write(&result, &bytes[..bytes.len() - 500]).unwrap();
        assert_eq!(file_kind(&result).unwrap(), FileKind::Own);
        let channel = NativeChannel {
            location: "deflection".to_owned(),
            codes: Codes::Int16(vec![1; 100]),
            unit: "V".to_owned(),
            scale_factor: 1.0,
            add_offset: 0.0,
            long_name: String::new(),
        };
        let record = NativeRecord { sample_rate_hz: 5e6, started_at: String::new(), channels: vec![channel] };
        let path = folder.path().join("record.h5");
        write_native(&path, &record, RecordStorage::Raw).unwrap();
        assert_eq!(file_kind(&path).unwrap(), FileKind::Record);
    }
}
