//! Values and their standard errors among many names.

use std::collections::{HashMap, HashSet};

/// Which of the names are standard errors of which others, as [`afmid_pipeline::artifact::std_name`] finds them, for
/// all names at once.
pub struct Partners<'a> {
    /// Names of standard errors by the names of their values.
    std: HashMap<&'a str, &'a str>,
    /// The standard errors.
    hidden: HashSet<&'a str>,
}

impl<'a> Partners<'a> {
    /// Among these names.
    pub fn of(names: impl Iterator<Item = &'a str> + Clone) -> Self {
        let mut by_value: HashMap<String, &'a str> = HashMap::new();
        for (std, value) in names.clone().filter_map(|name| Some((name, value_name(name)?))) {
            by_value.entry(value).or_insert(std);
        }
        let std: HashMap<&str, &str> = names.filter_map(|name| Some((name, *by_value.get(name)?))).collect();
        let hidden = std.values().copied().collect();
        Self { std, hidden }
    }

    /// The name that holds the standard error of a name.
    pub fn std(&self, name: &str) -> Option<&'a str> {
        self.std.get(name).copied()
    }

    /// Whether a name holds the standard error of another: it is shown with that one's value.
    pub fn is_std(&self, name: &str) -> bool {
        self.hidden.contains(name)
    }
}

/// The name of the value that a standard error would belong to.
fn value_name(name: &str) -> Option<String> {
    let mut parts: Vec<&str> = name.split('_').collect();
    let std = parts.iter().position(|part| *part == "std")?;
    parts.remove(std);
    Some(parts.join("_"))
}

#[cfg(test)]
mod tests {
    use afmid_pipeline::artifact::std_name;

    use super::Partners;

    #[test]
    fn partners_are_those_that_std_name_finds() {
        let names = ["a_hz", "a_std_hz", "std_a_hz", "q", "q_std", "q_std_std", "x", "std", "", "_std", "y_std"];
        let partners = Partners::of(names.into_iter());
        for name in names {
            assert_eq!(partners.std(name), std_name(name, names.into_iter()), "{name}");
            assert_eq!(partners.is_std(name), names.iter().any(|n| std_name(n, names.into_iter()) == Some(name)));
        }
    }
}
