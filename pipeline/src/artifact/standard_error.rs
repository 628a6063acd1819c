//! Names of standard errors.

/// The name that holds the standard error of `name`: `frequency_std_hz` for `frequency_hz`, `quality_factor_std` for
/// `quality_factor`.
pub fn std_name<'a>(name: &str, mut names: impl Iterator<Item = &'a str>) -> Option<&'a str> {
    names.find(|other| {
        let mut parts: Vec<&str> = other.split('_').collect();
        let std = parts.iter().position(|part| *part == "std");
        std.is_some_and(|std| {
            parts.remove(std);
            parts.join("_") == name
        })
    })
}

#[cfg(test)]
#[test]
fn a_value_finds_its_standard_error() {
    let names = ["frequency_hz", "frequency_std_hz", "quality_factor", "quality_factor_std"];
    assert_eq!(std_name("frequency_hz", names.into_iter()), Some("frequency_std_hz"));
    assert_eq!(std_name("quality_factor", names.into_iter()), Some("quality_factor_std"));
    assert_eq!(std_name("delay_s", names.into_iter()), None);
}
