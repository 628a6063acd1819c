//! The registry: who recognises what, by content before name.

use crate::support::{real, written};
use afmid_formats::{formats, head_of, recognise};
use std::path::Path;

fn known(path: &Path) -> Option<&'static str> {
    recognise(&head_of(path).unwrap(), path).map(|known| known.row.name)
}

#[test]
fn tables_of_text_are_asked_last_and_names_are_distinct() {
    let names: Vec<&str> = formats().iter().map(|known| known.row.name).collect();
    assert_eq!(names.last(), Some(&"text"));
    let mut sorted = names.clone();
    sorted.sort_unstable();
    sorted.dedup();
    assert_eq!(sorted.len(), names.len());
}

#[test]
fn written_files_are_recognised_by_their_endings_kind() {
    for entry in std::fs::read_dir(written("")).unwrap() {
        let path = entry.unwrap().path();
        assert_eq!(known(&path), path.extension().and_then(|ending| ending.to_str()), "{}", path.display());
    }
}

#[test]
fn real_files_are_recognised_by_nobody_else() {
    for (folder, name) in [("tdms", "tdms"), ("ibw", "ibw"), ("lvm", "text"), ("spm", "nanoscope"), ("uff", "uff")] {
        let Some(folder) = real(folder) else { return };
        for entry in std::fs::read_dir(folder).unwrap() {
            let path = entry.unwrap().path();
            let head = head_of(&path).unwrap();
            assert_eq!(known(&path), Some(name), "{}", path.display());
            let others = formats().iter().filter(|known| known.recognises(&head, &path)).count();
            assert_eq!(others, 1, "{}", path.display());
        }
    }
}

#[test]
fn what_nobody_knows_is_nobodys() {
    let path = Path::new("notes.bin");
    assert!(recognise(&[0x17; 4096], path).is_none());
    assert!(recognise(b"", path).is_none());
    let error = head_of(Path::new("/nowhere/at/all")).unwrap_err();
    assert!(error.file.is_some() && error.to_string().contains("/nowhere/at/all"), "{error}");
}
