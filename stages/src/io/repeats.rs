//! What was recorded once counts once: copies of a recording under other names, in other formats or with other
//! attributes would let standard errors fall by the root of their number.

use std::collections::HashMap;
use std::path::{Path, PathBuf};

use afmid_pipeline::recording::{Opened, SamplePrint, equal_samples};
use afmid_pipeline::{Channel, Context, Record, StageError};
use num_complex::Complex64;
use rayon::prelude::*;

use crate::artifacts::PIEZO;

/// Copies that a warning names; more are counted.
const MOST_NAMED: usize = 5;

/// A copy, and what it is a copy of.
pub(crate) type CopyOf = (String, String);

/// Says which copies are left out, if there are any. `equal` is what they have in common: "the same bytes".
pub(crate) fn warn_of_copies(cx: &Context, copies: &[CopyOf], equal: &str) {
    if copies.is_empty() {
        return;
    }
    let named: Vec<String> = copies.iter().take(MOST_NAMED).map(|(copy, of)| format!("{copy} (as {of})")).collect();
    let more = copies.len().saturating_sub(MOST_NAMED);
    let more = if more > 0 { format!(" and {more} more") } else { String::new() };
    let (count, are) =
        if copies.len() == 1 { ("1 copy".to_owned(), "is") } else { (format!("{} copies", copies.len()), "are") };
    cx.warn(format!(
        "{count} of what was recorded once {are} left out, so that it counts once: {}{more}; {equal}. Remove them, or \
         record again what was to be measured several times",
        named.join(", ")
    ));
}

/// A file's name, with its folder where another file has the same.
pub(crate) fn name_beside(path: &Path, other: &Path) -> String {
    let name = |path: &Path| path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
    let folder = path.parent().filter(|_| name(path) == name(other)).map(name).unwrap_or_default();
    if folder.is_empty() { name(path) } else { format!("{folder}/{}", name(path)) }
}

/// For each item the first one before it with the same key and another path, if there is one. An empty key is none.
pub(crate) fn equal_files<'a>(items: impl Iterator<Item = (&'a Path, &'a str)>) -> Vec<Option<&'a Path>> {
    let mut first: HashMap<&str, &Path> = HashMap::new();
    let of = |(path, hash): (&'a Path, &'a str)| {
        let known = *first.entry(hash).or_insert(path);
        (known != path && !hash.is_empty()).then_some(known)
    };
    items.map(of).collect()
}

/// The files without later ones of the same bytes; says which are left out. Errors: one cannot be read.
pub(crate) fn each_file_once(paths: Vec<PathBuf>, cx: &Context) -> Result<Vec<PathBuf>, StageError> {
    if paths.len() < 2 {
        return Ok(paths);
    }
    let hashes = paths.par_iter().map(|path| cx.files().hash(path)).collect::<Result<Vec<String>, _>>()?;
    let equal = equal_files(paths.iter().zip(&hashes).map(|(path, hash)| (path.as_path(), hash.as_str())));
    warn_of_equal_files(cx, paths.iter().map(PathBuf::as_path).zip(equal.iter().copied()));
    let copies: Vec<bool> = equal.iter().map(Option::is_some).collect();
    Ok(paths.into_iter().zip(copies).filter(|(_, is_copy)| !is_copy).map(|(path, _)| path).collect())
}

fn warn_of_equal_files<'a>(cx: &Context, files: impl Iterator<Item = (&'a Path, Option<&'a Path>)>) {
    let named = |(path, of): (&Path, Option<&Path>)| of.map(|of| (name_beside(path, of), name_beside(of, path)));
    warn_of_copies(cx, &files.filter_map(named).collect::<Vec<CopyOf>>(), "the files hold the same bytes");
}

/// Values up to which equal ones are no sign of one recording, as for samples of records.
const MOST_VALUES_BY_CHANCE: usize = 100;

/// Whether two rows hold the same values.
pub(crate) fn same_values<T: Same>(one: &[T], other: &[T]) -> bool {
    one.len() == other.len() && one.iter().zip(other).all(|(a, b)| a.same(b))
}

/// Whether a row has more values than repeat by chance, and not all of them equal.
pub(crate) fn varies<T: Same>(row: &[T]) -> bool {
    row.len() > MOST_VALUES_BY_CHANCE && row.iter().any(|value| !value.same(&row[0]))
}

/// Numbers of which those that are not known are equal, too.
pub(crate) trait Same {
    /// Whether both are one number, or both not known.
    fn same(&self, other: &Self) -> bool;
}

impl Same for f64 {
    fn same(&self, other: &Self) -> bool {
        self == other || self.is_nan() && other.is_nan()
    }
}

impl Same for Complex64 {
    fn same(&self, other: &Self) -> bool {
        self.re.same(&other.re) && self.im.same(&other.im)
    }
}

/// A file that was opened, with the prints of its records' channels as far as they are known.
pub(crate) struct Printed {
    pub opened: Opened,
    /// Record by record, channel by channel, without the piezo's.
    prints: Vec<Vec<SamplePrint>>,
}

