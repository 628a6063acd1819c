//! Zip archives: where their members lie. They are inflated by [`Packed`], never by the archive's library.

use crate::grid::Store;
use crate::packed::{Packed, Wrapper};
use crate::pinned::{Pinned, read_at};
use crate::{FormatError, fail};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;
use std::sync::Arc;
use zip::{CompressionMethod, ZipArchive};

/// What every archive with a member begins with.
pub(crate) const MAGIC: &[u8] = b"PK\x03\x04";

/// An archive's directory and the file.
pub(crate) struct Archive {
    directory: ZipArchive<BufReader<File>>,
    file: File,
    pinned: Pinned,
}

/// Where a member's bytes lie, whether packed, and what they must come out as.
#[derive(Debug, Clone)]
pub(crate) struct Member {
    /// Byte of the file.
    pub(crate) at: u64,
    pub(crate) packed_bytes: u64,
    /// Bytes when unpacked.
    pub(crate) bytes: u64,
    crc32: u32,
    deflated: bool,
}

/// Why a member cannot be read, though the archive is whole.
#[derive(Debug)]
pub(crate) enum Refused {
    /// It is packed or encrypted in a way that is not read.
    Kind(String),
    /// It is damaged.
    Damaged(FormatError),
}

impl Archive {
    /// Reads the directory. Errors: no archive.
    pub(crate) fn open(path: &Path) -> Result<Self, FormatError> {
        let (pinned, file) = Pinned::open(path)?;
        let directory = ZipArchive::new(BufReader::new(pinned.reopen()?)).map_err(|e| damaged(&e))?;
        Ok(Self { directory, file, pinned })
    }

    /// The file.
    pub(crate) fn file(&self) -> &File {
        &self.file
    }

    /// What readers of samples open again.
    pub(crate) fn pinned(&self) -> &Pinned {
        &self.pinned
    }

    /// Number of members.
    pub(crate) fn len(&self) -> usize {
        self.directory.len()
    }

    /// Name of a member; empty if it is not readable.
    pub(crate) fn name(&self, number: usize) -> String {
        self.directory.name_for_index(number).and_then(Result::ok).unwrap_or_default().into_owned()
    }

    /// Where a member lies, by its name; none if there is none of that name. Errors: as [`Archive::member`].
    pub(crate) fn find(&mut self, name: &str) -> Option<Result<Member, Refused>> {
        self.directory.index_for_name(name).map(|number| self.member(number))
    }

    /// Where a member lies. Errors: outside the file, encrypted, packed otherwise than by deflate, another size than it
    /// can have.
    pub(crate) fn member(&mut self, number: usize) -> Result<Member, Refused> {
        let found = self.directory.by_index_raw(number).map_err(|e| Refused::Damaged(damaged(&e)))?;
        let name = found.name().map_err(|e| Refused::Damaged(damaged(&e)))?.to_string();
        if found.encrypted() {
            return Err(Refused::Kind("encrypted".to_owned()));
        }
        let method = found.compression();
        let deflated = method == CompressionMethod::DEFLATE;
        if !deflated && method != CompressionMethod::Stored {
            return Err(Refused::Kind(format!("compressed by {method:?}, only stored and deflated members are read")));
        }
        let at = found.data_start().unwrap_or(u64::MAX);
        let (packed_bytes, bytes, crc32) = (found.compressed_size(), found.size(), found.crc32());
        if at.checked_add(packed_bytes).is_none_or(|end| end > self.pinned.bytes()) {
            let what = format!("{}: the member of the archive", name.escape_debug());
            return Err(Refused::Damaged(fail::truncated(&what, at, packed_bytes, self.pinned.bytes())));
        }
        if !deflated && bytes != packed_bytes {
            let problem = format!(
                "{}: found {packed_bytes} stored bytes, which cannot hold the {bytes} announced",
                name.escape_debug()
            );
            return Err(Refused::Damaged(fail::at(at, problem, fail::COPY_AGAIN)));
        }
        Ok(Member { at, packed_bytes, bytes, crc32, deflated })
    }

    /// The first bytes of a member, at most `count`. Errors: it cannot be inflated.
    pub(crate) fn head(&self, member: &Member, count: u64) -> Result<Vec<u8>, FormatError> {
        let mut bytes = vec![0; member.bytes.min(count) as usize];
        match self.packed(member)? {
            Some(packed) => packed.inflating()?.fill(&mut bytes)?,
            None => read_at(&self.file, member.at, &mut bytes)?,
        }
        Ok(bytes)
    }

    /// The member as a compressed stretch of the file; none if it is stored as it is. Errors: it cannot hold what it
    /// announces.
    pub(crate) fn packed(&self, member: &Member) -> Result<Option<Packed>, FormatError> {
        let wrapper = Wrapper::Bare { crc32: member.crc32 };
        let packed = || Packed::new(&self.pinned, member.at, member.packed_bytes, member.bytes, wrapper);
        member.deflated.then(packed).transpose()
    }

    /// Where readers of samples find a member's bytes, and the first of them there. Errors: as [`Archive::packed`].
    pub(crate) fn store(&self, member: &Member) -> Result<(Store, u64), FormatError> {
        Ok(match self.packed(member)? {
            Some(packed) => (Store::Packed(Arc::new(packed)), 0),
            None => (Store::File(self.pinned.clone()), member.at),
        })
    }
}

fn damaged(found: &dyn std::fmt::Display) -> FormatError {
    let help = "the archive is damaged, cut off or none: copy it again from where it was written";
    fail::plain(format!("the archive cannot be read: {found}"), help)
}
