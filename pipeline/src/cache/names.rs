//! The names that the cache gives its files. What has another name is none of its own.

/// A folder of stamps: what the files of earlier runs hashed to.
pub(super) const STAMPS: &str = "stamps";

/// What a file of the cache is, by its name.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind<'a> {
    /// The result with this key.
    Result(&'a str),
    /// The origin of the result with this key.
    Origin(&'a str),
    /// Being written, or left by a killed run.
    Temporary,
}

/// What a file with this name is; none if it is not the cache's.
pub(super) fn kind_of(name: &str) -> Option<Kind<'_>> {
    if let Some(hidden) = name.strip_prefix('.') {
        let own = hidden.split_once('.').is_some_and(|(key, rest)| is_key(key) && is_temporary(rest));
        return own.then_some(Kind::Temporary);
    }
    match name.split_once('.')? {
        (key, "h5") if is_key(key) => Some(Kind::Result(key)),
        (key, "json") if is_key(key) => Some(Kind::Origin(key)),
        _ => None,
    }
}

/// BLAKE3 in lowercase hexadecimal.
pub(super) fn is_key(text: &str) -> bool {
    text.len() == 64 && text.bytes().all(|byte| matches!(byte, b'0'..=b'9' | b'a'..=b'f'))
}

/// `h5.HOST.PID.COUNT.tmp`, as `replace_file` names them.
fn is_temporary(rest: &str) -> bool {
    let parts: Vec<&str> = rest.split('.').collect();
    matches!(parts[..], ["h5" | "json", _, pid, count, "tmp"]
        if [pid, count].iter().all(|number| number.parse::<u64>().is_ok()))
}

/// Whether a file in the folder of stamps is one: its name begins with a hash.
pub(super) fn is_stamp(name: &str) -> bool {
    let start = name.strip_prefix('.').unwrap_or(name);
    start.split('.').next().is_some_and(|stem| stem.len() >= 32 && stem.bytes().all(|byte| byte.is_ascii_hexdigit()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_names_that_the_cache_gives_are_its_own() {
        let key = "0123456789abcdef".repeat(4);
        assert_eq!(kind_of(&format!("{key}.h5")), Some(Kind::Result(&key)));
        assert_eq!(kind_of(&format!("{key}.json")), Some(Kind::Origin(&key)));
        assert_eq!(kind_of(&format!(".{key}.h5.host-1.12.0.tmp")), Some(Kind::Temporary));
        assert_eq!(kind_of(&format!(".{key}.json.host-1.12.0.tmp")), Some(Kind::Temporary));
        let others = [
            "thesis.h5".to_owned(),
            key.clone(),
            format!("{key}.txt"),
            format!("{key}.h5.bak"),
            format!("{}.h5", key.to_uppercase()),
            format!("{}.h5", &key[1..]),
            ".thesis.tmp".to_owned(),
            format!(".{key}.h5"),
            format!(".{key}.h5.mine.tmp"),
            ".result.h5.host.12.0.tmp".to_owned(),
            String::new(),
            "..".to_owned(),
        ];
        for other in others {
            assert_eq!(kind_of(&other), None, "{other}");
        }
        assert!(is_stamp(&key) && is_stamp(&format!("{key}.json")) && is_stamp(&format!(".{key}.h.1.2.tmp")));
        assert!(!is_stamp("notes.txt") && !is_stamp("cafe"));
    }
}
