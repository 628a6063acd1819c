//! Opening what a user names: a regular file or nothing.

use std::fs::{File, FileType, OpenOptions};
use std::io::{Error, ErrorKind, Read, Result};
use std::os::unix::fs::{FileTypeExt, OpenOptionsExt};
use std::path::Path;

use rustix::fs::OFlags;

/// Opens a file for reading. Errors: the system's; it is no regular file.
///
/// A FIFO, socket or device is refused before it is opened: opening alone may wait for ever or have an effect. Should
/// the path become one in between, opening does not wait, and what was opened is looked at again.
pub fn open_regular(path: &Path) -> Result<File> {
    check(std::fs::metadata(path)?.file_type())?;
    let file = OpenOptions::new().read(true).custom_flags(OFlags::NONBLOCK.bits().cast_signed()).open(path)?;
    check(file.metadata()?.file_type())?;
    Ok(file)
}

/// Opens a file for reading and for writing at its end; makes it if it is not there. Errors: as [`open_regular`].
pub fn append_regular(path: &Path) -> Result<File> {
    match std::fs::metadata(path) {
        Ok(metadata) => check(metadata.file_type())?,
        Err(error) if error.kind() == ErrorKind::NotFound => {}
        Err(error) => return Err(error),
    }
    let mut options = OpenOptions::new();
    options.read(true).append(true).create(true).custom_flags(OFlags::NONBLOCK.bits().cast_signed());
    let file = options.open(path)?;
    check(file.metadata()?.file_type())?;
    Ok(file)
}

/// The bytes of a regular file of at most `most`. Errors: as [`open_regular`]; it is larger.
pub fn read_regular(path: &Path, most: u64) -> Result<Vec<u8>> {
    let file = open_regular(path)?;
    let larger = || Error::new(ErrorKind::FileTooLarge, format!("it has more than the {most} bytes that are read"));
    if file.metadata()?.len() > most {
        return Err(larger());
    }
    let mut bytes = Vec::new();
    // the size that is stated need not be that which is there: files of /proc state none
    file.take(most.saturating_add(1)).read_to_end(&mut bytes)?;
    if bytes.len() as u64 > most {
        return Err(larger());
    }
    Ok(bytes)
}

fn check(kind: FileType) -> Result<()> {
    let what = match kind {
        kind if kind.is_file() => return Ok(()),
        kind if kind.is_dir() => return Err(Error::new(ErrorKind::IsADirectory, "it is a folder, a file was wanted")),
        kind if kind.is_fifo() => "a FIFO",
        kind if kind.is_socket() => "a socket",
        _ => "a device",
    };
    Err(Error::new(ErrorKind::InvalidInput, format!("it is {what}, a regular file was wanted")))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_regular_files_are_opened_and_none_beyond_its_limit() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        std::fs::write(path("text"), "12345").unwrap();
        std::os::unix::fs::symlink(path("text"), path("link")).unwrap();
        rustix::fs::mknodat(rustix::fs::CWD, path("fifo"), rustix::fs::FileType::Fifo, 0o600.into(), 0).unwrap();
        let _socket = std::os::unix::net::UnixListener::bind(path("socket")).unwrap();
        assert_eq!(read_regular(&path("link"), 5).unwrap(), b"12345");
        for (file, word) in [
            (path("text"), "more than the 4 bytes"),
            (path("fifo"), "a FIFO"),
            (path("socket"), "a socket"),
            ("/dev/zero".into(), "a device"),
            (folder.path().to_owned(), "a folder"),
        ] {
            let error = read_regular(&file, 4).unwrap_err().to_string();
            assert!(error.contains(word), "{error}");
            if word != "more than the 4 bytes" {
                assert!(append_regular(&file).is_err(), "{word}");
            }
        }
        std::io::Write::write_all(&mut append_regular(&path("new")).unwrap(), b"1").unwrap();
        std::io::Write::write_all(&mut append_regular(&path("new")).unwrap(), b"2").unwrap();
        assert_eq!(read_regular(&path("new"), 5).unwrap(), b"12");
        // it states no size
        assert!(read_regular(Path::new("/proc/self/status"), 4).is_err());
    }
}
