//! The members of a JPK file's archive: headers and samples.

use std::sync::Arc;

use super::properties::{Table, parse};
use crate::archive::{Archive, Member, Refused};
use crate::grid::Grid;
use crate::number::Number;
use crate::{FormatError, Source, fail};

/// Headers of real files have some kB; more is no header but an attempt at this machine's memory.
const MOST_HEADER_BYTES: u64 = 1 << 20;

/// Names of the members, in the archive's order.
pub(super) fn names(archive: &Archive) -> Vec<String> {
    (0..archive.len()).map(|number| archive.name(number)).collect()
}

/// Where a member lies; none if there is no such member. Errors: outside the file, encrypted, packed otherwise than by
/// deflate.
pub(super) fn locate(archive: &mut Archive, name: &str) -> Result<Option<Member>, FormatError> {
    let refused = |refused| match refused {
        Refused::Kind(what) => fail::plain(format!("{name}: the member of the archive is {what}"), fail::COPY_AGAIN),
        Refused::Damaged(error) => error,
    };
    archive.find(name).transpose().map_err(refused)
}

/// A property file; none if there is no such member. Errors: it cannot be unpacked.
pub(super) fn table(archive: &mut Archive, name: &str) -> Result<Option<Table>, FormatError> {
    let Some(member) = locate(archive, name)? else { return Ok(None) };
    if member.bytes > MOST_HEADER_BYTES {
        let problem = format!("{name}: a header of {} bytes, wanted at most {MOST_HEADER_BYTES}", member.bytes);
        return Err(fail::at(member.at, problem, fail::COPY_AGAIN));
    }
    match archive.packed(&member)? {
        Some(packed) => Ok(Some(parse(&packed.bytes()?))),
        None => Ok(Some(parse(&archive.head(&member, member.bytes)?))),
    }
}

/// The samples of a member, from the first to the last whole one. Errors: more than can come from its stored bytes.
pub(super) fn source(archive: &Archive, member: &Member, number: Number) -> Result<Arc<dyn Source>, FormatError> {
    let (store, first) = archive.store(member)?;
    let samples = (member.bytes / number.bytes()) as usize;
    Ok(Arc::new(Grid { store, first, step: number.bytes(), samples, number, big_endian: true }))
}
