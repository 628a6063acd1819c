//! Where the shared data lie.

use std::path::Path;

/// A path into the shared data folder, with its root moved: `../../shared/data/afm/x/*.h5` becomes `ROOT/afm/x/*.h5`;
/// any other stays.
pub(super) fn moved(path: &str, root: Option<&Path>) -> String {
    const SHARED: &str = "../../shared/data/";
    match (root, path.strip_prefix(SHARED)) {
        (Some(root), Some(rest)) => root.join(rest).display().to_string(),
        _ => path.to_owned(),
    }
}

#[cfg(test)]
#[test]
fn the_root_of_shared_data_moves_and_other_paths_stay() {
    let (shared, other) = ("../../shared/data/afm/x/*.h5", "archive/*.h5");
    assert_eq!(moved(shared, Some(Path::new("/data"))), "/data/afm/x/*.h5");
    assert_eq!(moved(other, Some(Path::new("/data"))), other);
    assert_eq!(moved(shared, None), shared);
}
