//! Names of groups: stage ids and ports, as far as NeXus allows.

/// A group name per id: `nxcheck` passes letters, digits and `_`; every other character becomes `_`, and `_` is added until no two
/// names are equal.
pub(super) fn group_names<'a>(ids: impl Iterator<Item = &'a str>) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for id in ids {
        let mut name: String = id.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect();
        if name.is_empty() {
            name.push('_');
        }
        while names.contains(&name) {
            name.push('_');
        }
        names.push(name);
    }
    names
}

#[cfg(test)]
mod tests {
    use super::group_names;

    #[test]
    fn valid_names_stay_and_no_two_are_equal() {
        let ids = ["records", "free-lever", "free_lever", "a.b", ".", "", "zähler", "records_"];
        let names = group_names(ids.into_iter());
        assert_eq!(names, ["records", "free_lever", "free_lever_", "a_b", "_", "__", "z_hler", "records_"]);
    }
}
