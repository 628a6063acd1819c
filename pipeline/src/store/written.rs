//! Whether a file may be replaced by a result: only one that this program wrote, as it wrote it.

use std::os::unix::fs::FileExt;
use std::path::Path;

use super::file_kind::{FileKind, file_kind};
use super::seal::{Seal, look_at_seal};
use crate::files::{SEAL, open_regular};

/// What lies where a result is going to be written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Written {
    /// A result or stage file, as it was written: its seal fits.
    AsWritten,
    /// The beginning of one: nothing of it can be read.
    CutShort,
    /// One that somebody changed since.
    Changed,
    /// A file of another kind.
    Other(FileKind),
}

/// What lies at a path. Errors: it cannot be read.
pub fn written(path: &Path) -> std::io::Result<Written> {
    match file_kind(path)? {
        FileKind::Own => {}
        other => return Ok(Written::Other(other)),
    }
    Ok(match look_at_seal(path)? {
        Seal::Fits => Written::AsWritten,
        Seal::DoesNotFit => Written::Changed,
        Seal::None if is_cut_short(path)? => Written::CutShort,
        Seal::None => Written::Changed,
    })
}

/// Whether an HDF5 file ends before the end that its superblock states, or within the seal behind that. Programs that
/// change a file write a new end.
fn is_cut_short(path: &Path) -> std::io::Result<bool> {
    let file = open_regular(path)?;
    let length = file.metadata()?.len();
    let mut head = [0; 48];
    if length < head.len() as u64 {
        return Ok(true);
    }
    file.read_exact_at(&mut head, 0)?;
    // HDF5 File Format Specification, version 3, II.A: where each version of the superblock has its address of the end
    // of the file
    let at = match head[8] {
        0 => 40,
        2 | 3 => 28,
        _ => return Ok(false),
    };
    let mut end = [0; 8];
    end.copy_from_slice(&head[at..at + 8]);
    let end = u64::from_le_bytes(end);
    let Some(behind) = length.checked_sub(end) else { return Ok(true) };
    if behind == 0 || behind >= SEAL.len() as u64 + 65 {
        return Ok(false);
    }
    let mut rest = vec![0; behind as usize];
    file.read_exact_at(&mut rest, end)?;
    let stated = rest.len().min(SEAL.len());
    Ok(rest[..stated] == SEAL.as_bytes()[..stated])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::fixture::Folder;
    use crate::store::fixture::run_result;
    use crate::store::write_result;

    #[test]
    fn a_result_is_known_by_its_seal_and_a_changed_one_is_distinguished_from_a_cut_one() {
        let folder = Folder::new("written");
        let path = folder.file("r.h5");
        write_result(&path, &run_result()).unwrap();
        assert_eq!(written(&path).unwrap(), Written::AsWritten);
        let whole = std::fs::read(&path).unwrap();
        for length in [whole.len() - 1, whole.len() - 114, whole.len() - 115, whole.len() / 2, 700] {
            std::fs::write(&path, &whole[..length]).unwrap();
            let cut = written(&path).unwrap();
            assert!(matches!(cut, Written::CutShort | Written::Other(FileKind::Hdf5)), "cut at {length}: {cut:?}");
        }
        let mut other = whole.clone();
        let middle = whole.len() / 2;
        other[middle] ^= 1;
        std::fs::write(&path, &other).unwrap();
        assert_eq!(written(&path).unwrap(), Written::Changed);
        std::fs::write(&path, &whole).unwrap();
        // as h5py does with mode "a"
        let file = hdf5::File::open_rw(&path).unwrap();
        file.new_attr::<f64>().create("note").unwrap().write_scalar(&1.0).unwrap();
        file.close().unwrap();
        assert_eq!(written(&path).unwrap(), Written::Changed);
        std::fs::write(&path, "notes").unwrap();
        assert_eq!(written(&path).unwrap(), Written::Other(FileKind::Text));
    }
}