impl Printed {
    /// Of a file that has just been opened. `begin`: its first samples are read now, since it had to be parsed.
    pub fn new(opened: Opened, begin: bool) -> Self {
        let print = |channel: &Channel| if begin { SamplePrint::begun(channel) } else { SamplePrint::new(channel) };
        let of = |record: &Record| sensors(record).map(print).collect();
        let prints = opened.records.iter().map(of).collect();
        Self { opened, prints }
    }
}

/// What measures: the piezo's position is driven, and equal in many records.
fn sensors(record: &Record) -> impl Iterator<Item = &Channel> {
    record.channels.iter().filter(|channel| channel.role != PIEZO)
}

/// The files and their records, each recording once, the first of its copies; says which are left out.
pub(crate) fn each_once(files: Vec<Printed>, cx: &Context) -> Vec<Opened> {
    let files = without_equal_files(files, cx);
    let (mut opened, mut prints, mut owners): (Vec<Opened>, Vec<SamplePrint>, Vec<usize>) = Default::default();
    let mut records = 0;
    for file in files {
        for own in file.prints {
            owners.extend(own.iter().map(|_| records));
            prints.extend(own);
            records += 1;
        }
        opened.push(file.opened);
    }
    if records < 2 {
        return opened;
    }
    let equal = equal_samples(&mut prints);
    let of_record = record_copies(&equal, &owners, records);
    let all: Vec<&Record> = opened.iter().flat_map(|file| &file.records).collect();
    let named = |(copy, of): (usize, &Option<usize>)| {
        let (copy, of) = (all.get(copy)?, all.get((*of)?)?);
        Some((name_of(copy, of), name_of(of, copy)))
    };
    let copies: Vec<CopyOf> = of_record.iter().enumerate().filter_map(named).collect();
    warn_of_copies(cx, &copies, "all their samples are equal");
    let mut stay = of_record.iter().map(Option::is_none);
    opened.iter_mut().for_each(|file| file.records.retain(|_| stay.next().unwrap_or(true)));
    opened.retain(|file| !file.records.is_empty());
    opened
}

fn without_equal_files(files: Vec<Printed>, cx: &Context) -> Vec<Printed> {
    let key =
        |file: &'_ Printed| file.opened.records.first().map(|record| (record.path.clone(), record.blake3.clone()));
    let keys: Vec<_> = files.iter().map(|file| key(file).unwrap_or_default()).collect();
    let equal = equal_files(keys.iter().map(|(path, hash)| (path.as_path(), hash.as_str())));
    warn_of_equal_files(cx, keys.iter().map(|(path, _)| path.as_path()).zip(equal.iter().copied()));
    files.into_iter().zip(&equal).filter(|(_, of)| of.is_none()).map(|(file, _)| file).collect()
}

fn name_of(record: &Record, other: &Record) -> String {
    match record.name == other.name {
        true => name_beside(&record.path, &other.path),
        false => record.name.clone(),
    }
}

/// For each record the first one before it of which it is a copy: each of its channels has the samples of one of an
/// earlier record. `equal` is as [`equal_samples`] has it, `owners` the record of each channel.
fn record_copies(equal: &[Option<usize>], owners: &[usize], records: usize) -> Vec<Option<usize>> {
    let mut copies: Vec<Option<Option<usize>>> = vec![None; records];
    for (channel, owner) in owners.iter().enumerate() {
        let of = equal.get(channel).copied().flatten().and_then(|of| owners.get(of)).copied().filter(|of| of < owner);
        let Some(known) = copies.get_mut(*owner) else { continue };
        // the record of its first channel is named
        *known = Some(match known {
            None => of,
            Some(first) => first.filter(|_| of.is_some()),
        });
    }
    copies.into_iter().map(Option::flatten).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_is_a_copy_if_all_its_channels_are() {
        // two channels of records 0, 1 and 2: those of 1 are those of 0, of 2 only the second
        let equal = [None, None, Some(0), Some(1), None, Some(1)];
        assert_eq!(record_copies(&equal, &[0, 0, 1, 1, 2, 2], 3), [None, Some(0), None]);
        // two channels of one record that are equal are no copy of another record
        assert_eq!(record_copies(&[None, Some(0), Some(0), Some(0)], &[0, 0, 1, 1], 2), [None, Some(0)]);
        // a record without a channel
        assert_eq!(record_copies(&[None], &[1], 2), [None, None]);
    }

    #[test]
    fn files_of_one_name_are_distinguished_by_their_folders() {
        let name = |path: &str, other: &str| name_beside(Path::new(path), Path::new(other));
        assert_eq!([name("a/x.h5", "b/x.h5"), name("a/x.h5", "b/y.h5")], ["a/x.h5", "x.h5"]);
        let items = [("a", "1"), ("b", "2"), ("c", "1"), ("a", "1"), ("d", ""), ("e", "")];
        let equal = equal_files(items.iter().map(|(path, hash)| (Path::new(*path), *hash)));
        assert_eq!(equal, [None, None, Some(Path::new("a")), None, None, None]);
    }
}
