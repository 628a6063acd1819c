//! Names of groups: stage ids and ports, as far as NeXus allows.

use std::collections::HashSet;

/// What a result file keeps under its entry beside the stages: configs refuse these ids, so that a stage's group has
/// its name.
pub const RESERVED_STAGE_IDS: [&str; 4] = ["pipeline", "run", "title", "definition"];

/// What a stage's group holds beside its ports.
pub(super) const TAKEN_BY_STAGE: [&str; 5] = ["provenance", "program", "version", "sequence_index", "date"];

/// A group name per id: `nxcheck` passes letters, digits and `_`; every other character becomes `_`, and `_` is added
/// until no two names are equal and none is taken.
pub(super) fn group_names<'a>(ids: impl Iterator<Item = &'a str>, taken: &[&str]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let mut used: HashSet<String> = taken.iter().map(|&name| name.to_owned()).collect();
    for id in ids {
        let mut name: String = id.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        if name.is_empty() {
            name.push('_');
        }
        while !used.insert(name.clone()) {
            name.push('_');
        }
        names.push(name);
    }
    names
}

#[cfg(test)]
mod tests {
    use super::{RESERVED_STAGE_IDS, group_names};

    #[test]
    fn valid_names_stay_and_no_two_are_equal() {
        let ids = ["records", "free-lever", "free_lever", "a.b", ".", "", "zähler", "records_", "run", "run_"];
        let names = group_names(ids.into_iter(), &RESERVED_STAGE_IDS);
        assert_eq!(
            names,
            ["records", "free_lever", "free_lever_", "a_b", "_", "__", "z_hler", "records_", "run_", "run__"]
        );
    }
}
